/* Solids through sections: the order of things, and the handle. See <batten/stack.h>; the map is section_inner.h. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "section/section_inner.h"

#include <batten/mesh.h>

/* ---- the form ------------------------------------------------------------------------------------- */

/* A stack as the state of a solid, with what its parts point to. */
typedef struct stack_state {
  stack s; /* first: a pointer to the state is one to the stack */
  batten_section_method method;
  batten_section *views;    /* [count] */
  batten_solid **functions; /* [count] not retained again */
  double *numbers;          /* [3 count] parameters, scales, saturations */
  size_t (*starts)[2];      /* [count] of sections that are but points */
} stack_state;

static void release(void *state) {
  stack_state *t = state;
  batten_context *ctx = t->s.ctx;
  stack_release(&t->s);
  batten_free(ctx, t->views);
  batten_free(ctx, t->functions);
  batten_free(ctx, t->numbers);
  batten_free(ctx, t->starts);
  batten_free(ctx, t);
}

static batten_status evaluate(const void *state, batten_context *ctx, size_t count, const double *points,
                              double *values, double *gradients, double *hessians) {
  const stack *s = state;
  (void)hessians; /* differences, by the solid */
  return s->parallel ? stack_parallel_evaluate(s, ctx, count, points, values, gradients)
                     : stack_swept_evaluate(s, ctx, count, points, values, gradients);
}

static batten_status bounds(const void *state, batten_context *ctx, size_t count, const double *boxes,
                            double *ranges) {
  const stack *s = state;
  return s->parallel ? stack_parallel_bounds(s, ctx, count, boxes, ranges)
                     : stack_swept_bounds(s, ctx, count, boxes, ranges);
}

const solid_form stack_form = {
    .kind = BATTEN_SOLID_STACK, .order = 1, .evaluate = evaluate, .bounds = bounds, .release = release};

/* ---- from sections to a solid ------------------------------------------------------------------------ */

/* An apex has closed the solid already. */
static void close_apexes(stack *s) {
  for (size_t e = 0; e < 2; e++)
    if (s->sections[e ? s->count - 1 : 0].apex_count) {
      s->ends[e] = BATTEN_END_PLANE;
      s->end_lengths[e] = 0;
    }
}

/* How far an end goes on beyond its plane, as far as that is finite. */
static double end_reach(const stack *s, size_t e) { return s->ends[e] == BATTEN_END_OPEN ? 0 : s->end_lengths[e]; }

/* What is made of sections and functions alone. */
static batten_status prepare(batten_context *ctx, stack *s) {
  double *t = batten_alloc_array(ctx, s->count, sizeof *t);
  if (!t) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) t[i] = s->sections[i].t;
  batten_status st = stack_weights_make(ctx, s->between, s->shape, s->count, t, &s->weights);
  if (st >= 0 && !s->parallel) st = stack_path_make(ctx, s, &s->path);
  if (st >= 0) st = stack_end_prepare(ctx, s);
  batten_free(ctx, t);
  return st;
}

static void lift(const stack_section *c, const double *x, double along, double *out) {
  for (size_t k = 0; k < 3; k++)
    out[k] = c->origin[k] + x[0] * c->rotation[0][k] + x[1] * c->rotation[1][k] + along * c->rotation[2][k];
}

/* The points by which a section is known: of its loops, its apex, or its function. */
static const double *section_points(const stack_state *t, const stack_section *c, size_t *count) {
  *count = c->apex_count;
  if (c->apex_count) return c->apex[0];
  if (t->method != BATTEN_SECTION_PAIRS) return batten_solid_points(c->function, count);
  *count = c->loops.starts[c->loops.count];
  return c->loops.points;
}

