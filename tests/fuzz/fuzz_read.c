/* Every reader on arbitrary bytes. Whatever they are: a status with a text or a whole result, finite numbers, indices
 * in range, nothing left in memory, and no more memory than the bytes can account for. */
#include "fuzz.h"

#include "format.h"
#include "qp_file.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MEMORY_LIMIT = 1 << 28 };

static const char *check_failure(batten_context *ctx, batten_status st) {
  if (st != BATTEN_E_FORMAT && st != BATTEN_E_TOO_LARGE && st != BATTEN_E_NOMEM) return "a status that none expects";
  return *batten_error(ctx) ? NULL : "a failure without a text";
}

static const char *check_cloud(const batten_cloud *c) {
  if (c->count == 0 || (c->n != 2 && c->n != 3)) return "a cloud without points or dimension";
  for (size_t i = 0; i < c->count * c->n; i++) {
    if (!isfinite(c->points[i])) return "a point that is not finite";
    if (c->normals && !isfinite(c->normals[i])) return "a normal that is not finite";
  }
  for (size_t i = 0; i < c->count; i++) {
    if (c->weights && !isfinite(c->weights[i])) return "a weight that is not finite";
    for (size_t k = 0; c->parameters && k < 2; k++)
      if (!isfinite(c->parameters[2 * i + k])) return "a parameter that is not finite";
  }
  return NULL;
}

static const char *check_mesh(const batten_mesh *m) {
  size_t vertices = batten_mesh_vertex_count(m), triangles = batten_mesh_triangle_count(m);
  for (size_t i = 0; i < 3 * triangles; i++)
    if (batten_mesh_triangles(m)[i] >= vertices) return "a corner that is no vertex";
  for (size_t i = 0; i < 3 * vertices; i++)
    if (!isfinite(batten_mesh_vertices(m)[i])) return "a vertex that is not finite";
  return triangles ? NULL : "a mesh without triangles";
}

static const char *read_points(bx_reader *r, bx_format format, unsigned n) {
  batten_cloud cloud = {0};
  batten_status st = bx_read_points_from(r, format, n, &cloud);
  if (st != BATTEN_OK) return cloud.points ? "a result in spite of a failure" : check_failure(r->ctx, st);
  const char *wrong = check_cloud(&cloud);
  batten_cloud_free(r->ctx, &cloud);
  return wrong;
}

static const char *read_mesh(bx_reader *r, bx_format format) {
  batten_mesh *mesh = NULL;
  batten_status st = bx_read_mesh_from(r, format, &mesh);
  if (st != BATTEN_OK) return mesh ? "a result in spite of a failure" : check_failure(r->ctx, st);
  const char *wrong = check_mesh(mesh);
  batten_mesh_free(mesh);
  return wrong;
}

/* Of a problem of 2 unknowns and 1 row, as the corpus has it. */
static const char *load_qp_solution(bx_reader *r) {
  double x[2] = {0}, y[3] = {0};
  signed char active[3] = {0};
  batten_qp_solution s = {.x = x, .multipliers = y, .active = active};
  batten_status st = bx_load_qp_solution(r, 2, 1, &s);
  if (st != BATTEN_OK)
    return x[0] < 0 || x[0] > 0 || active[2] ? "a result in spite of a failure" : check_failure(r->ctx, st);
  for (size_t i = 0; i < 3; i++)
    if (!isfinite(y[i]) || active[i] < -1 || active[i] > 2) return "a solution that is none";
  return isfinite(x[0]) && isfinite(x[1]) ? NULL : "an x that is not finite";
}

static const char *load_solid(bx_reader *r) {
  batten_solid *solid = NULL;
  batten_status st = bx_load_solid_from(r, &solid);
  if (st != BATTEN_OK) return solid ? "a result in spite of a failure" : check_failure(r->ctx, st);
  double x[3] = {0.25, 0.5, 0.75}, f, g[3], h[9];
  st = batten_solid_evaluate(r->ctx, solid, 1, x, &f, g, h);
  batten_solid_free(solid);
  return st < 0 ? "a solid that cannot be evaluated" : NULL;
}

static const char *load_carrier(bx_reader *r) {
  batten_carrier *carrier = NULL;
  batten_status st = bx_load_carrier_from(r, &carrier);
  if (st != BATTEN_OK) return carrier ? "a result in spite of a failure" : check_failure(r->ctx, st);
  double x[3] = {0.25, 0.5, 0.75}, f, g[3], h[9];
  st = batten_carrier_evaluate(r->ctx, carrier, 1, x, &f, g, h);
  batten_carrier_free(carrier);
  return st < 0 ? "a carrier that cannot be evaluated" : NULL;
}

