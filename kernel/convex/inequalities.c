/* Linear inequalities around a reference surface.   [section 4, eqs. 7 and 9]
 *
 * Each is c (x) t: a combination c of the control points of a span pair, which is one of the coefficients of a
 * derivative on a box, in a direction t. For a box with coefficient vectors w of x_u and x_v and of the second
 * derivatives, t is a facet of their cone, or a ray t_k of the cross products' with c a form of (x_uu, x_uv, x_vv);
 * see boxes.h. So most of the work of a row is to write it down. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "convex/boxes.h"
#include "mesh/vec.h"

/* Rows under way. Entries of a sparse row are the nonzero coefficients' three columns each. */
typedef struct writer {
  const convex_space *space;
  double margin;
  bool dense;
  size_t columns, rows;
  double *values, *lower;
  size_t *starts;    /* sparse: [rows + 1] */
  uint32_t *indices; /* sparse */
  struct slot {
    uint32_t row, hash; /* row + 1; 0 = free */
  } * table;
  size_t mask;
} writer;

static uint64_t mix(uint64_t hash, double value) {
  uint64_t bits;
  value += 0.0; /* one zero */
  memcpy(&bits, &value, sizeof bits);
  hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
  return hash ^ (hash >> 29);
}

/* Start and number of entries of a row. */
static size_t row_start(const writer *w, size_t row) { return w->dense ? row * w->columns : w->starts[row]; }

static bool same_row(const writer *w, size_t a, size_t b) {
  size_t at = row_start(w, a), bt = row_start(w, b), count = row_start(w, a + 1) - at;
  return row_start(w, b + 1) - bt == count &&
         (w->dense || memcmp(w->indices + at, w->indices + bt, count * sizeof *w->indices) == 0) &&
         memcmp(w->values + at, w->values + bt, count * sizeof *w->values) == 0;
}

/* Keeps the row that was written last, unless it is there already. */
static void keep(writer *w, uint64_t hash, double lower) {
  size_t row = w->rows, at = (size_t)(hash >> 20) & w->mask;
  for (; w->table[at].row; at = (at + 1) & w->mask)
    if (w->table[at].hash == (uint32_t)hash && same_row(w, w->table[at].row - 1, row)) {
      double *other = &w->lower[w->table[at].row - 1];
      *other = fmax(*other, lower);
      return;
    }
  w->table[at] = (struct slot){(uint32_t)row + 1, (uint32_t)hash};
  w->lower[row] = lower;
  w->rows++;
}

/* Rows c (x) t for some directions of length 1; c [points of the span pair] is scaled. */
static void write_rows(writer *w, const convex_patch *p, const convex_box *box, double *c, size_t count,
                       double (*directions)[3]) {
  const bspline *axis = w->space->axis;
  size_t m = axis[0].degree, n = axis[1].degree, net = (m + 1) * (n + 1);
  double size = 0, sign = 0, value[3] = {0};
  for (size_t i = 0; i < net; i++) {
    size += c[i] * c[i];
    if (sign == 0 && c[i] != 0) sign = c[i] > 0 ? 1 : -1;
  }
  if (!(size > 0)) return; /* nothing is asked */
  /* -c (x) -t is the same row: the first nonzero coefficient is positive. */
  double scale = sign / sqrt(size);
  uint64_t hash = 0;
  uint32_t column[CONVEX_NET], used[CONVEX_NET];
  size_t entries = 0;
  for (size_t i = 0; i < net; i++) {
    c[i] *= scale;
    if (c[i] == 0 && !w->dense) continue;
    size_t point = (box->span[0] - m + i / (n + 1)) * axis[1].count + box->span[1] - n + i % (n + 1);
    column[entries] = (uint32_t)(3 * point);
    used[entries++] = (uint32_t)i;
    hash = mix(hash + point, c[i]);
    for (int k = 0; k < 3; k++) value[k] += c[i] * p->points[i][k];
  }
  for (size_t d = 0; d < count; d++) {
    double t[3];
    uint64_t row_hash = hash;
    for (int k = 0; k < 3; k++) {
      t[k] = sign * directions[d][k] + 0.0;
      row_hash = mix(row_hash, t[k]);
    }
    size_t at = row_start(w, w->rows);
    for (size_t e = 0; e < entries; e++)
      for (size_t k = 0; k < 3; k++) w->values[at + 3 * e + k] = c[used[e]] * t[k] + 0.0;
    if (!w->dense) {
      for (size_t e = 0; e < entries; e++)
        for (uint32_t k = 0; k < 3; k++) w->indices[at + 3 * e + k] = column[e] + k;
      w->starts[w->rows + 1] = at + 3 * entries;
    }
    keep(w, row_hash, w->margin * vec_dot(t, value));
  }
}

/* c [m + 1][n + 1] = outer product of a row of each axis. */
static void outer(size_t m, size_t n, const double *a, const double *b, double *c) {
  for (size_t i = 0; i <= m; i++)
    for (size_t j = 0; j <= n; j++) c[i * (n + 1) + j] = a[i] * b[j];
}

static void write_cones(writer *w, const convex_patch *p, const convex_box *box) {
  size_t m = w->space->axis[0].degree, n = w->space->axis[1].degree;
  double c[CONVEX_NET], facets[4][3];
  for (int d = 0; d < 2; d++) {
    convex_cone wide = convex_cone_widen(&p->cone[d], box->delta);
    convex_cone_facets(&wide, facets);
    const double *along_u = d == 0 ? p->rows[0].first : p->rows[0].value,
                 *along_v = d == 1 ? p->rows[1].first : p->rows[1].value;
    for (size_t r = 0; r < (d == 0 ? m : m + 1); r++)
      for (size_t s = 0; s < (d == 1 ? n : n + 1); s++) {
        outer(m, n, along_u + r * (m + 1), along_v + s * (n + 1), c);
        write_rows(w, p, box, c, 4, facets);
      }
  }
}

