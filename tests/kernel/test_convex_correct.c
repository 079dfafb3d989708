/* Parameter correction: kernel/convex/correct.c. */
#include "convex/convex_inner.h"
#include "convex_scenes.h"
#include "tap.h"

enum { KNOTS = 40, COUNT = 300 };

typedef struct rig {
  double knots[2][KNOTS], control[3 * 64];
  convex_space space;
  double points[3 * COUNT], places[2 * COUNT], squares[COUNT];
} rig;

/* A wavy surface, and points near it. */
static void make_rig(rig *r, unsigned degree, size_t spans, double away) {
  uint64_t seed = degree;
  for (int k = 0; k < 2; k++) {
    size_t n = bspline_make_knots(degree, degree - 1, spans, NULL, 0, 1, r->knots[k]);
    r->space.axis[k] = (bspline){degree, n - degree - 1, r->knots[k]};
  }
  size_t n = r->space.axis[0].count;
  for (size_t i = 0; i < n * n; i++) {
    r->control[3 * i] = (double)(i / n) + 0.3 * t_uniform(&seed);
    r->control[3 * i + 1] = (double)(i % n) + 0.3 * t_uniform(&seed);
    r->control[3 * i + 2] = t_uniform(&seed);
  }
  for (size_t i = 0; i < COUNT; i++) {
    double jet[6][3];
    for (size_t k = 0; k < 2; k++) r->places[2 * i + k] = t_uniform(&seed);
    convex_jet(&r->space, r->control, r->places + 2 * i, jet);
    for (size_t k = 0; k < 3; k++) r->points[3 * i + k] = jet[0][k] + away * (2 * t_uniform(&seed) - 1);
  }
}

/* Jets against central differences of the surface itself. */
static void check_jet(unsigned degree, size_t spans) {
  rig *r = malloc(sizeof *r);
  make_rig(r, degree, spans, 0);
  const double h = 1e-4;
  double first = 0, second = 0;
  for (size_t i = 0; i < COUNT; i++) {
    double jet[6][3], around[3][3][6][3], place[2], *at = r->places + 2 * i;
    size_t mu[2] = {bspline_span(&r->space.axis[0], at[0]), bspline_span(&r->space.axis[1], at[1])};
    bool inside = true; /* of one span pair */
    for (int k = 0; k < 2; k++)
      inside = inside && at[k] - r->knots[k][mu[k]] > h && r->knots[k][mu[k] + 1] - at[k] > h;
    if (!inside) continue;
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        place[0] = at[0] + h * (a - 1);
        place[1] = at[1] + h * (b - 1);
        convex_jet(&r->space, r->control, place, around[a][b]);
      }
    convex_jet(&r->space, r->control, at, jet);
    for (int k = 0; k < 3; k++) {
      first = fmax(first, fabs(jet[1][k] - (around[2][1][0][k] - around[0][1][0][k]) / 2 / h));
      first = fmax(first, fabs(jet[2][k] - (around[1][2][0][k] - around[1][0][0][k]) / 2 / h));
      second = fmax(second, fabs(jet[3][k] - (around[2][1][1][k] - around[0][1][1][k]) / 2 / h));
      second = fmax(second, fabs(jet[4][k] - (around[1][2][1][k] - around[1][0][1][k]) / 2 / h));
      second = fmax(second, fabs(jet[5][k] - (around[1][2][2][k] - around[1][0][2][k]) / 2 / h));
    }
  }
  T_RATIO(first, 3e-5, "degree %u, %zu spans: first derivatives against differences", degree, spans);
  T_RATIO(second, 1e-3, "second ones");
  free(r);
}

/* The nearest of a fine grid is no nearer than what the steps reach from its neighbourhood; the vector to the point
 * is normal, or the place lies on the border and the point beyond it. */
