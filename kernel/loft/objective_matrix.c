/* The matrix of the objective of lofts: what every leg and every trajectory says about the unknowns on which its
 * control points depend, added up leg by leg. */
#include "objective.h"

#include <string.h>

#include "base/checked.h"

/* For every leg the unknowns that its two trajectories depend on: legs [leg][..]. */
typedef struct incidence {
  size_t legs, most; /* most unknowns of a leg */
  size_t *starts;    /* [legs + 1] */
  uint32_t *columns;
} incidence;

static void incidence_free(batten_context *ctx, incidence *a) {
  batten_free(ctx, a->columns);
  batten_free(ctx, a->starts);
}

/* Rows of net.z of leg v of patch i: n + 1 of each trajectory. */
static size_t row_of(const loft_net *net, size_t i, size_t v, unsigned r) {
  unsigned order = net->degree + 1;
  size_t j = r < order ? v : objective_after(&net->slabs[i].space, v);
  return loft_at(net, i, j, r % order);
}

/* Unknowns of the leg, each once; columns may be NULL. seen [unknowns]: 1 + the last leg that met it. */
static size_t list_unknowns(const loft_net *net, size_t i, size_t v, size_t stamp, size_t *seen, uint32_t *columns) {
  size_t count = 0;
  for (unsigned r = 0; r < 2 * (net->degree + 1); r++) {
    size_t row = row_of(net, i, v, r);
    for (size_t e = net->z.starts[row]; e < net->z.starts[row + 1]; e++) {
      uint32_t column = net->z.indices[e];
      if (seen[column] == stamp) continue;
      seen[column] = stamp;
      if (columns) columns[count] = column;
      count++;
    }
  }
  return count;
}

static batten_status incidence_make(batten_context *ctx, const loft_objective *o, incidence *out) {
  const loft_net *net = o->net;
  incidence a = {.legs = o->leg_start[net->slab_count]};
  batten_status st = BATTEN_E_NOMEM;
  size_t *seen = batten_alloc_array(ctx, net->z.columns, sizeof *seen), stamp = 0;
  a.starts = batten_alloc_array(ctx, a.legs + 1, sizeof *a.starts);
  if (!seen || !a.starts) goto done;
  memset(seen, 0, net->z.columns * sizeof *seen);
  a.starts[0] = 0;
  for (size_t i = 0, leg = 0; i < net->slab_count; i++)
    for (size_t v = 0; v < loft_legs(&net->slabs[i].space); v++, leg++) {
      size_t count = list_unknowns(net, i, v, ++stamp, seen, NULL);
      a.starts[leg + 1] = a.starts[leg] + count;
      if (count > a.most) a.most = count;
    }
  a.columns = batten_alloc_array(ctx, a.starts[a.legs], sizeof *a.columns);
  if (!a.columns) goto done;
  for (size_t i = 0, leg = 0; i < net->slab_count; i++)
    for (size_t v = 0; v < loft_legs(&net->slabs[i].space); v++, leg++)
      list_unknowns(net, i, v, ++stamp, seen, a.columns + a.starts[leg]);
  *out = a;
  a = (incidence){0};
  st = BATTEN_OK;
done:
  incidence_free(ctx, &a);
  batten_free(ctx, seen);
  return st;
}

/* The legs of every unknown: the transpose. */
static batten_status transpose(batten_context *ctx, const incidence *a, size_t unknowns, incidence *out) {
  incidence t = {.legs = unknowns};
  t.starts = batten_alloc_array(ctx, unknowns + 2, sizeof *t.starts);
  t.columns = batten_alloc_array(ctx, a->starts[a->legs], sizeof *t.columns);
  if (!t.starts || !t.columns) {
    incidence_free(ctx, &t);
    return BATTEN_E_NOMEM;
  }
  memset(t.starts, 0, (unknowns + 2) * sizeof *t.starts);
  for (size_t e = 0; e < a->starts[a->legs]; e++) t.starts[a->columns[e] + 2]++;
  for (size_t p = 0; p < unknowns; p++) t.starts[p + 2] += t.starts[p + 1];
  for (size_t leg = 0; leg < a->legs; leg++)
    for (size_t e = a->starts[leg]; e < a->starts[leg + 1]; e++)
      t.columns[t.starts[a->columns[e] + 1]++] = (uint32_t)leg;
  *out = t;
  return BATTEN_OK;
}

/* Pairs (p, q), q < p, of unknowns that meet in a leg, each once; pairs may be NULL. Returns how many. */
static size_t list_pairs(const incidence *a, const incidence *t, size_t *seen, uint32_t *pairs) {
  size_t count = 0;
  memset(seen, 0, t->legs * sizeof *seen);
  for (size_t p = 0; p < t->legs; p++)
    for (size_t e = t->starts[p]; e < t->starts[p + 1]; e++)
      for (size_t f = a->starts[t->columns[e]]; f < a->starts[t->columns[e] + 1]; f++) {
        size_t q = a->columns[f];
        if (q >= p || seen[q] == p) continue; /* 0 is smaller than none */
        seen[q] = p;
        if (pairs) {
          pairs[2 * count] = (uint32_t)p;
          pairs[2 * count + 1] = (uint32_t)q;
        }
        count++;
      }
  return count;
}

