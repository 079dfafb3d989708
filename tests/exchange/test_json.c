/* Documents: same bits back for every kind of carrier in 1, 2, 3 dimensions, gradients, nesting; what is refused. */
#include "files.h"

enum { PROBES = 40 };

static void probes(unsigned n, double *x) {
  uint64_t seed = 5;
  for (size_t i = 0; i < (size_t)PROBES * n; i++) x[i] = 4 * t_uniform(&seed) - 2;
}

static bool same_field(batten_context *ctx, const batten_field *a, const batten_field *b) {
  double x[3 * PROBES], fa[PROBES], fb[PROBES], ga[3 * PROBES], gb[3 * PROBES], ha[9 * PROBES], hb[9 * PROBES];
  unsigned n = a->dimension;
  if (b->dimension != n) return false;
  probes(n, x);
  return a->evaluate(a->user, ctx, PROBES, x, fa, ga, ha) == BATTEN_OK &&
         b->evaluate(b->user, ctx, PROBES, x, fb, gb, hb) == BATTEN_OK && !memcmp(fa, fb, sizeof fa) &&
         !memcmp(ga, gb, PROBES * n * sizeof(double)) && !memcmp(ha, hb, (size_t)PROBES * n * n * sizeof(double));
}

/* A solid through points on a circle, sphere or two points, with numbers that have all their bits. */
static batten_status make_solid(batten_context *ctx, unsigned n, bool gradients, batten_carrier *carrier,
                                batten_solid **out) {
  enum { N = 24 };
  double x[3 * N], v[N], g[3 * N], lower[3] = {-1, -1, -1}, upper[3] = {1, 1.1, 1};
  uint64_t seed = 77;
  size_t count = n == 1 ? 2 : N;
  for (size_t i = 0; i < count; i++) {
    double length = 0;
    for (unsigned k = 0; k < n; k++) {
      x[i * n + k] = n == 1 ? (double)i * 2 / 3 - 0.3 : t_uniform(&seed) - 0.5;
      length += x[i * n + k] * x[i * n + k];
    }
    for (unsigned k = 0; k < n; k++) {
      g[i * n + k] = x[i * n + k] / sqrt(length);
      if (n > 1) x[i * n + k] = g[i * n + k] / 3;
    }
  }
  batten_status st = batten_carrier_evaluate(ctx, carrier, count, x, v, NULL, NULL);
  batten_spline *spline = NULL;
  batten_spline_data d = batten_spline_data_default();
  batten_spline_options o = batten_spline_options_default();
  o.loo_samples = 0;
  o.m = gradients ? 3 : 2;
  d.n = n;
  d.count = count;
  d.points = x;
  d.values = v;
  if (gradients) {
    d.gradient_count = count / 2;
    d.gradients = g;
  }
  if (st >= 0) st = batten_spline_fit(ctx, &d, &o, &spline, NULL);
  if (st >= 0) st = batten_solid_create(ctx, spline, carrier, -1, lower, upper, 0, NULL, out);
  batten_spline_free(spline);
  return st;
}

/* One of each kind that exists in n dimensions; freed by the caller. */
static size_t make_carriers(batten_context *ctx, unsigned n, batten_carrier **c) {
  const double center[3] = {0.1, -1.0 / 3, 1e-300}, axes[3] = {1, 2.0 / 3, 1.5}, other[3] = {-0.7, 0.2, 1e-5};
  const double turn[3][9] = {{-1}, {0.6, 0.8, -0.8, 0.6}, {0.6, 0.8, 0, -0.8, 0.6, 0, 0, 0, 1}};
  size_t k = 0;
  batten_carrier_none(ctx, n, &c[k++]);
  batten_carrier_ball(ctx, n, center, 1 / 7.0, &c[k++]);
  batten_carrier_ellipsoid(ctx, n, center, axes, turn[n - 1], &c[k++]);
  batten_carrier_box(ctx, n, center, axes, NULL, 0.1, &c[k++]);
  batten_carrier_half_space(ctx, n, center, other, &c[k++]);
  if (n == 3) batten_carrier_cylinder(ctx, center, other, 0.3, 0.01, &c[k++]);
  if (n == 3) batten_carrier_torus(ctx, center, other, 0.9, 0.2, &c[k++]);
  batten_carrier_union(ctx, c[1], c[2], 0.25, &c[k++]);
  batten_carrier_intersection(ctx, c[k - 1], c[3], 1, &c[k]);
  k++;
  batten_solid *solid = NULL;
  if (make_solid(ctx, n, false, c[1], &solid) >= 0) {
    batten_carrier_solid(ctx, solid, &c[k++]);
    batten_solid_free(solid);
    batten_carrier_union(ctx, c[k - 1], c[1], 0, &c[k]);
    k++;
  }
  return k;
}

