/* Has a section's function the sign of its loops everywhere, but for a band along them?
 *
 * A square of 100 half diagonals around the section is parted in four, and so on. A box is settled when all of it
 * lies within the tolerance of the loops (BAND), or when the bounds of F over it (batten_solid_bounds, roundings
 * included) have one sign and the bounds of the signed distance to the polygons the same. What is left when boxes are
 * smaller than a sixteenth of the tolerance is not proven; F in its middle tells whether it is wrong. Boxes meet
 * without gaps: corners are multiples of the side, which round alike on every level.
 *
 * Boxes wait on a stack, coarse ones below, and are taken by blocks from its top. Boxes of a level are made only
 * while fewer than a block of them and finer ones wait, so that no more than a block and the parts of another wait of
 * each level. */
#include "base/checked.h"
#include "section/section_inner.h"

enum {
  BLOCK = 256,
  LEVELS = 31, /* places of boxes are counted in 32 bits */
  BOXES_MAX = 400000,
  UNPROVEN_MAX = 1024 /* there is no proof after the first: the others are looked at for places that are wrong */
};
static const double REACH = 100;      /* half diagonals */
static const double LEAST = 1.0 / 16; /* side of a box, in tolerances */
/* A part as thick as twice the tolerance is nowhere deeper than that, but boxes across its middle reach beyond: the
 * smallest ones are settled within this many tolerances, if F is not seen to be wrong beyond one in their middle. */
static const double BAND = 1.0625;
static const double ASKED_GAP = 0.5; /* boxes nearer to the loops, in sides, are parted without asking for F */

typedef struct square {
  uint32_t at[2], level;
} square;

typedef struct proof {
  batten_context *ctx;
  const polygon_set *loops;
  const batten_solid *function;
  double tolerance, origin[2], side;
  size_t waiting, seen, unproven;
  square *stack, *asked;                    /* [LEVELS * 5 BLOCK], [BLOCK] */
  double *boxes, *distances, *ranges, *mid; /* [BLOCK] of those asked: [2][2], [2], [2], [2] */
  section_wrong *wrong;
  bool thin[BLOCK]; /* of those with a mid */
} proof;

static double side_of(const proof *p, const square *s) { return ldexp(p->side, -(int)s->level); }

static void box_of(const proof *p, const square *s, double box[4]) {
  const double side = side_of(p, s);
  for (unsigned k = 0; k < 2; k++) {
    box[k] = p->origin[k] + s->at[k] * side;
    box[2 + k] = p->origin[k] + (s->at[k] + 1.0) * side;
  }
}

static bool can_part(const proof *p, const square *s) {
  return s->level < LEVELS && side_of(p, s) > LEAST * p->tolerance;
}

static void part(proof *p, const square *s) {
  for (uint32_t c = 0; c < 4; c++)
    p->stack[p->waiting++] = (square){{2 * s->at[0] + c % 2, 2 * s->at[1] + c / 2}, s->level + 1};
}

/* The deepest ones, some way apart from each other. */
static void note_place(section_wrong *wrong, const double *x, double depth) {
  size_t to = wrong->count, least = 0;
  for (size_t i = 0; i < wrong->count; i++) {
    if (hypot(wrong->places[i][0] - x[0], wrong->places[i][1] - x[1]) <= 0.5 * fmax(depth, wrong->depths[i])) {
      to = i;
      break;
    }
    if (wrong->depths[i] < wrong->depths[least]) least = i;
  }
  if (to == SECTION_WRONG_MAX) to = least;
  if (to < wrong->count && wrong->depths[to] >= depth) return;
  if (to == wrong->count) wrong->count++;
  for (unsigned k = 0; k < 2; k++) wrong->places[to][k] = x[k];
  wrong->depths[to] = depth;
}

void section_add_wrong(section_wrong *wrong, const double *x, double depth) {
  wrong->depth = fmax(wrong->depth, depth);
  note_place(wrong, x, depth);
}

/* F has the sign of `sign` in x, the middle of a box that bounds do not settle; thin: within BAND. */
static void judge_place(proof *p, const double *x, double sign, bool thin) {
  const double distance = polygon_distance(p->loops, x, NULL, NULL);
  if (thin && (fabs(distance) <= p->tolerance || sign * distance > 0)) return;
  p->unproven++;
  if (isnan(sign))
    section_add_wrong(p->wrong, x, INFINITY);
  else if (sign * distance < 0)
    section_add_wrong(p->wrong, x, fabs(distance));
  else
    note_place(p->wrong, x, fabs(distance)); /* but F is as good as 0 */
}

