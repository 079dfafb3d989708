/* A field as the polygoniser sees it: batches, counted and checked, with gradients whether the field has them or not;
 * for kernel/mesh only. */
#ifndef BATTEN_MESH_SAMPLER_H
#define BATTEN_MESH_SAMPLER_H

#include <batten/field.h>

typedef struct batten_sampler {
  batten_context *ctx;
  const batten_field *field;
  size_t evaluations, evaluations_max; /* 0 = no limit */
  double difference;                   /* half the step of central differences, for fields without gradients */
  int exponent;                        /* points here times 2^exponent are the field's; gradients to match */
} batten_sampler;

/* values [count] at points [count][n]. Fails: what the field fails with, INVALID (a value is not finite, names the
 * point), TOO_LARGE (evaluations_max), NOMEM. */
batten_status batten_sampler_values(batten_sampler *s, size_t count, const double *points, double *values);

/* And gradients [count][n], those that are not finite set to 0. */
batten_status batten_sampler_gradients(batten_sampler *s, size_t count, const double *points, double *values,
                                       double *gradients);

#endif
