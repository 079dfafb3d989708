/* The proof that plane sections keep their sign.
 *
 * All span pairs are looked at once without cutting them: which sign is wanted, whether the coefficients of w have
 * it, and the least curvature that was met anywhere. Those whose sign or share of that least is still open are then
 * proven by bisection. Each goes by what all said before and what it meets itself, so that bits do not depend on
 * threads. */
#include "certify_sections.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/checked.h"

enum { LOOK = 16, PROVE = 4, LANES = 32 }; /* span pairs of a task, tasks at a time */

/* Room of a task. */
typedef struct lane {
  sections_search search;
  sections_pair pair;
  double *block;
} lane;

typedef struct job {
  const sections_plan *plan;
  const batten_sections_options *opt;
  size_t spans[2], *span[2];
  size_t pairs;
  sections_record *records; /* [pairs] */
  size_t *open;             /* [open_count] of them */
  size_t open_count;
  double target; /* of all */
  size_t first;  /* task */
  lane *lanes;
} job;

batten_sections_options batten_sections_options_default(void) {
  return (batten_sections_options){
      .struct_size = sizeof(batten_sections_options), .normal = {0, 0, 1}, .depth_max = 20, .box_limit = 100000};
}

/* ---- what is given -------------------------------------------------------------------------------- */

static batten_status check(batten_context *ctx, const batten_surface *surface, const batten_sections_options *opt,
                           const batten_sections *out) {
  if (!surface || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a surface and room for the result",
                       surface ? "out" : "surface");
  batten_status st = batten_check_struct(ctx, "batten_sections_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  const double *n = opt->normal;
  if (!(isfinite(n[0]) && isfinite(n[1]) && isfinite(n[2]) && (n[0] != 0 || n[1] != 0 || n[2] != 0)))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.normal: %g %g %g; give a direction", n[0], n[1], n[2]);
  if (opt->depth_max > 30)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.depth_max: %u; give 0 to 30", opt->depth_max);
  if (opt->box_limit < 1) return batten_fail(ctx, BATTEN_E_INVALID, "opt.box_limit: 0; give 1 or more");
  size_t spans[2] = {bspline_span_count(&surface->space[0]), bspline_span_count(&surface->space[1])};
  for (size_t k = 0; opt->signs && k < spans[0] * spans[1]; k++)
    if (opt->signs[k] < -1 || opt->signs[k] > 1)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.signs[%zu][%zu]: %d; give -1, 0 or 1", k / spans[1],
                         k % spans[1], opt->signs[k]);
  return BATTEN_OK;
}

/* Control points of one v have to be in one plane, but for the rounding of points that were turned. */
static batten_status check_plane(batten_context *ctx, const batten_surface *s, const double normal[3]) {
  size_t rows = s->space[0].count, columns = s->space[1].count;
  double most = 0, direction[3], scale = batten_unit(fmax(fabs(normal[0]), fmax(fabs(normal[1]), fabs(normal[2]))));
  for (size_t k = 0; k < 3 * rows * columns; k++) most = fmax(most, fabs(s->control_points[k]));
  double unit = most > 0 ? 0.125 * batten_unit(most) : 1;
  for (int x = 0; x < 3; x++) direction[x] = scale * normal[x];
  for (size_t k = 0; k < rows * columns; k++) {
    const double *p = s->control_points + 3 * k, *first = s->control_points + 3 * (k % columns);
    double off = 0;
    for (int x = 0; x < 3; x++) off += direction[x] * (unit * p[x] - unit * first[x]);
    if (!(fabs(off) <= 32 * DBL_EPSILON * unit * most))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "control_points[%zu][%zu]: not in the plane of control_points[0][%zu] across opt.normal; "
                         "sections v = const must be plane",
                         k / columns, k % columns, k % columns);
  }
  return BATTEN_OK;
}

/* ---- one span pair -------------------------------------------------------------------------------- */

/* Column 0 or the last (1), or all of them (-1). */
static void copy_columns(const sections_sheet *from, int column, sections_sheet *to) {
  double *c = to->c;
  size_t columns = from->degree[1] + 1, rows = sections_count(from) / columns;
  *to = *from;
  to->c = c;
  if (column < 0) {
    memcpy(c, from->c, rows * columns * sizeof *c);
    return;
  }
  to->degree[1] = 0;
  for (size_t k = 0; k < rows; k++) c[k] = from->c[k * columns + (column ? columns - 1 : 0)];
}

