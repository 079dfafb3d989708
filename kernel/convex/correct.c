/* Parameter correction: every point goes to a nearer place of the surface.   [Hoschek, Lasser 1993]
 *
 * A step is Newton's for half the squared distance, Gauss and Newton's where that has no minimum, in the directions
 * that the border of the domain leaves free; it is halved until the distance drops, or not made. */
#include "convex_inner.h"

#include "base/checked.h"
#include "mesh/vec.h"

#include <string.h>

enum { HALVINGS = 4, CHUNK = 256 }; /* points of a task: some 100 us */

/* ---- values ------------------------------------------------------------------------------------- */

/* Values of the order functions of degree p over span mu at t, p + 1 of them: the triangle of Cox and de Boor. */
static void basis_values(const bspline *b, size_t mu, unsigned p, double t, double *out) {
  out[0] = 1;
  for (unsigned q = 1; q <= p; q++) {
    double carry = 0;
    for (unsigned r = 0; r < q; r++) {
      double left = b->knots[mu + r + 1 - q], right = b->knots[mu + r + 1];
      double part = out[r] / (right - left);
      out[r] = carry + (right - t) * part;
      carry = (t - left) * part;
    }
    out[q] = carry;
  }
}

/* in [q]: factors of the functions of degree q - 1; becomes [q + 1], those of the derivatives of degree q. */
static void basis_derive(const bspline *b, size_t mu, unsigned q, double *values) {
  double carry = 0;
  for (unsigned r = 0; r < q; r++) {
    double part = q / (b->knots[mu + r + 1] - b->knots[mu + r + 1 - q]) * values[r];
    values[r] = carry - part;
    carry = part;
  }
  values[q] = carry;
}

/* Values, first and second derivatives of the degree + 1 functions of the span at t; its first function. */
static size_t basis_jet(const bspline *b, double t, double (*table)[BSPLINE_ORDER]) {
  size_t mu = bspline_span(b, t);
  unsigned d = b->degree;
  basis_values(b, mu, d, t, table[0]);
  basis_values(b, mu, d - 1, t, table[1]);
  basis_derive(b, mu, d, table[1]);
  basis_values(b, mu, d - 2, t, table[2]);
  basis_derive(b, mu, d - 1, table[2]);
  basis_derive(b, mu, d, table[2]);
  return mu - d;
}

void convex_jet(const convex_space *space, const double *control, const double place[2], double (*jet)[3]) {
  static const unsigned char orders[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  double u[3][BSPLINE_ORDER], v[3][BSPLINE_ORDER];
  size_t nv = space->axis[1].count;
  size_t first = basis_jet(&space->axis[0], place[0], u) * nv;
  first += basis_jet(&space->axis[1], place[1], v);
  memset(jet, 0, 6 * sizeof *jet);
  for (unsigned i = 0; i <= space->axis[0].degree; i++) {
    double row[3][3] = {{0}}; /* value and derivatives along v */
    const double *points = control + 3 * (first + i * nv);
    for (unsigned j = 0; j <= space->axis[1].degree; j++)
      for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) row[r][k] += v[r][j] * points[3 * j + (unsigned)k];
    for (int r = 0; r < 6; r++)
      for (int k = 0; k < 3; k++) jet[r][k] += u[orders[r][0]][i] * row[orders[r][1]][k];
  }
}

/* ---- steps -------------------------------------------------------------------------------------- */

/* The step from a place where the surface is off by e = x - point; 0 in directions that are held. */
static void newton_step(const double (*jet)[3], const double *e, const bool held[2], double step[2]) {
  double g[2] = {vec_dot(e, jet[1]), vec_dot(e, jet[2])};
  double gauss[3] = {vec_dot(jet[1], jet[1]), vec_dot(jet[1], jet[2]), vec_dot(jet[2], jet[2])};
  double h[3] = {gauss[0] + vec_dot(e, jet[3]), gauss[1] + vec_dot(e, jet[4]), gauss[2] + vec_dot(e, jet[5])};
  step[0] = step[1] = 0;
  if (held[0] || held[1]) {
    int k = held[0] ? 1 : 0;
    double curve = h[2 * k] > 0.1 * gauss[2 * k] ? h[2 * k] : gauss[2 * k];
    if (!held[k] && curve > 0) step[k] = -g[k] / curve;
    return;
  }
  double determinant = h[0] * h[2] - h[1] * h[1], least = gauss[0] * gauss[2] - gauss[1] * gauss[1];
  const double *m = h;
  if (!(h[0] > 0 && determinant > 0.1 * least)) {
    m = gauss;
    determinant = least;
  }
  if (!(determinant > 1e-14 * gauss[0] * gauss[2])) return; /* no tangent plane */
  step[0] = (m[1] * g[1] - m[2] * g[0]) / determinant;
  step[1] = (m[1] * g[0] - m[0] * g[1]) / determinant;
}

/* The step, with a direction held where it leads out of the domain from its border. */
static void free_step(const double (*jet)[3], const double *e, const double place[2], double step[2]) {
  bool held[2] = {false, false};
  for (int round = 0; round < 2; round++) {
    newton_step(jet, e, held, step);
    bool out = false;
    for (int k = 0; k < 2; k++)
      if (!held[k] && ((place[k] <= 0 && step[k] < 0) || (place[k] >= 1 && step[k] > 0))) held[k] = out = true;
    if (!out) return;
  }
  newton_step(jet, e, held, step);
}

static double square_at(const double (*jet)[3], const double *point, double *e) {
  vec_sub(jet[0], point, e);
  return vec_dot(e, e);
}

static double correct_point(const convex_space *space, const double *control, const double *point, unsigned passes,
                            double *place) {
  double jet[6][3], e[3], step[2];
  convex_jet(space, control, place, jet);
  double square = square_at((const double(*)[3])jet, point, e);
  for (unsigned pass = 0; pass < passes; pass++) {
    free_step((const double(*)[3])jet, e, place, step);
    double part = 1, there[2], next[6][3], off[3], less = square;
    bool nearer = false;
    for (int k = 0; k <= HALVINGS && !nearer; k++, part /= 2) {
      for (int i = 0; i < 2; i++) there[i] = fmin(fmax(place[i] + part * step[i], 0), 1);
      if (there[0] == place[0] && there[1] == place[1]) break;
      convex_jet(space, control, there, next);
      less = square_at((const double(*)[3])next, point, off);
      nearer = less < square;
    }
    if (!nearer) break;
    square = less;
    memcpy(place, there, sizeof there);
    memcpy(jet, next, sizeof jet);
    memcpy(e, off, sizeof e);
  }
  return square;
}

typedef struct job {
  const convex_space *space;
  const double *control, *points;
  size_t count;
  unsigned passes;
  double *parameters, *squares;
} job;

static void correct_task(void *arg, size_t index) {
  const job *j = arg;
  size_t end = (index + 1) * CHUNK < j->count ? (index + 1) * CHUNK : j->count;
  for (size_t i = index * CHUNK; i < end; i++)
    j->squares[i] = correct_point(j->space, j->control, j->points + 3 * i, j->passes, j->parameters + 2 * i);
}

void convex_correct(batten_context *ctx, const convex_space *space, const double *control, size_t count,
                    const double *points, unsigned passes, double *parameters, double *squares) {
  job j = {space, control, points, count, passes, parameters, squares};
  batten_parallel(ctx, (count + CHUNK - 1) / CHUNK, correct_task, &j);
}
