/* Scenes of the algebra of solids, and solids of sections and of trees: what is read, saved, shared, refused. */
#include "files.h"

static batten_status load_text(batten_context *ctx, const char *text, batten_frep **out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, "a.json", text, strlen(text));
  if (st != BATTEN_OK) return st;
  st = bx_load_frep_from(&r, out);
  bx_close(&r);
  return st;
}

/* A scene of one node. */
static batten_status load_root(batten_context *ctx, const char *nodes, const char *root, batten_frep **out) {
  char text[4096];
  snprintf(text, sizeof text, "{\"batten\": \"frep\", \"version\": 1, \"nodes\": {%s}, \"root\": %s}", nodes, root);
  return load_text(ctx, text, out);
}

static double value_at(batten_context *ctx, const batten_frep *tree, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  batten_frep_evaluate(ctx, tree, 1, p, &f, NULL);
  return f;
}

/* ---- what a scene means --------------------------------------------------------------------------------- */

static void test_values(batten_context *ctx) {
  static const struct {
    const char *what, *root;
    double x[3], f;
  } cases[] = {
      {"ball", "{\"node\": \"ball\", \"center\": [1, 0, 0], \"radius\": 2}", {4, 4, 0}, -3},
      {"ball in the plane", "{\"node\": \"ball\", \"center\": [1, 0], \"radius\": 2}", {4, 4, 0}, -3},
      {"box", "{\"node\": \"box\", \"center\": [0, 0, 0], \"half_extents\": [1, 2, 3]}", {3, 0, 0}, -2},
      {"cylinder", "{\"node\": \"cylinder\", \"a\": [0, 0, 0], \"b\": [0, 0, 4], \"radius\": 1}", {3, 0, 2}, -2},
      {"half-space", "{\"node\": \"half-space\", \"point\": [0, 0, 1], \"normal\": [0, 0, 1]}", {5, 5, 3}, -2},
      {"carrier",
       "{\"node\": \"carrier\", \"n\": 2, \"carrier\": {\"kind\": \"ball\", \"center\": [0, 0], \"radius\": 2}}",
       {1, 0, 0},
       3},
      {"polygon with a hole",
       "{\"node\": \"polygon\", \"contours\": [[[0, 0], [9, 0], [9, 9], [0, 9]], [[3, 3], [6, 3], [6, 6], [3, 6]]]}",
       {4.5, 4, 0},
       -1},
      {"union, of smooth kind by itself",
       "{\"node\": \"union\", \"a\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 4}, \"b\": {\"node\": "
       "\"ball\", \"center\": [0, 0, 0], \"radius\": 5}}",
       {1, 0, 0},
       12},
      {"difference of many",
       "{\"node\": \"difference\", \"alpha\": 1, \"of\": [{\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": "
       "4}, "
       "{\"node\": \"ball\", \"center\": [3, 0, 0], \"radius\": 1}, {\"node\": \"ball\", \"center\": [0, 3, 0], "
       "\"radius\": 1}]}",
       {0, 3, 0},
       -1},
      {"affine: shifted",
       "{\"node\": \"affine\", \"shift\": [10, 0, 0], \"a\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": "
       "1}}",
       {10, 0, 3},
       -2},
      {"affine: doubled",
       "{\"node\": \"affine\", \"matrix\": [[2, 0, 0], [0, 2, 0], [0, 0, 2]], \"a\": {\"node\": \"ball\", "
       "\"center\": "
       "[0, 0, 0], \"radius\": 1}}",
       {0, 0, 3},
       -1},
      {"extrude without ends",
       "{\"node\": \"extrude\", \"a\": {\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}}",
       {3, 0, 77},
       -2},
      {"offset",
       "{\"node\": \"offset\", \"distance\": 0.5, \"a\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}}",
       {3, 0, 0},
       -1.5},
      {"a name", "\"b\"", {3, 0, 0}, -2},
      {"the name of a name", "\"c\"", {3, 0, 0}, -2},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_frep *tree = NULL;
    T_OK(load_root(ctx, "\"c\": \"b\", \"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
                   cases[i].root, &tree),
         ctx);
    double f = tree ? value_at(ctx, tree, cases[i].x[0], cases[i].x[1], cases[i].x[2]) : NAN;
    T_CHECK(fabs(f - cases[i].f) < 1e-12 * (1 + fabs(f)), "%s: %.17g", cases[i].what, f);
    batten_frep_free(tree);
  }
}

