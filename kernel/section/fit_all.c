/* All sections of a stack, on the context's threads.
 *
 * Sections know nothing of each other. As many workers as there are threads take them one after the other; each works
 * in an arena of its own (base/arena.h) and leaves the numbers of the spline in a room that the calling thread took;
 * the calling thread makes the solids of them. How much an arena and a room must hold is a guess from the points and
 * the tolerance. What failed, for want of memory or for any other reason, is done again with the caller's context, so
 * that the guess decides about time alone, and errors have their text.
 *
 * Points in no order are fitted on the calling thread: their solids come with carriers of many kinds, and
 * batten_solid_fit has loops of its own on the threads. */
#include "base/arena.h"
#include "base/checked.h"
#include "section/section_inner.h"

#include <stdatomic.h>
#include <string.h>

enum {
  WAVE = 8,          /* sections for each worker between two calls of the host's progress callback */
  CENTERS_MAX = 6000 /* 150 MB; larger ones are better done with all threads of BLAS */
};

/* What a worker leaves of a section. */
typedef struct section_room {
  size_t capacity; /* centres */
  double *numbers; /* [capacity] centres [2], coefficients, points [2] */
  size_t count, point_count;
  double polynomial[3], origin[2], scale;
  section_figures figures;
  bool done;
} section_room;

typedef struct fit_all {
  batten_context *ctx;
  stack *s;
  double tolerance, pair_distance;
  section_figures *figures;
  size_t workers;
  batten_arena **arenas; /* [workers] */
  section_room *rooms;   /* [sections of a wave] */
  size_t first, last;    /* of the wave */
  atomic_size_t next;
} fit_all;

/* ---- what it takes ------------------------------------------------------------------------------- */

/* Measured: 1.4 centres a point with a tolerance of a tenth of the spacing, 7 with a hundredth. */
static double factor_of(const fit_all *a, const polygon_set *p) { return 1 + 0.1 * p->spacing / a->tolerance; }

static size_t guess_centers(const fit_all *a, const polygon_set *p) {
  double guess = 64 + factor_of(a, p) * (double)p->starts[p->count];
  return guess < CENTERS_MAX ? (size_t)guess : CENTERS_MAX;
}

/* Beside the system: grids, and some three places a point, each looked at with some twenty beside it. */
static size_t guess_bytes(const fit_all *a, const polygon_set *p) {
  double places = fmin(3 * factor_of(a, p) * (double)p->starts[p->count], 65536);
  size_t system = batten_spline_bytes(BATTEN_SADDLE_CHOLESKY, 2, 2, guess_centers(a, p), 0), all;
  return batten_add(system, 1000000 + (size_t)(1000 * places), &all) ? all : SIZE_MAX;
}

static bool has_loops(const fit_all *a, size_t i) { return a->s->sections[i].loops.count > 0; }

/* As many arenas as can be had: with none, everything is done by the calling thread. */
static batten_status take_arenas(fit_all *a) {
  size_t bytes = 0, wanted = batten_workers(a->ctx), sections = 0;
  for (size_t i = 0; i < a->s->count; i++)
    if (has_loops(a, i)) {
      size_t own = guess_bytes(a, &a->s->sections[i].loops);
      if (own > bytes) bytes = own;
      sections++;
    }
  if (wanted > sections) wanted = sections;
  a->arenas = batten_alloc_array(a->ctx, wanted, sizeof(batten_arena *));
  if (!a->arenas) return BATTEN_E_NOMEM;
  while (a->workers < wanted) {
    batten_status st = batten_arena_new(a->ctx, bytes, &a->arenas[a->workers]);
    if (st < 0) return batten_expect(a->ctx, st, BATTEN_E_NOMEM);
    a->workers++;
  }
  return BATTEN_OK;
}

static void free_rooms(fit_all *a) {
  for (size_t i = a->first; a->rooms && i < a->last; i++) batten_free(a->ctx, a->rooms[i - a->first].numbers);
  batten_free(a->ctx, a->rooms);
  a->rooms = NULL;
}