static void negate(sections_sheet *p) {
  for (size_t k = 0; k < sections_count(p); k++) p->c[k] = -p->c[k];
}

/* Cuts box 0 of the stack in two by s and keeps one half. */
static void take_half(sections_search *search, bool upper) {
  sections_box *b = sections_box_at(search, 0), *other = sections_box_at(search, 1), keep;
  sections_halve(0, &b->a, &other->a, search->room);
  sections_halve(0, &b->w, &other->w, search->room);
  if (!upper) return;
  keep = *b;
  *b = *other;
  *other = keep;
}

/* A part of the domain: a, w over at[0][0] .. at[0][1], at[1][0] .. at[1][1], with the sign that is wanted. */
typedef struct source {
  const sections_sheet *a, *w;
  int column; /* -1: all, else one alone */
  int sign;
} source;

static void put_source(const source *from, sections_search *search) {
  sections_box *b = sections_box_at(search, 0);
  copy_columns(from->a, from->column, &b->a);
  copy_columns(from->w, from->column, &b->w);
  if (from->sign < 0) negate(&b->w);
}

/* A flat end is put to s = 0; flat ends at both sides are proven apart. */
static void prove_ends(sections_search *search, const sections_pair *p, const source *from, const double at[2][2],
                       bool margin, sections_record *record) {
  bool both = p->flat[0] && p->flat[1];
  signed char verdict = SECTIONS_PROVEN;
  for (int side = 0; side < 2 && verdict >= SECTIONS_OPEN; side++) {
    if (!both && side != p->flat[1]) continue;
    sections_stretch t = {.from = {at[0][side], at[1][0]},
                          .to = {both ? 0.5 * at[0][0] + 0.5 * at[0][1] : at[0][1 - side], at[1][1]},
                          .factor = p->factor,
                          .flat = p->flat[side],
                          .allowed = p->allowed[side],
                          .margin = margin};
    put_source(from, search);
    if (both) take_half(search, side == 1);
    if (side == 1) sections_reverse(&search->stack[0].a);
    if (side == 1) sections_reverse(&search->stack[0].w);
    sections_prove(search, &t, record);
    verdict = record->verdict < verdict ? record->verdict : verdict;
  }
  record->verdict = verdict;
}

/* Whether the section at the least or largest v has the sign. */
static bool section_has(lane *l, const double at[2][2], size_t box_limit, int column, int sign) {
  source from = {.a = &l->pair.a, .w = &l->pair.w, .column = column, .sign = sign};
  sections_record r = {.least = INFINITY, .target = INFINITY, .bound = INFINITY};
  l->search.box_limit = box_limit;
  prove_ends(&l->search, &l->pair, &from, at, false, &r);
  return r.verdict == SECTIONS_PROVEN;
}

/* The sign of both end sections, or 0. */
static signed char find_sign(lane *l, const double at[2][2], size_t box_limit) {
  const sections_sheet *w = &l->pair.w;
  if (l->pair.lonely[0] || l->pair.lonely[1]) return 0;
  double sum = 0;
  for (size_t k = 0; k <= w->degree[0]; k++) sum += w->c[k * (w->degree[1] + 1)];
  signed char sign = sum < 0 ? -1 : 1;
  return section_has(l, at, box_limit, 0, sign) && section_has(l, at, box_limit, 1, sign) ? sign : 0;
}

/* The place of span pair k, its polynomials. */
static void make_pair(const job *j, lane *l, size_t k, double at[2][2]) {
  size_t span[2] = {j->span[0][k / j->spans[1]], j->span[1][k % j->spans[1]]};
  for (int i = 0; i < 2; i++) {
    const double *knots = j->plan->surface->space[i].knots + span[i];
    at[i][0] = knots[0];
    at[i][1] = knots[1];
  }
  sections_pair_make(j->plan, span[0], span[1], l->search.room, &l->pair);
}

static void prove_pair(lane *l, const double at[2][2], double target, size_t box_limit, sections_record *r) {
  r->strict = !l->pair.flat[0] && !l->pair.flat[1];
  r->boxes = 0;
  r->target = target;
  r->bound = INFINITY;
  l->search.box_limit = box_limit;
  source from = {.a = &l->pair.a, .w = &l->pair.w, .column = -1, .sign = r->sign};
  prove_ends(&l->search, &l->pair, &from, at, r->strict, r);
}

