/* Convex fits to what was measured: caps of Phobos (P. C. Thomas, NASA PDS), the bilge of the research vessel
 * Gunnerus (table of offsets), each with a twin made here; and a panel with a dent, which must not pass for convex.
 *
 * Nobody knows the true surface, so that what is asked for is this: proven, near the points, and never called done
 * where the points say something else. */
#include "convex_scenes.h"
#include "phobos.h"
#include "tap.h"

#include <batten/convex.h>

/* Points within an angle of a direction, as seen from the origin; returns their number. */
static size_t take_cap(const phobos *p, const double direction[3], double cosine, double *out) {
  size_t count = 0;
  for (size_t i = 0; i < p->count; i++) {
    const double *x = p->points + 3 * i;
    double r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    if (x[0] * direction[0] + x[1] * direction[1] + x[2] * direction[2] < cosine * r) continue;
    memcpy(out + 3 * count++, x, 3 * sizeof *x);
  }
  return count;
}

/* BATTEN_OK and W_SHAPE are both right for real things; what is not a plane must be proven. */
static batten_status fit(batten_context *ctx, const char *name, size_t count, const double *points, unsigned degree,
                         batten_convex_info *info) {
  batten_convex_options o = batten_convex_options_default();
  o.degree[0] = o.degree[1] = degree;
  batten_surface *surface = NULL;
  batten_status st = batten_convex_fit(ctx, count, points, &o, &surface, NULL, info);
  T_CHECK(st == BATTEN_OK || st == BATTEN_W_SHAPE, "%s, degree %u: %s %s", name, degree, batten_status_name(st),
          st ? batten_error(ctx) : "");
  if (st < 0) return st;
  T_CHECK(info->plane || (info->convexity.certified && info->convexity.margin_min > 0 &&
                          info->gauss_min >= info->convexity.margin_min),
          "%s, degree %u: proven, K from %.3g (%.3g proven), unconstrained from %.3g", name, degree, info->gauss_min,
          info->convexity.margin_min, info->gauss_min_unconstrained);
  T_CHECK(st == BATTEN_OK || strncmp(batten_error(ctx), "points: ", 8) == 0, "%s, degree %u: a warning has its text",
          name, degree);
  /* The proof once more, of what the handle holds. */
  batten_convexity again = {0};
  T_OK(batten_surface_certify_convex(ctx, surface, NULL, &again), ctx);
  T_CHECK(again.certified == info->convexity.certified, "%s, degree %u: the surface itself has the proof", name,
          degree);
  batten_surface_free(surface);
  return st;
}

static void test_phobos(batten_context *ctx, const phobos *p, const char *name, size_t most) {
  static const double caps[][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  double *points = malloc(p->count * 3 * sizeof *points);
  for (size_t c = 0; c < most; c++) {
    size_t count = take_cap(p, caps[c], cos(30 * SCENE_PI / 180), points);
    batten_convex_info info;
    for (unsigned degree = 3; degree <= (c == 0 ? 5 : 3); degree += 2) {
      if (fit(ctx, name, count, points, degree, &info) < 0) continue;
      /* Craters of some hundred metres on a body of 11 km. */
      T_CHECK(info.rms < 0.25, "%s, cap %zu of %zu points, degree %u: rms %.3f km, %.2f of the unconstrained sum",
              name, c, count, degree, info.rms, info.lsq / info.lsq_unconstrained);
    }
  }
  free(points);
}

/* Offsets x, y, z with x and z in ranges and y > 0.3 m; 0 where the table is not there. */
static size_t read_bilge(double *out, size_t most) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024] = "", line[256];
  if (shared) snprintf(path, sizeof path, "%s/data/hulls/gunnerus_offsets.csv", shared);
  FILE *file = *path ? fopen(path, "r") : NULL;
  size_t count = 0;
  while (file && count < most && fgets(line, sizeof line, file)) {
    double x, z, y;
    if (sscanf(line, "%lf,%lf,%lf", &x, &z, &y) != 3) continue;
    if (x < 18 || x > 24 || z > 2 || y < 0.3) continue;
    double *p = out + 3 * count++;
    p[0] = x, p[1] = y, p[2] = z;
  }
  if (file) fclose(file);
  return count;
}

/* A bilge that narrows aft, millimetres rounded as tables are. */
static size_t make_bilge(double *out) {
  size_t count = 0;
  for (int i = 0; i <= 10; i++)
    for (int k = 1; k <= 4; k++) {
      double x = 18 + 0.58 * i, z = 0.5 * k, down = (2.6 - z) / 2.6, width = 4.8 - 0.012 * (x - 17) * (x - 17);
      double *p = out + 3 * count++;
      p[0] = x, p[1] = round(1e3 * width * pow(1 - pow(down, 3), 1 / 3.)) / 1e3, p[2] = z;
    }
  return count;
}

static void test_bilge(batten_context *ctx, const char *name, size_t count, const double *points) {
  batten_convex_info info;
  if (fit(ctx, name, count, points, 3, &info) < 0) return;
  T_CHECK(!info.plane && info.rms < 0.005, "%s: %zu offsets, rms %.1f mm, largest %.1f mm", name, count,
          1e3 * info.rms, 1e3 * info.max_error);
}

/* A panel of 1.4 x 1.1 m, 0.2 m high, points every 5 cm measured to 0.1 mm, and a dent. */
static void test_panel(batten_context *ctx) {
  static const double sizes[] = {0, 0.15, 0.2, 0.4}; /* of the dent: none, of 7, 13 and 50 points */
  for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
    bool dented = sizes[k] > 0;
    convex_scene s = convex_scene_make(&(convex_rule){.body = CONVEX_PARABOLOID,
                                                      .count = 600,
                                                      .axes = {1.4, 1.1, 0.9},
                                                      .reach = 0.5,
                                                      .noise = 1e-4,
                                                      .grid = true,
                                                      .dent_depth = dented ? 0.02 : 0,
                                                      .dent_size = sizes[k],
                                                      .dent_at = {0.15, -0.1}});
    batten_convex_info info;
    batten_status st = fit(ctx, dented ? "panel with a dent" : "panel", s.count, s.points, 3, &info);
    T_CHECK(st == (dented ? BATTEN_W_SHAPE : BATTEN_OK) && !info.plane, "%s: %s, misfit %.1f deviations: %s",
            dented ? "panel with a dent" : "panel", batten_status_name(st), info.misfit, st ? batten_error(ctx) : "");
    if (dented) {
      T_CHECK(s.dent[info.max_error_index], "the point that is furthest off lies in the dent");
      T_CHECK(st == BATTEN_W_SHAPE && strstr(batten_error(ctx), "leave out the points of the dent"),
              "the text says what to do");
    }
    convex_scene_free(&s);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  phobos real = phobos_points(), twin = {.points = malloc(20000 * 3 * sizeof(double))};
  phobos_make(&twin);
  if (real.real)
    test_phobos(ctx, &real, "Phobos", 4);
  else
    t_skip("Phobos", "no data");
  test_phobos(ctx, &twin, "bumpy ellipsoid", 2);
  double offsets[3 * 200];
  size_t count = read_bilge(offsets, 200);
  if (count)
    test_bilge(ctx, "bilge of Gunnerus", count, offsets);
  else
    t_skip("bilge of Gunnerus", "no data");
  test_bilge(ctx, "bilge", make_bilge(offsets), offsets);
  test_panel(ctx);
  free(real.points);
  free(twin.points);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
