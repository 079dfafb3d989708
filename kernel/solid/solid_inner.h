/* The inside of a solid, and the steps of a fit, shared by the files of kernel/solid. */
#ifndef BATTEN_SOLID_INNER_H
#define BATTEN_SOLID_INNER_H

#include "base/neighbours.h"
#include "solid/solid_form.h"

#include <stdatomic.h>

struct batten_solid {
  batten_context *ctx;
  atomic_size_t owners;
  unsigned n;
  const solid_form *form; /* NULL: spline under carrier */
  void *state;            /* of the form */
  unsigned depth;         /* levels of nested carriers and solids below */
  batten_spline *spline;
  batten_carrier *carrier;
  int sign; /* 1 with a form */
  double lower[3], upper[3];
  size_t count;   /* points on the surface */
  double *points; /* [count][n] */
};

/* batten_solid_create behind its checks. */
batten_status batten_solid_new(batten_context *ctx, batten_spline *spline, batten_carrier *carrier, int sign,
                               size_t count, const double *points, const double *lower, const double *upper,
                               batten_solid **out);

/* The points of a fit after merging, and how they lie. */
typedef struct surface_data {
  unsigned n;
  size_t given, count;
  double *points;        /* [count][n] */
  double *normals;       /* [count][n] unit, NULL = none given */
  double *smoothing;     /* [count], NULL = the same for all */
  double *spacing;       /* [count] local distance between neighbours on the surface */
  double *gap;           /* [count] >= spacing: how far the surface may go without data, about */
  size_t in_lines;       /* points of a surface in lines that lie farther apart than 3 of their spacings */
  double spacing_median; /* of the distances to the nearest */
  double lower[3], upper[3], middle[3], radius; /* box, and the ball about it */
  batten_tree *tree;
} surface_data;

/* Checks, merges, measures. Frees nothing of the caller's; batten_surface_data_free takes a zeroed struct too. */
batten_status batten_surface_data_make(batten_context *ctx, unsigned n, size_t count, const double *points,
                                       const batten_solid_options *opt, surface_data *out);
void batten_surface_data_free(batten_context *ctx, surface_data *d);

/* The check of the sign field. Where may_turn, a solid that is positive far away is turned inside out first. e: of
 * that solid, what values at many points are taken from. */
batten_status batten_solid_check_sign(batten_context *ctx, const surface_data *d, size_t cells, int may_turn,
                                      batten_solid *s, batten_solid_evaluator *e, batten_sign_check *out);

/* Terms of a solid's spline, N + n M; 0 of other kinds. */
size_t batten_solid_term_count(const batten_solid *s);
/* How many of a fit's points may be summed directly: 1e9 terms in all, 1000 points at least. */
size_t batten_solid_points_to_sum(const batten_solid *s, size_t count);

/* A solid through the points whose unit outward normals are data too: as gradients, without a carrier, or as pairs of
 * points off the surface. opt: the caller's. value_range: max - min of the interpolated values. */
batten_status batten_solid_fit_gradients(batten_context *ctx, const surface_data *d, const double *normals,
                                         const batten_solid_options *opt, batten_solid **out,
                                         batten_spline_info *info, double *value_range);
batten_status batten_solid_fit_pairs(batten_context *ctx, const surface_data *d, const double *normals,
                                     batten_carrier *carrier, const batten_solid_options *opt, batten_solid **out,
                                     batten_spline_info *info, batten_spline_reduce_info *reduced,
                                     double *value_range);

/* The spline U = f_c - f of data whose first `surface` points have f = 0: through all, or with opt->reduce with fewer
 * centres; without it reduced is zero. */
batten_status batten_solid_fit_spline(batten_context *ctx, const batten_solid_options *opt,
                                      const batten_carrier *carrier, size_t surface, const batten_spline_data *data,
                                      const batten_spline_options *o, batten_spline **out, batten_spline_info *info,
                                      batten_spline_reduce_info *reduced);

#endif