static void look_at_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = (j->first + index) * LOOK;
  for (size_t k = from; k < from + LOOK && k < j->pairs; k++) {
    lane *l = &j->lanes[index];
    sections_record *r = &j->records[k];
    double at[2][2];
    *r = (sections_record){.least = INFINITY, .bound = INFINITY};
    if (j->opt->signs && j->opt->signs[k] == 0) continue;
    make_pair(j, l, k, at);
    r->sign = j->opt->signs ? j->opt->signs[k] : find_sign(l, (const double(*)[2])at, j->opt->box_limit);
    if (r->sign != 0) prove_pair(l, (const double(*)[2])at, INFINITY, 0, r);
  }
}

static void prove_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = (j->first + index) * PROVE;
  for (size_t k = from; k < from + PROVE && k < j->open_count; k++) {
    lane *l = &j->lanes[index];
    double at[2][2];
    make_pair(j, l, j->open[k], at);
    prove_pair(l, (const double(*)[2])at, j->target, j->opt->box_limit, &j->records[j->open[k]]);
  }
}

/* ---- all of them ---------------------------------------------------------------------------------- */

static batten_status run(batten_context *ctx, job *j, size_t tasks, void (*task)(void *, size_t), double from) {
  for (size_t done = 0; done < tasks; done += LANES) {
    batten_status st = batten_progress(ctx, "certify", from + 0.5 * (double)done / (double)tasks);
    if (st < 0) return st;
    j->first = done;
    batten_parallel(ctx, tasks - done < LANES ? tasks - done : LANES, task, j);
  }
  return BATTEN_OK;
}

/* The target of all, and what is open with it. */
static void find_open(job *j) {
  double target = INFINITY;
  bool violated = false;
  for (size_t k = 0; k < j->pairs; k++) {
    const sections_record *r = &j->records[k];
    if (r->sign == 0) continue;
    violated = violated || r->verdict == SECTIONS_VIOLATED;
    if (r->strict) target = fmin(target, r->target);
  }
  j->target = violated ? 0 : target; /* then no margin is asked for */
  for (size_t k = 0; k < j->pairs; k++) {
    sections_record *r = &j->records[k];
    if (r->sign == 0 || r->verdict < 0) continue;
    bool known =
        r->strict ? isfinite(r->bound) && r->bound >= SECTIONS_SHARE * j->target : r->verdict == SECTIONS_PROVEN;
    if (known)
      r->verdict = SECTIONS_PROVEN;
    else
      j->open[j->open_count++] = k;
  }
}

/* A curvature in the caller's unit; a proven one not above it, and 0 rather than without all its digits. */
static double in_units(const sections_plan *plan, double value, bool proven) {
  value = ldexp(value, plan->exponent);
  if (proven && fabs(value) < DBL_MIN) return 0;
  return fmax(fmin(value, DBL_MAX), -DBL_MAX);
}

static batten_sections report(const job *j, signed char *verdicts) {
  batten_sections out = {.margin_min = NAN};
  double bound = INFINITY, least = INFINITY;
  for (size_t k = 0; k < j->pairs; k++) {
    const sections_record *r = &j->records[k];
    out.pairs += r->sign != 0;
    out.violations += r->verdict == SECTIONS_VIOLATED;
    out.unproven += r->verdict == SECTIONS_UNPROVEN;
    out.boxes += r->boxes;
    out.depth = r->depth > out.depth ? r->depth : out.depth;
    if (verdicts) verdicts[k] = r->verdict;
    if (r->strict && r->sign != 0) bound = fmin(bound, r->bound);
  }
  out.pairs_free = j->pairs - out.pairs;
  out.certified = out.violations == 0 && out.unproven == 0;
  bool strict = out.certified && isfinite(bound); /* then flat ones do not count */
  for (size_t k = 0; k < j->pairs; k++) {
    const sections_record *r = &j->records[k];
    if (r->sign == 0 || (strict && !r->strict) || !(r->least < least)) continue;
    least = r->least;
    memcpy(out.worst_at, r->least_at, sizeof out.worst_at);
  }
  if (strict) out.margin_min = in_units(j->plan, bound, true);
  if (!out.certified) out.margin_min = in_units(j->plan, least, false);
  return out;
}