/* ---- saving ------------------------------------------------------------------------------------------------ */

/* Nodes of all kinds, over a ball "b" and a plane "p"; each is shared by the union of all. */
static const char leaves[] =
    "\"b\": {\"node\": \"ball\", \"center\": [0.1, 0.2, 0.3], \"radius\": 1.1},"
    "\"p\": {\"node\": \"polygon\", \"contours\": [[[-1, -1], [1, -0.9], [0.3, 1]], [[0, 0], [0.1, 0], [0, 0.1]]]},"
    "\"c\": {\"node\": \"torus\", \"center\": [0, 0, 0], \"axis\": [0, 0.6, 0.8], \"major_radius\": 1, "
    "\"minor_radius\": 0.3}";
static const char *const roots[] = {
    "{\"node\": \"cone\", \"a\": [0, 0, 0], \"b\": [0.1, 0.2, 1.3], \"radius_a\": 0.7, \"radius_b\": 0}",
    "{\"node\": \"gyroid\", \"period\": 0.7, \"thickness\": 0.1}",
    "{\"node\": \"union\", \"a\": \"b\", \"b\": \"c\", \"alpha\": 0.3}",
    "{\"node\": \"intersection\", \"a\": \"b\", \"b\": \"b\"}",
    "{\"node\": \"difference\", \"a\": \"b\", \"b\": \"c\", \"alpha\": 1}",
    "{\"node\": \"negation\", \"a\": \"b\"}",
    "{\"node\": \"blend-union\", \"a\": \"b\", \"b\": \"c\", \"a0\": 0.3, \"a1\": 0.5, \"a2\": 0.6}",
    "{\"node\": \"blend-intersection\", \"a\": \"b\", \"b\": \"c\", \"a0\": 0.3, \"a1\": 0.5, \"a2\": 0.6}",
    "{\"node\": \"blend-difference\", \"a\": \"b\", \"b\": \"c\", \"a0\": -0.3, \"a1\": 0.5, \"a2\": 0.6}",
    "{\"node\": \"normalize\", \"a\": \"c\"}",
    "{\"node\": \"offset\", \"a\": \"b\", \"distance\": -0.1}",
    "{\"node\": \"shell\", \"a\": \"c\", \"thickness\": 0.1}",
    "{\"node\": \"morph\", \"a\": \"b\", \"b\": \"c\", \"t\": 0.4}",
    "{\"node\": \"noise\", \"a\": \"b\", \"amplitude\": 0.05, \"frequency\": 7, \"phase\": 0.2}",
    "{\"node\": \"extrude\", \"a\": \"p\", \"lower\": -0.5}",
    "{\"node\": \"revolve\", \"a\": \"p\"}",
    "{\"node\": \"extrude\", \"upper\": 1, \"a\": {\"node\": \"project\", \"a\": \"c\", \"axis\": \"y\", \"lower\": "
    "-2, "
    "\"upper\": 2}}",
    "{\"node\": \"extrude\", \"a\": {\"node\": \"section\", \"a\": \"c\", \"origin\": [0, 0, 0.1], \"axes\": [[1, 0, "
    "0], "
    "[0, 0.6, 0.8]]}}",
    "{\"node\": \"affine\", \"a\": \"b\", \"matrix\": [[1, 0.2, 0], [0, 1, 0.1], [0.3, 0, 1]], \"shift\": [0.1, 0, "
    "0]}",
    "{\"node\": \"twist\", \"a\": \"c\", \"origin\": [0, 0, 0.1], \"axis\": [0, 0.1, 1], \"rate\": 0.7}",
    "{\"node\": \"bend\", \"a\": \"c\", \"origin\": [0, 0, 0], \"axis\": [0, 0, 1], \"direction\": [1, 0, 0], "
    "\"curvature\": 0.3, \"lower\": -1, \"upper\": 1}",
    "{\"node\": \"taper\", \"a\": \"c\", \"origin\": [0, 0, 0], \"axis\": [0, 0, 1], \"lower\": -1, \"upper\": 1, "
    "\"scale_lower\": 0.5, \"scale_upper\": 2}",
    "{\"node\": \"deform\", \"a\": \"c\", \"from\": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], \"to\": "
    "[[0, 0, 0.1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1.1, 1, 1]]}",
    "{\"node\": \"sweep\", \"a\": \"b\", \"path\": [[0, 0, 0], [1, 0.2, 0], [1.5, 1, 0.3]]}",
    "{\"node\": \"sweep\", \"a\": \"p\", \"path\": [[0, 0, 0], [1, 0.2, 0], [1.5, 1, 0.3], [1, 2, 1]], \"smooth\": "
    "true, "
    "\"up\": [0, 0, 1]}",
    "{\"node\": \"sweep\", \"a\": \"p\", \"path\": [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], \"smooth\": true, "
    "\"closed\": true}",
};

