/* kernel/loft/net.c: a case by hand; control points of random unknowns by evaluation of the patches, at contours and
 * by derivatives across them, x'' at flat points, slopes at the ends; and whether the unknowns are all that there
 * are: their number against the null space of the conditions written down as equations, with no unknown too
 * many. */
#include "tap.h"

#include "loft/loft_inner.h"

enum { CONTOURS_MAX = 6, PLACES = 40 };

typedef struct net_case {
  unsigned degree, smoothness, n;
  bool closed, slopes;
  size_t contours, spans; /* at most, of a contour */
  size_t grid;            /* breaks are multiples of 1 / grid */
  unsigned flats;         /* of each patch, at most: at knots of both contours */
  bool straight;          /* contours are so on [0.1, 0.8] where their knots allow */
  uint64_t seed;
} net_case;

typedef struct net_rig {
  loft_contour contours[CONTOURS_MAX];
  loft_stack stack;
  loft_slab *slabs;
} net_rig;

/* ---- stacks by hand ------------------------------------------------------------------------------ */

static void random_contour(batten_context *ctx, const net_case *c, uint64_t *seed, loft_contour *out) {
  double breaks[64] = {0};
  unsigned folds[64] = {0};
  size_t spans = 0;
  for (size_t g = 1; g < c->grid && spans + 1 < c->spans; g++)
    if (t_uniform(seed) < 0.6) breaks[++spans] = (double)g / (double)c->grid;
  breaks[++spans] = 1;
  for (size_t i = 0; i <= spans; i++)
    folds[i] = c->degree > 2 && t_uniform(seed) < 0.3 ? c->degree - c->smoothness : 1;
  size_t all = 0;
  for (size_t i = 0; i < spans; i++) all += folds[i];
  if (c->closed && all <= c->degree) { /* too few control points: finer */
    spans = c->degree + 1;
    for (size_t i = 0; i <= spans; i++) {
      breaks[i] = (double)i / (double)spans;
      folds[i] = 1;
    }
  }
  if (loft_space_make(ctx, c->degree, c->closed, spans, breaks, folds, &out->space) < 0) abort();
  out->points = batten_alloc_array(ctx, out->space.count, 2 * sizeof *out->points);
  for (size_t k = 0; k < 2 * out->space.count; k++) out->points[k] = 2 * t_uniform(seed) - 1;
}

/* x'' at vertex v, times an interval. */
static double bend(const loft_space *s, const double *points, size_t v) {
  double legs[2] = {loft_interval(s, (ptrdiff_t)v), loft_interval(s, (ptrdiff_t)v + 1)}, out[2];
  for (size_t x = 0; x < 2; x++) {
    const double p[3] = {points[2 * v + x], points[2 * ((v + 1) % s->count) + x],
                         points[2 * ((v + 2) % s->count) + x]};
    out[x] = (p[2] - p[1]) / legs[1] - (p[1] - p[0]) / legs[0];
  }
  return hypot(out[0], out[1]);
}

/* Makes x'' = 0 on [a, b], knots or not. */
static void straighten(loft_contour *c, double a, double b) {
  const loft_space *s = &c->space;
  size_t from = 0, to;
  while (from < s->count && loft_knot(s, (ptrdiff_t)from + 2) < a) from++;
  for (to = from; loft_knot(s, (ptrdiff_t)(to + s->degree) + 1) <= b; to++) {
  }
  /* Vertices from .. to - 1 lie within, between control points from and to + 1. */
  double g[2] = {loft_greville(s, (ptrdiff_t)from), loft_greville(s, (ptrdiff_t)to + 1)};
  for (size_t j = from + 1; j <= to; j++)
    for (size_t x = 0; x < 2; x++) {
      double part = (loft_greville(s, (ptrdiff_t)j) - g[0]) / (g[1] - g[0]);
      c->points[2 * (j % s->count) + x] =
          (1 - part) * c->points[2 * (from % s->count) + x] + part * c->points[2 * ((to + 1) % s->count) + x];
    }
}

