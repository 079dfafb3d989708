/* STEP and IGES files as Open CASCADE sees them. Of networks: are the shapes valid, closed where they should be, with
 * the volume that batten measured, as many faces as it wrote, under their names, and without a kink across smooth
 * edges? judge MANIFEST A line of the manifest: FILE FACES SOLIDS VOLUME AREA NORMALS: VOLUME and AREA nan where not
 * known, in the file's unit; NORMALS the largest angle allowed across shared edges in degrees, nan where there may be
 * kinks. TAP on stdout.
 *
 * A line "surface FILE PLACES EDGES CLOSED AREA" is one face instead, with so many different edges, closed or not:
 * are points, normals and curvatures at the places the same, and is it the same area?
 *
 * A line "curves FILE PLACES COUNT" is so many edges instead: are they the same B-splines, with the same points and
 * derivatives at the places? */
#include <BRepAdaptor_Surface.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomLProp_SLProps.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_Surface.hxx>
#include <IGESControl_Reader.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <StepShape_AdvancedFace.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <gp_Dir.hxx>
#include <gp_Pnt2d.hxx>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

static int count_of, failed;

static void line(bool ok, const std::string &what) {
  std::printf("%s %d - %s\n", ok ? "ok" : "not ok", ++count_of, what.c_str());
  if (!ok) failed++;
}

/* The normal of a face where its surface comes nearest to p, started from (u, v): Newton's method on the tangent
 * plane, so that the interpolated curve in parameter space does not limit the angle. */
static bool normal_near(const TopoDS_Face &face, const gp_Pnt &p, double u, double v, gp_Vec &normal, double &off) {
  TopLoc_Location place;
  Handle(Geom_Surface) surface = BRep_Tool::Surface(face, place);
  gp_Pnt s;
  gp_Vec su, sv;
  for (int i = 0; i < 8; i++) {
    surface->D1(u, v, s, su, sv);
    gp_Vec d(s, p);
    double e = su * su, f = su * sv, g = sv * sv, det = e * g - f * f, a = d * su, b = d * sv;
    if (!(std::fmin(e, g) > 1e-6 * std::fmax(e, g))) return false; /* at a pole */
    u += (a * g - b * f) / det;
    v += (b * e - a * f) / det;
  }
  surface->D1(u, v, s, su, sv);
  off = s.Distance(p);
  normal = su ^ sv;
  if (normal.Magnitude() <= 0) return false;
  normal.Normalize();
  if (face.Orientation() == TopAbs_REVERSED) normal.Reverse();
  return true;
}

struct joints {
  size_t edges = 0, samples = 0;
  double angle = 0, gap = 0;
};

/* Angles between the two faces of every edge at places along it, through the curves in parameter space of both. */
static joints measure_joints(const TopoDS_Shape &shape) {
  joints out;
  TopTools_IndexedDataMapOfShapeListOfShape faces_of;
  TopExp::MapShapesAndAncestors(shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
  for (int i = 1; i <= faces_of.Extent(); i++) {
    const TopoDS_Edge &edge = TopoDS::Edge(faces_of.FindKey(i));
    const TopTools_ListOfShape &faces = faces_of(i);
    if (faces.Extent() != 2 || BRep_Tool::Degenerated(edge)) continue;
    TopoDS_Face face[2] = {TopoDS::Face(faces.First()), TopoDS::Face(faces.Last())};
    if (face[0].IsSame(face[1])) continue;
    out.edges++;
    double first, last;
    Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);
    for (int k = 0; k <= 16; k++) {
      double t = first + (last - first) * k / 16;
      gp_Pnt p = curve->Value(t);
      gp_Vec normal[2];
      bool known = true;
      for (int side = 0; side < 2; side++) {
        double from, to, off = 0;
        Handle(Geom2d_Curve) flat = BRep_Tool::CurveOnSurface(edge, face[side], from, to);
        gp_Pnt2d at = flat->Value(from + (to - from) * k / 16);
        known = known && normal_near(face[side], p, at.X(), at.Y(), normal[side], off);
        if (known) out.gap = std::fmax(out.gap, off);
      }
      if (!known) continue;
      out.samples++;
      out.angle = std::fmax(out.angle, std::atan2((normal[0] ^ normal[1]).Magnitude(), normal[0] * normal[1]));
    }
  }
  out.angle *= 180 / M_PI;
  return out;
}

