/* The moving plane: its frame and origin between sections. */
#include "stack_swept.h"

static const double length = SCENE_PI / 2; /* of the block */

typedef struct path_case {
  stack s;
  stack_section sections[64];
  double omega[64][3];
} path_case;

/* The block's sections, all turned by `turn` [9] (NULL: not), with t along the arc. */
static void path_sections(path_case *c, size_t count, double uneven, const double *turn) {
  scene_block b = scene_block_figure4();
  stack_scene scene = {0};
  stack_scene_block(&scene, &b, count, uneven, 0);
  memset(c, 0, sizeof *c);
  for (size_t i = 0; i < count; i++) {
    double xy[2], u = scene_block_local(&b, scene.sections[i].origin, xy), unused[3], m[3][3];
    c->sections[i].t = u * length;
    scene_block_frame(&b, u, unused, m, c->omega[i]);
  }
  if (turn) stack_scene_turn(&scene, turn);
  for (size_t i = 0; i < count; i++) {
    memcpy(c->sections[i].origin, scene.sections[i].origin, sizeof c->sections[i].origin);
    memcpy(c->sections[i].rotation, scene.sections[i].rotation, sizeof c->sections[i].rotation);
  }
  stack_scene_free(&scene);
  c->s = (stack){.count = count, .sections = c->sections, .angular_velocity = c->omega[0]};
}

static double difference(size_t count, const double *a, const double *b) {
  double worst = 0;
  for (size_t k = 0; k < count; k++) worst = fmax(worst, fabs(a[k] - b[k]));
  return worst;
}

/* Largest error of frame and origin against the block's own, at 500 places. */
static void block_error(const stack_path *p, double *rotation, double *origin) {
  scene_block b = scene_block_figure4();
  *rotation = *origin = 0;
  for (int i = 0; i <= 500; i++) {
    double u = i / 500.0, o[3], m[3][3];
    stack_frame f;
    stack_path_frame(p, u * length, &f);
    scene_block_frame(&b, u, o, m, NULL);
    *rotation = fmax(*rotation, difference(9, m[0], f.rotation[0]));
    *origin = fmax(*origin, difference(3, o, f.origin));
  }
}

/* Frames at the sections, derivatives against differences, and bounds of the motion against samples. */
static void check_path(const path_case *c, const stack_path *p, const char *name) {
  double at_sections = 0, derivatives = 0;
  bool held = true, inside = true;
  stack_frame f, a, b;
  for (size_t i = 0; i < c->s.count; i++) {
    stack_path_frame(p, c->sections[i].t, &f);
    at_sections = fmax(at_sections, difference(9, f.rotation[0], c->sections[i].rotation[0]));
    at_sections = fmax(at_sections, difference(3, f.origin, c->sections[i].origin));
  }
  const stack_piece *pieces;
  size_t count = stack_path_pieces(p, &pieces);
  for (size_t k = 0; k < count; k++)
    for (int n = 0; n <= 8; n++) {
      const stack_piece *piece = pieces + k;
      double h = 1e-6, t = piece->t0 + (piece->t1 - piece->t0) * n / 8;
      stack_piece_frame(piece, t, &f);
      double rate[3], y[3], far = 0;
      for (int i = 0; i < 3; i++) { /* M' = -[omega]x M: omega_0 = -M'_2 . M_1 and so on */
        const double *d = f.d_rotation[(i + 2) % 3], *m = f.rotation[(i + 1) % 3];
        rate[i] = -(d[0] * m[0] + d[1] * m[1] + d[2] * m[2]);
        const double *row = f.rotation[i];
        y[i] = row[0] * f.d_origin[0] + row[1] * f.d_origin[1] + row[2] * f.d_origin[2];
        far += pow(f.origin[i] - piece->middle[i], 2);
        double slack = 1e-14;
        inside = inside && rate[i] >= piece->rate[i].lo - slack && rate[i] <= piece->rate[i].hi + slack &&
                 y[i] >= piece->velocity[i].lo - slack && y[i] <= piece->velocity[i].hi + slack;
      }
      inside = inside && sqrt(far) <= piece->reach * (1 + 1e-14);
      if (n == 0 || n == 8) continue;
      stack_piece_frame(piece, t - h, &a);
      stack_piece_frame(piece, t + h, &b);
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          derivatives = fmax(derivatives, fabs((b.rotation[i][j] - a.rotation[i][j]) / (2 * h) - f.d_rotation[i][j]));
      for (int i = 0; i < 3; i++)
        derivatives = fmax(derivatives, fabs((b.origin[i] - a.origin[i]) / (2 * h) - f.d_origin[i]));
    }
  stack_path_frame(p, c->sections[0].t - 1, &f);
  held = difference(9, f.rotation[0], c->sections[0].rotation[0]) < 1e-15 && f.d_origin[2] == 0;
  stack_path_frame(p, length + 1, &f);
  stack_path_frame(p, length, &a);
  held = held && memcmp(f.rotation, a.rotation, sizeof f.rotation) == 0 && f.d_rotation[0][0] == 0;
  T_RATIO(at_sections, c->s.rotation == BATTEN_ROTATION_VELOCITY ? 1e-5 : 2e-15, "%s: frames at the sections", name);
  T_RATIO(derivatives, 1e-8, "%s: derivatives against differences", name);
  T_CHECK(held, "%s: held beyond the ends", name);
  T_CHECK(inside, "%s: %zu pieces hold rate, velocity and origin", name, count);
}

