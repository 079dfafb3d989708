/* The surface f = 0 as a triangle mesh: track (track.c), improve and settle (improve.c). See <batten/mesh.h>. */
#include "polygonize.h"

#include "base/neighbours.h"
#include "improve.h"
#include "mesh_inner.h"
#include "seeds.h"
#include "sharp.h"
#include "track.h"

#include "base/checked.h"

#include <string.h>

static const double BOX_MARGIN = 0.25; /* of the seeds' largest extent, on every side */
static const double DEGREE = 0.017453292519943295;
static const double CELL_SPACING = 0.7; /* of the median distance between neighbouring seeds */
static const double CELL_LARGEST = 1.0 / 60, CELL_SMALLEST = 1.0 / 200; /* of the diagonal of the seeds' box */
static const double SHARP_MIN = 15, SHARP_MAX = 170; /* degrees: flatter creases are not told from smooth places */
static const double CUBE_EDGES = 1.25; /* lattice cubes are wider than the edges: they give 3.6 vertices for each */

batten_polygonize_options batten_polygonize_options_default(void) {
  return (batten_polygonize_options){
      .struct_size = sizeof(batten_polygonize_options), .accuracy = 1e-6, .improve = 8};
}

/* ---- arguments ---------------------------------------------------------------------------------- */

static batten_status check_options(batten_context *ctx, unsigned n, const batten_polygonize_options *o) {
  batten_status st =
      batten_check_struct(ctx, "batten_polygonize_options", o->struct_size, sizeof(batten_polygonize_options));
  if (st < 0) return st;
  if (!(o->cell >= 0) || isinf(o->cell))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.cell: %g; give a length > 0, or 0 for one from the seeds",
                       o->cell);
  if (!(o->accuracy > 0) || !(o->accuracy < 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.accuracy: %g; give a share of the box diagonal, 0 < accuracy < 1",
                       o->accuracy);
  if (!(o->sharp_deg >= 0) || !(o->sharp_deg <= SHARP_MAX) || (o->sharp_deg > 0 && o->sharp_deg < SHARP_MIN))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.sharp_deg: %g; give an angle from %g to %g degrees, or 0",
                       o->sharp_deg, SHARP_MIN, SHARP_MAX);
  bool given = false;
  for (unsigned k = 0; k < n; k++) given = given || o->lower[k] != 0 || o->upper[k] != 0;
  for (unsigned k = 0; given && k < n; k++)
    if (!(o->lower[k] < o->upper[k]) || isinf(o->lower[k]) || isinf(o->upper[k]) || isinf(o->upper[k] - o->lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.lower[%u], opt.upper[%u]: %g, %g; give lower < upper, or all 0 for the seeds' box", k,
                         k, o->lower[k], o->upper[k]);
  return BATTEN_OK;
}

static batten_status check_arguments(batten_context *ctx, unsigned n, const batten_field *field, size_t seed_count,
                                     const double *seeds, const batten_polygonize_options *o, const void *out) {
  if (!field || !field->evaluate)
    return batten_fail(ctx, BATTEN_E_INVALID, "field: NULL; give a field with its evaluate function");
  if (field->dimension != n)
    return batten_fail(ctx, BATTEN_E_INVALID, "field.dimension: %u; %s takes fields in %u dimensions",
                       field->dimension, n == 3 ? "batten_polygonize" : "batten_trace_outline", n);
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  if (seed_count == 0 || !seeds)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "seeds: none; give points on or near the surface, or none, opt.lower and opt.upper, and a "
                       "field with bounds");
  size_t values;
  if (!batten_mul(seed_count, n, &values) || values > SIZE_MAX / sizeof *seeds)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "seed_count: %zu", seed_count);
  size_t bad = batten_first_nonfinite(values, seeds);
  if (bad < values)
    return batten_fail(ctx, BATTEN_E_INVALID, "seeds[%zu][%zu]: %g; give finite coordinates", bad / n, bad % n,
                       seeds[bad]);
  return check_options(ctx, n, o);
}

/* ---- box and cell ------------------------------------------------------------------------------- */

static int compare_doubles(const double *a, const double *b) { return *a < *b ? -1 : *a > *b; }

