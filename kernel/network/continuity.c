/* The joints of a network as they are: both sides of every edge at the same places.
 *
 * This is the certificate by which results are called G1, so it uses nothing but patches and mesh, and whatever
 * cannot be judged counts as the worst: a side without a normal 180 degrees, a value that is not finite an infinite
 * gap. Along a side only three rows of control points matter: the edge is a Bezier curve, and so are its derivatives
 * across. With rows c0, c1, c2 counted from the edge inwards, x the parameter across, t along:
 *   S_t = n sum B^(n-1) (c0_(i+1) - c0_i), S_x = n sum B^(n-1) (c1_i - c0_i), S_xx = n (n-1) sum B^(n-2) (c2 - 2 c1 +
 * c0) and so on. The right side's rows are read backwards, so that one table of Bernstein values serves both, and an
 * edge with the same control points on both sides has no gap at all.
 *
 * The 99 % quantiles come from a histogram of 64 bins an octave: rounded up by at most 1.6 %. */
#include "surface.h"

#include "base/checked.h"
#include "basis/shape.h"

#include <string.h>

static const double DEGREES = 57.295779513082320877;

enum {
  TASKS = 64,   /* most tasks: each has a histogram */
  FACES = 256,  /* least faces of a task */
  BATCH = 8,    /* tasks between two progress calls */
  OCTAVES = 72, /* of the histogram: 2^-64 .. 2^8 degrees */
  LOWEST = -64,
  BINS = OCTAVES * 64
};
typedef enum edge_class { SMOOTH, CREASE, INNER, CLASSES } edge_class;

typedef struct tally {
  size_t edges, samples;
  double gap_max, gap_squares, angle_max, angle_squares, jump_max, jump_squares;
  uint32_t face[2], corner;
  uint32_t bins[BINS]; /* of the angles; full ones stay full */
} tally;
typedef struct report {
  tally of[CLASSES];
  size_t boundary;
  double corner_gap;
} report;

typedef struct job {
  const batten_network *network;
  unsigned samples;
  const double *bernstein; /* degree m: at samples m (m + 1) / 2, [samples][m + 1] */
  size_t faces_each, first_task;
  report *reports;
} job;

/* ---- one side of an edge ------------------------------------------------------------------------ */

/* Control points of the curve, its derivatives and those across. */
typedef struct strip {
  unsigned degree;
  double s[TRIANGULAR_DEGREE + 1][3], t[TRIANGULAR_DEGREE][3], x[TRIANGULAR_DEGREE][3];
  double tt[TRIANGULAR_DEGREE][3], tx[TRIANGULAR_DEGREE][3], xx[TRIANGULAR_DEGREE][3];
} strip;
typedef struct side_point {
  double point[3], normal[3], gauss;
  bool regular;
} side_point;

static void make_strip(const batten_network *network, net_side side, bool backwards, strip *out) {
  unsigned n = net_surface_degree(network, side.patch);
  const double(*net)[3] = (const double(*)[3])net_surface_points(network, side.patch);
  double c[3][TRIANGULAR_DEGREE + 1][3];
  for (unsigned row = 0; row < 3 && row <= n; row++)
    for (unsigned i = 0; i + row <= n; i++)
      memcpy(c[row][i], net[net_side_index(n, side.side, row, backwards ? n - row - i : i)], sizeof c[row][i]);
  out->degree = n;
  memcpy(out->s, c[0], (n + 1) * sizeof *out->s);
  for (unsigned i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) {
      out->t[i][d] = n * (c[0][i + 1][d] - c[0][i][d]);
      out->x[i][d] = n * (c[1][i][d] - c[0][i][d]);
    }
  for (unsigned i = 0; i + 1 < n; i++)
    for (int d = 0; d < 3; d++) {
      double factor = n * (n - 1), ahead = c[0][i + 1][d] - c[0][i][d];
      out->tt[i][d] = factor * ((c[0][i + 2][d] - c[0][i + 1][d]) - ahead);
      out->tx[i][d] = factor * ((c[1][i + 1][d] - c[1][i][d]) - ahead);
      out->xx[i][d] = factor * ((c[2][i][d] - c[1][i][d]) - (c[1][i][d] - c[0][i][d]));
    }
}