static const char *read_network(bx_reader *r) {
  batten_network *network = NULL;
  batten_status st = bx_read_network_from(r, &network);
  if (st != BATTEN_OK) return network ? "a result in spite of a failure" : check_failure(r->ctx, st);
  const char *wrong = NULL;
  size_t vertices = batten_network_vertex_count(network), faces = batten_network_face_count(network);
  for (size_t i = 0; i < 3 * faces; i++)
    if (batten_network_triangles(network)[i] >= vertices) wrong = "a corner that is no vertex";
  for (size_t p = 0; p < batten_network_patch_count(network); p++) {
    batten_network_patch patch = batten_network_get_patch(network, p);
    if (patch.degree < 1 || patch.degree > 12 || patch.face >= faces || patch.part > 3) {
      wrong = "a patch of nothing";
      break;
    }
    size_t numbers = 3 * (size_t)(patch.degree + 1) * (patch.degree + 2) / 2;
    for (size_t i = 0; i < numbers; i++)
      if (!isfinite(patch.control_points[i])) wrong = "a control point that is not finite";
  }
  batten_network_free(network);
  return wrong;
}

static const char *read_surface(bx_reader *r) {
  batten_surface *surface = NULL;
  batten_status st = bx_read_surface_from(r, &surface);
  if (st != BATTEN_OK) return surface ? "a result in spite of a failure" : check_failure(r->ctx, st);
  batten_surface_form form = batten_surface_get(surface);
  double place[2];
  batten_surface_point p;
  for (int i = 0; i < 2; i++) place[i] = 0.5 * form.knots[i][0] + 0.5 * form.knots[i][form.knot_count[i] - 1];
  st = batten_surface_evaluate(r->ctx, surface, 1, place, &p);
  batten_surface_free(surface);
  return st < 0 ? "a surface that cannot be evaluated" : NULL;
}

static const char *read_curves(bx_reader *r) {
  batten_curves curves = {0};
  const char *wrong = NULL;
  batten_status st = bx_read_curves_from(r, &curves);
  if (st != BATTEN_OK) return curves.curves ? "a result in spite of a failure" : check_failure(r->ctx, st);
  for (size_t i = 0; i < curves.count; i++) {
    batten_curve_form form = batten_curve_get(curves.curves[i]);
    double t = 0.5 * form.knots[0] + 0.5 * form.knots[form.knot_count - 1];
    batten_curve_point p;
    if (batten_curve_evaluate(r->ctx, curves.curves[i], 1, &t, &p) < 0) wrong = "a curve that cannot be evaluated";
    if (curves.planes && !isfinite(curves.planes[i].origin[2])) wrong = "a plane that is nowhere";
  }
  if (curves.count == 0) wrong = "no curves";
  batten_curves_free(r->ctx, &curves);
  return wrong;
}

static const char *read_contours(bx_reader *r) {
  batten_contours c = {0};
  const char *wrong = NULL;
  batten_status st = bx_read_contours_from(r, &c);
  if (st != BATTEN_OK) return c.starts ? "a result in spite of a failure" : check_failure(r->ctx, st);
  if (c.count == 0 || c.starts[0] != 0) wrong = "no contours";
  for (size_t i = 0; i < c.count; i++) {
    if (c.starts[i] >= c.starts[i + 1]) wrong = "a contour without points";
    for (size_t k = 0; c.planes && k < 3; k++)
      if (!isfinite(c.planes[i].origin[k]) || !isfinite(c.planes[i].axes[0][k]) || !isfinite(c.planes[i].axes[1][k]))
        wrong = "a plane that is not finite";
  }
  for (size_t k = 0; !wrong && k < c.starts[c.count]; k++)
    if (!isfinite(c.points[2 * k]) || !isfinite(c.points[2 * k + 1]) || (c.weights && !isfinite(c.weights[k])) ||
        (c.parameters && !isfinite(c.parameters[k])))
      wrong = "a point that is not finite";
  batten_contours_free(r->ctx, &c);
  return wrong;
}

static const char *check_matrix(const batten_matrix *m, size_t n) {
  if (!m) return NULL;
  if (m->columns != n) return "a matrix of another width";
  size_t count = m->dense ? m->rows * n : m->starts[m->rows];
  for (size_t i = 0; i < count; i++) {
    if (!isfinite(m->dense ? m->dense[i] : m->values[i])) return "an entry that is not finite";
    if (!m->dense && m->indices[i] >= n) return "an entry beyond the columns";
  }
  for (size_t i = 0; !m->dense && i < m->rows; i++)
    if (m->starts[i] > m->starts[i + 1]) return "rows that go backwards";
  return NULL;
}

static const char *check_sides(const double *lower, const double *upper, size_t count) {
  for (size_t i = 0; i < count; i++)
    if ((lower && !(lower[i] < INFINITY)) || (upper && !(upper[i] > -INFINITY))) return "a side that leaves nothing";
  return NULL;
}

static const char *read_qp(bx_reader *r, bx_format format) {
  batten_qp_file file = {0};
  batten_status st = bx_read_qp_from(r, format, &file);
  if (st != BATTEN_OK) return file.memory ? "a result in spite of a failure" : check_failure(r->ctx, st);
  const batten_qp_problem *p = &file.problem;
  const char *wrong = check_matrix(p->a, p->n);
  if (!wrong) wrong = check_matrix(p->h, p->n);
  if (!wrong) wrong = check_matrix(p->c, p->n);
  if (!wrong) wrong = check_sides(p->lower, p->upper, p->c ? p->c->rows : 0);
  if (!wrong) wrong = check_sides(p->x_lower, p->x_upper, p->n);
  for (size_t j = 0; !wrong && j < p->n; j++)
    if ((p->g && !isfinite(p->g[j])) || (file.unknown_names && !file.unknown_names[j]))
      wrong = "g or a name is wrong";
  if (!isfinite(p->constant) || !file.name) wrong = "the constant or the name is wrong";
  batten_qp_file_free(r->ctx, &file);
  return wrong;
}