/* k-th smallest of the values, which are reordered: quickselect. */
static double select_value(size_t count, double *v, size_t wanted) {
  size_t low = 0, high = count - 1;
  while (low < high) {
    double pivot = v[low + (high - low) / 2];
    size_t i = low, j = high;
    for (;;) {
      while (compare_doubles(v + i, &pivot) < 0) i++;
      while (compare_doubles(v + j, &pivot) > 0) j--;
      if (i >= j) break;
      double t = v[i];
      v[i++] = v[j];
      v[j--] = t;
    }
    if (j >= wanted)
      high = j;
    else
      low = j + 1;
  }
  return v[wanted];
}

/* Median distance of a seed to the nearest other one, those at the same place left out; 0 when there is none. */
static batten_status seed_spacing(batten_context *ctx, unsigned n, size_t count, const double *seeds,
                                  double *spacing) {
  *spacing = 0;
  if (count < 2) return BATTEN_OK;
  size_t *index = batten_alloc_array(ctx, count, sizeof *index);
  double *distance = index ? batten_alloc_array(ctx, count, sizeof *distance) : NULL;
  batten_status st = distance ? batten_neighbours(ctx, n, count, seeds, 1, index, distance) : BATTEN_E_NOMEM;
  if (st >= 0) {
    size_t apart = 0;
    for (size_t i = 0; i < count; i++)
      if (distance[i] > 0) distance[apart++] = distance[i];
    if (apart) *spacing = select_value(apart, distance, apart / 2);
  }
  batten_free(ctx, distance);
  batten_free(ctx, index);
  return st;
}

static double diagonal(unsigned n, const double *lower, const double *upper) {
  double largest = 0, sum = 0;
  for (unsigned k = 0; k < n; k++) largest = fmax(largest, upper[k] - lower[k]);
  if (!(largest > 0)) return 0;
  for (unsigned k = 0; k < n; k++) sum += (upper[k] - lower[k]) / largest * ((upper[k] - lower[k]) / largest);
  return largest * sqrt(sum);
}