static void combine(unsigned count, const double *weights, const double (*points)[3], double out[3]) {
  double x = 0, y = 0, z = 0;
  for (unsigned i = 0; i < count; i++) {
    x += weights[i] * points[i][0];
    y += weights[i] * points[i][1];
    z += weights[i] * points[i][2];
  }
  out[0] = x;
  out[1] = y;
  out[2] = z;
}

static const double *bernstein_at(const job *j, unsigned degree, unsigned sample) {
  return j->bernstein + (size_t)j->samples * (degree * (degree + 1) / 2) + (size_t)sample * (degree + 1);
}

/* The normal is along S_t x S_x: outwards on the left of the run, inwards when the side is read backwards. */
static void evaluate_side(const job *j, const strip *s, unsigned sample, bool backwards, side_point *out) {
  double t[3], x[3], tt[3] = {0}, tx[3] = {0}, xx[3] = {0}, area;
  unsigned n = s->degree;
  const double *weights = bernstein_at(j, n - 1, sample);
  combine(n + 1, bernstein_at(j, n, sample), s->s, out->point);
  combine(n, weights, s->t, t);
  combine(n, weights, s->x, x);
  out->regular = surface_shape_normal(t, x, out->normal, &area);
  out->gauss = NAN;
  if (!out->regular) return;
  if (n >= 2) {
    weights = bernstein_at(j, n - 2, sample);
    combine(n - 1, weights, s->tt, tt);
    combine(n - 1, weights, s->tx, tx);
    combine(n - 1, weights, s->xx, xx);
  }
  double l = vec_dot(out->normal, tt), m = vec_dot(out->normal, tx), q = vec_dot(out->normal, xx);
  out->gauss = (l * q - m * m) / area / area;
  if (backwards)
    for (int d = 0; d < 3; d++) out->normal[d] = -out->normal[d];
}

/* ---- one edge ----------------------------------------------------------------------------------- */

static double angle_deg(const side_point *a, const side_point *b) {
  if (!a->regular || !b->regular) return 180;
  double cross[3];
  vec_cross(a->normal, b->normal, cross);
  double sine = vec_norm(cross), cosine = vec_dot(a->normal, b->normal);
  /* atan2 is slow; below 1e-4 rad the next term of the series is below rounding. */
  double angle = cosine > 0 && sine < 1e-4 * cosine ? sine / cosine * (1 - sine * sine / 3) : atan2(sine, cosine);
  return isfinite(angle) ? DEGREES * angle : 180;
}

static double or_infinity(double x) { return isfinite(x) ? x : INFINITY; }

/* Bin 64 o + i holds the angles from 2^(LOWEST + o) (1 + i / 64) on, bin 0 all that are smaller too. */
static unsigned bin_of(double angle) {
  int exponent;
  double fraction = frexp(angle, &exponent); /* [0.5, 1) */
  if (!(angle > 0) || exponent <= LOWEST) return 0;
  unsigned bin = (unsigned)(exponent - 1 - LOWEST) * 64 + (unsigned)((fraction - 0.5) * 128);
  return bin < BINS ? bin : BINS - 1;
}
static double bin_end(unsigned bin) { return ldexp(1 + (bin % 64 + 1) / 64.0, (int)(bin / 64) + LOWEST); }