static void test_carriers(batten_context *ctx, scratch *s, unsigned n) {
  batten_carrier *c[16] = {NULL};
  size_t count = make_carriers(ctx, n, c), bad = 0;
  for (size_t i = 0; i < count; i++) {
    char first[400];
    snprintf(first, sizeof first, "%s", scratch_file(s, "first.json"));
    batten_carrier *back = NULL;
    batten_status st = batten_save_carrier(ctx, c[i], first);
    if (st == BATTEN_OK) st = batten_load_carrier(ctx, first, &back);
    bool ok = st == BATTEN_OK;
    if (ok) {
      batten_field a = batten_carrier_field(c[i]), b = batten_carrier_field(back);
      ok = same_field(ctx, &a, &b) && batten_save_carrier(ctx, back, scratch_file(s, "second.json")) == BATTEN_OK &&
           files_equal(first, s->name);
    }
    batten_file_kind kind;
    ok = ok && batten_file_identify(ctx, first, &kind) == BATTEN_OK && kind == BATTEN_FILE_CARRIER;
    if (!ok) printf("# n = %u, carrier %zu: %s\n", n, i, batten_error(ctx));
    bad += !ok;
    batten_carrier_free(back);
  }
  T_CHECK(bad == 0 && count >= 9, "n = %u: %zu carriers come back with the same bits, %zu do not", n, count, bad);
  for (size_t i = 0; i < count; i++) batten_carrier_free(c[i]);
}

static void test_solid(batten_context *ctx, scratch *s, unsigned n, bool gradients) {
  const double center[3] = {0.1, -1.0 / 3, 0.3};
  batten_carrier *carrier = NULL;
  batten_solid *solid = NULL, *back = NULL;
  char first[400];
  snprintf(first, sizeof first, "%s", scratch_file(s, "first.json"));
  T_OK(batten_carrier_ball(ctx, n, center, 0.9, &carrier), ctx);
  T_CHECK(make_solid(ctx, n, gradients, carrier, &solid) >= 0, "a solid, n = %u: %s", n, batten_error(ctx));
  T_OK(batten_save_solid(ctx, solid, first), ctx);
  T_OK(batten_load_solid(ctx, first, &back), ctx);
  if (back) {
    double box[4][3] = {{0}};
    batten_field a = batten_solid_field(solid), b = batten_solid_field(back);
    batten_solid_box(solid, box[0], box[1]);
    batten_solid_box(back, box[2], box[3]);
    T_CHECK(same_field(ctx, &a, &b), "n = %u%s: values, gradients and Hessians have the same bits", n,
            gradients ? ", gradient data" : "");
    T_CHECK(!memcmp(box[0], box[2], sizeof box[0]) && !memcmp(box[1], box[3], sizeof box[1]) &&
                batten_solid_sign(back) == -1,
            "box and sign");
    T_OK(batten_save_solid(ctx, back, scratch_file(s, "second.json")), ctx);
    T_CHECK(files_equal(first, s->name), "saved again: the same bytes");
  }
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  T_CHECK(batten_file_identify(ctx, first, &kind) == BATTEN_OK && kind == BATTEN_FILE_SOLID, "told to be a solid");
  batten_solid_free(solid);
  batten_solid_free(back);
  batten_carrier_free(carrier);
}

static bool same_points(const batten_solid *a, const batten_solid *b) {
  size_t of_a, of_b;
  const double *at_a = batten_solid_points(a, &of_a), *at_b = batten_solid_points(b, &of_b);
  return of_a == of_b && !memcmp(at_a, at_b, of_a * batten_solid_dimension(a) * sizeof *at_a);
}

