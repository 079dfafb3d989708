// Open CASCADE's surfaces of points: peer-occt WAY SCENE SURFACE SECONDS (files: convex_fits.c). Ways:
//   plate    a plate through the points, then a spline near it, with the settings of its guide (GeomPlate)
//   grid     a spline within three standard deviations of a grid of points (GeomAPI_PointsToBSplineSurface)
//   smooth   the same within five with its fairness criterion of third order alone: of a dozen settings that were
//   tried
//            those that come nearest to the truth
#include <GeomAPI_PointsToBSplineSurface.hxx>
#include <GeomPlate_BuildPlateSurface.hxx>
#include <GeomPlate_MakeApprox.hxx>
#include <GeomPlate_PointConstraint.hxx>
#include <GeomPlate_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Standard_Failure.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

struct scene {
  size_t count = 0;
  int degree = 3, side = 0;
  double noise = 0;
  const double *points = nullptr;
  std::vector<double> numbers;
  gp_Pnt point(size_t i) const { return gp_Pnt(points[3 * i], points[3 * i + 1], points[3 * i + 2]); }
};

static bool read_scene(const char *path, scene &s) {
  std::FILE *file = std::fopen(path, "rb");
  double value;
  if (!file) return false;
  while (std::fread(&value, sizeof value, 1, file) == 1) s.numbers.push_back(value);
  std::fclose(file);
  if (s.numbers.size() < 10 || s.numbers.size() != 10 + 6 * size_t(s.numbers[0])) return false;
  s.count = size_t(s.numbers[0]);
  s.degree = int(s.numbers[1]);
  s.noise = s.numbers[5];
  s.side = int(s.numbers[6]);
  s.points = s.numbers.data() + 10;
  return true;
}

static Handle(Geom_BSplineSurface) fit_plate(const scene &s) {
  GeomPlate_BuildPlateSurface plate(3, 10, 2);
  for (size_t i = 0; i < s.count; i++) plate.Add(new GeomPlate_PointConstraint(s.point(i), 0, s.noise));
  plate.Perform();
  if (!plate.IsDone()) return nullptr;
  return GeomPlate_MakeApprox(plate.Surface(), s.noise, 9, 8, s.noise, 0).Surface();
}

static Handle(Geom_BSplineSurface) fit_grid(const scene &s, bool smooth) {
  TColgp_Array2OfPnt points(1, s.side, 1, s.side);
  for (int i = 0; i < s.side; i++)
    for (int j = 0; j < s.side; j++) points(i + 1, j + 1) = s.point(size_t(i) * size_t(s.side) + size_t(j));
  GeomAPI_PointsToBSplineSurface fit;
  if (smooth)
    fit.Init(points, 0, 0, 1, 8, GeomAbs_C2, 5 * s.noise);
  else
    fit.Init(points, s.degree, s.degree, GeomAbs_C2, 3 * s.noise);
  return fit.IsDone() ? fit.Surface() : Handle(Geom_BSplineSurface)();
}

static Handle(Geom_BSplineSurface) fit(const std::string &way, const scene &s) {
  try {
    return way == "plate" ? fit_plate(s) : fit_grid(s, way == "smooth");
  } catch (const Standard_Failure &reason) {
    std::fprintf(stderr, "%s\n", reason.GetMessageString());
    return nullptr;
  }
}

static bool write_surface(const char *path, const Handle(Geom_BSplineSurface) & surface, double seconds,
                          size_t fits) {
  std::vector<double> out = {seconds, double(fits), double(surface->UDegree()), double(surface->VDegree())};
  TColStd_Array1OfReal u(1, surface->NbUPoles() + surface->UDegree() + 1);
  TColStd_Array1OfReal v(1, surface->NbVPoles() + surface->VDegree() + 1);
  surface->UKnotSequence(u);
  surface->VKnotSequence(v);
  out.push_back(u.Length());
  out.push_back(v.Length());
  out.insert(out.end(), u.begin(), u.end());
  out.insert(out.end(), v.begin(), v.end());
  for (int i = 1; i <= surface->NbUPoles(); i++)
    for (int j = 1; j <= surface->NbVPoles(); j++)
      for (int k = 1; k <= 3; k++) out.push_back(surface->Pole(i, j).Coord(k));
  std::FILE *file = std::fopen(path, "wb");
  if (!file) return false;
  const bool good = std::fwrite(out.data(), sizeof(double), out.size(), file) == out.size();
  return std::fclose(file) == 0 && good;
}

int main(int argc, char **argv) {
  scene s;
  if (argc != 5 || !read_scene(argv[2], s)) {
    std::fprintf(stderr, "usage: peer-occt plate|grid|smooth SCENE SURFACE SECONDS\n");
    return 2;
  }
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto since = [&](auto begin) { return std::chrono::duration<double>(now() - begin).count(); };
  const auto begin = now();
  std::vector<double> times;
  Handle(Geom_BSplineSurface) surface;
  do {
    const auto start = now();
    surface = fit(argv[1], s);
    times.push_back(since(start));
  } while (!surface.IsNull() && times.size() < 25 && since(begin) < std::atof(argv[4]));
  if (surface.IsNull()) return 1;
  std::sort(times.begin(), times.end());
  return write_surface(argv[3], surface, times[times.size() / 2], times.size()) ? 0 : 1;
}
