/* Assumption (3): polygons that bend as their curves do.   [Juettler, section 3.1]
 *
 * The turn at vertex v has the sign of [leg v, leg v + 1]; legs are values of the blossom of x' at the knots v + 2 ..
 * v + degree + 1. As these move together the turn becomes that of the tangent: so at a vertex whose turn has another
 * sign than the spans on which it acts, or is too large, the longest interval between these knots is halved, until
 * there is none. Each time the polygon is four times nearer to the curve there. */
#include "base/checked.h"
#include "shape_inner.h"

static const double PI = 3.14159265358979323846;
/* Of pi / (degree - 1): turns must leave sections some room below it. */
static const double ROOM = 0.9;
/* Turns below that (and below what rounding of points does) have no sign. */
static const double STRAIGHT = 0x1p-33, STRAIGHT_ROUNDING = 0x1p-46;
/* Of the domain: beside cusps no knots are enough, and polygons would drown in rounding. */
static const double NARROW = 0x1p-20;
enum { ROUNDS = 40 };

void shape_knots_free(batten_context *ctx, shape_knots *list) {
  batten_free(ctx, list->knots);
  batten_free(ctx, list->folds);
  *list = (shape_knots){0};
}

batten_status shape_knots_add(batten_context *ctx, shape_knots *list, double t, unsigned fold) {
  if (list->count == list->room) {
    size_t room = list->room ? 2 * list->room : 32;
    double *knots = batten_realloc_array(ctx, list->knots, room, sizeof *knots);
    if (knots) list->knots = knots;
    unsigned *folds = knots ? batten_realloc_array(ctx, list->folds, room, sizeof *folds) : NULL;
    if (!folds) return BATTEN_E_NOMEM;
    list->folds = folds;
    list->room = room;
  }
  size_t k = list->count;
  while (k > 0 && list->knots[k - 1] > t) k--;
  if (k > 0 && list->knots[k - 1] == t) {
    if (list->folds[k - 1] < fold) list->folds[k - 1] = fold;
    return BATTEN_OK;
  }
  for (size_t i = list->count++; i > k; i--) {
    list->knots[i] = list->knots[i - 1];
    list->folds[i] = list->folds[i - 1];
  }
  list->knots[k] = t;
  list->folds[k] = fold;
  return BATTEN_OK;
}

/* ---- what is wanted of vertices ------------------------------------------------------------------ */

enum { NOTHING = 0, BOTH = 2 }; /* else the sign */

/* Whether the span is in the zone of an inflection that is not flat. */
static bool is_free(const shape_places *places, const loft_space *s, size_t span) {
  for (size_t k = 0; k < places->count; k++) {
    const shape_place *p = places->at + k;
    if (p->kind != SHAPE_BENT) continue;
    for (int period = s->closed ? -1 : 0; period <= (s->closed ? 1 : 0); period++) {
      double middle = (s->breaks[span] + s->breaks[span + 1]) / 2 + period;
      if (middle >= p->from && middle <= p->to) return true;
    }
  }
  return false;
}

static void find_wanted(const loft_contour *c, const shape_places *places, signed char *wanted) {
  const loft_space *s = &c->space;
  size_t vertices = loft_vertices(s);
  for (size_t v = 0; v < vertices; v++) wanted[v] = NOTHING;
  for (size_t span = 0; span < s->spans; span++) {
    if (is_free(places, s, span)) continue;
    int sign = shape_sign(c, s->breaks[span], s->breaks[span + 1]);
    for (size_t k = 0; k + 2 <= s->degree && sign != 0; k++) {
      signed char *w = wanted + (s->first[span] + k) % vertices;
      *w = (signed char)(*w == NOTHING || *w == sign ? sign : BOTH);
    }
  }
}

static void get_leg(const loft_contour *c, size_t v, double out[2]) {
  size_t n = c->space.count, from = v % n, to = (v + 1) % n;
  for (size_t x = 0; x < 2; x++) out[x] = c->points[2 * to + x] - c->points[2 * from + x];
}