/* Takes a block off the stack; those of it that the polygons alone do not settle or part are asked about. */
static size_t take_block(proof *p) {
  size_t count = 0, first = p->waiting > BLOCK ? p->waiting - BLOCK : 0, taken = p->waiting - first;
  square block[BLOCK];
  for (size_t i = 0; i < taken; i++) block[i] = p->stack[first + i];
  p->waiting = first;
  p->seen += taken;
  for (size_t i = 0; i < taken; i++) {
    double *box = p->boxes + 4 * count, *d = p->distances + 2 * count;
    box_of(p, &block[i], box);
    polygon_distance_bounds(p->loops, box, box + 2, d);
    if (fmax(-d[0], d[1]) <= p->tolerance) continue;
    if (fmax(d[0], -d[1]) < ASKED_GAP * side_of(p, &block[i]) && can_part(p, &block[i]))
      part(p, &block[i]);
    else
      p->asked[count++] = block[i];
  }
  return count;
}

/* Boxes [count] of which F is asked. */
static batten_status ask(proof *p, size_t count) {
  size_t left = 0;
  batten_status st = batten_solid_bounds(p->ctx, p->function, count, p->boxes, p->ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    const double *f = p->ranges + 2 * i, *d = p->distances + 2 * i, *box = p->boxes + 4 * i;
    if ((f[0] > 0 && d[0] > 0) || (f[1] < 0 && d[1] < 0)) continue;
    const bool opposite = (f[0] > 0 && d[1] < -p->tolerance) || (f[1] < 0 && d[0] > p->tolerance);
    if (can_part(p, &p->asked[i]) && !opposite) {
      part(p, &p->asked[i]);
      continue;
    }
    p->thin[left] = fmax(-d[0], d[1]) <= BAND * p->tolerance;
    for (unsigned k = 0; k < 2; k++) p->mid[2 * left + k] = 0.5 * (box[k] + box[2 + k]);
    left++;
  }
  if (st < 0 || left == 0) return st;
  st = batten_solid_evaluate(p->ctx, p->function, left, p->mid, p->ranges, NULL, NULL);
  for (size_t i = 0; st >= 0 && i < left; i++) judge_place(p, p->mid + 2 * i, p->ranges[i], p->thin[i]);
  return st;
}

static void open_square(proof *p) {
  const polygon_set *loops = p->loops;
  const double radius = 0.5 * hypot(loops->upper[0] - loops->lower[0], loops->upper[1] - loops->lower[1]);
  p->side = 2 * REACH * radius;
  for (unsigned k = 0; k < 2; k++) p->origin[k] = 0.5 * (loops->lower[k] + loops->upper[k]) - REACH * radius;
  p->stack[p->waiting++] = (square){{0, 0}, 0};
}

batten_status section_prove(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                            double tolerance, bool *proven, section_wrong *wrong) {
  proof p = {.ctx = ctx, .loops = loops, .function = function, .tolerance = tolerance, .wrong = wrong};
  p.stack = batten_alloc_array(ctx, (size_t)(LEVELS + 1) * 5 * BLOCK, sizeof *p.stack);
  p.asked = batten_alloc_array(ctx, BLOCK, sizeof *p.asked);
  p.boxes = batten_alloc_array(ctx, BLOCK, 10 * sizeof *p.boxes);
  batten_status st = p.stack && p.asked && p.boxes ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  p.distances = p.boxes + 4 * BLOCK;
  p.ranges = p.distances + 2 * BLOCK;
  p.mid = p.ranges + 2 * BLOCK;
  open_square(&p);
  while (st >= 0 && p.waiting > 0 && p.seen < BOXES_MAX && p.unproven < UNPROVEN_MAX) {
    size_t count = take_block(&p);
    if (count > 0) st = ask(&p, count);
  }
  if (st >= 0) *proven = p.waiting == 0 && p.unproven == 0;
done:
  batten_free(ctx, p.boxes);
  batten_free(ctx, p.asked);
  batten_free(ctx, p.stack);
  return st;
}
