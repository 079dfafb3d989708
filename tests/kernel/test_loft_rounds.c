/* Separators and programs in rounds: turns of sections hold, as dense samples say too; the objective does not rise;
 * what cannot hold is named. */
#include "loft_case.h"

typedef struct answer {
  loft_result result;
  loft_tally before, after;
  double objective_free, objective, seconds[2];
} answer;

static batten_status run(loft_case *c, answer *a) {
  *a = (answer){.before = loft_case_tally(c, c->free)};
  batten_status st =
      loft_rounds(c->ctx, &c->net, c->objective, &c->opt, c->free, &a->seconds[0], &a->seconds[1], &a->result);
  if (st < 0) return st;
  a->after = loft_case_tally(c, a->result.y);
  a->objective_free = loft_objective_value(c->objective, c->free);
  a->objective = loft_objective_value(c->objective, a->result.y);
  return st;
}

static bool solve(batten_context *ctx, const loft_rule *rule, unsigned degree, double scale,
                  const batten_loft_options *opt, loft_case *c, answer *a) {
  batten_status st = loft_case_make(ctx, rule, degree, scale, opt, c);
  if (st >= 0) {
    st = run(c, a);
    if (st < 0) loft_case_free(c);
  }
  if (st < 0) T_CHECK(false, "%s: %s", batten_status_name(st), batten_error(ctx));
  return st >= 0;
}

static void drop(loft_case *c, answer *a) {
  loft_result_free(c->ctx, &a->result);
  loft_case_free(c);
}

static void test_nothing_to_do(void) {
  static const loft_rule rules[] = {
      {.kind = LOFT_CYLINDER, .degree = 3, .smoothness = 2, .contours = 4, .decades = 1},
      {.kind = LOFT_CONE, .degree = 4, .smoothness = 2, .contours = 5, .closed = true, .decades = 1},
      {.kind = LOFT_STRAIGHT, .degree = 3, .smoothness = 2, .contours = 3, .decades = 1}};
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (size_t k = 0; k < 3; k++) {
    loft_case c;
    answer a;
    if (!solve(ctx, &rules[k], 0, 1, NULL, &c, &a)) continue;
    bool same = memcmp(a.result.y, c.free, 2 * c.net.z.columns * sizeof *c.free) == 0;
    T_CHECK(k == 2 || (a.result.rounds == 0 && a.result.rows_used == 0 && a.result.feasible && same),
            "scene %zu: the minimum that satisfies all of %zu inequalities stays, without a program", k,
            a.result.rows);
    T_CHECK(a.result.feasible && a.after.wrong == 0, "scene %zu: %zu turns hold", k, a.after.vertices);
    drop(&c, &a);
  }
  batten_context_free(ctx);
}

/* One case in words, and as it must be. */
static void judge(const loft_case *c, const answer *a, const char *what) {
  T_CHECK(a->result.feasible && a->after.wrong == 0 && a->after.wide == 0 && a->result.elastic_count == 0,
          "%s: %zu of %zu turns fail before, %zu after; %u rounds, %zu of %zu inequalities used, %.2f s", what,
          a->before.wrong + a->before.wide, a->after.vertices, a->after.wrong + a->after.wide, a->result.rounds,
          a->result.rows_used, a->result.rows, a->seconds[1]);
  T_CHECK(a->after.worst >= c->opt.margin * (1 - 1e-9), "%s: turns keep %.3g of what the contours turn by", what,
          a->after.worst);
  T_CHECK(a->objective >= a->objective_free, "%s: the objective %.9g is not below its minimum %.9g", what,
          a->objective, a->objective_free);
}

static void test_paper(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  loft_case c;
  answer a;
  loft_rule rule = {.kind = LOFT_PAPER};
  if (solve(ctx, &rule, 3, 1, NULL, &c, &a)) {
    judge(&c, &a, "figure 5, degree 3");
    T_CHECK(a.before.wrong > 0, "without inequalities %zu of its turns have the wrong sign", a.before.wrong);
    drop(&c, &a);
  }
  batten_context_free(ctx);
}

static void test_stacks(void) {
  static const uint64_t seeds[] = {2, 3, 5, 8, 27, 31, 34, 41, 48, 57};
  batten_context *ctx = t_context(NULL, NULL, 1);
  size_t needed = 0;
  for (size_t k = 0; k < sizeof seeds / sizeof *seeds; k++) {
    loft_rule rule = loft_rule_random(seeds[k]);
    loft_case c;
    answer a;
    char what[64];
    snprintf(what, sizeof what, "stack %d, degree %u", (int)seeds[k], rule.degree);
    if (!solve(ctx, &rule, 0, 1, NULL, &c, &a)) continue;
    judge(&c, &a, what);
    needed += a.before.wrong > 0;
    drop(&c, &a);
  }
  T_CHECK(needed >= 4, "%zu of them have turns of the wrong sign without inequalities", needed);
  batten_context_free(ctx);
}

/* More rounds of programs never give a larger objective. Where the first ones leave vertices turns are settled, which
 * is free of separators and gives less. */