/* The points of a deformed solid are none of its spline's centres, so that nobody could guess them. */
static void test_points(batten_context *ctx, scratch *s) {
  batten_carrier *first = NULL, *second = NULL;
  batten_solid *solid = NULL, *moved = NULL, *back = NULL;
  T_OK(batten_carrier_ball(ctx, 3, (double[]){0, 0, 0}, 0.9, &first), ctx);
  T_OK(batten_carrier_ball(ctx, 3, (double[]){0.1, 0, 0}, 0.9, &second), ctx);
  T_OK(make_solid(ctx, 3, false, first, &solid), ctx);
  T_OK(batten_solid_with_carrier(ctx, solid, second, &moved), ctx);
  T_CHECK(!same_points(solid, moved), "deforming moves the points");
  T_OK(batten_save_solid(ctx, moved, scratch_file(s, "moved.json")), ctx);
  T_OK(batten_load_solid(ctx, s->name, &back), ctx);
  T_CHECK(back && same_points(moved, back), "the points on the surface have the same bits");
  batten_solid_free(solid);
  batten_solid_free(moved);
  batten_solid_free(back);
  batten_carrier_free(first);
  batten_carrier_free(second);
}

static batten_status load_text(batten_context *ctx, const char *text, bool carrier) {
  bx_reader r;
  batten_solid *solid = NULL;
  batten_carrier *c = NULL;
  batten_status st = bx_open_memory(&r, ctx, "bad.json", text, strlen(text));
  if (st != BATTEN_OK) return st;
  st = carrier ? bx_load_carrier_from(&r, &c) : bx_load_solid_from(&r, &solid);
  bx_close(&r);
  batten_solid_free(solid);
  batten_carrier_free(c);
  return st;
}

#define HEAD "{\"batten\": \"solid\", \"version\": 1, \"n\": 2, \"sign\": 1, \"lower\": [0, 0], \"upper\": [1, 1], "
#define SPLINE(centers, coefficients)                                                              \
  "\"spline\": {\"n\": 2, \"m\": 2, \"origin\": [0, 0], \"scale\": 1, \"polynomial\": [0, 0, 0], " \
  "\"centers\": " centers ", \"coefficients\": " coefficients "}, "