static bool same_values(batten_context *ctx, const batten_frep *a, const batten_frep *b) {
  enum { COUNT = 60 };
  double p[3 * COUNT], f[2][COUNT], g[2][3 * COUNT];
  uint64_t seed = 17;
  for (int i = 0; i < 3 * COUNT; i++) p[i] = 4 * t_uniform(&seed) - 2;
  return batten_frep_evaluate(ctx, a, COUNT, p, f[0], g[0]) == BATTEN_OK &&
         batten_frep_evaluate(ctx, b, COUNT, p, f[1], g[1]) == BATTEN_OK && !memcmp(f[0], f[1], sizeof f[0]) &&
         !memcmp(g[0], g[1], sizeof g[0]);
}

/* Loads, saves, loads: the same bits; saves again: the same bytes. */
static void test_round_trips(batten_context *ctx, scratch *s) {
  char first[384], second[384];
  bool met[BATTEN_FREP_KIND_COUNT] = {false};
  snprintf(first, sizeof first, "%s", scratch_file(s, "first.json"));
  snprintf(second, sizeof second, "%s", scratch_file(s, "second.json"));
  for (size_t i = 0; i < sizeof roots / sizeof *roots; i++) {
    batten_frep *a = NULL, *b = NULL;
    batten_frep_parts parts;
    T_OK(load_root(ctx, leaves, roots[i], &a), ctx);
    if (!a) continue;
    batten_frep_get_parts(a, &parts);
    met[parts.kind] = true;
    T_OK(batten_save_frep(ctx, a, first), ctx);
    T_OK(batten_load_frep(ctx, first, &b), ctx);
    if (b) T_OK(batten_save_frep(ctx, b, second), ctx);
    T_CHECK(b && same_values(ctx, a, b) && files_equal(first, second), "%s reads back to the same bits",
            batten_frep_kind_name(parts.kind));
    batten_frep_free(a);
    batten_frep_free(b);
  }
  size_t missing = 0;
  for (int k = BATTEN_FREP_KIND_UNION; k < BATTEN_FREP_KIND_COUNT; k++)
    missing += !met[k] && k != BATTEN_FREP_KIND_PROJECT && k != BATTEN_FREP_KIND_SECTION; /* these stand inside */
  T_CHECK(missing == 0, "all kinds of operations are tried, but %zu", missing);
}