static size_t count_shapes(const TopoDS_Shape &shape, TopAbs_ShapeEnum kind) {
  size_t count = 0;
  for (TopExp_Explorer e(shape, kind); e.More(); e.Next()) count++;
  return count;
}

/* The names that the file gives to faces, all different. */
static size_t count_names(STEPControl_Reader &reader) {
  Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  std::set<std::string> names;
  for (int i = 1; i <= process->NbMapped(); i++) {
    Handle(StepShape_AdvancedFace) face = Handle(StepShape_AdvancedFace)::DownCast(process->Mapped(i));
    if (face.IsNull() || face->Name().IsNull() || TransferBRep::ShapeResult(process, face).IsNull()) continue;
    std::string name = face->Name()->ToCString();
    if (name.compare(0, 5, "face ") == 0) names.insert(name);
  }
  return names.size();
}

static std::string text(double value) {
  char out[40];
  std::snprintf(out, sizeof out, "%.12g", value);
  return out;
}

/* Largest differences from what the places' file says: of points over the size, normals, curvatures over the largest.
 */
struct differences {
  size_t count = 0;
  double point = 0, normal = 0, gauss = 0, mean = 0;
};

static differences compare_places(const TopoDS_Face &face, const std::string &places) {
  differences out;
  TopLoc_Location place;
  Handle(Geom_Surface) surface = BRep_Tool::Surface(face, place);
  double u, v, x[3], n[3], gauss, mean, size = 0, gauss_largest = 0, mean_largest = 0;
  std::ifstream in(places);
  while (in >> u >> v >> x[0] >> x[1] >> x[2] >> n[0] >> n[1] >> n[2] >> gauss >> mean) {
    GeomLProp_SLProps at(surface, u, v, 2, 1e-12);
    if (!at.IsNormalDefined() || !at.IsCurvatureDefined()) return differences();
    gp_Vec normal(at.Normal());
    if (face.Orientation() == TopAbs_REVERSED) normal.Reverse();
    out.count++;
    out.point = std::fmax(out.point, at.Value().Distance(gp_Pnt(x[0], x[1], x[2])));
    out.normal = std::fmax(out.normal, (normal - gp_Vec(n[0], n[1], n[2])).Magnitude());
    out.gauss = std::fmax(out.gauss, std::fabs(at.GaussianCurvature() - gauss));
    out.mean = std::fmax(out.mean, std::fabs(std::fabs(at.MeanCurvature()) - std::fabs(mean)));
    size = std::fmax(size, gp_Vec(x[0], x[1], x[2]).Magnitude());
    gauss_largest = std::fmax(gauss_largest, std::fabs(gauss));
    mean_largest = std::fmax(mean_largest, std::fabs(mean));
  }
  out.point /= size;
  out.gauss /= gauss_largest + 1 / size / size;
  out.mean /= mean_largest + 1 / size;
  return out;
}

static TopoDS_Shape read_file(const std::string &file) {
  if (file.rfind(".step") == file.size() - 5) {
    STEPControl_Reader reader;
    if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) return TopoDS_Shape();
    reader.TransferRoots();
    return reader.OneShape();
  }
  IGESControl_Reader reader;
  if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) return TopoDS_Shape();
  reader.TransferRoots();
  return reader.OneShape();
}