/* Seeds are the points of all sections; the box holds them and what the ends add. */
static batten_status wrap(batten_context *ctx, stack_state *t, batten_solid **out) {
  stack *s = &t->s;
  size_t total = 0, count, next = 0;
  for (size_t i = 0; i < s->count; i++) {
    section_points(t, s->sections + i, &count);
    total += count;
  }
  double *points = batten_alloc_array(ctx, total, 3 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  unsigned depth = 0;
  for (size_t i = 0; i < s->count; i++) {
    const stack_section *c = s->sections + i;
    const double *x = section_points(t, c, &count);
    double below = i == 0 ? end_reach(s, 0) : 0, above = i + 1 == s->count ? end_reach(s, 1) : 0;
    if (c->function && batten_solid_depth(c->function) > depth) depth = batten_solid_depth(c->function);
    for (size_t j = 0; j < count; j++, next++) {
      double ends[2][3];
      lift(c, x + 2 * j, 0, points + 3 * next);
      lift(c, x + 2 * j, -below, ends[0]);
      lift(c, x + 2 * j, above, ends[1]);
      for (size_t k = 0; k < 3; k++) {
        lower[k] = fmin(lower[k], fmin(ends[0][k], ends[1][k]));
        upper[k] = fmax(upper[k], fmax(ends[0][k], ends[1][k]));
      }
    }
  }
  batten_status st = batten_solid_make(ctx, &stack_form, t, 3, depth + 1, lower, upper, total, points, out);
  batten_free(ctx, points);
  return st;
}

static batten_status new_state(batten_context *ctx, stack_state **out) {
  stack_state *t = batten_alloc(ctx, sizeof *t);
  if (!t) return BATTEN_E_NOMEM;
  memset(t, 0, sizeof *t);
  t->s.ctx = ctx;
  *out = t;
  return BATTEN_OK;
}

/* Parts that batten_stack_get_parts hands out. */
static batten_status make_views(batten_context *ctx, stack_state *t) {
  stack *s = &t->s;
  t->views = batten_alloc_array(ctx, s->count, sizeof *t->views);
  t->functions = batten_alloc_array(ctx, s->count, sizeof(batten_solid *));
  t->numbers = batten_alloc_array(ctx, s->count, 3 * sizeof *t->numbers);
  t->starts = batten_alloc_array(ctx, s->count, sizeof *t->starts);
  if (!t->views || !t->functions || !t->numbers || !t->starts) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) {
    stack_section *c = s->sections + i;
    batten_section *v = t->views + i;
    memcpy(v->origin, c->origin, sizeof v->origin);
    memcpy(v->rotation, c->rotation, sizeof v->rotation);
    v->points = section_points(t, c, &t->starts[i][1]);
    t->starts[i][0] = 0;
    bool loops = !c->apex_count && t->method == BATTEN_SECTION_PAIRS;
    v->contour_count = loops ? c->loops.count : 1;
    v->starts = loops ? c->loops.starts : t->starts[i];
    t->functions[i] = c->function;
    t->numbers[i] = c->t;
    t->numbers[s->count + i] = c->scale;
    t->numbers[2 * s->count + i] = c->saturation;
  }
  return BATTEN_OK;
}

/* ---- build ------------------------------------------------------------------------------------------ */

/* Does the moving plane have a way through sections whose planes cross? Neighbours must look the same way to 30
 * degrees, and the middle of each lie ahead of the one before: through crossing cuts in no sequence there is none. */
static bool has_sequence(const stack *s) {
  const double cos_limit = 0.86602540378443864676;
  for (size_t i = 0; i + 1 < s->count; i++) {
    const stack_section *pair = s->sections + i;
    double middle[2][3], dot = 0, ahead[2] = {0, 0};
    for (size_t e = 0; e < 2; e++) {
      const polygon_set *p = &pair[e].loops;
      double x[2] = {0, 0};
      if (p->count > 0) {
        x[0] = p->lower[0] + (p->upper[0] - p->lower[0]) / 2;
        x[1] = p->lower[1] + (p->upper[1] - p->lower[1]) / 2;
      }
      lift(pair + e, x, 0, middle[e]);
    }
    for (size_t k = 0; k < 3; k++) {
      dot += pair[0].rotation[2][k] * pair[1].rotation[2][k];
      for (size_t e = 0; e < 2; e++) ahead[e] += pair[e].rotation[2][k] * (middle[1][k] - middle[0][k]);
    }
    if (dot < cos_limit || !(ahead[0] > 0) || !(ahead[1] > 0)) return false;
  }
  return true;
}