/* 2^40 places of one ball in 40 nodes: each is saved once. */
static void test_sharing(batten_context *ctx, scratch *s) {
  char path[384];
  batten_frep *a = NULL, *b = NULL, *more = NULL;
  size_t size;
  double center[3] = {0, 0, 0};
  T_OK(batten_frep_ball(ctx, 3, center, 1, &a), ctx);
  for (int i = 0; i < 12; i++) {
    T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, a, a, 1, &more), ctx);
    batten_frep_free(a);
    a = more;
  }
  snprintf(path, sizeof path, "%s", scratch_file(s, "shared.json"));
  T_OK(batten_save_frep(ctx, a, path), ctx);
  T_OK(batten_load_frep(ctx, path, &b), ctx);
  unsigned char *bytes = file_read(path, &size);
  T_CHECK(size < 2000 && b && same_values(ctx, a, b), "12 levels of shared nodes take %zu bytes", size);
  batten_frep_parts p;
  if (b) {
    batten_frep_get_parts(b, &p);
    T_CHECK(p.children[0] == p.children[1], "and are shared again");
  }
  free(bytes);
  batten_frep_free(a);
  batten_frep_free(b);
}

/* ---- solids of all kinds -------------------------------------------------------------------------------------- */

static bool same_solids(batten_context *ctx, const batten_solid *a, const batten_solid *b) {
  enum { COUNT = 60 };
  double p[3 * COUNT], f[2][COUNT], g[2][3 * COUNT], low[2][3] = {{0}}, high[2][3] = {{0}};
  uint64_t seed = 23;
  size_t counts[2];
  for (int i = 0; i < 3 * COUNT; i++) p[i] = 4 * t_uniform(&seed) - 2;
  batten_solid_box(a, low[0], high[0]);
  batten_solid_box(b, low[1], high[1]);
  const double *points[2] = {batten_solid_points(a, &counts[0]), batten_solid_points(b, &counts[1])};
  return batten_solid_kind_of(a) == batten_solid_kind_of(b) &&
         batten_solid_evaluate(ctx, a, COUNT, p, f[0], g[0], NULL) == BATTEN_OK &&
         batten_solid_evaluate(ctx, b, COUNT, p, f[1], g[1], NULL) == BATTEN_OK && !memcmp(f[0], f[1], sizeof f[0]) &&
         !memcmp(g[0], g[1], sizeof g[0]) && !memcmp(low[0], low[1], sizeof low[0]) &&
         !memcmp(high[0], high[1], sizeof high[0]) && counts[0] == counts[1] &&
         !memcmp(points[0], points[1], batten_solid_dimension(a) * counts[0] * sizeof(double));
}

static void check_solid(batten_context *ctx, scratch *s, const char *what, const batten_solid *a) {
  batten_solid *b = NULL;
  char path[384];
  snprintf(path, sizeof path, "%s", scratch_file(s, "solid.json"));
  T_OK(batten_save_solid(ctx, a, path), ctx);
  T_OK(batten_load_solid(ctx, path, &b), ctx);
  T_CHECK(b && same_solids(ctx, a, b), "%s reads back to the same bits", what);
  batten_solid_free(b);
}

enum { RING = 24, LEVELS = 4 };