batten_status batten_polygonize_frame(batten_context *ctx, unsigned n, const batten_field *field, size_t seed_count,
                                      const double *seeds, const batten_polygonize_options *opt, const void *out,
                                      batten_frame *frame) {
  batten_status st = check_arguments(ctx, n, field, seed_count, seeds, opt, out);
  if (st < 0) return st;
  batten_frame f = {.cell = opt->cell};
  bool given = false;
  double lower[3] = {0, 0, 0}, upper[3] = {0, 0, 0}, extent = 0;
  for (unsigned k = 0; k < n; k++) {
    lower[k] = upper[k] = seeds[k];
    for (size_t i = 1; i < seed_count; i++) {
      lower[k] = fmin(lower[k], seeds[n * i + k]);
      upper[k] = fmax(upper[k], seeds[n * i + k]);
    }
    extent = fmax(extent, upper[k] - lower[k]);
    given = given || opt->lower[k] != 0 || opt->upper[k] != 0;
  }
  for (unsigned k = 0; k < n; k++) {
    f.lower[k] = given ? opt->lower[k] : lower[k] - BOX_MARGIN * extent;
    f.upper[k] = given ? opt->upper[k] : upper[k] + BOX_MARGIN * extent;
    if (!(f.lower[k] < f.upper[k]) || isinf(f.upper[k] - f.lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "seeds: their box is [%g, %g] along axis %u; give opt.lower and opt.upper", lower[k],
                         upper[k], k);
  }
  f.diagonal = diagonal(n, f.lower, f.upper);
  if (f.cell == 0) {
    double size = diagonal(n, lower, upper), spacing;
    st = seed_spacing(ctx, n, seed_count, seeds, &spacing);
    if (st < 0) return st;
    if (!(size > 0) || size > f.diagonal) size = f.diagonal;
    f.cell = spacing > 0 ? CELL_SPACING * spacing : CELL_LARGEST * size;
    f.cell = fmin(fmax(f.cell, CELL_SMALLEST * size), CELL_LARGEST * size);
  }
  *frame = f;
  return BATTEN_OK;
}

batten_status batten_polygonize_seeds(batten_context *ctx, unsigned n, const batten_field *field, const void *out,
                                      batten_polygonize_options *opt, size_t *seed_count, const double **seeds,
                                      double **found, size_t *evaluations) {
  bool given = false;
  for (unsigned k = 0; k < n; k++) given = given || opt->lower[k] != 0 || opt->upper[k] != 0;
  if (*seed_count || *seeds || !out || !given) return BATTEN_OK;
  if (!field || !field->evaluate || !field->bounds || field->dimension != n) return BATTEN_OK;
  batten_status st = check_options(ctx, n, opt);
  if (st < 0) return st;
  if (opt->cell == 0) opt->cell = CELL_LARGEST * diagonal(n, opt->lower, opt->upper);
  batten_sampler sampler = {.ctx = ctx, .field = field, .evaluations_max = opt->evaluations_max};
  st = batten_search_seeds(&sampler, opt->lower, opt->upper, opt->cell, seed_count, found);
  if (st < 0) return st;
  *seeds = *found;
  *evaluations = sampler.evaluations;
  return BATTEN_OK;
}

/* ---- the phases --------------------------------------------------------------------------------- */

batten_status batten_polygonize_warn(batten_context *ctx, const batten_polygonize_info *info, double tolerance) {
  if (info->distance_max > tolerance)
    return batten_fail(ctx, BATTEN_W_ACCURACY,
                       "accuracy: vertices lie up to %g off f = 0, %g allowed; the field may not be smooth there",
                       info->distance_max, tolerance);
  if (info->self_intersections)
    return batten_fail(ctx, BATTEN_W_ACCURACY,
                       "the surface crosses itself at %zu pairs of triangles: parts or gaps of it are too thin for "
                       "opt.cell; make that smaller than %g",
                       info->self_intersections, info->cell);
  if (info->clipped)
    return batten_fail(ctx, BATTEN_W_CLIPPED,
                       "the surface reaches its box and is cut there; enlarge opt.lower and "
                       "opt.upper for all of it");
  return BATTEN_OK;
}

/* Takes away what only changes need. */
static void mesh_surface_trim(mesh_surface *s) {
  void **blocks[] = {(void **)&s->normals, (void **)&s->out, (void **)&s->twin, (void **)&s->sharp,
                     (void **)&s->drift};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
    batten_free(s->ctx, *blocks[i]);
    *blocks[i] = NULL;
  }
}

static batten_status count_crossings(const mesh_surface *s, size_t *pairs) {
  return batten_mesh_find_crossings(s->ctx, s->vertex_count, s->points, s->triangle_count, s->origin, NULL, pairs);
}

typedef struct avoided {
  size_t count;
  double *places;    /* [count][3] */
  batten_tree *tree; /* of these; NULL: there are none */
} avoided;

/* Adds corners of triangles that cross others; *fresh: how many of them no crease was kept away from before. */
static batten_status add_crossings(const mesh_surface *s, double edge, avoided *a, size_t *fresh, size_t *pairs) {
  batten_context *ctx = s->ctx;
  const size_t before = a->count;
  size_t marked = 0;
  *fresh = *pairs = 0;
  unsigned char *marks = batten_alloc_array(ctx, s->triangle_count, 1);
  batten_status st =
      marks ? batten_mesh_find_crossings(ctx, s->vertex_count, s->points, s->triangle_count, s->origin, marks, pairs)
            : BATTEN_E_NOMEM;
  for (size_t t = 0; st >= 0 && *pairs && t < s->triangle_count; t++) marked += marks[t];
  double *grown = marked ? batten_realloc_array(ctx, a->places, before + marked, 3 * sizeof *grown) : NULL;
  if (marked && !grown) st = BATTEN_E_NOMEM;
  if (grown) a->places = grown;
  for (size_t t = 0; grown && t < s->triangle_count; t++) {
    const double *x = s->points + 3 * (size_t)s->origin[3 * t];
    if (!marks[t]) continue;
    *fresh += !mesh_surface_is_near(x, edge, a->tree);
    memcpy(grown + 3 * a->count++, x, 3 * sizeof *grown);
  }
  batten_free(ctx, marks);
  if (st < 0 || a->count == before) return st;
  batten_tree_free(ctx, a->tree);
  a->tree = NULL;
  return batten_tree_new(ctx, 3, a->count, a->places, &a->tree);
}