static unsigned fold_at(const loft_space *s, double t) {
  for (size_t i = 0; i <= s->spans; i++)
    if (s->breaks[i] == t) return s->folds[i];
  return 0;
}

/* Flags some vertices of a patch. With `flats` of them only those where x'' of both contours has a control point at
 * one and the same knot. */
static void random_flats(batten_context *ctx, const net_case *c, uint64_t *seed, const loft_contour *ends,
                         loft_slab *slab) {
  size_t vertices = loft_vertices(&slab->space), left = c->flats;
  slab->wanted = batten_alloc_array(ctx, vertices, 1);
  for (size_t v = 0; v < vertices; v++) slab->wanted[v] = LOFT_FREE;
  for (size_t v = 0; v < vertices && c->straight; v++) {
    double ends_bend = 0;
    for (size_t e = 0; e < 2; e++) ends_bend = fmax(ends_bend, bend(&slab->space, slab->end[e], v));
    if (ends_bend < 1e-12) slab->wanted[v] = LOFT_FLAT;
  }
  for (size_t v = 0; v < vertices && left > 0 && c->degree > 2; v++) {
    double a = loft_knot(&slab->space, (ptrdiff_t)v + 3), b = loft_knot(&slab->space, (ptrdiff_t)(v + c->degree));
    double at = c->closed && a >= 1 ? a - 1 : a;
    bool both = fold_at(&ends[0].space, at) >= c->degree - 2 && fold_at(&ends[1].space, at) >= c->degree - 2;
    if (a != b || !both || t_uniform(seed) < 0.3) continue;
    slab->wanted[v] = LOFT_FLAT;
    left--;
  }
}

static void rig_make(batten_context *ctx, const net_case *c, net_rig *r) {
  *r = (net_rig){
      .stack = {.degree = c->degree, .smoothness = c->smoothness, .closed = c->closed, .count = c->contours}};
  uint64_t seed = c->seed;
  double z = 0;
  for (size_t i = 0; i < c->contours; i++) {
    random_contour(ctx, c, &seed, &r->contours[i]);
    if (c->straight) straighten(&r->contours[i], 0.1, 0.8);
    r->contours[i].height = z;
    z += pow(10, 1.4 * t_uniform(&seed) - 0.7);
  }
  r->stack.contours = r->contours;
  for (size_t e = 0; e < 2 && c->slopes; e++) {
    size_t count = r->contours[e ? c->contours - 1 : 0].space.count;
    r->stack.slopes[e] = batten_alloc_array(ctx, count, 2 * sizeof(double));
    for (size_t k = 0; k < 2 * count; k++) r->stack.slopes[e][k] = 2 * t_uniform(&seed) - 1;
  }
  if (loft_slabs_make(ctx, &r->stack, &r->slabs) < 0) abort();
  for (size_t i = 0; i + 1 < c->contours && (c->flats > 0 || c->straight); i++)
    random_flats(ctx, c, &seed, &r->contours[i], &r->slabs[i]);
}

static void rig_free(batten_context *ctx, net_rig *r) {
  loft_slabs_free(ctx, r->stack.count - 1, r->slabs);
  for (size_t i = 0; i < r->stack.count; i++) {
    batten_free(ctx, r->contours[i].points);
    loft_space_free(ctx, &r->contours[i].space);
  }
  for (size_t e = 0; e < 2; e++) batten_free(ctx, r->stack.slopes[e]);
}

/* ---- evaluation ---------------------------------------------------------------------------------- */

/* Functions [degree + 1] of a space at t, k-th derivatives, and the control points that they are of. */
static void functions(const loft_space *s, unsigned k, double t, double *values, size_t *which) {
  double table[BSPLINE_ORDER * BSPLINE_ORDER];
  size_t span = s->spans - 1;
  while (span > 0 && t < s->breaks[span]) span--;
  bspline_basis(&s->b, s->first[span] + s->degree, t, k, table);
  for (unsigned j = 0; j <= s->degree; j++) {
    values[j] = table[k * (s->degree + 1) + j];
    which[j] = (s->first[span] + j) % s->count;
  }
}