/* Rings at heights, turned by `turn` radians from one to the next, with a hole in one of them. */
static batten_solid *make_stack(batten_context *ctx, double turn, batten_stack_options *o) {
  static const size_t one[] = {0, RING}, two[] = {0, RING, 2 * RING};
  double points[LEVELS][4 * RING];
  batten_section sections[LEVELS];
  batten_solid *out = NULL;
  for (int i = 0; i < LEVELS; i++) {
    double a = turn * i, c = cos(a), d = sin(a), r = 1 + 0.1 * i;
    sections[i] = (batten_section){.origin = {0, 3 * (turn > 0 ? c : 0), turn > 0 ? 3 * d : 0.5 * i},
                                   .rotation = {{1, 0, 0}, {0, c, d}, {0, -d, c}},
                                   .contour_count = i == 1 ? 2 : 1,
                                   .starts = i == 1 ? two : one,
                                   .points = points[i]};
    for (int k = 0; k < 2 * RING; k++) {
      double b = 2 * 3.14159265358979 * k / RING, size = k < RING ? r : 0.3;
      points[i][2 * k] = size * cos(b);
      points[i][2 * k + 1] = size * sin(b);
    }
  }
  batten_status st = batten_stack_build(ctx, LEVELS, sections, o, &out, NULL, NULL, NULL);
  T_CHECK(st >= 0, "a stack is built: %s", st < 0 ? batten_error(ctx) : "yes");
  return out;
}

static void test_solids(batten_context *ctx, scratch *s) {
  static const double omega[LEVELS][3] = {{0.1, 0, 0}, {0.1, 0, 0}, {0.1, 0, 0}, {0.1, 0, 0}};
  static const double lower[3] = {-3, -3, -3}, upper[3] = {3, 3, 3};
  batten_stack_options o = batten_stack_options_default();
  batten_solid *parallel = make_stack(ctx, 0, &o);
  o.between = BATTEN_BETWEEN_RATIONAL;
  o.shape = 2;
  o.saturation = INFINITY;
  o.ends[0] = BATTEN_END_ROUNDED;
  o.ends[1] = BATTEN_END_PLANE;
  batten_solid *turned = make_stack(ctx, 0.1, &o);
  o.rotation = BATTEN_ROTATION_VELOCITY;
  o.angular_velocity = omega[0];
  batten_solid *driven = make_stack(ctx, 0.1, &o);
  if (parallel && turned && driven) {
    batten_carrier *carrier = NULL;
    batten_frep *leaf = NULL, *leaf2 = NULL, *both = NULL;
    batten_solid *tree = NULL;
    check_solid(ctx, s, "a stack", parallel);
    check_solid(ctx, s, "one of planes that turn", turned);
    check_solid(ctx, s, "one by angular velocities", driven);
    T_OK(batten_frep_solid(ctx, parallel, &leaf), ctx);
    T_OK(load_root(ctx, leaves, roots[6], &leaf2), ctx);
    T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, leaf, leaf2, 0, &both), ctx);
    T_OK(batten_frep_to_solid(ctx, both, lower, upper, 0.3, &tree), ctx);
    if (tree) check_solid(ctx, s, "a tree with a stack in it", tree);
    if (tree) T_OK(batten_carrier_solid(ctx, tree, &carrier), ctx);
    if (carrier) {
      batten_carrier *again = NULL;
      char path[384];
      double p[3] = {0.3, 0.2, 0.1}, f[2] = {0, 1};
      snprintf(path, sizeof path, "%s", scratch_file(s, "carrier.json"));
      T_OK(batten_save_carrier(ctx, carrier, path), ctx);
      T_OK(batten_load_carrier(ctx, path, &again), ctx);
      if (again) batten_carrier_evaluate(ctx, carrier, 1, p, &f[0], NULL, NULL);
      if (again) batten_carrier_evaluate(ctx, again, 1, p, &f[1], NULL, NULL);
      T_CHECK(f[0] == f[1], "a carrier made of it: %.17g", f[0]);
      batten_carrier_free(again);
    }
    batten_carrier_free(carrier);
    batten_solid_free(tree);
    batten_frep_free(leaf);
    batten_frep_free(leaf2);
    batten_frep_free(both);
  }
  if (parallel) { /* a file beside the scene, seen from elsewhere */
    batten_frep *scene = NULL, *leaf = NULL;
    char path[384];
    static const char text[] =
        "{\"batten\": \"frep\", \"version\": 1, \"root\": {\"node\": \"solid\", \"file\": "
        "\"beside.json\"}}";
    T_OK(batten_save_solid(ctx, parallel, scratch_file(s, "beside.json")), ctx);
    snprintf(path, sizeof path, "%s", scratch_file(s, "scene.json"));
    file_write(path, text, strlen(text));
    T_OK(batten_load_frep(ctx, path, &scene), ctx);
    T_OK(batten_frep_solid(ctx, parallel, &leaf), ctx);
    T_CHECK(scene && same_values(ctx, scene, leaf), "a solid in a file beside the scene");
    batten_frep_free(scene);
    batten_frep_free(leaf);
    T_OK(batten_save_solid(ctx, parallel, scratch_file(s, "stack.json")), ctx);
  }
  batten_solid_free(parallel);
  batten_solid_free(turned);
  batten_solid_free(driven);
}

