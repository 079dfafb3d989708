/* Bounds of turns, separators and the inequalities that they give: against their definition at many heights, and that
 * they leave only turns within the bounds, whatever the separator. */
#include "loft_case.h"

static const loft_rule RULES[] = {
    {.kind = LOFT_STACK, .degree = 3, .smoothness = 1, .contours = 4, .decades = 1, .rotation = 1, .seed = 3},
    {.kind = LOFT_STACK, .degree = 3, .smoothness = 2, .contours = 3, .decades = 1, .rotation = 1, .closed = true},
    {.kind = LOFT_STACK, .degree = 5, .smoothness = 2, .contours = 3, .inflections = 1, .decades = 1, .seed = 5},
    {.kind = LOFT_PAPER}};

/* Control points of all patches of a surface beside the minimum: unknowns moved by up to `part`. */
static double *spoiled(const loft_case *c, double part, uint64_t seed, double *y) {
  double *control = loft_scene_memory(2 * c->net.z.rows, sizeof *control);
  for (size_t k = 0; k < 2 * c->net.z.columns; k++) y[k] = c->free[k] + part * (2 * t_uniform(&seed) - 1);
  loft_net_expand(&c->net, y, control);
  return control;
}

static void test_bound(void) {
  double ends[2][10] = {{0, 0, 1, 0, 2, 0, 3, 0, 4, 0}}, angles[2][4] = {{0, 0.1, 0.4, 0.4}, {0, 0.3, 0.2, 0.2}};
  double lengths[4] = {1, 1, 1, 1}, breaks[3] = {0, 0.5, 1};
  unsigned folds[3] = {4, 1, 4};
  signed char wanted[3] = {1, LOFT_FREE, LOFT_FLAT};
  batten_context *ctx = t_context(NULL, NULL, 1);
  loft_slab slab = {.gap = 1, .end = {ends[0], ends[1]}, .angle = {angles[0], angles[1]}, .wanted = wanted};
  slab.length[0] = slab.length[1] = lengths;
  T_OK(loft_space_make(ctx, 3, false, 2, breaks, folds, &slab.space), ctx);
  loft_bound b = {0, 0};
  T_CHECK(loft_bound_of(&slab, 0, 0.1, &b) && fabs(b.lower - 0.01) < 1e-15 && fabs(b.upper - CASE_PI / 2) < 1e-15,
          "a turn from 0.1 to 0.3 stays above 0.01 and below pi / 2: %g, %g", b.lower, b.upper);
  T_CHECK(loft_bound_of(&slab, 1, 0.1, &b) && b.lower == -b.upper, "a free one stays between -pi / 2 and pi / 2");
  T_CHECK(!loft_bound_of(&slab, 2, 0.1, &b), "nothing is asked of flat vertices");
  wanted[0] = -1;
  T_CHECK(loft_bound_of(&slab, 0, 0.1, &b) && fabs(b.upper + 0.01) < 1e-15 && b.lower < b.upper, "mirrored: %g, %g",
          b.lower, b.upper);
  loft_space_free(ctx, &slab.space);
  batten_context_free(ctx);
}

/* What is proven holds at many heights; what fails does so somewhere by what is told. */
static void test_shortage(const loft_case *c, const double *control, const char *what) {
  size_t held = 0, failed = 0, wrong = 0;
  for (size_t i = 0; i < c->slab_count; i++)
    for (size_t v = 0; v < loft_vertices(&c->slabs[i].space); v++) {
      loft_bound bound;
      if (!loft_bound_of(&c->slabs[i], v, 0.01, &bound)) continue;
      double told = loft_shortage(&c->net, control, i, v, &bound), met = 0;
      for (unsigned r = 0; r <= 640; r++) {
        double turn = loft_case_turn(c, control, i, v, r / 640.0);
        double middle = (bound.lower + bound.upper) / 2, off = fabs(remainder(turn - middle, 2 * CASE_PI));
        met = fmax(met, off - (bound.upper - bound.lower) / 2);
      }
      held += told == 0;
      failed += told > 0;
      if (told == 0 ? met > 1e-12 : told > met + 1e-12 || told < 0.8 * met - 0.01) wrong++;
    }
  T_CHECK(wrong == 0, "%s: %zu turns hold, %zu fail, by as much as samples say", what, held, failed);
}

