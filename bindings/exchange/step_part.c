/* Entities of STEP files that networks, surfaces and curves have in common: see step_part.h. */
#include "step_part.h"

void step_begin_file(step_text *s, const bx_product *product) {
  bx_print(s->w, "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('%s'),'2;1');\nFILE_NAME(", product->description);
  step_put_text(s, product->name);
  bx_print(s->w, ",'%s',(''),(''),'batten %s','batten','');\n", product->time_stamp, batten_version());
  bx_print(s->w, "FILE_SCHEMA(('%s'));\nENDSEC;\nDATA;\n",
           product->schema == BATTEN_STEP_AP242
               ? "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }"
               : "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }");
}

/* ---- B-splines --------------------------------------------------------------------------------------- */

static size_t knots_equal_to(const double *knots, size_t count, size_t first) {
  size_t end = first + 1;
  while (end < count && !(knots[end] > knots[first])) end++;
  return end - first;
}

/* What stands before an item of a list: lines are broken. */
static const char *between(size_t item) { return item == 0 ? "(" : item % 10 ? "," : ",\n"; }

/* "(4,1,4)" */
static void put_multiplicities(step_text *s, size_t count, const double *knots) {
  for (size_t i = 0, item = 0, times; i < count; i += times, item++) {
    times = knots_equal_to(knots, count, i);
    bx_print(s->w, "%s%zu", between(item), times);
  }
  bx_put_u8(s->w, ')');
}

/* "(0.,0.5,1.)" */
static void put_different(step_text *s, size_t count, const double *knots) {
  for (size_t i = 0, item = 0; i < count; i += knots_equal_to(knots, count, i), item++) {
    bx_put_text(s->w, between(item));
    step_put_real(s, knots[i]);
  }
  bx_put_u8(s->w, ')');
}

static const char *logical(bool is) { return is ? ".T." : ".F."; }

uint64_t step_put_curve(step_text *s, const char *name, unsigned degree, size_t knot_count, const double *knots,
                        const uint64_t *points, bool closed) {
  uint64_t curve = step_begin(s);
  bx_print(s->w, "B_SPLINE_CURVE_WITH_KNOTS('%s',%u,", name, degree);
  step_put_references(s, points, knot_count - degree - 1);
  bx_print(s->w, ",.UNSPECIFIED.,%s,.F.,", logical(closed));
  put_multiplicities(s, knot_count, knots);
  bx_put_u8(s->w, ',');
  put_different(s, knot_count, knots);
  bx_put_text(s->w, ",.UNSPECIFIED.);\n");
  return curve;
}

uint64_t step_put_surface(step_text *s, const batten_surface_form *form, const bool closed[2]) {
  size_t rows = form->knot_count[0] - form->degree[0] - 1, columns = form->knot_count[1] - form->degree[1] - 1;
  uint64_t first = s->last + 1;
  for (size_t i = 0; i < rows * columns; i++) step_put_point(s, form->control_points + 3 * i);
  uint64_t surface = step_begin(s);
  bx_print(s->w, "B_SPLINE_SURFACE_WITH_KNOTS('',%u,%u,(\n", form->degree[0], form->degree[1]);
  for (size_t i = 0; i < rows; i++) {
    for (size_t j = 0; j < columns; j++) step_put_item(s, j, first + i * columns + j);
    bx_put_text(s->w, i + 1 < rows ? "),\n" : "))");
  }
  bx_print(s->w, ",.UNSPECIFIED.,%s,%s,.F.,", logical(closed[0]), logical(closed[1]));
  for (int i = 0; i < 2; i++) {
    put_multiplicities(s, form->knot_count[i], form->knots[i]);
    bx_put_u8(s->w, ',');
  }
  for (int i = 0; i < 2; i++) {
    put_different(s, form->knot_count[i], form->knots[i]);
    bx_put_u8(s->w, ',');
  }
  bx_put_text(s->w, ".UNSPECIFIED.);\n");
  return surface;
}

/* ---- topology ---------------------------------------------------------------------------------------- */

uint64_t step_put_vertex_at(step_text *s, uint64_t point) {
  return step_print(s, "VERTEX_POINT('',#%llu)", (unsigned long long)point);
}

uint64_t step_put_vertex(step_text *s, const double point[3]) {
  return step_put_vertex_at(s, step_put_point(s, point));
}

uint64_t step_put_edge(step_text *s, uint64_t from, uint64_t to, uint64_t curve) {
  return step_print(s, "EDGE_CURVE('',#%llu,#%llu,#%llu,.T.)", (unsigned long long)from, (unsigned long long)to,
                    (unsigned long long)curve);
}

uint64_t step_put_face(step_text *s, const char *name, uint64_t surface, const step_loop *b, bool same_sense) {
  uint64_t oriented[STEP_SIDES_MAX];
  const char *sense = logical(same_sense);
  for (unsigned i = 0; i < b->count; i++)
    oriented[i] =
        step_print(s, "ORIENTED_EDGE('',*,*,#%llu,%s)", (unsigned long long)b->edges[i], logical(b->forward[i]));
  uint64_t loop = step_begin(s);
  bx_put_text(s->w, "EDGE_LOOP('',");
  step_put_references(s, oriented, b->count);
  bx_put_text(s->w, ");\n");
  uint64_t outer = step_print(s, "FACE_OUTER_BOUND('',#%llu,%s)", (unsigned long long)loop, sense);
  return step_print(s, "ADVANCED_FACE('%s',(#%llu),#%llu,%s)", name, (unsigned long long)outer,
                    (unsigned long long)surface, sense);
}