static const char *read_sections(bx_reader *r, bx_format format, int points) {
  batten_section_set set = {0};
  const char *wrong = NULL;
  batten_read_sections_options o = batten_read_sections_options_default();
  o.gap = 1;
  o.points = points;
  batten_status st = bx_read_sections_from(r, format, &o, &set);
  if (st != BATTEN_OK) return set.sections ? "a result in spite of a failure" : check_failure(r->ctx, st);
  if (set.count == 0) wrong = "no sections";
  for (size_t i = 0; i < set.count; i++) {
    const batten_section *s = &set.sections[i];
    for (size_t k = 0; k < s->contour_count; k++)
      if (s->starts[k] >= s->starts[k + 1]) wrong = "a contour without points";
    for (size_t k = 0; k < 2 * s->starts[s->contour_count]; k++)
      if (!isfinite(s->points[k])) wrong = "a point that is not finite";
    for (int k = 0; k < 3; k++)
      if (!isfinite(s->origin[k]) || !isfinite(s->rotation[k][0])) wrong = "a frame that is not finite";
  }
  batten_section_set_free(r->ctx, &set);
  return wrong;
}

/* Trees may fail as their nodes' constructors do. */
static const char *load_frep(bx_reader *r) {
  batten_frep *tree = NULL;
  batten_status st = bx_load_frep_from(r, &tree);
  if (st != BATTEN_OK)
    return tree ? "a result in spite of a failure" : st == BATTEN_E_SINGULAR ? NULL : check_failure(r->ctx, st);
  double x[3] = {0.25, 0.5, 0.75}, f, g[3];
  st = batten_frep_evaluate(r->ctx, tree, 1, x, &f, g);
  batten_frep_free(tree);
  return st < 0 ? "a tree that cannot be evaluated" : NULL;
}

/* The readers of a format, by number; false when there are no more. */
static bool read_once(bx_reader *r, bx_format format, unsigned which, const char **wrong) {
  *wrong = NULL;
  if (format == BX_QPS || format == BX_MAT) {
    if (which > 0) return false;
    *wrong = read_qp(r, format);
    return true;
  }
  if (format == BX_JSON) {
    if (which > 8) return false;
    *wrong = which == 0   ? load_solid(r)
             : which == 1 ? load_carrier(r)
             : which == 2 ? read_qp(r, format)
             : which == 3 ? load_qp_solution(r)
             : which == 4 ? read_network(r)
             : which == 5 ? read_surface(r)
             : which == 6 ? read_curves(r)
             : which == 7 ? read_sections(r, format, 0)
                          : load_frep(r);
    return true;
  }
  if (which > 3 && which < 6 && format == BX_TEXT)
    *wrong = read_sections(r, format, which == 5);
  else if (which == 3)
    *wrong = format == BX_TEXT ? read_contours(r) : read_mesh(r, format);
  else if (which < 3)
    *wrong = read_points(r, format, which ? which + 1 : 0);
  else
    return false;
  return true;
}

const char *fuzz_read(const char *name, const unsigned char *data, size_t size) {
  batten_context_options o = batten_context_options_default();
  o.memory_limit = MEMORY_LIMIT;
  batten_context *ctx = NULL;
  if (batten_context_new(&o, &ctx) != BATTEN_OK) return NULL;
  const char *wrong = NULL;
  bool packed = size >= 2 && data[0] == 0x1f && data[1] == 0x8b, more = true, named;
  bx_format format = bx_format_of(name, &named);
  for (size_t i = 0; format == BX_MAT && i < size; i++) packed = packed || data[i] == 0x0f; /* compressed elements */
  for (unsigned which = 0; more && !wrong; which++) {
    bx_reader r;
    batten_status st = bx_open_memory(&r, ctx, name, data, size);
    if (st != BATTEN_OK) {
      wrong = check_failure(ctx, st);
      break;
    }
    more = read_once(&r, format, which, &wrong);
    bx_close(&r);
    if (!wrong && batten_bytes_in_use(ctx)) wrong = "memory is left";
    /* 400: a byte of text can be a corner that takes a triangle's 12, twice while it grows, and a slot's share */
    if (!wrong && !packed && batten_bytes_peak(ctx) > (1 << 19) + 400 * size)
      wrong = "more memory than the bytes account for";
  }
  batten_context_free(ctx);
  return wrong;
}

#ifdef FUZZ_NAME
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  const char *wrong = fuzz_read(FUZZ_NAME, data, size);
  if (wrong) {
    fprintf(stderr, "%s: %s\n", FUZZ_NAME, wrong);
    abort();
  }
  return 0;
}
#endif