static void curve_value(const loft_space *s, const double *points, unsigned k, double t, double out[2]) {
  double values[BSPLINE_ORDER];
  size_t which[BSPLINE_ORDER];
  functions(s, k, t, values, which);
  out[0] = out[1] = 0;
  for (unsigned j = 0; j <= s->degree; j++)
    for (size_t x = 0; x < 2; x++) out[x] += values[j] * points[2 * which[j] + x];
}

/* Weights [n + 1] of the Bezier points for the m-th derivative by z at either end. */
static void end_weights(unsigned n, unsigned m, unsigned end, double gap, double *weights) {
  double factor = 1;
  for (unsigned k = 0; k <= n; k++) weights[k] = 0;
  for (unsigned r = 0; r < m; r++) factor *= (n - r) / gap;
  static const double signs[3][3] = {{1, 0, 0}, {-1, 1, 0}, {1, -2, 1}};
  for (unsigned r = 0; r <= m; r++) {
    double w = factor * signs[m][r];
    if (end)
      weights[n - m + r] = w;
    else
      weights[r] = w;
  }
}

/* The m-th derivative by z of patch i at an end. control [rows][2]. */
static void patch_value(const loft_net *net, size_t i, unsigned end, unsigned m, double t, const double *control,
                        double out[2]) {
  const loft_space *s = &net->slabs[i].space;
  double values[BSPLINE_ORDER], weights[32];
  size_t which[BSPLINE_ORDER];
  functions(s, 0, t, values, which);
  end_weights(net->degree, m, end, net->slabs[i].gap, weights);
  out[0] = out[1] = 0;
  for (unsigned j = 0; j <= s->degree; j++)
    for (unsigned k = 0; k <= net->degree; k++)
      for (size_t x = 0; x < 2; x++) out[x] += values[j] * weights[k] * control[2 * loft_at(net, i, which[j], k) + x];
}

/* x'' of the sections' control points k by t. */
static double patch_second(const loft_net *net, size_t i, unsigned k, double t, const double *control) {
  const loft_space *s = &net->slabs[i].space;
  double values[BSPLINE_ORDER], out[2] = {0, 0};
  size_t which[BSPLINE_ORDER];
  functions(s, 2, t, values, which);
  for (unsigned j = 0; j <= s->degree; j++)
    for (size_t x = 0; x < 2; x++) out[x] += values[j] * control[2 * loft_at(net, i, which[j], k) + x];
  return hypot(out[0], out[1]);
}

/* ---- the conditions as equations ----------------------------------------------------------------- */

/* The rank of rows x columns, by elimination with the largest pivot; destroys it. Rows are scaled to length 1. */
static size_t rank(size_t rows, size_t columns, double *a, double *gap) {
  for (size_t i = 0; i < rows; i++) {
    double length = 0;
    for (size_t j = 0; j < columns; j++) length = hypot(length, a[i * columns + j]);
    for (size_t j = 0; j < columns && length > 0; j++) a[i * columns + j] /= length;
  }
  size_t r = 0;
  double before = 1;
  for (; r < rows && r < columns; r++) {
    size_t pi = r, pj = r;
    for (size_t i = r; i < rows; i++)
      for (size_t j = r; j < columns; j++)
        if (fabs(a[i * columns + j]) > fabs(a[pi * columns + pj])) pi = i, pj = j;
    double pivot = a[pi * columns + pj];
    if (fabs(pivot) < 1e-10) {
      *gap = fmin(*gap, before);
      return r;
    }
    before = fmin(before, fabs(pivot));
    for (size_t j = 0; j < columns; j++) {
      double keep = a[r * columns + j];
      a[r * columns + j] = a[pi * columns + j];
      a[pi * columns + j] = keep;
    }
    for (size_t i = 0; i < rows; i++) {
      double keep = a[i * columns + r];
      a[i * columns + r] = a[i * columns + pj];
      a[i * columns + pj] = keep;
    }
    for (size_t i = r + 1; i < rows; i++) {
      double factor = a[i * columns + r] / pivot;
      for (size_t j = r; j < columns && factor != 0; j++) a[i * columns + j] -= factor * a[r * columns + j];
    }
  }
  *gap = fmin(*gap, before);
  return r;
}