static batten_status make_pattern(batten_context *ctx, const incidence *a, size_t unknowns, block_matrix *h) {
  incidence t = {0};
  uint32_t *pairs = NULL;
  size_t *seen = batten_alloc_array(ctx, unknowns, sizeof *seen);
  batten_status st = seen ? transpose(ctx, a, unknowns, &t) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  size_t count = list_pairs(a, &t, seen, NULL);
  st = BATTEN_E_NOMEM;
  pairs = batten_alloc_array(ctx, count, 2 * sizeof *pairs);
  if (!pairs) goto done;
  list_pairs(a, &t, seen, pairs);
  st = block_matrix_new(ctx, unknowns, 1, count, pairs, h);
done:
  batten_free(ctx, pairs);
  incidence_free(ctx, &t);
  batten_free(ctx, seen);
  return st;
}

/* What a leg puts into the matrix: its unknowns and, as combinations of them, the control points of both trajectories
 * [count][n + 1]. */
typedef struct element {
  size_t count;
  const uint32_t *columns;
  double *from, *to, *leg, *product; /* [most][ORDER] each */
} element;

/* place [unknowns] is scratch. */
static void load(const loft_net *net, size_t i, size_t v, size_t *place, element *t) {
  unsigned order = net->degree + 1;
  for (size_t p = 0; p < t->count; p++) place[t->columns[p]] = p;
  memset(t->from, 0, t->count * order * sizeof *t->from);
  memset(t->to, 0, t->count * order * sizeof *t->to);
  for (unsigned r = 0; r < 2 * order; r++) {
    size_t row = row_of(net, i, v, r);
    double *into = (r < order ? t->from : t->to) + r % order;
    for (size_t e = net->z.starts[row]; e < net->z.starts[row + 1]; e++)
      into[place[net->z.indices[e]] * order] = net->z.values[e];
  }
  for (size_t k = 0; k < t->count * order; k++) t->leg[k] = t->to[k] - t->from[k];
}

/* h += rows a rows', rows [count][n + 1]. */
static void add_element(const element *t, unsigned n, const form *a, const double *rows, block_matrix *h) {
  unsigned order = n + 1;
  for (size_t p = 0; p < t->count; p++)
    for (unsigned l = 0; l <= n; l++) {
      double sum = 0;
      for (unsigned k = 0; k <= n; k++) sum += rows[p * order + k] * a->at[k][l];
      t->product[p * order + l] = sum;
    }
  for (size_t p = 0; p < t->count; p++)
    for (size_t q = 0; q <= p; q++) {
      double sum = 0;
      for (unsigned k = 0; k <= n; k++) sum += t->product[p * order + k] * rows[q * order + k];
      if (sum == 0) continue;
      *block_matrix_at(h, t->columns[p], t->columns[q]) += sum;
      if (p != q) *block_matrix_at(h, t->columns[q], t->columns[p]) += sum;
    }
}

static void add_leg(const loft_objective *o, size_t i, size_t v, const element *t, block_matrix *h) {
  const loft_net *net = o->net;
  const loft_space *s = &net->slabs[i].space;
  unsigned n = net->degree;
  form a;
  double weight = 2 * o->weight[o->leg_start[i] + v];
  for (unsigned k = 0; k <= n; k++)
    for (unsigned l = 0; l <= n; l++) a.at[k][l] = weight * (o->sampled.at[k][l] + o->tension * o->bent.at[k][l]);
  add_element(t, n, &a, t->leg, h);
  bool ends[2] = {o->closed || v == 0, !o->closed && v + 2 == s->count};
  for (size_t e = 0; e < 2; e++) {
    if (!ends[e]) continue;
    weight = 2 * objective_trajectory_weight(o, i, v + e);
    for (unsigned k = 0; k <= n; k++)
      for (unsigned l = 0; l <= n; l++) a.at[k][l] = weight * o->bent.at[k][l];
    add_element(t, n, &a, e == 0 ? t->from : t->to, h);
  }
}

batten_status objective_make_matrix(batten_context *ctx, loft_objective *o) {
  const loft_net *net = o->net;
  incidence a = {0};
  size_t *place = NULL;
  double *work = NULL;
  batten_status st = incidence_make(ctx, o, &a);
  if (st >= 0) st = make_pattern(ctx, &a, net->z.columns, &o->h);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  size_t part = a.most * ORDER;
  place = batten_alloc_array(ctx, net->z.columns, sizeof *place);
  work = batten_alloc_array(ctx, part, 4 * sizeof *work);
  if (!place || !work) goto done;
  for (size_t i = 0, leg = 0; i < net->slab_count; i++) {
    st = batten_progress(ctx, "objective", (double)i / (double)net->slab_count);
    if (st < 0) goto done;
    for (size_t v = 0; v < loft_legs(&net->slabs[i].space); v++, leg++) {
      element t = {.count = a.starts[leg + 1] - a.starts[leg], .columns = a.columns + a.starts[leg]};
      t.from = work;
      t.to = work + part;
      t.leg = work + 2 * part;
      t.product = work + 3 * part;
      load(net, i, v, place, &t);
      add_leg(o, i, v, &t, &o->h);
    }
  }
  st = BATTEN_OK;
done:
  batten_free(ctx, work);
  batten_free(ctx, place);
  incidence_free(ctx, &a);
  return st;
}