/* ---- what is refused ----------------------------------------------------------------------------------------------
 */

static void test_refused(batten_context *ctx, scratch *s) {
  static const struct {
    const char *nodes, *root, *error;
  } cases[] = {
      {"\"a\": {\"node\": \"negation\", \"a\": \"a\"}", "\"a\"", "a.json: nodes.a.a: a cycle: a > a; no node may be"},
      {"\"a\": {\"node\": \"union\", \"a\": \"ball\", \"b\": \"c\"}, \"ball\": {\"node\": \"ball\", \"center\": [0, "
       "0, 0], "
       "\"radius\": 1}, \"c\": {\"node\": \"negation\", \"a\": \"d\"}, \"d\": {\"node\": \"negation\", \"a\": \"a\"}",
       "{\"node\": \"negation\", \"a\": \"c\"}", "a.json: nodes.a.b: a cycle: c > d > a > c;"},
      {"\"a\": \"b\", \"b\": \"a\"", "\"a\"", "a.json: nodes.b: a cycle: a > b > a;"},
      {"", "\"x\"", "a.json: root: 'x' is the name of no node in 'nodes';"},
      {"\"y\": \"x\"", "{\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}", "a.json: nodes.y: 'x' is the name"},
      {"", "{\"node\": \"unoin\"}", "a.json: root: 'unoin' is no kind of node; with this letter begin 'union'; the"},
      {"", "{\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": -1}", "a.json: root.radius: -1;"},
      {"", "{\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": \"1\"}",
       "a.json: root.radius: a text, where a number is expected"},
      {"", "{\"node\": \"ball\", \"center\": [0, 0, 0]}", "a.json: root: 'radius' is missing"},
      {"", "{\"node\": \"ball\", \"center\": [0], \"radius\": 1}",
       "a.json: root.center: it must be an array of 2 or 3"},
      {"", "{\"node\": \"ball\", \"center\": [0, 0], \"raduis\": 1}",
       "a.json: root: 'raduis' is no argument of ball, which takes center, radius"},
      {"", "{\"node\": \"negation\", \"a\": 5}", "a.json: root.a: neither the name of a node nor an object"},
      {"", "{\"node\": \"negation\"}", "a.json: root: 'a' is missing"},
      {"", "{\"node\": \"union\", \"of\": []}", "a.json: root: 'of' must be an array of nodes"},
      {"", "{\"node\": \"union\", \"of\": [{\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}, \"q\"]}",
       "a.json: root.of[1]: 'q' is the name of no node"},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"union\", \"a\": \"b\", \"b\": \"b\", \"alpha\": 2}", "a.json: root.alpha: 2;"},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"affine\", \"a\": \"b\", \"matrix\": [[1, 0], [0, 1]]}",
       "a.json: root.matrix[0]: 2 numbers, where 3 are expected"},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"project\", \"a\": \"b\", \"axis\": \"w\", \"lower\": 0, \"upper\": 1}",
       "a.json: root: 'axis' is not \"x\", \"y\" or \"z\""},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"union\", \"a\": \"b\", \"b\": {\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}}",
       "a.json: root.b: "},
      {"", "{\"node\": \"polygon\", \"contours\": []}", "a.json: root.contours: it must be an array of contours"},
      {"", "{\"node\": \"polygon\", \"contours\": [[[0, 0], [1], [0, 1]]]}",
       "a.json: root.contours[0][1]: 1 numbers, where 2 are expected"},
      {"", "{\"node\": \"polygon\", \"contours\": [[[0, 0], [1, 0], [0, 1]], []]}",
       "a.json: root.contours[1]: 0 points; give 3 or more"},
      {"", "{\"node\": \"polygon\", \"contours\": [5]}", "a.json: root.contours[0]: a number, where an array"},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"sweep\", \"a\": \"b\", \"path\": [[0, 0, 0]]}",
       "a.json: root: 'path' has fewer than 2 points; give 2 or more"},
      {"\"b\": {\"node\": \"ball\", \"center\": [0, 0, 0], \"radius\": 1}",
       "{\"node\": \"union\", \"of\": [\"b\", {\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}]}",
       "a.json: root.of[1]: of another dimension"},
      {"",
       "{\"node\": \"solid\", \"solid\": {\"kind\": \"stack\", \"shape\": -1, \"below\": {}, \"above\": {}, "
       "\"sections\": [{\"t\": 0, \"origin\": [0, 0, 0], \"contours\": [[[0, 0]]]}, "
       "{\"t\": 1, \"origin\": [0, 0, 1], \"contours\": [[[0, 0]]]}]}}",
       "a.json: root.solid: shape: -1;"},
      {"", "{\"node\": \"solid\", \"solid\": {\"kind\": \"stack\", \"below\": \"open\", \"above\": {}}}",
       "a.json: root.solid.below: it must be an object {"},
      {"", "{\"node\": \"solid\", \"file\": \"a.json\"}", "a.json: root: files stand in scenes alone"},
      {"", "{\"node\": \"solid\"}", "a.json: root: 'solid' is missing"},
      {"", "{\"node\": \"solid\", \"solid\": {\"kind\": \"stone\"}}",
       "a.json: root.solid: 'kind' is 'stone', which is none of spline, stack, tree"},
      {"", "{\"node\": \"solid\", \"solid\": {\"kind\": \"stack\", \"below\": {\"end\": \"flat\"}, \"above\": {}}}",
       "a.json: root.solid: 'sections' is missing"},
      {"", "{\"node\": \"carrier\", \"carrier\": {\"kind\": \"stone\"}}",
       "a.json: root.carrier: kind 'stone' is not"},
  };
  batten_frep *tree = NULL;
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    T_STATUS(load_root(ctx, cases[i].nodes, cases[i].root, &tree), BATTEN_E_FORMAT, ctx, cases[i].error);
    T_CHECK(!tree, "case %zu: nothing is handed out", i);
  }
  T_STATUS(load_text(ctx, "{\"batten\": \"frep\", \"version\": 1, \"nodes\": [], \"root\": \"a\"}", &tree),
           BATTEN_E_FORMAT, ctx, "a.json: nodes: it must be an object of nodes by their names");
  T_STATUS(load_text(ctx, "{\"batten\": \"frep\", \"version\": 1}", &tree), BATTEN_E_FORMAT, ctx,
           "a.json: document: 'root' is missing");
  T_STATUS(load_text(ctx, "{\"batten\": \"solid\", \"version\": 1}", &tree), BATTEN_E_FORMAT, ctx,
           "a.json: document: it holds a batten 'solid', not a frep");
  T_STATUS(batten_load_frep(ctx, "a.txt", &tree), BATTEN_E_INVALID, ctx, "a.txt: scenes are read from .json");
  T_STATUS(batten_load_frep(ctx, "a.json", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  char path[384], text[128];
  snprintf(path, sizeof path, "%s", scratch_file(s, "lonely.json"));
  snprintf(text, sizeof text,
           "{\"batten\": \"frep\", \"version\": 1, \"root\": {\"node\": \"solid\", \"file\": \"none.json\"}}");
  file_write(path, text, strlen(text));
  batten_status st = batten_load_frep(ctx, path, &tree);
  T_CHECK(st == BATTEN_E_IO && strstr(batten_error(ctx), "root.file: ") && strstr(batten_error(ctx), "none.json"),
          "a file that is not there is named with its place: %s", batten_error(ctx));
}

/* Deeper than any tree: no crash, a status. */
static void test_deep(batten_context *ctx) {
  enum { DEEP = 1500 };
  char *text = malloc(DEEP * 40 + 200), *to = text;
  batten_frep *tree = NULL;
  to += sprintf(to, "{\"batten\": \"frep\", \"version\": 1, \"root\": ");
  for (int i = 0; i < DEEP; i++) to += sprintf(to, "{\"node\": \"negation\", \"a\": ");
  to += sprintf(to, "5");
  for (int i = 0; i < DEEP; i++) to += sprintf(to, "}");
  sprintf(to, "}");
  batten_status st = load_text(ctx, text, &tree);
  T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), "deeper than 512"), "%d levels: %.200s", DEEP,
          batten_error(ctx));
  to = text + sprintf(text, "{\"batten\": \"frep\", \"version\": 1, \"root\": \"0\", \"nodes\": {");
  for (int i = 0; i < 200; i++) to += sprintf(to, "\"%d\": {\"node\": \"negation\", \"a\": \"%d\"}, ", i, i + 1);
  sprintf(to, "\"200\": {\"node\": \"ball\", \"center\": [0, 0], \"radius\": 1}}}");
  st = load_text(ctx, text, &tree);
  T_CHECK(st == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "a.json: nodes."), "200 levels by names: %s",
          batten_error(ctx));
  free(text);
}