/* Conditions on all Bezier points but those of the contours: eq. 9 at as many t in each span as settle it, and flat
 * vertices: second differences of all k. [rows][z.rows], rows counted; NULL counts. */
static size_t conditions(const net_rig *rig, const loft_net *net, double *a) {
  size_t rows = 0, columns = net->z.rows;
  unsigned d = rig->stack.degree, n = net->degree;
  for (size_t i = 0; i + 1 < net->slab_count; i++) {
    const loft_space *beside[2] = {&net->slabs[i].space, &net->slabs[i + 1].space};
    loft_space both = {0};
    batten_context *ctx = t_context(NULL, NULL, 1);
    if (loft_space_union(ctx, beside[0], beside[1], &both) < 0) abort();
    for (size_t s = 0; s < both.spans; s++)
      for (unsigned q = 0; q <= d; q++) {
        double t = both.breaks[s] + (both.breaks[s + 1] - both.breaks[s]) * (q + 0.5) / (d + 1);
        for (unsigned m = 1; m <= net->smoothness; m++, rows++)
          for (unsigned e = 0; e < 2 && a; e++) {
            double values[BSPLINE_ORDER], weights[32];
            size_t which[BSPLINE_ORDER];
            functions(beside[e], 0, t, values, which);
            end_weights(n, m, !e, net->slabs[i + e].gap, weights);
            for (unsigned j = 0; j <= d; j++)
              for (unsigned k = 1; k < n; k++)
                a[rows * columns + loft_at(net, i + e, which[j], k)] += (e ? 1 : -1) * values[j] * weights[k];
          }
      }
    loft_space_free(ctx, &both);
    batten_context_free(ctx);
  }
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *slab = &net->slabs[i];
    for (size_t v = 0; v < loft_vertices(&slab->space) && slab->wanted; v++)
      for (unsigned k = 1; k < n && slab->wanted[v] == LOFT_FLAT; k++, rows++) {
        double legs[2] = {1 / loft_interval(&slab->space, (ptrdiff_t)v),
                          1 / loft_interval(&slab->space, (ptrdiff_t)v + 1)};
        double parts[3] = {legs[0], -legs[0] - legs[1], legs[1]};
        for (size_t p = 0; p < 3 && a; p++)
          a[rows * columns + loft_at(net, i, (v + p) % slab->space.count, k)] += parts[p];
      }
  }
  return rows;
}

/* The unknowns are the null space of the conditions: as many, all different; on straight pieces, where derivatives at
 * a contour are straight as far as the contour is, there may be fewer. Flat points of the contours are not
 * (the points are random), so that only what unknowns add is asked. */
static void check_complete(const char *what, bool straight, const net_rig *rig, const loft_net *net) {
  size_t columns = net->z.rows, rows = conditions(rig, net, NULL), free_points = 0;
  for (size_t i = 0; i < net->slab_count; i++) free_points += net->slabs[i].space.count * (net->degree - 1);
  double *a = calloc(rows * columns + 1, sizeof *a), *z = calloc(columns * net->z.columns + 1, sizeof *z);
  conditions(rig, net, a);
  double worst = 0, gap = 1;
  for (size_t i = 0; i < columns; i++)
    for (size_t e = net->z.starts[i]; e < net->z.starts[i + 1]; e++)
      z[i * net->z.columns + net->z.indices[e]] += net->z.values[e];
  for (size_t i = 0; i < rows; i++) {
    double size = 0;
    for (size_t j = 0; j < columns; j++) size = fmax(size, fabs(a[i * columns + j]));
    for (size_t p = 0; p < net->z.columns; p++) {
      double sum = 0;
      for (size_t j = 0; j < columns; j++) sum += a[i * columns + j] * z[j * net->z.columns + p];
      worst = fmax(worst, fabs(sum) / size);
    }
  }
  size_t bound = rank(rows, columns, a, &gap), own = rank(columns, net->z.columns, z, &gap);
  T_RATIO(worst, 1e-12, "%s: unknowns keep the %zu conditions", what, rows);
  T_CHECK(own == net->z.columns &&
              (straight ? net->z.columns <= free_points - bound : net->z.columns == free_points - bound),
          "%s: %zu unknowns of rank %zu, %zu taken away, %zu control points under %zu conditions leave %zu (least "
          "pivot %.1e)",
          what, net->z.columns, own, net->equalities, free_points, bound, free_points - bound, gap);
  free(a);
  free(z);
}