/* Makes the settled surface follow its creases. Where that makes it cross itself it is tried again without these
 * places; in the end, or where it misses the accuracy that it had, it stays as it was. Parts that are too thin for
 * the mesh may cross anew without any crease near them, if they crossed before, but not twice as often. */
static batten_status sharpen(batten_sampler *sampler, const batten_frame *frame, double edge,
                             const batten_polygonize_options *opt, mesh_surface *surface,
                             batten_polygonize_info *info) {
  enum { TRIES = 4, AVOID_MAX = 4096 };
  double distance = 0, tolerance = opt->accuracy * frame->diagonal;
  avoided avoid = {0};
  size_t fresh = 1, pairs = 0;
  batten_status st = BATTEN_OK;
  for (int attempt = 0; st >= 0 && fresh && avoid.count < AVOID_MAX && attempt < TRIES; attempt++) {
    size_t count = 0;
    mesh_surface sharp = {.ctx = sampler->ctx};
    fresh = 0;
    st = mesh_surface_copy(surface, &sharp);
    if (st >= 0)
      st = mesh_surface_sharpen(&sharp, sampler, frame->lower, frame->upper, edge, opt->sharp_deg * DEGREE,
                                avoid.tree, &count);
    if (st >= 0 && count) st = mesh_surface_settle(&sharp, sampler, edge, tolerance, &distance);
    if (st >= 0 && count) st = add_crossings(&sharp, edge, &avoid, &fresh, &pairs);
    if (st >= 0 && !fresh && pairs <= 2 * info->self_intersections && count &&
        distance <= fmax(tolerance, info->distance_max)) {
      mesh_surface was = *surface;
      *surface = sharp;
      sharp = was;
      info->crease_vertices = count;
      info->distance_max = distance;
    }
    mesh_surface_free(&sharp);
  }
  batten_tree_free(sampler->ctx, avoid.tree);
  batten_free(sampler->ctx, avoid.places);
  return st;
}

/* One attempt: *surface is a mesh with edges of about `edge`, from a lattice of cubes with the side `cube`. */
static batten_status attempt(batten_sampler *sampler, const batten_frame *frame, double cube, double edge,
                             size_t seed_count, const double *seeds, const batten_polygonize_options *opt,
                             mesh_surface *surface, batten_polygonize_info *info) {
  batten_rough_surface rough = {0};
  double start = batten_now();
  batten_status st = batten_track_surface(sampler, frame->lower, frame->upper, cube, seed_count, seeds, &rough);
  info->time_track_s += batten_now() - start;
  if (st < 0) return st;
  start = batten_now();
  info->cell = edge;
  info->seeds_missed = rough.seeds_missed;
  info->clipped = 0;
  for (size_t v = 0; v < rough.vertex_count; v++) info->clipped = info->clipped || rough.faces[v];
  st = mesh_surface_build(sampler->ctx, &rough, surface);
  if (st >= 0) st = mesh_surface_improve(surface, sampler, frame->lower, frame->upper, edge, opt->improve);
  if (st >= 0) st = mesh_surface_settle(surface, sampler, edge, opt->accuracy * frame->diagonal, &info->distance_max);
  info->crease_vertices = 0;
  if (st >= 0) st = count_crossings(surface, &info->self_intersections);
  info->time_improve_s += batten_now() - start;
  return st;
}

/* A surface that crosses itself has parts too thin for the lattice: again with cubes of half the side, and at last
 * with shorter edges too. Creases are followed on the surface that stays. */
static batten_status make_surface(batten_sampler *sampler, const batten_frame *frame, size_t seed_count,
                                  const double *seeds, const batten_polygonize_options *opt, mesh_surface *surface,
                                  batten_polygonize_info *info) {
  static const double cube_share[] = {1, 0.5, 0.25}, edge_share[] = {1, 1, 0.5};
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < sizeof cube_share / sizeof *cube_share; i++) {
    mesh_surface_free(surface);
    st = attempt(sampler, frame, CUBE_EDGES * cube_share[i] * frame->cell, edge_share[i] * frame->cell, seed_count,
                 seeds, opt, surface, info);
    if (st < 0 || info->self_intersections == 0 || opt->improve == 0) break;
  }
  if (st < 0 || opt->improve == 0 || !(opt->sharp_deg > 0)) return st;
  double start = batten_now();
  st = sharpen(sampler, frame, info->cell, opt, surface, info);
  if (st >= 0) st = count_crossings(surface, &info->self_intersections);
  info->time_improve_s += batten_now() - start;
  return st;
}