static const char *const names[] = {"SPHERICAL", "GEODESIC", "LOGARITHM", "VELOCITY"};

static void test_ways(batten_context *ctx) {
  /* rotation and origin, of 50 and 10 sections */
  static const double allowed[4][2] = {{3e-7, 4e-5}, {1.5e-4, 4e-3}, {2.5e-4, 7e-3}, {3e-7, 3e-5}};
  for (int rotation = 0; rotation < 4; rotation++)
    for (int few = 0; few < 2; few++) {
      path_case c;
      stack_path *p = NULL;
      double turns, origins;
      path_sections(&c, few ? 10 : 50, 0, NULL);
      c.s.rotation = (batten_stack_rotation)rotation;
      T_OK(stack_path_make(ctx, &c.s, &p), ctx);
      block_error(p, &turns, &origins);
      T_RATIO(turns, allowed[rotation][few], "%s, %zu sections: error of frames", names[rotation], c.s.count);
      T_RATIO(origins, few ? 2e-4 : 3e-7, "%s, %zu sections: error of origins", names[rotation], c.s.count);
      if (!few) check_path(&c, p, names[rotation]);
      T_CHECK((stack_path_drift(p) > 0) == (rotation == BATTEN_ROTATION_VELOCITY) && stack_path_drift(p) < 1e-13,
              "drift %g", stack_path_drift(p));
      stack_path_free(p);
    }
  path_case c;
  stack_path *p = NULL;
  double turns, origins;
  path_sections(&c, 50, 0.8, NULL);
  T_OK(stack_path_make(ctx, &c.s, &p), ctx);
  block_error(p, &turns, &origins);
  T_RATIO(fmax(turns, origins), 5e-6, "uneven sections: frames and origins");
  stack_path_free(p);
  p = NULL;
  path_sections(&c, 50, 0, NULL);
  c.s.path_kind = BATTEN_PATH_LINEAR;
  T_OK(stack_path_make(ctx, &c.s, &p), ctx);
  block_error(p, &turns, &origins);
  T_CHECK(origins > 1e-5 && origins < 2e-4, "LINEAR: origins on chords, %.2g off", origins);
  check_path(&c, p, "LINEAR");
  stack_path_free(p);
}