/* What the sections' own figures come to. */
static batten_status sum_up(const stack *s, const section_figures *figures, batten_stack_info *info,
                            stack_notes *notes) {
  batten_status worst = BATTEN_OK, st = BATTEN_OK;
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    const section_figures *f = figures + i;
    info->certified += f->certified || s->sections[i].apex_count > 0;
    info->centers += f->centers;
    info->section_residual_max = fmax(info->section_residual_max, f->residual_max);
    info->wrong_sign_max = fmax(info->wrong_sign_max, f->wrong_sign_max);
    if (f->status > 0 && worst == BATTEN_OK) worst = f->status;
    if (!f->certified && s->sections[i].loops.count > 0)
      st = stack_note_add(
          notes, (batten_stack_note){
                     .kind = BATTEN_NOTE_UNCERTIFIED, .section = i, .other = SIZE_MAX, .value = f->wrong_sign_max});
  }
  return st < 0 ? st : worst;
}

static void count_loops(const stack *s, size_t count, const batten_section *given, batten_stack_info *info) {
  info->sections = s->count;
  info->parallel = s->parallel;
  info->spacing = s->spacing;
  info->gap = s->gap;
  for (size_t i = 0; i < count; i++) {
    const polygon_set *p = &s->sections[i].loops;
    info->points_given += given[i].starts[given[i].contour_count] - given[i].starts[0];
    info->contours += s->sections[i].apex_count ? 1 : p->count;
    for (size_t k = 0; k < p->count; k++) info->holes += p->depth[k] % 2;
  }
}

/* Loops of a section that is known by points in no order: where its function is 0. */
static batten_status trace_loops(batten_context *ctx, stack *s, size_t i) {
  stack_section *c = s->sections + i;
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_field field = batten_solid_field(c->function);
  batten_outline *outline = NULL;
  size_t seeds, total = 0, loops = 0, *starts = NULL;
  double *points = NULL;
  const double *at = batten_solid_points(c->function, &seeds);
  o.cell = s->spacing / 2;
  batten_status st = batten_trace_outline(ctx, &field, seeds, at, &o, &outline, NULL);
  if (st < 0) return st;
  size_t given = batten_outline_loop_count(outline);
  for (size_t k = 0, count; k < given; k++) total += batten_outline_loop(outline, k, &count, NULL) ? count : 0;
  starts = batten_alloc_array(ctx, given + 1, sizeof *starts);
  points = batten_alloc_array(ctx, total, 2 * sizeof *points);
  st = starts && points ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t k = 0, next = 0; st >= 0 && k < given; k++) {
    size_t count;
    int closed;
    const double *loop = batten_outline_loop(outline, k, &count, &closed);
    starts[loops] = next;
    if (!closed) continue; /* the box cut it: far from all points */
    memcpy(points + 2 * next, loop, count * 2 * sizeof *points);
    starts[++loops] = next += count;
  }
  polygon_fault fault;
  if (st >= 0) st = polygon_set_make(ctx, loops, starts, points, 0, &c->loops, NULL, &fault);
  if (st == BATTEN_E_INVALID)
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "sections[%zu]: the outline through its points crosses itself near (%g, %g); give more points "
                     "there, or contours in order",
                     i, fault.at[0], fault.at[1]);
  batten_free(ctx, points);
  batten_free(ctx, starts);
  batten_outline_free(outline);
  return st;
}