static void write_forms(writer *w, const convex_patch *p, const convex_box *box, unsigned directions) {
  size_t m = w->space->axis[0].degree, n = w->space->axis[1].degree;
  double c[CONVEX_NET], rays[CONVEX_CROSS_RAYS][3];
  memcpy(rays, p->rays, sizeof rays);
  for (size_t k = 0; k < p->ray_count; k++) vec_normalize(rays[k]);
  for (size_t r = 0; r <= m; r++)
    for (size_t s = 0; s <= n; s++) {
      const double *u0 = p->rows[0].value + r * (m + 1), *u1 = p->rows[0].first_raised + r * (m + 1),
                   *u2 = p->rows[0].second_raised + r * (m + 1);
      const double *v0 = p->rows[1].value + s * (n + 1), *v1 = p->rows[1].first_raised + s * (n + 1),
                   *v2 = p->rows[1].second_raised + s * (n + 1);
      for (unsigned a = 0; a < directions; a++) {
        const double *form = p->form[a];
        double along[2] = {0}; /* of x_u and x_v that the form's combination loses */
        for (int h = 0; h < 3; h++)
          for (int k = 0; k < 2; k++) along[k] += form[h] * p->along[h][k];
        for (size_t i = 0; i <= m; i++) {
          double w0 = form[0] * u2[i] - along[0] * u1[i], w1 = form[1] * u1[i] - along[1] * u0[i],
                 w2 = form[2] * u0[i];
          for (size_t j = 0; j <= n; j++) c[i * (n + 1) + j] = w0 * v0[j] + w1 * v1[j] + w2 * v2[j];
        }
        write_rows(w, p, box, c, p->ray_count, rays);
      }
    }
}

/* Room for all rows of the boxes. */
static batten_status writer_start(batten_context *ctx, writer *w, const convex_space *space, size_t boxes,
                                  const convex_box *box) {
  size_t rows = 0, entries, slots = 16;
  for (size_t b = 0; b < boxes; b++) rows += box[b].rows;
  if (rows > UINT32_MAX / 4 || convex_points(space) > UINT32_MAX / 3)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu inequalities for %zu control points are too many", rows,
                       convex_points(space));
  size_t net = (space->axis[0].degree + 1) * (size_t)(space->axis[1].degree + 1);
  w->space = space;
  w->dense = net == convex_points(space);
  w->columns = 3 * convex_points(space);
  while (slots < 2 * rows) slots *= 2;
  w->mask = slots - 1;
  if (!batten_mul3(rows, 3, net, &entries)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu inequalities", rows);
  w->values = batten_alloc_array(ctx, entries, sizeof *w->values);
  w->lower = batten_alloc_array(ctx, rows, sizeof *w->lower);
  w->table = batten_alloc_array(ctx, slots, sizeof *w->table);
  if (!w->dense) {
    w->starts = batten_alloc_array(ctx, rows + 1, sizeof *w->starts);
    w->indices = batten_alloc_array(ctx, entries, sizeof *w->indices);
  }
  if (!w->values || !w->lower || !w->table || (!w->dense && (!w->starts || !w->indices))) return BATTEN_E_NOMEM;
  memset(w->table, 0, slots * sizeof *w->table);
  if (!w->dense) w->starts[0] = 0;
  return BATTEN_OK;
}

static void writer_free(batten_context *ctx, writer *w) {
  batten_free(ctx, w->values);
  batten_free(ctx, w->lower);
  batten_free(ctx, w->starts);
  batten_free(ctx, w->indices);
  batten_free(ctx, w->table);
}

batten_status convex_rows_make(batten_context *ctx, const convex_space *space, const double *reference,
                               const convex_row_options *opt, bool *accepted, convex_rows *out) {
  convex_box *boxes = NULL;
  convex_patch *patch = NULL;
  size_t count = 0;
  int sign;
  writer w = {.margin = opt->margin};
  batten_status status = convex_boxes_make(ctx, space, reference, opt, accepted, &sign, out ? &boxes : NULL, &count);
  if (status < 0 || !*accepted || !out) goto done;

  status = BATTEN_E_NOMEM;
  patch = batten_alloc(ctx, sizeof *patch);
  if (!patch) goto done;
  status = writer_start(ctx, &w, space, count, boxes);
  if (status < 0) goto done;
  unsigned depth = 0;
  for (size_t b = 0; b < count; b++) {
    convex_patch_set(patch, space, reference, &boxes[b]);
    convex_patch_measure(patch, sign, opt->directions, boxes[b].delta);
    write_cones(&w, patch, &boxes[b]);
    write_forms(&w, patch, &boxes[b], opt->directions);
    for (int d = 0; d < 2; d++) depth = boxes[b].depth[d] > depth ? boxes[b].depth[d] : depth;
  }
  *out = (convex_rows){w.dense ? batten_matrix_dense(w.rows, w.columns, w.values)
                               : batten_matrix_sparse(w.rows, w.columns, w.starts, w.indices, w.values),
                       w.lower, count, depth, sign};
  w.values = w.lower = NULL;
  w.starts = NULL;
  w.indices = NULL;
done:
  writer_free(ctx, &w);
  batten_free(ctx, patch);
  batten_free(ctx, boxes);
  return status;
}

void convex_rows_free(batten_context *ctx, convex_rows *rows) {
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.dense);
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.starts);
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.indices);
  batten_free(ctx, (void *)(uintptr_t)rows->matrix.values);
  batten_free(ctx, rows->lower);
  *rows = (convex_rows){0};
}