static void check_nearest(batten_context *ctx, unsigned degree, size_t spans) {
  enum { SIDE = 24 };
  rig *r = malloc(sizeof *r);
  make_rig(r, degree, spans, 0.2);
  double worst = 0, slope = 0;
  size_t on_border = 0;
  for (size_t i = 0; i < COUNT; i++) { /* from the nearest of the grid */
    double least = INFINITY;
    for (int q = 0; q < (SIDE + 1) * (SIDE + 1); q++) {
      double place[2] = {(double)(q / (SIDE + 1)) / SIDE, (double)(q % (SIDE + 1)) / SIDE}, jet[6][3], square = 0;
      convex_jet(&r->space, r->control, place, jet);
      for (int k = 0; k < 3; k++) square += pow(jet[0][k] - r->points[3 * i + (size_t)k], 2);
      if (square < least) {
        least = square;
        memcpy(r->places + 2 * i, place, sizeof place);
      }
    }
    r->squares[i] = least;
  }
  double *grid = malloc(COUNT * sizeof *grid);
  memcpy(grid, r->squares, COUNT * sizeof *grid);
  convex_correct(ctx, &r->space, r->control, COUNT, r->points, 20, r->places, r->squares);
  for (size_t i = 0; i < COUNT; i++) {
    double jet[6][3], e[3], g[2] = {0, 0}, size = 0;
    worst = fmax(worst, r->squares[i] - grid[i]);
    convex_jet(&r->space, r->control, r->places + 2 * i, jet);
    for (int k = 0; k < 3; k++) e[k] = jet[0][k] - r->points[3 * i + (size_t)k];
    for (int k = 0; k < 3; k++) size += jet[1][k] * jet[1][k] + jet[2][k] * jet[2][k];
    for (int d = 0; d < 2; d++) {
      double t = r->places[2 * i + (size_t)d];
      for (int k = 0; k < 3; k++) g[d] += e[k] * jet[1 + d][k];
      if ((t == 0 && g[d] > 0) || (t == 1 && g[d] < 0)) {
        g[d] = 0;
        on_border++;
      }
      slope = fmax(slope, fabs(g[d]) / sqrt(size));
      if (t < 0 || t > 1) slope = INFINITY;
    }
  }
  T_RATIO(worst, 0, "degree %u, %zu spans: no distance rises", degree, spans);
  T_RATIO(slope, 1e-7, "distance along the tangents at the end");
  T_CHECK(on_border > 0, "%zu times the border holds a place", on_border);
  free(grid);
  free(r);
}

/* From places that are off, few steps: never farther; none: the parameters stay. Any number of threads: same bits. */
static void check_steps(batten_context *ctx) {
  rig *r = malloc(sizeof *r), *other = malloc(sizeof *r);
  make_rig(r, 3, 2, 0.1);
  uint64_t seed = 3;
  for (size_t i = 0; i < 2 * COUNT; i++)
    r->places[i] = fmin(fmax(r->places[i] + 0.4 * (t_uniform(&seed) - 0.5), 0), 1);
  *other = *r;
  double before[COUNT];
  convex_correct(ctx, &r->space, r->control, COUNT, r->points, 0, r->places, r->squares);
  T_CHECK(memcmp(r->places, other->places, sizeof r->places) == 0, "no passes: parameters stay");
  memcpy(before, r->squares, sizeof before);
  for (unsigned pass = 0; pass < 6; pass++) {
    size_t rises = 0;
    double sum = 0;
    convex_correct(ctx, &r->space, r->control, COUNT, r->points, 1, r->places, r->squares);
    for (size_t i = 0; i < COUNT; i++) {
      rises += r->squares[i] > before[i];
      sum += r->squares[i];
    }
    memcpy(before, r->squares, sizeof before);
    T_CHECK(rises == 0, "pass %u: %zu distances rise, sum %.4g", pass, rises, sum);
  }
  batten_context *many = t_context(NULL, NULL, 3);
  convex_correct(many, &r->space, other->control, COUNT, other->points, 6, other->places, other->squares);
  T_CHECK(memcmp(r->places, other->places, sizeof r->places) == 0, "six passes at once, on three threads: same bits");
  batten_context_free(many);
  free(other);
  free(r);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  check_jet(2, 1);
  check_jet(3, 3);
  check_jet(6, 1);
  check_nearest(ctx, 3, 1);
  check_nearest(ctx, 4, 2);
  check_steps(ctx);
  batten_context_free(ctx);
  return t_done();
}
