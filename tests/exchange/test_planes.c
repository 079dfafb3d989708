/* Parallel planes as heights, and surfaces from there to space. */
#include "files.h"

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double *a, const double *b, double *out) {
  for (int k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* A point of plane i in space: by the plane itself, and by base and place. */
static double gap(const batten_plane *plane, const batten_plane *base, const batten_plane_place *p, double x,
                  double y) {
  double normal[3], worst = 0, in_base[2];
  cross(base->axes[0], base->axes[1], normal);
  for (int r = 0; r < 2; r++) in_base[r] = p->matrix[2 * r] * x + p->matrix[2 * r + 1] * y + p->shift[r];
  for (int k = 0; k < 3; k++) {
    double straight = plane->origin[k] + x * plane->axes[0][k] + y * plane->axes[1][k];
    double over =
        base->origin[k] + in_base[0] * base->axes[0][k] + in_base[1] * base->axes[1][k] + p->height * normal[k];
    worst = fmax(worst, fabs(straight - over));
  }
  return worst;
}

static bool is_identity(const batten_plane_place *p) {
  return p->matrix[0] == 1 && p->matrix[1] == 0 && p->matrix[2] == 0 && p->matrix[3] == 1 && p->shift[0] == 0 &&
         p->shift[1] == 0;
}

/* Coordinate planes: the numbers stay. */
static void test_coordinates(batten_context *ctx) {
  static const int axes[3][2] = {{1, 2}, {0, 2}, {0, 1}};
  static const double at[4] = {-98.44, 0.1, 7, 3};
  for (int k = 0; k < 3; k++) {
    batten_plane planes[4] = {{{0}, {{0}}}}, base;
    batten_plane_place places[4];
    for (int i = 0; i < 4; i++) {
      planes[i].origin[k] = at[i];
      for (int a = 0; a < 2; a++) planes[i].axes[a][axes[k][a]] = 1;
    }
    T_OK(batten_plane_stack(ctx, 4, planes, &base, places), ctx);
    double sign = k == 1 ? -1 : 1;
    bool good = base.origin[0] == 0 && base.origin[1] == 0 && base.origin[2] == 0;
    for (int i = 0; i < 4; i++) good = good && is_identity(&places[i]) && places[i].height == sign * at[i];
    T_CHECK(good, "planes across axis %d: heights %g %g %g %g", k, places[0].height, places[1].height,
            places[2].height, places[3].height);
  }
}

/* Turned planes with axes of their own, some looking the other way. */
static void test_turned(batten_context *ctx) {
  uint64_t seed = 3;
  double worst = 0, near = 0;
  for (int trial = 0; trial < 100; trial++) {
    enum { COUNT = 5 };
    double n[3], e[2][3];
    for (int k = 0; k < 3; k++) n[k] = t_uniform(&seed) - 0.5, e[0][k] = t_uniform(&seed) - 0.5;
    double length = sqrt(dot(n, n));
    for (int k = 0; k < 3; k++) n[k] /= length;
    double along = dot(n, e[0]);
    for (int k = 0; k < 3; k++) e[0][k] -= along * n[k];
    length = sqrt(dot(e[0], e[0]));
    for (int k = 0; k < 3; k++) e[0][k] /= length;
    cross(n, e[0], e[1]);
    batten_plane planes[COUNT], base;
    batten_plane_place places[COUNT];
    for (int i = 0; i < COUNT; i++) {
      double angle = 6 * t_uniform(&seed), c = cos(angle), s = sin(angle), side = i == 3 ? -1 : 1;
      for (int k = 0; k < 3; k++) {
        planes[i].axes[0][k] = c * e[0][k] + s * e[1][k];
        planes[i].axes[1][k] = side * (-s * e[0][k] + c * e[1][k]);
        planes[i].origin[k] = 10 * t_uniform(&seed);
      }
    }
    T_OK(batten_plane_stack(ctx, COUNT, planes, &base, places), ctx);
    for (int i = 0; i < COUNT; i++) worst = fmax(worst, gap(&planes[i], &base, &places[i], 3, -2));
    for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(base.axes[0][k] - planes[0].axes[0][k]));
    double normal[3];
    cross(base.axes[0], base.axes[1], normal);
    near = fmax(near, fabs(dot(base.origin, normal)));
  }
  T_RATIO(worst, 1e-14 * 30, "points of turned planes are the same points over the base");
  T_RATIO(near, 1e-13, "heights count from the origin of space");
}

static void test_lift(batten_context *ctx) {
  double knots[] = {0, 0, 1, 1}, points[] = {1, 2, 3, 1, 2, 5, 4, 2, 3, 4, 2, 5};
  batten_surface *s = NULL, *lifted = NULL;
  batten_surface_form form = {{1, 1}, {4, 4}, {knots, knots}, points};
  T_OK(batten_surface_create(ctx, &form, &s), ctx);
  batten_plane base = {{10, 0, 0}, {{0, 1, 0}, {0, 0, 1}}};
  T_OK(batten_plane_lift(ctx, &base, s, &lifted), ctx);
  if (lifted) {
    batten_surface_form f = batten_surface_get(lifted);
    bool good = f.degree[0] == 1 && f.knot_count[1] == 4;
    for (int i = 0; i < 4; i++) {
      const double *p = points + 3 * i, *q = f.control_points + 3 * i;
      good = good && q[0] == 10 + p[2] && q[1] == p[0] && q[2] == p[1];
    }
    T_CHECK(good, "heights become x, points y and z");
  }
  batten_surface_free(lifted);
  base.axes[0][0] = 1;
  lifted = NULL;
  T_STATUS(batten_plane_lift(ctx, &base, s, &lifted), BATTEN_E_INVALID, ctx, "base.axes: not of length 1");
  T_STATUS(batten_plane_lift(ctx, NULL, s, &lifted), BATTEN_E_INVALID, ctx, "base: NULL");
  T_STATUS(batten_plane_lift(ctx, &base, NULL, &lifted), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_plane_lift(ctx, &base, s, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(!lifted, "untouched");
  batten_surface_free(s);
}

static batten_status lift_again(batten_context *ctx, void *arg) {
  double knots[] = {0, 0, 1, 1}, points[] = {1, 2, 3, 1, 2, 5, 4, 2, 3, 4, 2, 5};
  batten_surface *s = NULL, *lifted = NULL;
  (void)arg;
  batten_status st = batten_surface_create(ctx, &(batten_surface_form){{1, 1}, {4, 4}, {knots, knots}, points}, &s);
  if (st == BATTEN_OK) st = batten_plane_lift(ctx, &(batten_plane){{0}, {{1, 0, 0}, {0, 1, 0}}}, s, &lifted);
  batten_surface_free(lifted);
  batten_surface_free(s);
  return st;
}

static void test_refused(batten_context *ctx) {
  batten_plane planes[2] = {{{0}, {{1, 0, 0}, {0, 1, 0}}}, {{0}, {{1, 0, 0}, {0, 0.8, 0.6}}}}, base = {{77}, {{0}}};
  batten_plane_place places[2];
  T_STATUS(batten_plane_stack(ctx, 2, planes, &base, places), BATTEN_E_INVALID, ctx,
           "planes[1]: turned by 36.9 degrees against planes[0]; they must be parallel");
  planes[1].axes[1][2] = NAN;
  T_STATUS(batten_plane_stack(ctx, 2, planes, &base, places), BATTEN_E_INVALID, ctx, "planes[1].axes: not finite");
  T_STATUS(batten_plane_stack(ctx, 0, planes, &base, places), BATTEN_E_INVALID, ctx, "count: 0");
  T_STATUS(batten_plane_stack(ctx, 1, NULL, &base, places), BATTEN_E_INVALID, ctx, "planes: NULL");
  T_STATUS(batten_plane_stack(ctx, 1, planes, NULL, places), BATTEN_E_INVALID, ctx, "base: NULL");
  T_STATUS(batten_plane_stack(ctx, 1, planes, &base, NULL), BATTEN_E_INVALID, ctx, "places: NULL");
  batten_plane far[2] = {{{1.5e308, 0, 0}, {{1, 0, 0}, {0, 1, 0}}}, {{-1.5e308, 0, 0}, {{1, 0, 0}, {0, 1, 0}}}};
  T_STATUS(batten_plane_stack(ctx, 2, far, &base, places), BATTEN_E_INVALID, ctx,
           "planes[1].origin: beyond a double");
  T_CHECK(base.origin[0] == 77, "untouched");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_coordinates(ctx);
  test_turned(ctx);
  test_lift(ctx);
  test_refused(ctx);
  t_fail_every_allocation("lift", lift_again, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