static void measure_edge(const job *j, net_side left, net_side right, const uint32_t faces[2], uint32_t corner,
                         tally *out) {
  strip a, b;
  make_strip(j->network, left, false, &a);
  make_strip(j->network, right, true, &b);
  out->edges++;
  for (unsigned i = 0; i < j->samples; i++) {
    side_point p, q;
    evaluate_side(j, &a, i, false, &p);
    evaluate_side(j, &b, i, true, &q);
    double gap = or_infinity(vec_distance(p.point, q.point)), jump = or_infinity(fabs(p.gauss - q.gauss));
    double angle = angle_deg(&p, &q);
    out->samples++;
    out->gap_max = fmax(out->gap_max, gap);
    out->gap_squares += gap * gap;
    out->jump_max = fmax(out->jump_max, jump);
    out->jump_squares += jump * jump;
    out->angle_squares += angle * angle;
    if (angle > out->angle_max || out->face[0] == NET_NONE) {
      out->angle_max = angle;
      out->face[0] = faces[0];
      out->face[1] = faces[1];
      out->corner = corner;
    }
    uint32_t *bin = &out->bins[bin_of(angle)];
    *bin += *bin < UINT32_MAX;
  }
}

/* ---- one task: a run of faces ------------------------------------------------------------------- */

/* Control points that no edge sees can spoil a patch too. */
static bool all_finite(const batten_network *n, size_t face) {
  double nothing = 0; /* times 0: 0, or NaN for infinite numbers too */
  size_t first = net_surface_first(n, face);
  for (size_t p = first; p < first + net_surface_parts(n, face); p++) {
    const double *x = net_surface_points(n, p)[0];
    size_t numbers = 3 * triangular_count(net_surface_degree(n, p));
    for (size_t i = 0; i < numbers; i++) nothing += 0 * x[i];
  }
  return nothing == 0;
}

static void measure_face(const job *j, size_t face, report *out) {
  const batten_network *n = j->network;
  if (!all_finite(n, face)) out->corner_gap = INFINITY;
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face + k), twin = n->twin[h];
    net_side side = net_surface_side(n, h);
    unsigned degree = net_surface_degree(n, side.patch);
    const double(*net)[3] = (const double(*)[3])net_surface_points(n, side.patch);
    for (unsigned end = 0; end < 2; end++) {
      const double *vertex = n->vertices + 3 * (size_t)n->triangles[end ? net_next(h) : h];
      double gap = vec_distance(net[net_side_index(degree, side.side, 0, end ? degree : 0)], vertex);
      out->corner_gap = fmax(out->corner_gap, or_infinity(gap));
    }
    if (twin == NET_NONE) out->boundary++;
    if (twin != NET_NONE && h < twin) {
      const uint32_t faces[2] = {h / 3, twin / 3};
      measure_edge(j, side, net_surface_side(n, twin), faces, k, &out->of[net_surface_sharp(n, h) ? CREASE : SMOOTH]);
    }
    if (net_surface_parts(n, face) == 3) {
      net_side inner[2];
      const uint32_t faces[2] = {(uint32_t)face, (uint32_t)face};
      net_surface_inner(n, face, k, inner);
      measure_edge(j, inner[0], inner[1], faces, k, &out->of[INNER]);
    }
  }
}

static void measure_faces(void *arg, size_t index) {
  const job *j = arg;
  size_t task = j->first_task + index, from = task * j->faces_each, to = from + j->faces_each;
  report *out = &j->reports[task];
  memset(out, 0, sizeof *out);
  for (int c = 0; c < CLASSES; c++) out->of[c].face[0] = out->of[c].face[1] = out->of[c].corner = NET_NONE;
  for (size_t f = from; f < to && f < j->network->face_count; f++) measure_face(j, f, out);
}

/* ---- the whole ---------------------------------------------------------------------------------- */

/* Values at i / (samples - 1) by the recursion over degrees. */
static void fill_bernstein(unsigned samples, double *table) {
  for (unsigned i = 0; i < samples; i++) table[i] = 1;
  for (unsigned m = 1; m <= TRIANGULAR_DEGREE; m++)
    for (unsigned i = 0; i < samples; i++) {
      double t = (double)i / (samples - 1), s = (double)(samples - 1 - i) / (samples - 1);
      const double *below = table + (size_t)samples * ((m - 1) * m / 2) + (size_t)i * m;
      double *row = table + (size_t)samples * (m * (m + 1) / 2) + (size_t)i * (m + 1);
      for (unsigned k = 0; k <= m; k++) row[k] = (k < m ? s * below[k] : 0) + (k > 0 ? t * below[k - 1] : 0);
    }
}