#define GOOD SPLINE("[[0, 0], [1, 0], [0, 1]]", "[1, -1, 0]")
#define BALL "\"carrier\": {\"kind\": \"ball\", \"center\": [0, 0], \"radius\": 1}}"
#define CARRIER "{\"batten\": \"carrier\", \"version\": 1, \"n\": 2, \"carrier\": "

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *text, *error;
    bool carrier;
  } cases[] = {
      {"", "bad.json:1: JSON:", false},
      {"{\"batten\": \"solid\",\n \"version\": 1", "bad.json:2: JSON:", false},
      {"{\"batten\": \"solid\", \"n\": nan}", "JSON:", false},
      {"{\"n\": 1e999}", "JSON: real number overflow", false},
      {"{\"n\": 1, \"n\": 2}", "JSON: duplicate object key", false},
      {HEAD GOOD BALL " trailing", "JSON: end of file expected", false},
      {"[1, 2]", "document: an array, where an object is expected", false},
      {"{}", "document: 'batten' is missing", false},
      {"{\"batten\": 7}", "document.batten: a number, where a text is expected", false},
      {"{\"batten\": \"carrier\", \"version\": 1}", "holds a batten 'carrier', not a solid", false},
      {"{\"batten\": \"solid\", \"version\": 2}", "document.version: 2, where a whole number from 1 to 1", false},
      {"{\"batten\": \"solid\", \"version\": 1}", "solid: 'n' is missing", false},
      {"{\"batten\": \"solid\", \"version\": 1, \"n\": 2.5}", "solid.n: 2.5, where a whole number from 1 to 3",
       false},
      {"{\"batten\": \"solid\", \"version\": 1, \"n\": 2, \"sign\": 1, \"lower\": [0]}",
       "solid.lower: 1 numbers, where 2 are expected", false},
      {"{\"batten\": \"solid\", \"version\": 1, \"n\": 2, \"sign\": 1, \"lower\": [0, null]}",
       "solid.lower[1]: null, where a number is expected", false},
      {HEAD BALL, "solid: 'spline' is missing", false},
      {HEAD SPLINE("[[0, 0], [1, 0], [0, true]]", "[1, -1, 0]") BALL,
       "solid.spline.centers[2][1]: true or false, where a number is expected", false},
      {HEAD SPLINE("[[0, 0], [1], [0, 1]]", "[1, -1, 0]") BALL,
       "solid.spline.centers[1]: 1 numbers, where 2 are expected", false},
      {HEAD SPLINE("[[0, 0], [1, 0], [0, 1]]", "[1, -1]") BALL,
       "solid.spline: 2 in 'coefficients', but 3 in 'centers'", false},
      {HEAD SPLINE("7", "[1, -1]") BALL, "solid.spline.centers: a number, where an array is expected", false},
      {HEAD "\"spline\": {\"n\": 2, \"m\": 1}}", "solid.spline: 'origin' is missing", false},
      {HEAD "\"spline\": {\"n\": 2, \"m\": 2, \"origin\": [0, 0], \"scale\": 0, \"polynomial\": [0, 0, 0], "
            "\"centers\": [], \"coefficients\": []}}",
       "solid.spline: parts.scale: 0", false},
      {HEAD
       "\"spline\": {\"n\": 2, \"m\": 3, \"origin\": [0, 0], \"scale\": 1, \"polynomial\": [0, 0, 0, 0, 0, 0], "
       "\"centers\": [[0, 0]], \"coefficients\": [1], \"gradient_at\": [1.5], \"gradient_coefficients\": [[0, 0]]}}",
       "solid.spline.gradient_at[0]: 1.5, where the number of a center", false},
      {HEAD GOOD "\"carrier\": {}}", "solid.carrier: 'kind' is missing", false},
      {HEAD GOOD "\"carrier\": 5}", "solid.carrier: a number, where an object is expected", false},
      {"{\"batten\": \"solid\", \"version\": 1, \"n\": 2, \"sign\": 0, \"lower\": [0, 0], \"upper\": [1, 1], " GOOD
           BALL,
       "solid: sign: 0", false},
      {HEAD GOOD "\"points\": [[0, 0], [1]], " BALL, "solid.points[1]: 1 numbers, where 2 are expected", false},
      {HEAD GOOD "\"points\": [], " BALL, "solid: point_count: 0", false},
      {CARRIER "{\"kind\": \"callback\"}}", "carrier: kind 'callback' is not none, ball", true},
      {CARRIER "{\"kind\": \"ball\", \"center\": [0, 0]}}", "carrier: 'radius' is missing", true},
      {CARRIER "{\"kind\": \"ball\", \"center\": [0, 0], \"radius\": -1}}", "carrier: radius: -1", true},
      {CARRIER "{\"kind\": \"torus\", \"center\": [0, 0], \"axis\": [0, 1], \"major_radius\": 1, "
               "\"minor_radius\": 0.5}}",
       "carrier: ", true},
      {CARRIER "{\"kind\": \"box\", \"center\": [0, 0], \"half_extents\": [1, 1], \"rotation\": [[1, 0]], "
               "\"rounding\": 0}}",
       "carrier: 1 in 'rotation', but 2 in 'n'", true},
      {CARRIER "{\"kind\": \"union\", \"alpha\": 0, \"children\": [{\"kind\": \"none\"}]}}",
       "carrier: 'children' must be an array of two carriers", true},
      {CARRIER "{\"kind\": \"union\", \"alpha\": 0, \"children\": [{\"kind\": \"none\"}, {\"kind\": \"x\"}]}}",
       "carrier.children[1]: kind 'x' is not", true},
      {CARRIER "{\"kind\": \"solid\"}}", "carrier: 'solid' is missing", true},
      {CARRIER "{\"kind\": \"solid\", \"solid\": {\"n\": 4}}}", "carrier.solid.n: 4, where a whole number", true},
  };
  enum { CASES = sizeof cases / sizeof cases[0] };
  for (size_t i = 0; i < CASES; i++) {
    batten_status st = load_text(ctx, cases[i].text, cases[i].carrier);
    T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error), "%s", batten_error(ctx));
  }
  T_OK(load_text(ctx, HEAD GOOD BALL, false), ctx);
  T_OK(load_text(ctx, "\xef\xbb\xbf" HEAD GOOD BALL, false), ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
}

static void test_depth(batten_context *ctx) {
  enum { DEPTH = 3000 };
  char *text = malloc(DEPTH * 120), *at = text + sprintf(text, CARRIER);
  for (int levels = 64; levels <= 66; levels += 2) {
    char *to = at;
    for (int i = 0; i < levels; i++)
      to += sprintf(to, "{\"kind\":\"union\",\"alpha\":0,\"children\":[{\"kind\":\"none\"},");
    to += sprintf(to, "{\"kind\":\"none\"}");
    for (int i = 0; i < levels; i++) to += sprintf(to, "]}");
    sprintf(to, "}");
    batten_status st = load_text(ctx, text, true);
    T_CHECK(levels == 64 ? st == BATTEN_OK : st == BATTEN_E_FORMAT && strstr(batten_error(ctx), "nested deeper"),
            "unions nested %d levels deep: %.300s", levels, st ? batten_error(ctx) : "read");
  }
  memset(text, '[', DEPTH);
  text[DEPTH] = '\0';
  T_STATUS(load_text(ctx, text, true), BATTEN_E_FORMAT, ctx, "JSON:");
  free(text);
}