/* Everything turned: M(t) turns along; and the way back is the same. */
static void test_invariance(batten_context *ctx) {
  double turn[9];
  stack_scene_rotation((const double[3]){0.3, -0.5, 0.8}, 170 * SCENE_PI / 180, turn);
  for (int rotation = 0; rotation < 3; rotation++) {
    path_case c, turned, back;
    stack_path *p = NULL, *q = NULL, *r = NULL;
    path_sections(&c, 12, 0.5, NULL);
    path_sections(&turned, 12, 0.5, turn);
    back = c;
    for (size_t i = 0; i < 12; i++) {
      back.sections[i] = c.sections[11 - i];
      back.sections[i].t = -c.sections[11 - i].t;
    }
    back.s.sections = back.sections;
    c.s.rotation = turned.s.rotation = back.s.rotation = (batten_stack_rotation)rotation;
    c.s.sections = c.sections;
    if (stack_path_make(ctx, &c.s, &p) < 0 || stack_path_make(ctx, &turned.s, &q) < 0 ||
        stack_path_make(ctx, &back.s, &r) < 0) {
      T_CHECK(false, "%s", batten_error(ctx));
    } else {
      double worst = 0, reversed = 0;
      for (int i = 0; i <= 300; i++) {
        stack_frame f, g, h;
        stack_path_frame(p, length * i / 300, &f);
        stack_path_frame(q, length * i / 300, &g);
        stack_path_frame(r, -length * i / 300, &h);
        for (int k = 0; k < 3; k++) {
          stack_scene_turn_vector(turn, f.rotation[k]);
          worst = fmax(worst, difference(3, f.rotation[k], g.rotation[k]));
          stack_scene_turn_vector(turn, h.rotation[k]);
          reversed = fmax(reversed, difference(3, f.rotation[k], h.rotation[k]));
        }
      }
      if (rotation == BATTEN_ROTATION_LOGARITHM)
        T_CHECK(worst > 0.01, "LOGARITHM: another motion when all is turned by 170 degrees, %.2g", worst);
      else
        T_RATIO(worst, 1e-13, "%s: all turned by 170 degrees", names[rotation]);
      T_RATIO(reversed, 1e-13, "%s: the way back", names[rotation]);
    }
    stack_path_free(p);
    stack_path_free(q);
    stack_path_free(r);
  }
}

static batten_status call_make(batten_context *ctx, void *arg) {
  path_case *c = arg;
  stack_path *p = NULL;
  batten_status st = stack_path_make(ctx, &c->s, &p);
  stack_path_free(p);
  return st;
}

static void test_edges(batten_context *ctx) {
  path_case c;
  stack_path *p = NULL;
  path_sections(&c, 2, 0, NULL); /* two sections: the geodesic, and a straight line */
  T_OK(stack_path_make(ctx, &c.s, &p), ctx);
  check_path(&c, p, "two sections");
  stack_path_free(p);
  p = NULL;
  const double half[9] = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  path_sections(&c, 3, 0, NULL);
  for (int k = 0; k < 3; k++) /* section 2: section 1 turned by half a turn about its x axis */
    for (int j = 0; j < 3; j++) c.sections[2].rotation[k][j] = half[4 * k] * c.sections[1].rotation[k][j];
  T_STATUS(stack_path_make(ctx, &c.s, &p), BATTEN_E_INVALID, ctx,
           "sections[2].rotation: half a turn from sections[1]");
  c.s.rotation = BATTEN_ROTATION_LOGARITHM;
  memcpy(c.sections[1].rotation, half, sizeof half);
  T_STATUS(stack_path_make(ctx, &c.s, &p), BATTEN_E_INVALID, ctx,
           "sections[1].rotation: half a turn from the axes of reference");
  T_CHECK(!p, "outputs untouched by failures");
  path_sections(&c, 5, 0, NULL);
  c.s.rotation = BATTEN_ROTATION_VELOCITY;
  t_fail_every_allocation("stack_path_make", call_make, &c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_ways(ctx);
  test_invariance(ctx);
  test_edges(ctx);
  batten_context_free(ctx);
  return t_done();
}
