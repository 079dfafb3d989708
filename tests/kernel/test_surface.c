/* Surfaces: what they are made of, and what is refused. */
#include "surface_shapes.h"

static void test_parts(batten_context *ctx) {
  surface_case c = surface_case_random(3, 2, 3, 2, 2, 7), old = c;
  batten_surface *s = surface_case_make(ctx, &c);
  memset(&c, 0, sizeof c); /* it has copies */
  batten_surface_form f = batten_surface_get(s);
  bool same = true;
  for (int k = 0; k < 2; k++)
    same = same && f.degree[k] == old.degree[k] && f.knot_count[k] == old.knot_count[k] &&
           memcmp(f.knots[k], old.knots[k], old.knot_count[k] * sizeof(double)) == 0;
  same = same && memcmp(f.control_points, old.control, old.points[0] * old.points[1] * sizeof *old.control) == 0;
  T_CHECK(same, "a surface has the parts that it was made of");
  batten_surface *again = NULL;
  T_OK(batten_surface_create(ctx, &f, &again), ctx);
  batten_surface_free(again);
  batten_surface_free(s);
  batten_surface_free(NULL);
}

/* Refused with these words, nothing written. */
static void refused(batten_context *ctx, const surface_case *c, const char *text) {
  batten_surface_form f = surface_case_form(c);
  batten_surface *s = NULL;
  T_STATUS(batten_surface_create(ctx, &f, &s), BATTEN_E_INVALID, ctx, text);
  T_CHECK(s == NULL, "no surface");
}

static void test_bad(batten_context *ctx) {
  const surface_case good = surface_case_bowl(3, 3);
  surface_case c = good;
  batten_surface *s = NULL;
  batten_surface_form f = surface_case_form(&good);
  T_STATUS(batten_surface_create(ctx, NULL, &s), BATTEN_E_INVALID, ctx, "form: NULL");
  T_STATUS(batten_surface_create(ctx, &f, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_surface_create(NULL, &f, &s) == BATTEN_E_INVALID && !s, "no context");
  c.degree[1] = 10;
  refused(ctx, &c, "degree[1]: 10; give 1 to 9");
  c.degree[1] = 0;
  refused(ctx, &c, "degree[1]: 0; give 1 to 9");
  c = good;
  c.knot_count[0] = 7;
  refused(ctx, &c, "knot_count[0]: 7; degree 3 needs 8 knots at least");
  c = good;
  c.knots[1][5] = NAN;
  refused(ctx, &c, "knots[1][5]: nan");
  c = good;
  c.knots[1][5] = -0.9;
  refused(ctx, &c, "knots[1][5]: -0.90000000000000002 is below the knot before it; sort them");
  c = good;
  c.knots[0][3] = -0.9;
  refused(ctx, &c, "knots[0][3]: -0.90000000000000002; the first and the last 4 knots of degree 3 must be equal");
  c = good;
  c.knots[0][9] = 2;
  refused(ctx, &c, "the first and the last 4 knots of degree 3 must be equal");
  surface_case_axis(&c, 0, 3, 2, 4, -1, 1);
  refused(ctx, &c, "knots[0][7]: 0 repeats too often; inner knots may be there 3 times");
  surface_case_axis(&c, 0, 1, 1, 1, 2, 2);
  refused(ctx, &c, "knots[0]: all are 2; give a domain of some length");
  c = good;
  c.knots[0][5] = 1;
  refused(ctx, &c, "knots[0][6]: 1 repeats too often");
  c = good;
  c.knots[0][4] = -1;
  refused(ctx, &c, "knots[0][4]: -1 repeats too often");
  surface_case_axis(&c, 0, 3, 1, 1, -1, 1);
  for (int k = 0; k < 8; k++) c.knots[0][k] *= 1.5e308;
  refused(ctx, &c, "knots[0]: -1.5e+308 to 1.5e+308; their distance is beyond a double");
  c = good;
  c.control[8][2] = INFINITY;
  refused(ctx, &c, "control_points[1][2][2]: inf; give finite points");
  c = good;
  c.control[8][2] = 1e308;
  c.control[9][2] = -1e308;
  refused(ctx, &c, "control_points: their box is larger than a double can say; scale them");
  f = surface_case_form(&good);
  f.control_points = NULL;
  T_STATUS(batten_surface_create(ctx, &f, &s), BATTEN_E_INVALID, ctx, "control_points: NULL");
  f = surface_case_form(&good);
  f.knots[1] = NULL;
  T_STATUS(batten_surface_create(ctx, &f, &s), BATTEN_E_INVALID, ctx, "knots[1]: NULL");
}

static batten_status make_one(batten_context *ctx, void *arg) {
  batten_surface_form f = surface_case_form(arg);
  batten_surface *s;
  batten_status st = batten_surface_create(ctx, &f, &s);
  if (st >= 0) batten_surface_free(s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_parts(ctx);
  test_bad(ctx);
  surface_case c = surface_case_bowl(2, 1);
  t_fail_every_allocation("batten_surface_create", make_one, &c);
  batten_context_free(ctx);
  return t_done();
}