/* ---- random cases -------------------------------------------------------------------------------- */

static double distance(const double a[2], const double b[2]) { return hypot(a[0] - b[0], a[1] - b[1]); }

static void check_values(const char *what, const net_rig *rig, const loft_net *net, uint64_t *seed) {
  size_t unknowns = net->z.columns, rows = net->z.rows, last = net->slab_count - 1;
  double *y = malloc(2 * unknowns * sizeof *y + 1), *control = malloc(2 * rows * sizeof *control);
  for (size_t p = 0; p < 2 * unknowns; p++) y[p] = 2 * t_uniform(seed) - 1;
  loft_net_expand(net, y, control);
  double through = 0, jump = 0, slope = 0, flat = 0;
  for (size_t q = 0; q < PLACES; q++) {
    double t = t_uniform(seed), a[2], b[2];
    for (size_t i = 0; i <= last; i++)
      for (unsigned e = 0; e < 2; e++) {
        patch_value(net, i, e, 0, t, control, a);
        curve_value(&rig->contours[i + e].space, rig->contours[i + e].points, 0, t, b);
        through = fmax(through, distance(a, b));
      }
    for (size_t i = 0; i < last; i++)
      for (unsigned m = 1; m <= net->smoothness; m++) {
        patch_value(net, i, 1, m, t, control, a);
        patch_value(net, i + 1, 0, m, t, control, b);
        jump = fmax(jump, distance(a, b) * pow(net->slabs[i].gap, m));
      }
    for (unsigned e = 0; e < 2 && rig->stack.slopes[e]; e++) {
      const loft_contour *end = &rig->contours[e ? last + 1 : 0];
      patch_value(net, e ? last : 0, e, 1, t, control, a);
      curve_value(&end->space, rig->stack.slopes[e], 0, t, b);
      slope = fmax(slope, distance(a, b));
    }
  }
  T_RATIO(through, 1e-14, "%s: off the contours", what);
  T_RATIO(jump, 1e-11, "%s: jumps of derivatives by z", what); /* (n (n - 1)) (gap / gap)^2 of sizes near 1 */
  if (rig->stack.slopes[0]) T_RATIO(slope, 1e-13, "%s: off the slopes", what);
  /* Flat points: of what unknowns add, the contours themselves having none. */
  for (size_t k = 0; k < 2 * rows; k++) control[k] -= net->offset[k];
  size_t flats = 0;
  for (size_t i = 0; i <= last; i++) {
    const loft_slab *slab = &net->slabs[i];
    for (size_t v = 0; v < loft_vertices(&slab->space) && slab->wanted; v++) {
      double t = loft_knot(&slab->space, (ptrdiff_t)v + 3);
      if (slab->wanted[v] != LOFT_FLAT || t != loft_knot(&slab->space, (ptrdiff_t)(v + slab->space.degree))) continue;
      flats++;
      for (unsigned k = 0; k <= net->degree; k++)
        flat = fmax(flat, patch_second(net, i, k, slab->space.closed && t >= 1 ? t - 1 : t, control));
    }
  }
  if (flats > 0) T_RATIO(flat, 1e-11, "%s: x'' at %zu flat points", what, flats);
  free(y);
  free(control);
}