/* Sums of the tasks in their order: the same for any number of threads. */
static batten_joint_figures gather(size_t tasks, const report *reports, edge_class c) {
  batten_joint_figures f = {.worst_face = {NET_NONE, NET_NONE}, .worst_corner = NET_NONE};
  double gaps = 0, angles = 0, jumps = 0;
  for (size_t i = 0; i < tasks; i++) {
    const tally *t = &reports[i].of[c];
    if (!t->edges) continue;
    f.edges += t->edges;
    f.samples += t->samples;
    f.gap_max = fmax(f.gap_max, t->gap_max);
    f.curvature_jump_max = fmax(f.curvature_jump_max, t->jump_max);
    gaps += t->gap_squares;
    angles += t->angle_squares;
    jumps += t->jump_squares;
    if (t->angle_max > f.normal_max_deg || f.worst_face[0] == NET_NONE) {
      f.normal_max_deg = t->angle_max;
      memcpy(f.worst_face, t->face, sizeof f.worst_face);
      f.worst_corner = t->corner;
    }
  }
  if (!f.samples) return f;
  f.gap_rms = sqrt(gaps / (double)f.samples);
  f.normal_rms_deg = sqrt(angles / (double)f.samples);
  f.curvature_jump_rms = sqrt(jumps / (double)f.samples);
  size_t above = f.samples / 100, seen = 0;
  unsigned bin = BINS;
  while (bin > 0 && seen <= above) {
    bin--;
    for (size_t i = 0; i < tasks; i++) seen += reports[i].of[c].bins[bin];
  }
  f.normal_p99_deg = fmin(f.normal_max_deg, bin == 0 ? 0 : bin_end(bin));
  return f;
}

batten_status batten_network_measure_continuity(batten_context *ctx, const batten_network *network, unsigned samples,
                                                batten_network_continuity *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!network || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a network and room for its joints",
                       network ? "out" : "network");
  if (samples < 2 || samples > 1000)
    return batten_fail(ctx, BATTEN_E_INVALID, "samples: %u; give 2 to 1000", samples);
  size_t each = network->face_count / TASKS + 1;
  if (each < FACES) each = FACES;
  size_t tasks = network->face_count / each + (network->face_count % each > 0);
  const unsigned rows = (TRIANGULAR_DEGREE + 1) * (TRIANGULAR_DEGREE + 2) / 2;
  double *bernstein = batten_alloc_array(ctx, samples, rows * sizeof *bernstein);
  report *reports = bernstein ? batten_alloc_array(ctx, tasks, sizeof *reports) : NULL;
  batten_status st = BATTEN_E_NOMEM;
  if (!reports) goto done;
  fill_bernstein(samples, bernstein);
  job j = {network, samples, bernstein, each, 0, reports};
  for (size_t done = 0; done < tasks; done += BATCH) {
    st = batten_progress(ctx, "check", (double)done / (double)tasks);
    if (st < 0) goto done;
    j.first_task = done;
    batten_parallel(ctx, tasks - done < BATCH ? tasks - done : BATCH, measure_faces, &j);
  }
  st = batten_progress(ctx, "check", 1);
  if (st < 0) goto done;
  batten_network_continuity c = {.smooth = gather(tasks, reports, SMOOTH),
                                 .crease = gather(tasks, reports, CREASE),
                                 .inner = gather(tasks, reports, INNER)};
  for (size_t i = 0; i < tasks; i++) {
    c.boundary_edges += reports[i].boundary;
    c.corner_gap_max = fmax(c.corner_gap_max, reports[i].corner_gap);
  }
  *out = c;
done:
  batten_free(ctx, reports);
  batten_free(ctx, bernstein);
  return st;
}
