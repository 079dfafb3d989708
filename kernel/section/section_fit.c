/* One section's function F: > 0 in the area of its loops, < 0 outside, slope 1 across them.
 *                                                                        [Savchenko et al. 1995, section 4]
 *
 * A volume spline with r^2 ln r through points of the loops alone, under a carrier, fills concave parts with
 * phantoms; points in their order say more: which side is in, and how far away everything is. So a centre on a loop
 * (F = 0) comes with two beside it, which take the exact signed distance to the polygons, and circles of them far
 * around keep F down there.
 *
 * Not every vertex needs a centre, but leaving out those of a smooth stretch is no way to find which: an interpolant
 * bulges between centres far apart whatever the data are like. The choice is greedy: every twelfth place along a
 * loop; then, as long as the curve F = 0 misses a place by more than the tolerance, the places of worst miss, some
 * way apart. Then the same for the sign: places off the loops at which it is wrong, deeper than the tolerance, become
 * centres. */
#include "base/checked.h"
#include "section/places.h"
#include "section/section_inner.h"

#include <stdlib.h>
#include <string.h>

enum {
  START_STRIDE = 12, /* places, about four edges */
  START_LEAST = 8,   /* centres of a loop, if it has as many places ... */
  START_MOST = 64,   /* ... and no more, however dense its points are */
  ROUND_MOST = 40,   /* new places of a round, or a quarter of those there are */
  ROUNDS = 40,       /* 3 to 7 are usual */
  SIGN_ROUNDS = 8,
  CENTERS_MAX = 6000, /* of all: seconds and 150 MB; what is missed then, the proof tells */
  FAR = 16,           /* places on each of */
  FAR_CIRCLES = 2,
  REPAIRS = 5, /* fits after the first that the judge's places are given to */
  SIGN_CELLS = 48
};
static const double PART = 0.9;      /* of the tolerance is aimed at, since other places than ours are judged */
static const double STEP = 0.35;     /* of places, in edges ... */
static const double STEP_MAX = 3.5;  /* ... and in tolerances */
static const double APART = 1.25;    /* new places of a round, in edges ... */
static const double APART_MAX = 40;  /* ... and in tolerances, for edges that are long beside it */
static const double MEET = 0.05;     /* of its pair distance: a centre nearer than this to another is left out */
static const double SLOPE_MIN = 0.3; /* where F is flatter than this the miss counts as if it were not */
static const double FAR_RADII[FAR_CIRCLES] = {3, 30}; /* half diagonals of the box */
static const double FAR_PART = 0.5;                   /* of the distance there */
static const double SIGN_SHIFT = 0.5;                 /* of the grid, in cells */
static const double HINT_PART = 0.9;                  /* of the tolerance: less deep signs are let be */
static const double SIGN_NEAR = 1.25;                 /* of the places nearest to the loops, in tolerances */

typedef struct section_fit {
  batten_context *ctx;
  const polygon_set *loops;
  double tolerance; /* PART of the caller's */
  double pair_distance;
  loop_places places;
  size_t *loop;                 /* [places] */
  unsigned char *used;          /* [places] */
  double *f, *df, *misses;      /* [places], [places][2], [places] */
  struct candidate *candidates; /* [places] */
  size_t count, capacity;       /* centres */
  double *points, *values;      /* [capacity][2], [capacity] of F */
  batten_spline *spline;        /* of -F: a solid is minus its spline */
  batten_status status;         /* of the last fit */
  unsigned rounds;              /* of all so far */
} section_fit;

/* ---- centres ------------------------------------------------------------------------------------- */