static void test_rounds(const loft_rule *rule, unsigned degree) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  double last = INFINITY, first = 0, settled = 0;
  bool falls = true;
  unsigned feasible = 0;
  for (unsigned rounds = 1; rounds <= 6; rounds++) {
    batten_loft_options opt = batten_loft_options_default();
    opt.rounds = rounds;
    opt.tension = 0.001; /* fewer turns fail, so that programs are tried */
    loft_case c;
    answer a;
    if (!solve(ctx, rule, degree, 1, &opt, &c, &a)) break;
    if (a.result.feasible && a.result.settled)
      settled = a.objective;
    else if (a.result.feasible) {
      if (!feasible++) first = a.objective;
      falls = falls && a.objective <= last && a.objective >= (1 - 1e-3) * settled;
      last = a.objective;
    } else {
      falls = falls && !feasible;
      T_CHECK(a.result.elastic_count == a.after.wrong + a.after.wide || a.result.elastic_count > a.after.wrong,
              "after %u rounds %zu vertices are named, %zu turn wrongly", rounds, a.result.elastic_count,
              a.after.wrong + a.after.wide);
      bool sorted = a.result.elastic_count > 0, true_amount = true;
      double *control = loft_scene_memory(2 * c.net.z.rows, sizeof *control);
      loft_net_expand(&c.net, a.result.y, control);
      for (size_t k = 0; k < a.result.elastic_count; k++) {
        const loft_elastic *e = &a.result.elastic[k];
        sorted = sorted && e->amount > 0 && (k == 0 || e[-1].amount >= e->amount);
        loft_bound bound;
        double met = 0;
        bool asked = loft_bound_of(&c.slabs[e->slab], e->vertex, opt.margin, &bound);
        for (unsigned r = 0; r <= 640; r++) {
          double turn = loft_case_turn(&c, control, e->slab, e->vertex, r / 640.0);
          met = fmax(met, fmax(bound.lower - turn, turn - bound.upper));
        }
        true_amount = true_amount && asked && fabs(met - e->amount) <= 0.1 * met + 1e-9;
      }
      T_CHECK(sorted && true_amount, "largest first, by as much as samples say");
      free(control);
    }
    drop(&c, &a);
  }
  T_CHECK(falls && feasible > 1, "over %u feasible rounds the objective falls: %.9g, %.9g", feasible, first, last);
  batten_context_free(ctx);
}

static void test_same_bits(const loft_rule *rule) {
  double *first = NULL;
  size_t count = 0;
  for (int k = 0; k < 3; k++) {
    batten_context *ctx = t_context(NULL, NULL, k == 1 ? 4 : 1);
    loft_case c;
    answer a;
    if (solve(ctx, rule, 0, k == 2 ? 0x1p10 : 1, NULL, &c, &a)) {
      if (k == 0) {
        count = 2 * c.net.z.columns;
        first = loft_scene_memory(count, sizeof *first);
        memcpy(first, a.result.y, count * sizeof *first);
      } else {
        T_CHECK(count == 2 * c.net.z.columns && memcmp(first, a.result.y, count * sizeof *first) == 0, "%s",
                k == 1 ? "four threads give the same bits" : "so do contours times 2^10");
      }
      drop(&c, &a);
    }
    batten_context_free(ctx);
  }
  free(first);
}

static void test_limit(const loft_rule *rule) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_loft_options opt = batten_loft_options_default();
  opt.row_limit = 50;
  loft_case c;
  loft_result result;
  double seconds[2] = {0};
  if (loft_case_make(ctx, rule, 0, 1, &opt, &c) >= 0) {
    T_STATUS(loft_rounds(ctx, &c.net, c.objective, &c.opt, c.free, &seconds[0], &seconds[1], &result),
             BATTEN_E_TOO_LARGE, ctx, "opt.row_limit: more than 50 inequalities");
    loft_case_free(&c);
  }
  batten_context_free(ctx);
}

static batten_status whole(batten_context *ctx, void *arg) {
  loft_case c;
  batten_loft_options opt = batten_loft_options_default();
  opt.rounds = 2;
  batten_status st = loft_case_make(ctx, arg, 3, 1, &opt, &c);
  if (st < 0) return st;
  loft_result result;
  double seconds[2] = {0};
  st = loft_rounds(ctx, &c.net, c.objective, &c.opt, c.free, &seconds[0], &seconds[1], &result);
  if (st >= 0) loft_result_free(ctx, &result);
  loft_case_free(&c);
  return st;
}

int main(void) {
  loft_rule paper = {.kind = LOFT_PAPER}, many = loft_rule_random(170);
  test_nothing_to_do();
  test_paper();
  test_stacks();
  test_rounds(&many, 0);
  test_rounds(&paper, 3);
  test_same_bits(&many);
  test_limit(&many);
  t_fail_every_allocation("rounds", whole, &paper);
  t_cancel_every_progress("rounds", whole, &paper);
  return t_done();
}