/* ---- failures
 * --------------------------------------------------------------------------------------------------------- */

static batten_status load_file(batten_context *ctx, void *path) {
  batten_frep *tree = NULL;
  batten_status st = batten_load_frep(ctx, path, &tree);
  batten_frep_free(tree);
  return st;
}

static batten_status load_solid_file(batten_context *ctx, void *path) {
  batten_solid *solid = NULL;
  batten_status st = batten_load_solid(ctx, path, &solid);
  batten_solid_free(solid);
  return st;
}

typedef struct saving {
  const char *text, *path;
} saving;

static batten_status save_scene(batten_context *ctx, void *arg) {
  saving *s = arg;
  batten_frep *tree = NULL;
  batten_status st = load_text(ctx, s->text, &tree);
  if (st == BATTEN_OK) st = batten_save_frep(ctx, tree, s->path);
  batten_frep_free(tree);
  return st;
}

static void test_failures(scratch *s) {
  char path[384], text[4096];
  snprintf(text, sizeof text,
           "{\"batten\": \"frep\", \"version\": 1, \"nodes\": {%s}, \"root\": {\"node\": \"union\", \"of\": [\"b\", "
           "\"c\", "
           "%s, %s]}}",
           leaves, roots[14], roots[2]);
  snprintf(path, sizeof path, "%s", scratch_file(s, "fails.json"));
  file_write(path, text, strlen(text));
  t_fail_every_allocation("loading a scene", load_file, path);
  saving job = {text, path};
  t_fail_every_allocation("saving a scene", save_scene, &job);
  snprintf(path, sizeof path, "%s", scratch_file(s, "stack.json"));
  t_fail_every_allocation("loading a stack", load_solid_file, path);
  t_cancel_every_progress("loading a stack", load_solid_file, path);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_values(ctx);
  test_round_trips(ctx, &s);
  test_sharing(ctx, &s);
  test_solids(ctx, &s);
  test_refused(ctx, &s);
  test_deep(ctx);
  test_failures(&s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