/* Areas are squared on the way: for cells beyond 2^+-UNIT_MAX lengths are taken in a power of two near the cell. */
enum { UNIT_MAX = 150 };

static int unit_exponent(double cell) {
  int exponent = 0;
  frexp(cell, &exponent);
  return exponent > UNIT_MAX || exponent < -UNIT_MAX ? exponent : 0;
}

static void scale_values(size_t count, const double *from, int exponent, double *to) {
  for (size_t i = 0; i < count; i++) to[i] = ldexp(from[i], exponent);
}

/* make_surface with frame and seeds in the unit 2^sampler->exponent; surface and info come back in the caller's. */
static batten_status make_in_unit(batten_sampler *sampler, const batten_frame *frame, size_t seed_count,
                                  const double *seeds, const batten_polygonize_options *opt, mesh_surface *surface,
                                  batten_polygonize_info *info) {
  const int exponent = sampler->exponent;
  if (exponent == 0) return make_surface(sampler, frame, seed_count, seeds, opt, surface, info);
  batten_frame scaled;
  double *scaled_seeds = batten_alloc_array(sampler->ctx, seed_count, 3 * sizeof *scaled_seeds);
  if (!scaled_seeds) return BATTEN_E_NOMEM;
  scale_values(3 * seed_count, seeds, -exponent, scaled_seeds);
  scale_values(3, frame->lower, -exponent, scaled.lower);
  scale_values(3, frame->upper, -exponent, scaled.upper);
  scale_values(1, &frame->diagonal, -exponent, &scaled.diagonal);
  scale_values(1, &frame->cell, -exponent, &scaled.cell);
  sampler->difference = BATTEN_DIFFERENCE * scaled.cell;
  batten_status st = make_surface(sampler, &scaled, seed_count, scaled_seeds, opt, surface, info);
  batten_free(sampler->ctx, scaled_seeds);
  if (st < 0) return st;
  scale_values(3 * surface->vertex_count, surface->points, exponent, surface->points);
  scale_values(1, &info->cell, exponent, &info->cell);
  scale_values(1, &info->distance_max, exponent, &info->distance_max);
  return st;
}

batten_status batten_polygonize(batten_context *ctx, const batten_field *field, size_t seed_count,
                                const double *seeds, const batten_polygonize_options *opt, batten_mesh **out,
                                batten_polygonize_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_polygonize_options o = opt ? *opt : batten_polygonize_options_default();
  batten_frame frame;
  double *searched = NULL;
  size_t evaluations = 0;
  batten_status st = batten_polygonize_seeds(ctx, 3, field, out, &o, &seed_count, &seeds, &searched, &evaluations);
  if (st >= 0) st = batten_polygonize_frame(ctx, 3, field, seed_count, seeds, &o, out, &frame);
  if (st < 0) {
    batten_free(ctx, searched);
    return st;
  }
  batten_polygonize_info found = {.cell = frame.cell};
  mesh_surface surface = {.ctx = ctx};
  batten_sampler sampler = {.ctx = ctx,
                            .field = field,
                            .evaluations = evaluations,
                            .evaluations_max = o.evaluations_max,
                            .difference = BATTEN_DIFFERENCE * frame.cell,
                            .exponent = unit_exponent(frame.cell)};
  st = make_in_unit(&sampler, &frame, seed_count, seeds, &o, &surface, &found);
  batten_free(ctx, searched);
  found.evaluations = sampler.evaluations;
  if (st >= 0) {
    mesh_surface_trim(&surface);
    st = batten_mesh_create(ctx, surface.vertex_count, surface.points, surface.triangle_count, surface.origin, out);
  }
  mesh_surface_free(&surface);
  if (st < 0) return st;
  if (info) *info = found;
  return batten_polygonize_warn(ctx, &found, o.accuracy * frame.diagonal);
}