/* Functions of all sections, and what they tell. */
static batten_status fit_sections(batten_context *ctx, stack_state *t, const batten_section *sections,
                                  const batten_stack_options *o, batten_stack_info *info, stack_notes *notes) {
  stack *s = &t->s;
  section_figures *figures = batten_alloc_array(ctx, s->count, sizeof *figures);
  if (!figures) return BATTEN_E_NOMEM;
  memset(figures, 0, s->count * sizeof *figures);
  double start = batten_now();
  batten_status worst = BATTEN_OK, st = stack_fit_all(ctx, s, sections, o, info->tolerance, figures);
  info->time_fit_s = batten_now() - start;
  if (st >= 0) st = worst = sum_up(s, figures, info, notes);
  for (size_t i = 0; st >= 0 && o->method != BATTEN_SECTION_PAIRS && i < s->count; i++)
    if (s->sections[i].function) st = trace_loops(ctx, s, i);
  batten_free(ctx, figures);
  return st < 0 ? st : worst;
}

/* Sections, each with its function, as one solid, whose state t becomes. */
static batten_status join_sections(batten_context *ctx, stack_state *t, const batten_stack_options *o,
                                   batten_stack_info *info, stack_notes *notes, batten_solid **out) {
  stack *s = &t->s;
  batten_status st = stack_find_components(ctx, s, o->link != 0, notes, &info->pieces, &info->non_overlaps);
  if (st >= 0) info->links = s->link_count;
  if (st >= 0) st = prepare(ctx, s);
  if (st >= 0) info->rotation_drift = s->path ? stack_path_drift(s->path) : 0;
  if (st >= 0) st = make_views(ctx, t);
  if (st >= 0) st = wrap(ctx, t, out);
  return st;
}

static batten_status tell(batten_context *ctx, const batten_stack_options *o, const batten_stack_info *info,
                          batten_status worst) {
  if (info->certified < info->sections && info->route == BATTEN_ROUTE_SECTIONS && o->method != BATTEN_SECTION_PAIRS)
    return batten_fail(
        ctx, BATTEN_W_AMBIGUOUS,
        "sections: the points of %zu of %zu do not settle which side of them is inside; give contours in "
        "their order, or more points",
        info->sections - info->certified, info->sections);
  if (info->certified < info->sections && info->route == BATTEN_ROUTE_SECTIONS && info->tolerance > 0)
    return batten_fail(
        ctx, BATTEN_W_AMBIGUOUS,
        "sections: %zu of %zu are not certified, wrong signs were found up to %g deep, %g allowed; give more "
        "points there, or a larger opt.tolerance",
        info->sections - info->certified, info->sections, info->wrong_sign_max, info->tolerance);
  if (info->crossings && info->route == BATTEN_ROUTE_SECTIONS)
    return batten_fail(ctx, BATTEN_W_AMBIGUOUS,
                       "sections: the planes of %zu pairs cross within both; the solid is the union of all that the "
                       "moving plane sweeps",
                       info->crossings);
  return worst;
}