static void judge_surface(const std::string &file, const std::string &places, size_t edges, bool closed,
                          double area) {
  const std::string name = file.substr(file.rfind('/') + 1) + ": ";
  TopoDS_Shape shape = read_file(file);
  if (shape.IsNull()) return line(false, name + "cannot be read");
  line(BRepCheck_Analyzer(shape).IsValid(), name + "valid");
  size_t faces = count_shapes(shape, TopAbs_FACE);
  line(faces == 1, name + std::to_string(faces) + " faces of 1");
  if (faces != 1) return;
  TopTools_IndexedMapOfShape map;
  TopExp::MapShapes(shape, TopAbs_EDGE, map);
  size_t have = 0;
  bool free_edges = false;
  for (int i = 1; i <= map.Extent(); i++) {
    const TopoDS_Edge &edge = TopoDS::Edge(map(i));
    if (BRep_Tool::Degenerated(edge)) continue;
    have++;
    free_edges =
        free_edges || !BRep_Tool::IsClosed(edge, TopoDS::Face(TopExp_Explorer(shape, TopAbs_FACE).Current()));
  }
  line(have == edges && free_edges == !closed, name + std::to_string(have) + " edges of " + std::to_string(edges));
  differences d = compare_places(TopoDS::Face(TopExp_Explorer(shape, TopAbs_FACE).Current()), places);
  line(d.count > 100 && d.point <= 1e-14 && d.normal <= 1e-11 && d.gauss <= 1e-9 && d.mean <= 1e-9,
       name + std::to_string(d.count) + " places: points within " + text(d.point) + ", normals " + text(d.normal) +
           ", curvatures " + text(d.gauss) + ", " + text(d.mean));
  GProp_GProps props;
  BRepGProp::SurfaceProperties(shape, props, 1e-10);
  double off = std::fabs(props.Mass() - area) / area;
  line(off <= 1e-7, name + "area " + text(props.Mass()) + ", off by " + text(off));
}

/* One curve of a places' file: its form, and the largest differences of points and derivatives over their sizes. */
static void judge_curve(const TopoDS_Edge &edge, std::istream &in, const std::string &name) {
  int degree, closed, knot_count, places;
  in >> degree >> closed >> knot_count >> places;
  std::vector<double> knots(knot_count);
  for (double &knot : knots) in >> knot;
  double first, last, t, x, y, z, off[3] = {0}, size[3] = {0};
  Handle(Geom_BSplineCurve) curve = Handle(Geom_BSplineCurve)::DownCast(BRep_Tool::Curve(edge, first, last));
  if (curve.IsNull()) return line(false, name + "no B-spline");
  /* closed curves of STEP become periodic ones there: their ends are knots like others then */
  bool same = curve->Degree() == degree && !curve->IsRational() && (closed || !curve->IsPeriodic()) &&
              first == knots.front() && last == knots.back();
  size_t at = 0;
  for (int i = 1; same && i <= curve->NbKnots(); i++) {
    size_t times = 0;
    while (at + times < knots.size() && knots[at + times] == curve->Knot(i)) times++;
    bool end = i == 1 || i == curve->NbKnots();
    same = times > 0 && (curve->Multiplicity(i) == (int)times || (end && curve->IsPeriodic()));
    at += times;
  }
  same = same && at == knots.size();
  line(same, name + "degree " + std::to_string(curve->Degree()) + " and the same knots" +
                 (curve->IsPeriodic() ? ", periodic" : ""));
  line(curve->IsClosed() == (closed != 0) && BRep_Tool::IsClosed(edge) == (closed != 0),
       name + (closed ? "closed" : "open"));
  for (int i = 0; i < places; i++) {
    gp_Pnt p;
    gp_Vec have[3], d2;
    in >> t;
    curve->D2(t, p, have[1], have[2]);
    have[0] = gp_Vec(p.XYZ());
    for (int order = 0; order < 3; order++) {
      in >> x >> y >> z;
      gp_Vec expected(x, y, z);
      off[order] = std::fmax(off[order], (have[order] - expected).Magnitude());
      size[order] = std::fmax(size[order], expected.Magnitude());
    }
  }
  for (int order = 0; order < 3; order++) off[order] /= size[order] > 0 ? size[order] : 1;
  line(in.good() && off[0] <= 1e-13 && off[1] <= 1e-12 && off[2] <= 1e-12,
       name + std::to_string(places) + " places: points within " + text(off[0]) + ", derivatives " + text(off[1]) +
           ", " + text(off[2]));
}