/* ---- the product ------------------------------------------------------------------------------------- */

static uint64_t put_length_unit(step_text *s, batten_length_unit unit) {
  static const char *const prefixes[] = {".MILLI.", ".CENTI.", "$"};
  if (unit != BATTEN_UNIT_INCH)
    return step_print(s, "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(%s,.METRE.))", prefixes[unit]);
  uint64_t mm = step_print(s, "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
  uint64_t inch = step_print(s, "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#%llu)", (unsigned long long)mm);
  uint64_t length = step_print(s, "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
  return step_print(s, "(CONVERSION_BASED_UNIT('INCH',#%llu)LENGTH_UNIT()NAMED_UNIT(#%llu))",
                    (unsigned long long)inch, (unsigned long long)length);
}

uint64_t step_put_context(step_text *s, const bx_product *product, double uncertainty) {
  uint64_t length = put_length_unit(s, product->unit);
  uint64_t angle = step_print(s, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
  uint64_t solid_angle = step_print(s, "(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
  uint64_t measure = step_begin(s);
  bx_put_text(s->w, "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(");
  step_put_real(s, uncertainty);
  bx_print(s->w, "),#%llu,'distance_accuracy_value','largest gap of what belongs together');\n",
           (unsigned long long)length);
  return step_print(s,
                    "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#%llu))"
                    "GLOBAL_UNIT_ASSIGNED_CONTEXT((#%llu,#%llu,#%llu))REPRESENTATION_CONTEXT('',''))",
                    (unsigned long long)measure, (unsigned long long)length, (unsigned long long)angle,
                    (unsigned long long)solid_angle);
}

uint64_t step_put_placement(step_text *s) {
  uint64_t origin = step_put_point(s, (double[3]){0, 0, 0});
  uint64_t z = step_print(s, "DIRECTION('',(0.,0.,1.))"), x = step_print(s, "DIRECTION('',(1.,0.,0.))");
  return step_print(s, "AXIS2_PLACEMENT_3D('',#%llu,#%llu,#%llu)", (unsigned long long)origin, (unsigned long long)z,
                    (unsigned long long)x);
}

uint64_t step_put_representation(step_text *s, const char *keyword, const bx_product *product, uint64_t placement,
                                 const uint64_t *items, size_t count, uint64_t context) {
  uint64_t representation = step_begin(s);
  bx_print(s->w, "%s(", keyword);
  step_put_text(s, product->name);
  bx_put_u8(s->w, ',');
  for (size_t i = 0; i <= count; i++) step_put_item(s, i, i == 0 ? placement : items[i - 1]);
  bx_print(s->w, "),#%llu);\n", (unsigned long long)context);
  return representation;
}

void step_end_file(step_text *s, const bx_product *p, uint64_t shape) {
  bool ap242 = p->schema == BATTEN_STEP_AP242;
  uint64_t application = step_print(
      s, "APPLICATION_CONTEXT('%s')",
      ap242 ? "managed model based 3d engineering" : "core data for automotive mechanical design processes");
  step_print(s, "APPLICATION_PROTOCOL_DEFINITION('international standard','%s',%d,#%llu)",
             ap242 ? "ap242_managed_model_based_3d_engineering" : "automotive_design", ap242 ? 2014 : 2000,
             (unsigned long long)application);
  uint64_t context = step_print(s, "PRODUCT_CONTEXT('',#%llu,'mechanical')", (unsigned long long)application);
  uint64_t product = step_begin(s);
  bx_put_text(s->w, "PRODUCT(");
  step_put_text(s, p->name);
  bx_put_u8(s->w, ',');
  step_put_text(s, p->name);
  bx_print(s->w, ",'',(#%llu));\n", (unsigned long long)context);
  step_print(s, "PRODUCT_RELATED_PRODUCT_CATEGORY('part','',(#%llu))", (unsigned long long)product);
  uint64_t formation = step_print(s, "PRODUCT_DEFINITION_FORMATION('','',#%llu)", (unsigned long long)product);
  uint64_t stage =
      step_print(s, "PRODUCT_DEFINITION_CONTEXT('part definition',#%llu,'design')", (unsigned long long)application);
  uint64_t definition = step_print(s, "PRODUCT_DEFINITION('design','',#%llu,#%llu)", (unsigned long long)formation,
                                   (unsigned long long)stage);
  uint64_t of = step_print(s, "PRODUCT_DEFINITION_SHAPE('','',#%llu)", (unsigned long long)definition);
  step_print(s, "SHAPE_DEFINITION_REPRESENTATION(#%llu,#%llu)", (unsigned long long)of, (unsigned long long)shape);
  bx_put_text(s->w, "ENDSEC;\nEND-ISO-10303-21;\n");
}