/* Each inequality of a piece inside a patch is a Bernstein coefficient of what it is said to be. */
static void test_values(const loft_case *c, const double *y, const double *control, const char *what) {
  unsigned n = c->net.degree, m = n + LOFT_FIELD;
  double worst = 0, longest = 0;
  size_t pieces_tried = 0;
  for (size_t i = 0; i < c->slab_count; i++) {
    loft_directions d;
    if (loft_directions_make(c->ctx, &c->net, control, i, 0.01, 2, &d) < 0) abort();
    for (size_t v = 0; v < loft_vertices(&c->slabs[i].space); v += 3) {
      loft_pieces pieces = {.count = 0};
      loft_rows rows = {.columns = 2 * c->net.z.columns};
      bool strict;
      if (loft_pieces_add(c->ctx, &c->net, control, &d, v, 0.01, 2, 0, &pieces, &strict) < 0) abort();
      if (pieces.count == 4 && loft_rows_add(c->ctx, &c->net, control, &pieces.all[1], INFINITY, INFINITY, &rows) < 0)
        abort();
      for (unsigned side = 0; side < 4 && rows.rows == 4 * (size_t)(m + 1); side++)
        for (double s = 0; s <= 1; s += 0.125) {
          const loft_piece *piece = &pieces.all[1];
          double sum = 0, w[2] = {0}, leg[2], zeta = piece->from + s * (piece->to - piece->from);
          for (unsigned r = 0; r <= m; r++) {
            size_t row = side * (m + 1) + r;
            double value = -rows.lower[row];
            for (size_t at = rows.starts[row]; at < rows.starts[row + 1]; at++)
              value += rows.values[at] * y[rows.indices[at]];
            sum += value * exp(lgamma(m + 1) - lgamma(r + 1) - lgamma(m - r + 1)) * pow(s, r) * pow(1 - s, m - r);
          }
          for (unsigned k = 0; k <= 4; k++)
            for (unsigned x = 0; x < 2; x++)
              w[x] += (k % 4 == 0 ? 1 : k == 2 ? 6 : 4) * pow(s, k) * pow(1 - s, 4 - k) * piece->w[k][x];
          size_t l = (v + side / 2) % loft_legs(&c->slabs[i].space);
          loft_case_leg(c, control, i, l, zeta, leg);
          double half = (side % 2 ? piece->bound.upper : piece->bound.lower) / 2, a[2], *turned = side < 2 ? leg : w;
          a[0] = cos(half) * turned[0] - sin(half) * turned[1];
          a[1] = sin(half) * turned[0] + cos(half) * turned[1];
          double value = side == 0   ? loft_cross(a, w)
                         : side == 1 ? loft_cross(w, a)
                         : side == 2 ? loft_cross(a, leg)
                                     : loft_cross(leg, a);
          value /= (c->slabs[i].length[0][l] + c->slabs[i].length[1][l]) / 2;
          worst = fmax(worst, fabs(sum + piece->inside - value));
          longest = fmax(longest, fabs(hypot(w[0], w[1]) - 1));
        }
      pieces_tried += rows.rows > 0;
      loft_rows_free(c->ctx, &rows);
      loft_pieces_free(c->ctx, &pieces);
    }
    loft_directions_free(c->ctx, &d);
  }
  T_RATIO(worst, 1e-9, "%s: inequalities of %zu pieces are what they are said to be", what, pieces_tried);
  T_RATIO(longest, 0.2, "%s: separators are about as long as directions", what);
}