static void judge_curves(const std::string &file, const std::string &places, size_t count) {
  const std::string name = file.substr(file.rfind('/') + 1) + ": ";
  IGESControl_Reader first; /* sets the defaults */
  /* a corner is no reason to cut a curve */
  Interface_Static::SetIVal("read.iges.bspline.continuity", 0);
  TopoDS_Shape shape = read_file(file);
  if (shape.IsNull()) return line(false, name + "cannot be read");
  line(BRepCheck_Analyzer(shape).IsValid(), name + "valid");
  TopTools_IndexedMapOfShape map;
  TopExp::MapShapes(shape, TopAbs_EDGE, map);
  line((size_t)map.Extent() == count && count_shapes(shape, TopAbs_FACE) == 0,
       name + std::to_string(map.Extent()) + " edges of " + std::to_string(count));
  if ((size_t)map.Extent() != count) return;
  std::ifstream in(places);
  for (int i = 1; i <= map.Extent(); i++)
    judge_curve(TopoDS::Edge(map(i)), in, name + "curve " + std::to_string(i - 1) + ": ");
}

static void judge(const std::string &file, size_t faces, size_t solids, double volume, double area, double normals) {
  bool step = file.size() > 5 && (file.rfind(".step") == file.size() - 5 || file.rfind(".stp") == file.size() - 4);
  TopoDS_Shape shape;
  const std::string name = file.substr(file.rfind('/') + 1) + ": ";
  size_t names = 0;
  if (step) {
    STEPControl_Reader reader;
    if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) return line(false, name + "cannot be read");
    reader.TransferRoots();
    shape = reader.OneShape();
    names = count_names(reader);
  } else {
    IGESControl_Reader reader;
    if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) return line(false, name + "cannot be read");
    reader.TransferRoots();
    shape = reader.OneShape();
  }
  if (shape.IsNull()) return line(false, name + "no shape");
  BRepCheck_Analyzer analyzer(shape);
  line(analyzer.IsValid(), name + "valid");
  size_t have = count_shapes(shape, TopAbs_FACE);
  line(have == faces, name + std::to_string(have) + " faces of " + std::to_string(faces));
  if (step) line(names == faces, name + std::to_string(names) + " names of faces");
  have = count_shapes(shape, TopAbs_SOLID);
  line(have == solids, name + std::to_string(have) + " solids of " + std::to_string(solids));
  if (!std::isnan(volume)) {
    GProp_GProps props;
    BRepGProp::VolumeProperties(shape, props, 1e-12, step); /* of closed shells; IGES: by the normals of its faces */
    double off = std::fabs(props.Mass() - volume) / std::fabs(volume);
    line(off <= 1e-9, name + "volume " + text(props.Mass()) + ", off by " + text(off));
  }
  if (!std::isnan(area)) {
    GProp_GProps props;
    BRepGProp::SurfaceProperties(shape, props, 1e-10);
    double off = std::fabs(props.Mass() - area) / area;
    line(off <= 1e-7, name + "area " + text(props.Mass()) + ", off by " + text(off));
  }
  if (!std::isnan(normals) && step) {
    joints j = measure_joints(shape);
    line(j.edges > 0 && j.samples >= 15 * j.edges && j.angle <= normals,
         name + "normals across " + std::to_string(j.edges) + " edges within " + text(j.angle) + " degrees, gap " +
             text(j.gap));
  }
}

int main(int argc, char **argv) {
  std::ifstream manifest(argc > 1 ? argv[1] : "");
  if (!manifest) {
    std::fprintf(stderr, "judge: no manifest\n");
    return 2;
  }
  Message::DefaultMessenger()->ChangePrinters().Clear();
  std::string row;
  while (std::getline(manifest, row)) {
    std::istringstream in(row);
    if (row.compare(0, 8, "surface ") == 0) {
      std::string word, surface, places, area;
      size_t edges;
      bool closed;
      in >> word >> surface >> places >> edges >> closed >> area;
      judge_surface(surface, places, edges, closed, std::strtod(area.c_str(), nullptr));
      continue;
    }
    if (row.compare(0, 7, "curves ") == 0) {
      std::string word, curves, places;
      size_t count;
      in >> word >> curves >> places >> count;
      judge_curves(curves, places, count);
      continue;
    }
    std::string file, volume, area, normals;
    size_t faces, solids;
    in >> file >> faces >> solids >> volume >> area >> normals;
    judge(file, faces, solids, std::strtod(volume.c_str(), nullptr), std::strtod(area.c_str(), nullptr),
          std::strtod(normals.c_str(), nullptr));
  }
  std::printf("1..%d\n", count_of);
  return failed != 0;
}