static batten_status take_rooms(fit_all *a) {
  a->rooms = batten_alloc_array(a->ctx, a->last - a->first, sizeof *a->rooms);
  if (!a->rooms) return BATTEN_E_NOMEM;
  for (size_t i = a->first; i < a->last; i++) a->rooms[i - a->first] = (section_room){0};
  for (size_t i = a->first; i < a->last; i++) {
    section_room *room = &a->rooms[i - a->first];
    if (!has_loops(a, i)) continue;
    room->capacity = guess_centers(a, &a->s->sections[i].loops);
    room->numbers = batten_alloc_array(a->ctx, room->capacity, 5 * sizeof *room->numbers);
    if (!room->numbers) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

/* ---- fits ---------------------------------------------------------------------------------------- */

static void leave(const batten_solid *solid, section_room *room) {
  batten_spline_parts parts;
  batten_spline_get_parts(batten_solid_spline(solid), &parts);
  const double *points = batten_solid_points(solid, &room->point_count);
  if (parts.count > room->capacity) return;
  double *to = room->numbers;
  memcpy(to, parts.centers, parts.count * 2 * sizeof *to);
  memcpy(to + 2 * parts.count, parts.coefficients, parts.count * sizeof *to);
  memcpy(to + 3 * parts.count, points, room->point_count * 2 * sizeof *to);
  memcpy(room->polynomial, parts.polynomial, sizeof room->polynomial);
  memcpy(room->origin, parts.origin, sizeof room->origin);
  room->scale = parts.scale;
  room->count = parts.count;
  room->done = true;
}

static void fit_task(void *arg, size_t worker) {
  fit_all *a = arg;
  for (size_t i; (i = atomic_fetch_add(&a->next, 1)) < a->last;) {
    section_room *room = &a->rooms[i - a->first];
    batten_context *own = has_loops(a, i) ? batten_arena_context(a->arenas[worker]) : NULL;
    batten_solid *solid = NULL;
    if (own && section_fit_proven(own, &a->s->sections[i].loops, a->tolerance, a->pair_distance, &solid,
                                  &room->figures) >= 0)
      leave(solid, room);
    batten_solid_free(solid);
  }
}

static batten_status make_solid(fit_all *a, const section_room *room, const polygon_set *loops, batten_solid **out) {
  batten_carrier *none = NULL;
  batten_spline *spline = NULL;
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = 2,
                               .m = 2,
                               .count = room->count,
                               .centers = room->numbers,
                               .coefficients = room->numbers + 2 * room->count,
                               .polynomial_count = 3,
                               .polynomial = room->polynomial,
                               .origin = {room->origin[0], room->origin[1], 0},
                               .scale = room->scale};
  batten_status st = batten_spline_create(a->ctx, &parts, &spline);
  if (st >= 0) st = batten_carrier_none(a->ctx, 2, &none);
  if (st >= 0)
    st = batten_solid_create(a->ctx, spline, none, 1, loops->lower, loops->upper, room->point_count,
                             room->numbers + 3 * room->count, out);
  batten_carrier_free(none);
  batten_spline_free(spline);
  return st;
}

static batten_status name_section(batten_context *ctx, size_t i, batten_status st) {
  if (st >= 0 || st == BATTEN_E_CANCELLED) return st;
  return batten_fail(ctx, st, "sections[%zu]: %s", i, batten_error(ctx));
}

/* What the workers left becomes solids; what they did not is done here. */
static batten_status collect(fit_all *a) {
  for (size_t i = a->first; i < a->last; i++) {
    stack_section *section = &a->s->sections[i];
    const section_room *room = &a->rooms[i - a->first];
    batten_status st = BATTEN_OK;
    if (!has_loops(a, i)) continue;
    a->figures[i] = room->figures;
    if (room->done)
      st = make_solid(a, room, &section->loops, &section->function);
    else
      st = section_fit_proven(a->ctx, &section->loops, a->tolerance, a->pair_distance, &section->function,
                              &a->figures[i]);
    if (st < 0) return name_section(a->ctx, i, st);
  }
  return BATTEN_OK;
}

static batten_status fit_wave(fit_all *a) {
  batten_status st = take_rooms(a);
  atomic_init(&a->next, a->first);
  if (st >= 0) batten_parallel(a->ctx, a->workers, fit_task, a);
  if (st >= 0) st = collect(a);
  free_rooms(a);
  return st;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

static batten_status in_waves(fit_all *a) {
  const size_t count = a->s->count, each = WAVE * (a->workers ? a->workers : 1);
  for (a->first = 0; a->first < count; a->first = a->last) {
    batten_status st = batten_progress(a->ctx, "sections", (double)a->first / (double)count);
    if (st < 0) return st;
    a->last = count - a->first < each ? count : a->first + each;
    if ((st = fit_wave(a)) < 0) return st;
  }
  return BATTEN_OK;
}

static batten_status fit_unordered(batten_context *ctx, stack *s, const batten_section *given,
                                   batten_section_method method, section_figures *figures) {
  for (size_t i = 0; i < s->count; i++) {
    if (s->sections[i].apex_count) continue;
    batten_status st = batten_progress(ctx, "sections", (double)i / (double)s->count);
    if (st >= 0)
      st = name_section(ctx, i,
                        section_fit_points(ctx, method, given[i].starts[given[i].contour_count], given[i].points,
                                           &s->sections[i].function, &figures[i]));
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

batten_status stack_fit_all(batten_context *ctx, stack *s, const batten_section *given,
                            const batten_stack_options *opt, double tolerance, section_figures *figures) {
  for (size_t i = 0; i < s->count; i++) figures[i] = (section_figures){0};
  if (opt->method != BATTEN_SECTION_PAIRS) return fit_unordered(ctx, s, given, opt->method, figures);
  fit_all a = {.ctx = ctx, .s = s, .tolerance = tolerance, .pair_distance = opt->pair_distance, .figures = figures};
  batten_status st = take_arenas(&a);
  if (st >= 0) st = in_waves(&a);
  while (a.workers > 0) batten_arena_free(ctx, a.arenas[--a.workers]);
  batten_free(ctx, a.arenas);
  return st;
}