/* Whether the polygon turns at v as it shall. */
static bool is_good(const loft_contour *c, size_t v, int wanted) {
  double a[2], b[2], i = loft_interval(&c->space, (ptrdiff_t)v), k = loft_interval(&c->space, (ptrdiff_t)v + 1);
  get_leg(c, v, a);
  get_leg(c, v + 1, b);
  double x = hypot(a[0], a[1]), y = hypot(b[0], b[1]), across = loft_cross(a, b), along = a[0] * b[0] + a[1] * b[1];
  if (contours_is_flat(&c->space, c->points, (ptrdiff_t)v)) return true;
  if (!(fabs(atan2(across, along)) < ROOM * PI / (c->space.degree - 1)) || x == 0 || y == 0) return false;
  if (wanted == NOTHING || wanted == BOTH || wanted * across > 0) return true;
  return fabs(across) <= STRAIGHT * x * y + STRAIGHT_ROUNDING * (x + y) * fmax(1, fmax(i / k, k / i));
}

/* ---- knots --------------------------------------------------------------------------------------- */

/* The middle of the longest interval between the knots of both legs of vertex v; NaN if that is too short. */
static double find_middle(const loft_space *s, size_t v) {
  double longest = 0, middle = 0;
  for (size_t k = v + 2; k <= v + s->degree; k++) {
    double a = loft_knot(s, (ptrdiff_t)k), b = loft_knot(s, (ptrdiff_t)k + 1);
    if (b - a <= longest) continue;
    longest = b - a;
    middle = a / 2 + b / 2;
  }
  return longest > NARROW ? shape_wrap(s, middle) : NAN;
}

static batten_status tell(batten_context *ctx, loft_stack *s, size_t i, size_t v) {
  const loft_space *space = &s->contours[i].space;
  double t = shape_wrap(space, loft_greville(space, (ptrdiff_t)v + 1));
  const batten_loft_note note = {
      .remark = BATTEN_LOFT_STEEP, .contour = i, .other = i, .t = s->domain[0] + t * (s->domain[1] - s->domain[0])};
  return loft_stack_note(ctx, s, &note);
}

/* Knots for all vertices that are not as they shall be; *steep: how many have none. list NULL: all are told. */
static batten_status judge(batten_context *ctx, loft_stack *s, size_t i, const shape_places *places,
                           shape_knots *list, size_t *steep) {
  const loft_contour *c = s->contours + i;
  size_t vertices = loft_vertices(&c->space);
  signed char *wanted = batten_alloc_array(ctx, vertices, sizeof *wanted);
  if (!wanted) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  find_wanted(c, places, wanted);
  *steep = 0;
  for (size_t v = 0; v < vertices && st >= 0; v++) {
    if (is_good(c, v, wanted[v])) continue;
    double middle = list ? find_middle(&c->space, v) : NAN;
    if (!isnan(middle))
      st = shape_knots_add(ctx, list, middle, 1);
    else if (list)
      ++*steep;
    else
      st = tell(ctx, s, i, v);
  }
  batten_free(ctx, wanted);
  return st;
}

batten_status shape_bend(batten_context *ctx, loft_stack *s, size_t i, const shape_places *places) {
  shape_knots list = {0};
  size_t steep = 0;
  batten_status st = BATTEN_OK;
  for (int round = 0; round <= ROUNDS && st >= 0; round++) {
    list.count = 0;
    st = judge(ctx, s, i, places, round < ROUNDS ? &list : NULL, &steep);
    if (st < 0 || list.count == 0) break;
    st = loft_stack_insert(ctx, s, i, list.count, list.knots, list.folds);
  }
  if (st >= 0 && steep > 0) st = judge(ctx, s, i, places, NULL, &steep);
  shape_knots_free(ctx, &list);
  return st;
}