static void random_cases(batten_context *ctx) {
  uint64_t seed = 20;
  for (size_t q = 0; q < 48; q++) {
    net_case c = {.seed = 100 + q, .closed = q % 3 == 0, .slopes = q % 5 == 0, .contours = 2 + q % 4, .spans = 4};
    c.degree = 2 + (unsigned)(q / 2 % 4);
    c.smoothness = c.degree > 2 ? 1 + q % 2 : 1;
    c.n = 2 * c.smoothness + 1 + (unsigned)(q / 4 % 3);
    c.grid = 6;
    c.flats = q % 4 == 1 ? 2 : 0;
    c.straight = q % 4 == 3;
    if (c.straight) c.grid = c.spans = 10;
    if (c.contours > 4 || c.straight) c.contours = 2 + q / 8 % 3;
    net_rig rig;
    rig_make(ctx, &c, &rig);
    loft_net net = {0};
    char what[160];
    snprintf(what, sizeof what, "seed %zu, degree (%u, %u), l = %u, %zu %s contours%s%s", (size_t)c.seed, c.degree,
             c.n, c.smoothness, c.contours, c.closed ? "closed" : "open",
             c.flats      ? ", flats"
             : c.straight ? ", straight"
                          : "",
             c.slopes ? ", slopes" : "");
    T_OK(loft_net_make(ctx, &rig.stack, rig.slabs, c.n, &net), ctx);
    check_values(what, &rig, &net, &seed);
    if (!c.slopes) check_complete(what, c.straight, &rig, &net);
    loft_net_free(ctx, &net);
    rig_free(ctx, &rig);
  }
}

/* ---- by hand ------------------------------------------------------------------------------------- */

/* Three quadratic contours, knots at 1/2, none, 1/2: the patches have it both, so that the common space at the
 * middle contour has it though the contour has not; with 1/2, none, none it has not. */
static void by_hand(batten_context *ctx) {
  for (int third = 0; third < 2; third++) {
    net_rig rig = {.stack = {.degree = 2, .smoothness = 1, .count = 3}};
    double breaks[] = {0, 0.5, 1}, plain[] = {0, 1};
    unsigned folds[] = {3, 1, 3};
    bool has[3] = {true, false, third != 0};
    for (size_t i = 0; i < 3; i++) {
      loft_contour *c = &rig.contours[i];
      T_OK(loft_space_make(ctx, 2, false, has[i] ? 2 : 1, has[i] ? breaks : plain, folds, &c->space), ctx);
      c->points = batten_alloc_array(ctx, c->space.count, 2 * sizeof *c->points);
      for (size_t j = 0; j < c->space.count; j++) {
        c->points[2 * j] = (double)j;
        c->points[2 * j + 1] = (double)i;
      }
      c->height = i < 2 ? (double)i : 4; /* gaps 1 and 3, the common height 2 */
    }
    rig.stack.contours = rig.contours;
    T_OK(loft_slabs_make(ctx, &rig.stack, &rig.slabs), ctx);
    loft_net net = {0};
    T_OK(loft_net_make(ctx, &rig.stack, rig.slabs, 3, &net), ctx);
    /* n = 3: of the lower patch c_1, 4 control points; of the upper c_2, 4 or 3; at the middle 3, or 4. */
    size_t unknowns = 4 + (third ? 4 + 4 : 3 + 3);
    T_CHECK(net.z.columns == unknowns && net.equalities == 0, "%zu unknowns by hand, %zu here", unknowns,
            net.z.columns);
    double y[24] = {0}, control[64];
    y[2 * (4 + 1)] = 1; /* x of the second control point at the middle */
    T_CHECK(net.z.rows <= 32, "room for %zu control points", net.z.rows);
    loft_net_expand(&net, y, control);
    /* The polygon 0 1 2 of the middle contour becomes 0 1/2 3/2 2; the unknown 0 1 0 becomes 0 1/2 1/2 0 where 1/2 is
     * inserted. Below -1/2 of it, above 3/2. */
    static const double below[2][4] = {{0, 0.5 - 0.25, 1.5 - 0.25, 2}, {0, 0.5 - 0.5, 1.5, 2}};
    static const double above[2][4] = {{0, 1 + 1.5, 2, 0}, {0, 0.5 + 1.5, 1.5, 2}};
    bool ok = true;
    for (size_t j = 0; j < 4; j++) ok = ok && control[2 * loft_at(&net, 0, j, 2)] == below[third][j];
    for (size_t j = 0; j < (third ? 4 : 3); j++) ok = ok && control[2 * loft_at(&net, 1, j, 1)] == above[third][j];
    T_CHECK(ok, "control points beside the middle contour, knots %s", third ? "of both neighbours" : "of one");
    loft_net_free(ctx, &net);
    rig_free(ctx, &rig);
  }
}