static batten_status zero(const void *user, batten_context *ctx, size_t count, const double *x, double *f, double *g,
                          double *h) {
  (void)user, (void)ctx, (void)x, (void)g, (void)h;
  for (size_t i = 0; f && i < count; i++) f[i] = 0;
  return BATTEN_OK;
}

static void test_callback(batten_context *ctx, scratch *s) {
  batten_field field = {.dimension = 2, .order = 0, .evaluate = zero};
  batten_carrier *c = NULL, *both = NULL, *ball = NULL;
  const double center[2] = {0, 0};
  batten_carrier_callback(ctx, &field, 1e-3, &c);
  batten_carrier_ball(ctx, 2, center, 1, &ball);
  batten_carrier_union(ctx, ball, c, 0, &both);
  size_t before = scratch_count(s);
  T_STATUS(batten_save_carrier(ctx, both, scratch_file(s, "callback.json")), BATTEN_E_INVALID, ctx,
           "a callback cannot be saved");
  T_CHECK(scratch_count(s) == before, "no file was begun");
  T_STATUS(batten_save_carrier(ctx, ball, scratch_file(s, "ball.txt")), BATTEN_E_INVALID, ctx, "saved as .json");
  T_STATUS(batten_save_carrier(ctx, NULL, "a.json"), BATTEN_E_INVALID, ctx, "carrier: NULL");
  T_STATUS(batten_save_solid(ctx, NULL, "a.json"), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_STATUS(batten_load_solid(ctx, "none.json", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  batten_solid *none = NULL;
  T_STATUS(batten_load_solid(ctx, "none.json", &none), BATTEN_E_IO, ctx, "none.json: cannot open");
  T_STATUS(batten_load_carrier(ctx, "none.json", &c), BATTEN_E_IO, ctx, "none.json: cannot open");
  batten_carrier_free(c);
  batten_carrier_free(ball);
  batten_carrier_free(both);
}

static batten_status load_sample(batten_context *ctx, void *arg) {
  (void)arg;
  return load_text(ctx, HEAD GOOD BALL, false);
}

typedef struct save_job {
  const batten_solid *solid;
  const char *path;
} save_job;

static batten_status load_saved(batten_context *ctx, void *arg) {
  const save_job *job = arg;
  batten_solid *solid = NULL;
  batten_status st = batten_load_solid(ctx, job->path, &solid);
  batten_solid_free(solid);
  return st;
}

static batten_status save_again(batten_context *ctx, void *arg) {
  const save_job *job = arg;
  return batten_save_solid(ctx, job->solid, job->path);
}

static void test_failures(batten_context *ctx, scratch *s) {
  const double center[2] = {0, 0};
  batten_carrier *ball = NULL, *both = NULL, *nested = NULL;
  batten_solid *inner = NULL, *solid = NULL;
  batten_carrier_ball(ctx, 2, center, 1, &ball);
  make_solid(ctx, 2, true, ball, &inner);
  batten_carrier_solid(ctx, inner, &nested);
  batten_carrier_union(ctx, nested, ball, 0, &both);
  make_solid(ctx, 2, false, both, &solid);
  save_job job = {solid, scratch_file(s, "nested.json")};
  T_OK(batten_save_solid(ctx, solid, job.path), ctx);
  size_t files = scratch_count(s);
  t_fail_every_allocation("loading a solid with a solid in its carrier", load_saved, &job);
  t_cancel_every_progress("loading", load_saved, &job);
  t_fail_every_allocation("loading a small solid", load_sample, NULL);
  t_fail_every_allocation("saving", save_again, &job);
  T_CHECK(scratch_count(s) == files, "no part files are left");
  batten_solid_free(solid);
  batten_solid_free(inner);
  batten_carrier_free(both);
  batten_carrier_free(nested);
  batten_carrier_free(ball);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  for (unsigned n = 1; n <= 3; n++) {
    test_carriers(ctx, &s, n);
    test_solid(ctx, &s, n, false);
  }
  test_solid(ctx, &s, 2, true);
  test_solid(ctx, &s, 3, true);
  test_points(ctx, &s);
  test_refused(ctx);
  test_depth(ctx);
  test_callback(ctx, &s);
  test_failures(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
