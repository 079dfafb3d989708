/* The proof that plane sections keep their sign: what its files say to each other.
 *
 * certify_sections_make.c   x_u and w = n . (x_u x x_uu) on a span pair   certify_sections_prove.c  a sign, by boxes
 * certify_sections.c        wanted signs, flat ends, all span pairs
 *
 * With a_0 .. a_m the rows of x_u in u (m = degree - 1) and b_0 .. b_(m-1) those of x_uu the product x_u x x_uu has
 * degree 2 m - 2 in u, one less than its factors tell: with p the rows a_0 .. a_(m-1) and q the rows a_1 .. a_m
 * Euler's theorem on homogeneous functions gives x_u = (1 - s) p + s q, x_uu = m (q - p), hence x_u x x_uu = p x
 * x_uu.
 *
 * Places on a span pair are parts (s, r) of its sides. Points are times 2^exponent of the plan, and both
 * derivatives then times powers of two of their own, so that spans and units of any size are alike. All bounds hold
 * in any rounding mode. Rows of coefficients of one s carry one bound: of a short span beside a long one in u, rows
 * differ by the ratio of their lengths. */
#ifndef BATTEN_SURFACE_CERTIFY_SECTIONS_H
#define BATTEN_SURFACE_CERTIFY_SECTIONS_H

#include <stdbool.h>

#include "basis/rounding.h"
#include "surface_inner.h"

enum { SECTIONS_ROWS = 2 * BATTEN_SURFACE_DEGREE_MAX - 1, SECTIONS_COLUMNS = 2 * BATTEN_SURFACE_DEGREE_MAX + 1 };

/* A polynomial of (s, r) in Bernstein form, of dim coordinates. */
typedef struct sections_sheet {
  unsigned dim, degree[2];
  double *c;                   /* [dim][degree[0] + 1][degree[1] + 1] */
  double error[SECTIONS_ROWS]; /* of a row's coefficients, at most */
  double most[SECTIONS_ROWS];  /* what none of them exceeds in size */
} sections_sheet;

static inline size_t sections_count(const sections_sheet *p) {
  return p->dim * (size_t)(p->degree[0] + 1) * (p->degree[1] + 1);
}

/* What is the same for all span pairs. */
typedef struct sections_plan {
  const batten_surface *surface;
  unsigned dim;     /* 2 where the normal is along an axis, else 3 */
  unsigned axis[3]; /* coordinates that count, those of a plane such that w = [x_u, x_uu] */
  double normal[3]; /* dim 3: as it was given, times a power of two: 1 .. 2 */
  double length;    /* its length; dim 2: 1 */
  int exponent;     /* brings the largest coordinate that counts to [1, 2): sections may be small beside the height */
  double unit;      /* 2^exponent */
  double data_error;  /* rounding of the control points themselves, times unit */
  unsigned degree[2]; /* of the surface */
  /* Binomials, and one over them: of b, of a and both squared; in v. */
  double own[2][SECTIONS_ROWS], both[2][SECTIONS_ROWS], own_v[SECTIONS_COLUMNS], both_v[SECTIONS_COLUMNS];
} sections_plan;

/* normal: not 0, finite. */
void sections_plan_make(const batten_surface *surface, const double normal[3], sections_plan *out);

/* A span pair. */
typedef struct sections_pair {
  sections_sheet a, w; /* x_u, and w */
  double factor;       /* curvature = factor w / |a|^3, of the surface times unit; not above it */
  bool flat[2];        /* at s = 0, 1: both end sections have x_uu = 0 there to rounding of the control points */
  bool lonely[2];      /* only one of them has */
  double allowed[2];   /* what that rounding leaves of w there */
} sections_pair;

/* Doubles that a sheet a, a sheet w need, and room to make them. */
size_t sections_a_count(const sections_plan *plan);
size_t sections_w_count(const sections_plan *plan);
size_t sections_room(const sections_plan *plan);
/* out->a.c and out->w.c are the caller's. */
void sections_pair_make(const sections_plan *plan, size_t mu, size_t nu, double *room, sections_pair *out);

/* |a|^2 of a sheet a: out->c [(2 m + 1) (2 n + 1)]. */
void sections_square(const sections_plan *plan, const sections_sheet *a, double *room, sections_sheet *out);

/* ---- proof ---------------------------------------------------------------------------------------- */

/* Share of the least curvature that is proven. */
static const double SECTIONS_SHARE = 0.905;

enum { SECTIONS_OPEN = 0, SECTIONS_PROVEN = 1, SECTIONS_VIOLATED = -1, SECTIONS_UNPROVEN = -2 };

/* What is found out about a span pair, curvatures with the wanted sign, of the surface times unit. */
typedef struct sections_record {
  double least, least_at[2]; /* met, and where in the domain */
  double target;             /* least of what could be proven at places that were met */
  double bound;              /* proven */
  size_t boxes;
  unsigned depth;
  signed char sign, verdict;
  bool strict; /* no flat ends: the bound counts */
} sections_record;

/* A part of a stretch that is not proven yet. */
typedef struct sections_box {
  sections_sheet a, w;
  double lower[2], width[2];
  unsigned depth[2], axis; /* axis: which to bisect */
  double least;            /* coefficient of w less its error */
  double bound;            /* proven of curvature, > 0, or not */
} sections_box;

/* A rectangle on which w is to be positive. */
typedef struct sections_stretch {
  double from[2], to[2]; /* the domain's parameters at 0 and 1: to[0] < from[0] where it was reversed */
  double factor;
  bool flat;      /* at s = 0 w vanishes, or nearly: */
  double allowed; /* by so much it may be wrong there */
  bool margin;    /* a bound is wanted besides the sign */
} sections_stretch;

/* What a task works with. Boxes of the stack get their room when they are needed first: most never are. */
typedef struct sections_search {
  const sections_plan *plan;
  unsigned depth_max;
  size_t box_limit;     /* 0: nothing is cut */
  sections_box *stack;  /* [2 depth_max + 2] */
  size_t made;          /* of them have room */
  double *coefficients; /* [2 depth_max + 2][those of a and of w] */
  double *room;         /* [sections_room] */
} sections_search;

/* Box k <= made of the stack, with room. */
sections_box *sections_box_at(sections_search *search, size_t k);
/* Proves that stack[0] is positive (its a, w are given), or sets record->verdict otherwise; OPEN: it was not cut. */
void sections_prove(sections_search *search, const sections_stretch *stretch, sections_record *record);
/* The halves of a sheet in direction axis; work [sections_count(lower)]. */
void sections_halve(unsigned axis, sections_sheet *lower, sections_sheet *upper, double *work);
/* By 1 - s. */
void sections_reverse(sections_sheet *p);

#endif