/* ---- room ----------------------------------------------------------------------------------------- */

static batten_status make_lane(batten_context *ctx, const sections_plan *plan, unsigned depth_max, lane *l) {
  size_t boxes = 2 * (size_t)depth_max + 2, a = sections_a_count(plan), w = sections_w_count(plan);
  l->block = batten_alloc_array(ctx, (boxes + 1) * (a + w) + sections_room(plan), sizeof *l->block);
  l->search.stack = batten_alloc_array(ctx, boxes, sizeof *l->search.stack);
  if (!l->block || !l->search.stack) return BATTEN_E_NOMEM;
  l->pair.a.c = l->block;
  l->pair.w.c = l->pair.a.c + a;
  l->search.room = l->pair.w.c + w;
  l->search.coefficients = l->search.room + sections_room(plan);
  l->search.plan = plan;
  l->search.depth_max = depth_max;
  return BATTEN_OK;
}

static batten_status make_spans(batten_context *ctx, const bspline *space, size_t count, size_t **out) {
  size_t *span = *out = batten_alloc_array(ctx, count, sizeof *span), k = 0;
  if (!span) return BATTEN_E_NOMEM;
  for (size_t mu = bspline_first(space); mu < space->count; mu = bspline_next(space, mu)) span[k++] = mu;
  return BATTEN_OK;
}

static size_t tasks_of(size_t count, size_t each) { return count / each + (count % each > 0); }

static batten_status plan_job(batten_context *ctx, job *j) {
  const batten_surface *s = j->plan->surface;
  batten_status st = BATTEN_OK;
  for (int i = 0; i < 2 && st >= 0; i++) {
    j->spans[i] = bspline_span_count(&s->space[i]);
    st = make_spans(ctx, &s->space[i], j->spans[i], &j->span[i]);
  }
  if (st < 0) return st;
  j->pairs = j->spans[0] * j->spans[1]; /* there are as many control points */
  j->records = batten_alloc_array(ctx, j->pairs, sizeof *j->records);
  j->open = batten_alloc_array(ctx, j->pairs, sizeof *j->open);
  j->lanes = batten_alloc_array(ctx, LANES, sizeof *j->lanes);
  if (j->lanes) memset(j->lanes, 0, LANES * sizeof *j->lanes);
  if (!j->records || !j->open || !j->lanes) return BATTEN_E_NOMEM;
  size_t lanes = tasks_of(j->pairs, PROVE); /* the more of both */
  for (size_t k = 0; k < lanes && k < LANES && st >= 0; k++)
    st = make_lane(ctx, j->plan, j->opt->depth_max, &j->lanes[k]);
  return st;
}

static void free_job(batten_context *ctx, job *j) {
  for (size_t k = 0; j->lanes && k < LANES; k++) {
    batten_free(ctx, j->lanes[k].search.stack);
    batten_free(ctx, j->lanes[k].block);
  }
  batten_free(ctx, j->lanes);
  batten_free(ctx, j->open);
  batten_free(ctx, j->records);
  batten_free(ctx, j->span[1]);
  batten_free(ctx, j->span[0]);
}

batten_status batten_surface_certify_sections(batten_context *ctx, const batten_surface *surface,
                                              const batten_sections_options *opt, batten_sections *out,
                                              signed char *verdicts) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_sections_options defaults = batten_sections_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, surface, opt, out);
  if (st >= 0) st = check_plane(ctx, surface, opt->normal);
  if (st < 0) return st;
  sections_plan plan;
  sections_plan_make(surface, opt->normal, &plan);
  job j = {.plan = &plan, .opt = opt};
  st = plan_job(ctx, &j);
  if (st >= 0) st = run(ctx, &j, tasks_of(j.pairs, LOOK), look_at_some, 0);
  if (st >= 0) {
    find_open(&j);
    st = run(ctx, &j, tasks_of(j.open_count, PROVE), prove_some, 0.5);
  }
  if (st >= 0) st = batten_progress(ctx, "certify", 1);
  if (st >= 0) *out = report(&j, verdicts);
  free_job(ctx, &j);
  return st;
}