batten_status batten_stack_build(batten_context *ctx, size_t count, const batten_section *sections,
                                 const batten_stack_options *opt, batten_solid **out, batten_stack_info *info,
                                 batten_stack_note **notes, size_t *note_count) {
  batten_stack_options o = opt ? *opt : batten_stack_options_default();
  batten_stack_info f = {0};
  stack_notes told = {.ctx = ctx};
  stack_state *t = NULL;
  batten_solid *solid = NULL;
  double start = batten_now();
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (notes && !note_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "note_count: NULL; give the place for how many notes there are");
  batten_status worst = BATTEN_OK, st = stack_check_options(ctx, count, &o);
  if (st >= 0) st = new_state(ctx, &t);
  if (st >= 0) st = stack_take_sections(ctx, count, sections, &o, &t->s, &told);
  if (st < 0) goto done;
  t->method = o.method;
  close_apexes(&t->s);
  f.tolerance = stack_tolerance(&t->s, &o);
  f.contours_dropped = told.count;
  worst = st = fit_sections(ctx, t, sections, &o, &f, &told);
  if (st < 0) goto done;
  count_loops(&t->s, count, sections, &f);
  if (!t->s.parallel) st = stack_find_crossings(ctx, &t->s, &told, &f.crossings);
  if (st < 0) goto done;
  f.route = o.route;
  if (o.route == BATTEN_ROUTE_AUTO)
    f.route = f.crossings && !has_sequence(&t->s) ? BATTEN_ROUTE_SPACE : BATTEN_ROUTE_SECTIONS;
  bool ordered = o.method == BATTEN_SECTION_PAIRS;
  st = f.route == BATTEN_ROUTE_SPACE ? stack_fit_space(ctx, &t->s, ordered, o.pair_distance, &solid, &f.centers)
                                     : join_sections(ctx, t, &o, &f, &told, &solid);
  if (st > 0 && worst == BATTEN_OK) worst = st;
  if (st < 0) goto done;
  if (f.route == BATTEN_ROUTE_SECTIONS) t = NULL; /* the solid's */
  f.time_total_s = batten_now() - start;
  st = tell(ctx, &o, &f, worst);
  *out = solid;
  if (info) *info = f;
  if (notes) {
    *notes = told.items;
    *note_count = told.count;
    told.items = NULL;
  }
done:
  if (t) release(t);
  batten_free(ctx, told.items);
  return st;
}

/* ---- parts ------------------------------------------------------------------------------------------- */

batten_status batten_stack_get_parts(batten_context *ctx, const batten_solid *solid, batten_stack_parts *parts) {
  if (!solid || !parts) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give one", solid ? "parts" : "solid");
  const stack_state *t = batten_solid_state(solid, &stack_form);
  if (!t) return batten_fail(ctx, BATTEN_E_INVALID, "solid: not of sections; give one of batten_stack_build");
  const stack *s = &t->s;
  *parts = (batten_stack_parts){.struct_size = sizeof *parts,
                                .count = s->count,
                                .sections = t->views,
                                .functions = t->functions,
                                .parameters = t->numbers,
                                .scales = t->numbers + s->count,
                                .saturations = t->numbers + 2 * s->count,
                                .angular_velocity = s->angular_velocity,
                                .method = t->method,
                                .between = s->between,
                                .shape = s->shape,
                                .ends = {s->ends[0], s->ends[1]},
                                .end_lengths = {s->end_lengths[0], s->end_lengths[1]},
                                .rotation = s->rotation,
                                .path = s->path_kind,
                                .parameter = s->parameter,
                                .link_count = s->link_count,
                                .links = s->links};
  return BATTEN_OK;
}

static batten_status take_functions(batten_context *ctx, const batten_stack_parts *p, stack_state *t) {
  stack *s = &t->s;
  for (size_t i = 0; i < s->count; i++) {
    bool apex = s->sections[i].apex_count > 0;
    if (apex != !p->functions[i] || (!apex && batten_solid_dimension(p->functions[i]) != 2))
      return batten_fail(ctx, BATTEN_E_INVALID, "functions[%zu]: %s; give %s", i,
                         p->functions[i] ? "not in the plane, or of an apex" : "NULL",
                         apex ? "NULL, the section is an apex" : "a solid of dimension 2");
    if (!(p->saturations[i] > 0))
      return batten_fail(ctx, BATTEN_E_INVALID, "saturations[%zu]: %g; give a positive number", i, p->saturations[i]);
  }
  for (size_t e = 0; e < 2; e++)
    if (!(p->end_lengths[e] >= 0) || isinf(p->end_lengths[e]))
      return batten_fail(ctx, BATTEN_E_INVALID, "end_lengths[%zu]: %g; give a length >= 0", e, p->end_lengths[e]);
  for (size_t i = 0; i < s->count; i++) {
    s->sections[i].function = batten_solid_retain(p->functions[i]);
    s->sections[i].saturation = p->saturations[i];
  }
  for (size_t e = 0; e < 2; e++) s->end_lengths[e] = p->end_lengths[e];
  t->method = p->method;
  return BATTEN_OK;
}