/* Nothing free: one patch with slopes at both ends, n = 3. It is Hermite's. */
static void hermite(batten_context *ctx) {
  net_case c = {
      .degree = 3, .smoothness = 1, .n = 3, .slopes = true, .contours = 2, .spans = 4, .grid = 8, .seed = 3};
  net_rig rig;
  rig_make(ctx, &c, &rig);
  loft_net net = {0};
  T_OK(loft_net_make(ctx, &rig.stack, rig.slabs, 3, &net), ctx);
  T_CHECK(net.z.columns == 0 && net.z.starts[net.z.rows] == 0, "no unknowns between contours with slopes");
  uint64_t seed = 4;
  check_values("Hermite", &rig, &net, &seed);
  loft_net_free(ctx, &net);
  rig_free(ctx, &rig);
}

/* All vertices of a closed patch flat cannot be; all of an open one are a straight line evenly run through. */
static void all_flat(batten_context *ctx) {
  for (int closed = 0; closed < 2; closed++) {
    net_case c = {.degree = 3, .smoothness = 2, .n = 6, .closed = closed, .contours = 2, .spans = 5, .grid = 9};
    c.seed = 9;
    net_rig rig;
    rig_make(ctx, &c, &rig);
    size_t vertices = loft_vertices(&rig.slabs[0].space);
    rig.slabs[0].wanted = batten_alloc_array(ctx, vertices, 1);
    memset(rig.slabs[0].wanted, LOFT_FLAT, vertices);
    loft_net net = {0};
    T_OK(loft_net_make(ctx, &rig.stack, rig.slabs, 6, &net), ctx);
    size_t kept = closed ? 1 : 2, taken = rig.slabs[0].space.count - kept;
    T_CHECK(net.z.columns == 5 * kept && net.equalities == 5 * taken, "%s, all flat: %zu unknowns, %zu equalities",
            closed ? "closed" : "open", net.z.columns, net.equalities);
    double y[20], control[600], worst = 0;
    T_CHECK(net.z.rows <= 300, "room for %zu control points", net.z.rows);
    for (size_t p = 0; p < 5 * kept; p++) y[2 * p] = y[2 * p + 1] = p < 5 ? 1 : 2;
    loft_net_expand(&net, y, control);
    for (size_t j = 0; j < rig.slabs[0].space.count; j++)
      for (unsigned k = 1; k < 6; k++) {
        double there = closed ? 1 : 1 + loft_greville(&rig.slabs[0].space, (ptrdiff_t)j);
        worst = fmax(worst, fabs(control[2 * loft_at(&net, 0, j, k)] - there));
      }
    T_RATIO(worst, 1e-15, "%s, all flat: off the line", closed ? "closed" : "open");
    loft_net_free(ctx, &net);
    rig_free(ctx, &rig);
  }
}

static batten_status make_once(batten_context *ctx, void *arg) {
  const net_rig *rig = arg;
  loft_net net = {0};
  batten_status st = loft_net_make(ctx, &rig->stack, rig->slabs, 6, &net);
  loft_net_free(ctx, &net);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  by_hand(ctx);
  hermite(ctx);
  all_flat(ctx);
  random_cases(ctx);
  net_case c = {.degree = 3, .smoothness = 2, .n = 6, .slopes = true, .contours = 4, .spans = 5, .grid = 8};
  c.flats = 1;
  c.seed = 5;
  net_rig rig;
  rig_make(ctx, &c, &rig);
  t_fail_every_allocation("loft_net_make", make_once, &rig);
  rig_free(ctx, &rig);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