static batten_status reserve(section_fit *s, size_t more) {
  size_t wanted = s->count + more;
  if (wanted <= s->capacity) return BATTEN_OK;
  wanted += wanted / 2;
  double *points = batten_realloc_array(s->ctx, s->points, wanted, 2 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  s->points = points;
  double *values = batten_realloc_array(s->ctx, s->values, wanted, sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  s->values = values;
  s->capacity = wanted;
  return BATTEN_OK;
}

static bool meets_another(const section_fit *s, const double *x, double distance) {
  for (size_t i = 0; i < s->count; i++) {
    double dx = s->points[2 * i] - x[0], dy = s->points[2 * i + 1] - x[1];
    if (dx * dx + dy * dy <= distance * distance) return true;
  }
  return false;
}

static bool is_full(const section_fit *s) { return s->count + 3 >= CENTERS_MAX; }

/* Room is there. */
static void add(section_fit *s, const double *x, double value) {
  memcpy(s->points + 2 * s->count, x, 2 * sizeof *x);
  s->values[s->count++] = value;
}

/* The centre beside place i, out of the area (side = 1) or in it (-1): as far off as the loop's edges let it lie on
 * its side, no nearer to another part of the loops than half its offset, or half as far, and so on; none in parts as
 * thin as the tolerance. */
static void add_beside(section_fit *s, size_t i, int side) {
  double offset = s->pair_distance * s->places.edge[s->loop[i]];
  for (; offset >= 0.5 * s->tolerance; offset /= 2) {
    double x[2];
    for (unsigned k = 0; k < 2; k++) x[k] = s->places.x[2 * i + k] + side * offset * s->places.outward[2 * i + k];
    double distance = polygon_distance(s->loops, x, NULL, NULL);
    if (-side * distance <= 0.5 * offset) continue;
    if (!meets_another(s, x, MEET * offset)) add(s, x, distance);
    return;
  }
}

static batten_status add_place(section_fit *s, size_t i) {
  const double *x = s->places.x + 2 * i;
  s->used[i] = 1;
  batten_status st = reserve(s, 3);
  /* Loops may touch, and an edge may come back along another; a centre each would be nearly the same. */
  if (st < 0 || meets_another(s, x, fmin(0.1 * MEET * s->places.edge[s->loop[i]], 0.1 * s->tolerance))) return st;
  add(s, x, 0);
  add_beside(s, i, 1);
  add_beside(s, i, -1);
  return BATTEN_OK;
}

/* They keep F down far away, and leave it to the pairs near the loops: half of the distance three radii away is what
 * these come to there by themselves. The whole distance, or a nearer circle, bends F about the loops, which shows
 * between sections. Without the outer circle the spline's linear part, which a lean shape may turn up on one side,
 * gets the upper hand a hundred radii away. */
static batten_status add_far(section_fit *s) {
  const polygon_set *p = s->loops;
  const double size = 0.5 * hypot(p->upper[0] - p->lower[0], p->upper[1] - p->lower[1]);
  batten_status st = reserve(s, FAR * FAR_CIRCLES);
  for (unsigned i = 0; st >= 0 && i < FAR * FAR_CIRCLES; i++) {
    double angle = 2 * 3.141592653589793 * (i % FAR) / FAR, radius = FAR_RADII[i / FAR] * size;
    double x[2] = {0.5 * (p->lower[0] + p->upper[0]) + radius * cos(angle),
                   0.5 * (p->lower[1] + p->upper[1]) + radius * sin(angle)};
    add(s, x, FAR_PART * polygon_distance(p, x, NULL, NULL));
  }
  return st;
}

static batten_status add_first(section_fit *s) {
  batten_status st = add_far(s);
  for (size_t loop = 0; st >= 0 && loop < s->loops->count; loop++) {
    size_t first = s->places.starts[loop], count = s->places.starts[loop + 1] - first;
    size_t wanted = count / START_STRIDE > START_LEAST ? count / START_STRIDE : START_LEAST;
    if (wanted > START_MOST) wanted = START_MOST;
    if (wanted > count) wanted = count;
    for (size_t j = 0; st >= 0 && j < wanted && (j < START_LEAST || !is_full(s)); j++)
      st = add_place(s, first + j * (count / wanted) + j * (count % wanted) / wanted);
  }
  return st;
}

/* ---- rounds -------------------------------------------------------------------------------------- */

static batten_status fit_centers(section_fit *s) {
  batten_spline_data data = batten_spline_data_default();
  batten_spline_options options = batten_spline_options_default();
  double *values = batten_alloc_array(s->ctx, s->count, sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->count; i++) values[i] = -s->values[i];
  data.n = 2;
  data.count = s->count;
  data.points = s->points;
  data.values = values;
  options.loo_samples = 0;
  batten_spline *spline = NULL;
  batten_status st = batten_spline_fit(s->ctx, &data, &options, &spline, NULL);
  batten_free(s->ctx, values);
  if (st < 0) return st;
  batten_spline_free(s->spline);
  s->spline = spline;
  s->status = st;
  return BATTEN_OK;
}

typedef struct candidate {
  double miss;
  size_t at;
} candidate;

static int compare_candidates(const void *left, const void *right) {
  const candidate *a = left, *b = right;
  if (a->miss != b->miss) return a->miss < b->miss ? 1 : -1;
  return (a->at > b->at) - (a->at < b->at);
}

/* How far the curve misses every place that is no centre yet. */
static batten_status measure_misses(section_fit *s) {
  const loop_places *p = &s->places;
  batten_status st = batten_spline_evaluate(s->ctx, s->spline, p->count, p->x, s->f, s->df, NULL);
  for (size_t i = 0; st >= 0 && i < p->count; i++) {
    double slope = s->df[2 * i] * p->outward[2 * i] + s->df[2 * i + 1] * p->outward[2 * i + 1];
    s->misses[i] = s->used[i] ? 0 : fabs(s->f[i]) / fmax(fabs(slope), SLOPE_MIN);
  }
  return st;
}

/* The worst places become centres, some way apart from each other. *added = 0: none misses by more than the
 * tolerance.
 */
static batten_status add_worst(section_fit *s, size_t *added) {
  const double *x = s->places.x;
  const size_t quarter = s->count / 12, most = quarter > ROUND_MOST ? quarter : ROUND_MOST;
  size_t count = 0;
  *added = 0;
  for (size_t i = 0; i < s->places.count; i++)
    if (s->misses[i] > s->tolerance) s->candidates[count++] = (candidate){s->misses[i], i};
  if (count == 0) return BATTEN_OK;
  qsort(s->candidates, count, sizeof *s->candidates, compare_candidates);
  for (size_t c = 0; c < count && *added < most && !is_full(s); c++) {
    const size_t i = s->candidates[c].at;
    const double apart = fmin(APART * s->places.edge[s->loop[i]], APART_MAX * s->tolerance);
    bool free = true;
    for (size_t j = 0; j < *added && free; j++) {
      const size_t other = s->candidates[j].at;
      free = hypot(x[2 * i] - x[2 * other], x[2 * i + 1] - x[2 * other + 1]) >= apart;
    }
    if (!free) continue;
    batten_status st = add_place(s, i);
    if (st < 0) return st;
    s->candidates[(*added)++] = s->candidates[c]; /* the chosen ones go to the front */
  }
  return BATTEN_OK;
}

static batten_status follow_loops(section_fit *s) {
  size_t added = 1;
  for (; s->rounds < ROUNDS; s->rounds++) {
    batten_status st = fit_centers(s);
    if (st >= 0) st = measure_misses(s);
    if (st >= 0) st = add_worst(s, &added);
    if (st < 0 || added == 0) return st;
  }
  return fit_centers(s);
}

/* Wrong signs deeper than the tolerance, the deepest ones apart from each other, become centres with their distance.
 */
static batten_status add_wrong_signs(section_fit *s, size_t count, const double *x, size_t *added) {
  double *f = batten_alloc_array(s->ctx, count, sizeof *f);
  candidate *wrong = batten_alloc_array(s->ctx, count, sizeof *wrong);
  batten_status st = BATTEN_E_NOMEM;
  size_t found = 0;
  *added = 0;
  if (!f || !wrong) goto done;
  if ((st = batten_spline_evaluate(s->ctx, s->spline, count, x, f, NULL, NULL)) < 0) goto done;
  for (size_t i = 0; i < count; i++) {
    if (polygon_inside(s->loops, x + 2 * i) == (f[i] < 0)) continue;
    double depth = fabs(polygon_distance(s->loops, x + 2 * i, NULL, NULL));
    if (depth > s->tolerance) wrong[found++] = (candidate){depth, i};
  }
  qsort(wrong, found, sizeof *wrong, compare_candidates);
  if ((st = reserve(s, ROUND_MOST)) < 0) goto done;
  for (size_t c = 0; c < found && *added < ROUND_MOST && !is_full(s); c++) {
    const double *at = x + 2 * wrong[c].at;
    if (meets_another(s, at, 0.5 * wrong[c].miss)) continue; /* that one speaks for this place too */
    add(s, at, polygon_distance(s->loops, at, NULL, NULL));
    (*added)++;
  }
done:
  batten_free(s->ctx, f);
  batten_free(s->ctx, wrong);
  return st;
}

static batten_status follow_signs(section_fit *s) {
  double *x = NULL;
  size_t count, added;
  batten_status st =
      loop_places_beside(s->ctx, s->loops, &s->places, SIGN_NEAR * s->tolerance, SIGN_CELLS, SIGN_SHIFT, &x, &count);
  for (int round = 0; st >= 0 && round < SIGN_ROUNDS; round++) {
    st = add_wrong_signs(s, count, x, &added);
    if (st < 0 || added == 0) break;
    st = follow_loops(s); /* what moved there may have moved the curve */
  }
  batten_free(s->ctx, x);
  return st;
}

/* ---- the whole ----------------------------------------------------------------------------------- */

static batten_status open_fit(section_fit *s) {
  batten_status st = loop_places_make(s->ctx, s->loops, STEP, STEP_MAX * s->tolerance, &s->places);
  if (st < 0) return st;
  const size_t count = s->places.count;
  s->loop = batten_alloc_array(s->ctx, count, sizeof *s->loop);
  s->used = batten_alloc(s->ctx, count);
  s->f = batten_alloc_array(s->ctx, count, 4 * sizeof *s->f);
  s->candidates = batten_alloc_array(s->ctx, count, sizeof *s->candidates);
  if (!s->loop || !s->used || !s->f || !s->candidates) return BATTEN_E_NOMEM;
  s->df = s->f + count;
  s->misses = s->df + 2 * count;
  memset(s->used, 0, count);
  for (size_t loop = 0; loop < s->loops->count; loop++)
    for (size_t i = s->places.starts[loop]; i < s->places.starts[loop + 1]; i++) s->loop[i] = loop;
  return BATTEN_OK;
}

static void close_fit(section_fit *s) {
  loop_places_free(s->ctx, &s->places);
  batten_free(s->ctx, s->loop);
  batten_free(s->ctx, s->used);
  batten_free(s->ctx, s->f);
  batten_free(s->ctx, s->candidates);
  batten_free(s->ctx, s->points);
  batten_free(s->ctx, s->values);
  batten_spline_free(s->spline);
}

/* The solid's points are the centres on the loops; they go to the front of s->points. */
static batten_status make_solid(section_fit *s, batten_solid **out) {
  batten_carrier *none = NULL;
  size_t kept = 0;
  for (size_t i = 0; i < s->count; i++)
    if (s->values[i] == 0) memmove(s->points + 2 * kept++, s->points + 2 * i, 2 * sizeof *s->points);
  batten_status st = batten_carrier_none(s->ctx, 2, &none);
  if (st >= 0)
    st = batten_solid_create(s->ctx, s->spline, none, 1, s->loops->lower, s->loops->upper, kept, s->points, out);
  batten_carrier_free(none);
  return st;
}

/* Places of wrong sign that others have found. */
static batten_status follow_wrong(section_fit *s, const section_wrong *wrong) {
  batten_status st = reserve(s, SECTION_WRONG_MAX);
  const size_t before = s->count;
  for (size_t i = 0; st >= 0 && wrong && i < wrong->count && !is_full(s); i++) {
    const double *at = wrong->places[i];
    if (isfinite(wrong->depths[i]) && !meets_another(s, at, MEET * wrong->depths[i]))
      add(s, at, polygon_distance(s->loops, at, NULL, NULL));
  }
  return st < 0 || s->count == before ? st : follow_loops(s);
}

/* hints: of wrong signs, from earlier fits, or NULL. */
static batten_status fit_loops(batten_context *ctx, const polygon_set *loops, double tolerance, double pair_distance,
                               const section_wrong *hints, size_t hint_count, batten_solid **out,
                               section_figures *figures) {
  section_fit s = {.ctx = ctx, .loops = loops, .tolerance = PART * tolerance, .pair_distance = pair_distance};
  batten_status st = open_fit(&s);
  if (st >= 0) st = add_first(&s);
  if (st >= 0) st = follow_loops(&s);
  if (st >= 0) st = follow_signs(&s);
  for (size_t i = 0; st >= 0 && i < hint_count; i++) st = follow_wrong(&s, &hints[i]);
  if (st >= 0) st = make_solid(&s, out);
  if (st >= 0) *figures = (section_figures){.centers = s.count, .status = s.status};
  close_fit(&s);
  return st < 0 ? st : s.status;
}

batten_status section_fit_loops(batten_context *ctx, const polygon_set *loops, double tolerance, double pair_distance,
                                batten_solid **out, section_figures *figures) {
  return fit_loops(ctx, loops, tolerance, pair_distance, NULL, 0, out, figures);
}

/* What is worse than the tolerance, as far as it is known. */
static void keep_deep(section_wrong *wrong, double depth) {
  size_t kept = 0;
  for (size_t i = 0; i < wrong->count; i++) {
    if (!(wrong->depths[i] > depth)) continue;
    memmove(wrong->places[kept], wrong->places[i], sizeof wrong->places[i]);
    wrong->depths[kept++] = wrong->depths[i];
  }
  wrong->count = kept;
}

batten_status section_fit_proven(batten_context *ctx, const polygon_set *loops, double tolerance,
                                 double pair_distance, batten_solid **out, section_figures *figures) {
  section_wrong *hints = batten_alloc_array(ctx, REPAIRS + 1, sizeof *hints);
  batten_solid *best = NULL;
  batten_status st = hints ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t repair = 0; st >= 0 && repair <= REPAIRS; repair++) {
    batten_solid *solid = NULL;
    section_figures own;
    st = fit_loops(ctx, loops, tolerance, pair_distance, hints, repair, &solid, &own);
    if (st >= 0) st = section_certify(ctx, loops, solid, tolerance, &own, &hints[repair]);
    if (st >= 0 && (!best || own.certified || own.wrong_sign_max < figures->wrong_sign_max)) {
      batten_solid *worse = best;
      best = solid;
      solid = worse;
      *figures = own;
    }
    batten_solid_free(solid);
    if (st < 0 || own.certified) break;
    keep_deep(&hints[repair], HINT_PART * tolerance);
    if (hints[repair].count == 0) break;
  }
  batten_free(ctx, hints);
  if (st < 0)
    batten_solid_free(best);
  else
    *out = best;
  return st < 0 ? st : figures->status;
}

batten_status section_fit_points(batten_context *ctx, batten_section_method method, size_t count,
                                 const double *points, batten_solid **out, section_figures *figures) {
  batten_solid_options options = batten_solid_options_default();
  batten_solid_info info;
  batten_solid *solid = NULL;
  if (method == BATTEN_SECTION_CARRIER) options.orientation = BATTEN_ORIENT_NEVER;
  options.spline.loo_samples = 0;
  batten_status st = batten_solid_fit(ctx, 2, count, points, &options, &solid, &info);
  if (st < 0) return st;
  batten_spline_parts parts;
  batten_spline_get_parts(batten_solid_spline(solid), &parts);
  *figures = (section_figures){.centers = parts.count,
                               .residual_max = info.distance_max,
                               .certified = info.check_final.clean != 0,
                               .status = st};
  *out = solid;
  return st;
}