static batten_status take_links(batten_context *ctx, const batten_stack_parts *p, stack *s) {
  for (size_t k = 0; k < p->link_count; k++)
    for (size_t e = 0; e < 2; e++) {
      const batten_stack_link *l = p->links + k;
      const polygon_set *loops = l->section + 1 < s->count ? &s->sections[l->section + e].loops : NULL;
      if (!loops || l->loop[e] >= loops->count || loops->depth[l->loop[e]] % 2 ||
          (k > 0 && l->section < l[-1].section))
        return batten_fail(
            ctx, BATTEN_E_INVALID,
            "links[%zu]: section %zu, loops %zu and %zu; give outer loops, links by ascending sections", k,
            l->section, l->loop[0], l->loop[1]);
    }
  if (p->link_count == 0) return BATTEN_OK;
  s->links = batten_alloc_array(ctx, p->link_count, sizeof *s->links);
  if (!s->links) return BATTEN_E_NOMEM;
  memcpy(s->links, p->links, p->link_count * sizeof *s->links);
  s->link_count = p->link_count;
  return BATTEN_OK;
}

/* The options by which stack_take_sections makes the same of the sections as it did before. */
static batten_stack_options options_of(const batten_stack_parts *p) {
  batten_stack_options o = batten_stack_options_default();
  o.method = p->method;
  o.min_area = 1e-300;
  o.apex = 1;
  o.between = p->between;
  o.shape = p->shape;
  o.scales = p->scales;
  o.gap = p->count == 1 ? 1 : 0; /* end lengths and saturations are given */
  o.rotation = p->rotation;
  o.path = p->path;
  o.parameter = p->parameter;
  o.parameters = p->parameters;
  o.angular_velocity = p->angular_velocity;
  for (size_t e = 0; e < 2; e++) o.ends[e] = p->ends[e];
  return o;
}

batten_status batten_stack_create(batten_context *ctx, const batten_stack_parts *parts, batten_solid **out) {
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (!parts) return batten_fail(ctx, BATTEN_E_INVALID, "parts: NULL; give the parts");
  batten_status st = batten_check_struct(ctx, "batten_stack_parts", parts->struct_size, sizeof *parts);
  if (st < 0) return st;
  if (!parts->functions || !parts->parameters || !parts->scales || !parts->saturations ||
      (parts->link_count && !parts->links))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "parts: functions, parameters, scales, saturations or links are NULL; give arrays");
  batten_stack_options o = options_of(parts);
  stack_notes told = {.ctx = ctx};
  stack_state *t = NULL;
  st = stack_check_options(ctx, parts->count, &o);
  if (st >= 0) st = new_state(ctx, &t);
  if (st >= 0) st = stack_take_sections(ctx, parts->count, parts->sections, &o, &t->s, &told);
  if (st >= 0 && told.count > 0)
    st = batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu]: contour %zu has no area; leave it out",
                     told.items[0].section, told.items[0].contour);
  if (st >= 0) close_apexes(&t->s);
  if (st >= 0) st = take_functions(ctx, parts, t);
  for (size_t i = 0; st >= 0 && parts->method != BATTEN_SECTION_PAIRS && i < t->s.count; i++)
    if (t->s.sections[i].function) st = trace_loops(ctx, &t->s, i);
  if (st >= 0) st = take_links(ctx, parts, &t->s);
  if (st >= 0) st = prepare(ctx, &t->s);
  if (st >= 0) st = make_views(ctx, t);
  if (st >= 0) st = wrap(ctx, t, out);
  if (st < 0 && t) release(t);
  batten_free(ctx, told.items);
  return st < 0 ? st : BATTEN_OK;
}