/* Legs at random that a separator at random allows turn as they must: sides as half planes, at one height. */
static void test_separators(void) {
  uint64_t seed = 7;
  size_t allowed = 0, wrong = 0;
  for (size_t trial = 0; trial < 200000; trial++) {
    double most = CASE_PI / (double)(1 + trial % 4), lower = trial % 3 ? 0.3 * most * t_uniform(&seed) : -most;
    if (trial % 3 == 0 && most > 1.6) continue;
    double upper = most, p = 2 * CASE_PI * t_uniform(&seed), q = 2 * CASE_PI * t_uniform(&seed);
    bool fits = sin(-p - lower / 2) >= 0 && sin(p + upper / 2) >= 0 && sin(q - lower / 2) >= 0 &&
                sin(upper / 2 - q) >= 0; /* w = (1, 0) */
    double turn = remainder(q - p - (lower + upper) / 2, 2 * CASE_PI) + (lower + upper) / 2;
    allowed += fits;
    wrong += fits && (turn < lower - 1e-12 || turn > upper + 1e-12);
  }
  T_CHECK(allowed > 1000 && wrong == 0, "%zu random pairs of legs that a separator allows turn within bounds",
          allowed);
}

/* Directions that were moved turn as they must at all heights. */
static void test_directions(const loft_case *c, const double *control, const char *what) {
  double worst = 0;
  size_t moved = 0;
  for (size_t i = 0; i < c->slab_count; i++) {
    loft_directions d;
    size_t legs = loft_legs(&c->slabs[i].space), nodes = (LOFT_FIELD << 3) + 1;
    if (loft_directions_make(c->ctx, &c->net, control, i, 0.01, 3, &d) < 0) abort();
    moved += !d.whole;
    for (size_t v = 0; v < loft_vertices(&c->slabs[i].space); v++)
      for (size_t r = 0; r < nodes; r++) {
        double zeta = (double)r / (double)(nodes - 1);
        double turn = (1 - zeta) * loft_turn(&c->slabs[i], 0, v) + zeta * loft_turn(&c->slabs[i], 1, v) +
                      d.turned[r * legs + (v + 1) % legs] - d.turned[r * legs + v];
        loft_bound bound;
        if (loft_bound_of(&c->slabs[i], v, 0.01, &bound))
          worst = fmax(worst, fmax(bound.lower - turn, turn - bound.upper));
      }
    loft_directions_free(c->ctx, &d);
  }
  T_RATIO(worst, 1e-2, "%s: directions turn within bounds, in %zu patches after moving them", what, moved);
}

static batten_status make_pieces(batten_context *ctx, void *arg) {
  loft_case *c = arg;
  loft_directions d = {.turned = NULL};
  loft_pieces pieces = {.count = 0};
  loft_rows rows = {.columns = 2 * c->net.z.columns};
  double *control = loft_scene_memory(2 * c->net.z.rows, sizeof *control);
  bool strict;
  loft_net_expand(&c->net, c->free, control);
  batten_status st = loft_directions_make(ctx, &c->net, control, 0, 0.01, 2, &d);
  for (size_t v = 0; v < 5 && st >= 0; v++)
    st = loft_pieces_add(ctx, &c->net, control, &d, v, 0.01, 2, v, &pieces, &strict);
  for (size_t k = 0; k < pieces.count && st >= 0; k++)
    st = loft_rows_add(ctx, &c->net, control, &pieces.all[k], INFINITY, INFINITY, &rows);
  loft_rows_free(ctx, &rows);
  loft_pieces_free(ctx, &pieces);
  loft_directions_free(ctx, &d);
  free(control);
  return st;
}

int main(void) {
  test_bound();
  test_separators();
  for (size_t k = 0; k < sizeof RULES / sizeof *RULES; k++) {
    batten_context *ctx = t_context(NULL, NULL, 1);
    loft_case c;
    char what[64];
    batten_status st = loft_case_make(ctx, &RULES[k], 0, 1, NULL, &c);
    T_CHECK(st >= 0, "scene %zu %s", k, st < 0 ? batten_error(ctx) : "");
    if (st >= 0) {
      double *y = loft_scene_memory(2 * c.net.z.columns, sizeof *y);
      for (int bad = 0; bad < 2; bad++) {
        double *control = spoiled(&c, bad ? 0.01 : 0, 11 + k, y);
        snprintf(what, sizeof what, "scene %zu%s", k, bad ? ", spoiled" : "");
        test_shortage(&c, control, what);
        test_values(&c, y, control, what);
        if (!bad) test_directions(&c, control, what);
        free(control);
      }
      free(y);
      if (k == 0) t_fail_every_allocation("making inequalities", make_pieces, &c);
      loft_case_free(&c);
    }
    batten_context_free(ctx);
  }
  return t_done();
}
