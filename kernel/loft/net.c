/* The control points of all patches as functions of free unknowns: what eq. 9 and flat points leave.
 *
 * At a contour between two patches the derivatives by z from below are splines on the knots of the patch below, those
 * from above on the knots of the patch above. Both are the same [eq. 9], so that they lie in the space that both
 * have in common, and any splines of that space will do. The unknowns there are control points y_1 .. y_l in it, of
 * the derivatives in the unit of Bezier differences: with h the height of a patch over a common height,
 *
 *   c_r = x + sum_s (r over s) h^s B y_s        c_(n - r) = x + sum_s (r over s) (-h)^s A y_s        r = 0 .. l
 *
 * above and below the contour, s = 1 .. r, where A and B insert the knots that the patches have beside the common
 * ones and x are the contour's control points. All other c_k of a patch are unknowns themselves, n >= 2 l + 1.
 *
 * A flat vertex has x'' = 0 in all sections of its patch: the control point lies on the line between its neighbours,
 * parted as the Greville abscissas are, those of a run of flat vertices likewise between the control points beside
 * the run. For the derivatives at a contour x'' = 0 is asked for wherever their own x'' takes part in that of a flat
 * vertex of the patch below or above: at inflections, whose knots leave x'' one control point, that is all that is
 * needed; on straight pieces, of which a patch may share but a part, it can be a little more. Without flat vertices
 * the unknowns are all the freedom that there is. */
#include "base/checked.h"
#include "loft_inner.h"

#include <string.h>

/* A spline space of which flat vertices leave some control points: all are `basis` times the free ones. */
typedef struct reduced {
  loft_matrix basis; /* rows of one or two entries */
  size_t first;      /* unknown of the first free control point; each has `each` of them */
  unsigned each;
} reduced;

/* Derivatives at the contour between two patches. */
typedef struct joint {
  loft_space space;
  reduced left;
  loft_matrix insertion[2]; /* into the patch below and above */
  double height;            /* the common one */
} joint;

typedef struct builder {
  batten_context *ctx;
  const loft_stack *stack;
  loft_net *net;
  joint *joints;   /* [slab_count - 1], at contour 1 on */
  reduced *inner;  /* [slab_count] */
  size_t unknowns; /* so far */
} builder;

/* ---- flat vertices ------------------------------------------------------------------------------- */

/* Vertex at control point j; SIZE_MAX at open ends. */
static size_t vertex_at(const loft_space *s, size_t j) {
  if (s->closed) return j > 0 ? j - 1 : s->count - 1;
  return j > 0 && j + 1 < s->count ? j - 1 : SIZE_MAX;
}

static bool is_flat(const loft_space *s, const unsigned char *flat, size_t j) {
  size_t v = vertex_at(s, j);
  return v != SIZE_MAX && flat[v];
}

/* Row `row` := (1 - part) a + part b, a and b columns. */
static void set_row(loft_matrix *m, size_t row, uint32_t a, uint32_t b, double part) {
  size_t at = m->starts[row];
  bool two = m->starts[row + 1] - at == 2;
  bool swap = two && b < a;
  m->indices[at + swap] = a;
  m->values[at + swap] = two ? 1 - part : 1;
  if (!two) return;
  m->indices[at + !swap] = b;
  m->values[at + !swap] = part;
}

/* The control points of the run of flat vertices behind the free control point `from` up to the next free one.
 * Returns that one, not modulo count. */
static size_t fill_run(const loft_space *s, const unsigned char *flat, size_t from, uint32_t column,
                       uint32_t next_column, loft_matrix *m) {
  size_t to = from + 1;
  double whole = loft_interval(s, (ptrdiff_t)from), sofar = 0;
  while (is_flat(s, flat, to % s->count)) whole += loft_interval(s, (ptrdiff_t)(to++ % s->count));
  for (size_t j = from + 1; j < to; j++) {
    sofar += loft_interval(s, (ptrdiff_t)((j - 1) % s->count));
    set_row(m, j % s->count, column, next_column, sofar / whole);
  }
  return to;
}

/* flat [vertices]: not all of a closed space; one is dropped here if they are. */
static batten_status reduce(batten_context *ctx, const loft_space *s, unsigned char *flat, loft_matrix *out) {
  size_t first = 0, frees = 0, entries = 0;
  while (first < s->count && is_flat(s, flat, first)) first++;
  if (first == s->count) flat[vertex_at(s, first = 0)] = 0;
  for (size_t j = 0; j < s->count; j++) frees += !is_flat(s, flat, j);
  loft_matrix m = {.rows = s->count, .columns = frees};
  m.starts = batten_alloc_array(ctx, s->count + 1, sizeof *m.starts);
  m.indices = batten_alloc_array(ctx, s->count, 2 * sizeof *m.indices);
  m.values = batten_alloc_array(ctx, s->count, 2 * sizeof *m.values);
  if (!m.starts || !m.indices || !m.values) {
    loft_matrix_free(ctx, &m);
    return BATTEN_E_NOMEM;
  }
  for (size_t j = 0; j < s->count; j++) {
    m.starts[j] = entries;
    entries += is_flat(s, flat, j) && frees > 1 ? 2 : 1;
  }
  m.starts[s->count] = entries;
  /* Columns by control points; where closed the run around the seam comes last and ends at column 0. */
  uint32_t column = 0;
  for (size_t j = first; j < s->count; column++) {
    set_row(&m, j, column, 0, 0);
    if (j + 1 == s->count && !s->closed) break;
    j = fill_run(s, flat, j, column, column + 1 < frees ? column + 1 : 0, &m);
  }
  *out = m;
  return BATTEN_OK;
}

/* x'' at vertex v is a spline's control point with knots v + 2 .. v + degree + 1. Whether that of the coarse space
 * takes part in that of the fine one, which has all of its knots: B-splines are sums of those finer ones that lie
 * within them and vanish at the ends no less. */
static bool takes_part(const loft_space *coarse, ptrdiff_t w, const loft_space *fine, ptrdiff_t v) {
  ptrdiff_t d = coarse->degree;
  for (int end = 0; end < 2; end++) {
    ptrdiff_t step = end ? -1 : 1, from = end ? d + 1 : 2, folds[2] = {1, 1};
    double outer = loft_knot(coarse, w + from), inner = loft_knot(fine, v + from);
    if (end ? inner > outer : inner < outer) return false;
    if (inner != outer) continue;
    while (folds[0] < d && loft_knot(coarse, w + from + folds[0] * step) == outer) folds[0]++;
    while (folds[1] < d && loft_knot(fine, v + from + folds[1] * step) == inner) folds[1]++;
    if (folds[1] > folds[0]) return false;
  }
  return true;
}

/* Marks flat [vertices of the joint] for the flat vertices of a patch beside it. */
static void mark_joint(const loft_space *s, const loft_slab *slab, unsigned char *flat) {
  ptrdiff_t d = s->degree, count = (ptrdiff_t)s->count, vertices = (ptrdiff_t)loft_vertices(s);
  ptrdiff_t low = s->closed ? -count : 0, high = s->closed ? 2 * count : vertices;
  for (ptrdiff_t v = 0; v < (ptrdiff_t)loft_vertices(&slab->space); v++) {
    if (!slab->wanted || slab->wanted[v] != LOFT_FLAT) continue;
    double left = loft_knot(&slab->space, v + 2), right = loft_knot(&slab->space, v + d + 1);
    while (low < high && loft_knot(s, low + d + 1) < right) low++;
    for (ptrdiff_t w = low; w < high && loft_knot(s, w + 2) <= left; w++)
      if (takes_part(s, w, &slab->space, v)) flat[(w + count) % count] = 1;
  }
}

/* ---- unknowns ------------------------------------------------------------------------------------ */

static void take_unknowns(builder *b, reduced *r, unsigned each) {
  r->first = b->unknowns;
  r->each = each;
  b->unknowns += each * r->basis.columns;
  b->net->equalities += each * (r->basis.rows - r->basis.columns);
}

/* How many control points of patch i beside contour i (end 0) or i + 1 (end 1) are not unknowns of their own. */
static unsigned bound(const builder *b, size_t i, unsigned end) {
  size_t last = b->net->slab_count - 1;
  if (end ? i < last : i > 0) return 1 + b->net->smoothness;
  return b->stack->slopes[end] ? 2 : 1;
}

static batten_status make_inner(builder *b, size_t i) {
  const loft_slab *slab = &b->net->slabs[i];
  size_t vertices = loft_vertices(&slab->space);
  unsigned char *flat = batten_alloc_array(b->ctx, vertices, sizeof *flat);
  if (!flat) return BATTEN_E_NOMEM;
  for (size_t v = 0; v < vertices; v++) flat[v] = slab->wanted && slab->wanted[v] == LOFT_FLAT;
  batten_status st = reduce(b->ctx, &slab->space, flat, &b->inner[i].basis);
  batten_free(b->ctx, flat);
  if (st >= 0) take_unknowns(b, &b->inner[i], b->net->degree + 1 - bound(b, i, 0) - bound(b, i, 1));
  return st;
}

/* At contour i, between patches i - 1 and i. */
static batten_status make_joint(builder *b, size_t i) {
  joint *out = &b->joints[i - 1];
  const loft_contour *at = b->stack->contours + i;
  const loft_slab *beside = b->net->slabs + i - 1;
  batten_status st = loft_space_common(b->ctx, &at[-1].space, &at->space, &at[1].space, &out->space);
  if (st < 0) return st;
  size_t vertices = loft_vertices(&out->space);
  unsigned char *flat = batten_alloc_array(b->ctx, vertices, sizeof *flat);
  if (!flat) return BATTEN_E_NOMEM;
  memset(flat, 0, vertices);
  out->height = 0.5 * (beside[0].gap + beside[1].gap);
  for (size_t e = 0; e < 2 && st >= 0; e++) {
    mark_joint(&out->space, &beside[e], flat);
    st = loft_insertion(b->ctx, &out->space, &beside[e].space, &out->insertion[e]);
  }
  if (st >= 0) st = reduce(b->ctx, &out->space, flat, &out->left.basis);
  batten_free(b->ctx, flat);
  if (st >= 0) take_unknowns(b, &out->left, b->net->smoothness);
  return st;
}

/* ---- rows ---------------------------------------------------------------------------------------- */

static void append(loft_matrix *z, size_t *entries, size_t column, double value) {
  if (z->indices) {
    z->indices[*entries] = (uint32_t)column;
    z->values[*entries] = value;
  }
  ++*entries;
}

/* c_r from the contour on, 0 < r <= l, of the patch below (end 0) or above (1). */
static void joint_row(const joint *at, unsigned end, double gap, size_t j, unsigned r, loft_matrix *z,
                      size_t *entries) {
  const loft_matrix *m = &at->insertion[end], *basis = &at->left.basis;
  uint32_t columns[2 * BSPLINE_ORDER];
  double values[2 * BSPLINE_ORDER], h = (end ? gap : -gap) / at->height;
  size_t used = 0;
  for (size_t e = m->starts[j]; e < m->starts[j + 1]; e++)
    for (size_t f = basis->starts[m->indices[e]]; f < basis->starts[m->indices[e] + 1]; f++) {
      uint32_t column = basis->indices[f];
      double value = m->values[e] * basis->values[f];
      size_t k = 0;
      while (k < used && columns[k] < column) k++;
      if (k < used && columns[k] == column) {
        values[k] += value;
        continue;
      }
      memmove(columns + k + 1, columns + k, (used - k) * sizeof *columns);
      memmove(values + k + 1, values + k, (used - k) * sizeof *values);
      columns[k] = column;
      values[k] = value;
      used++;
    }
  for (size_t k = 0; k < used; k++) {
    double factor = 1;
    for (unsigned s = 1; s <= r; s++) { /* factor = (r over s) h^s */
      factor *= h * (r + 1 - s) / s;
      append(z, entries, at->left.first + columns[k] * at->left.each + s - 1, factor * values[k]);
    }
  }
}

static void inner_row(const reduced *inner, size_t j, unsigned k, loft_matrix *z, size_t *entries) {
  for (size_t e = inner->basis.starts[j]; e < inner->basis.starts[j + 1]; e++)
    append(z, entries, inner->first + inner->basis.indices[e] * inner->each + k, inner->basis.values[e]);
}

/* All rows of z; counts entries while z has no arrays for them. */
static size_t fill_rows(const builder *b) {
  loft_net *net = b->net;
  unsigned n = net->degree, l = net->smoothness;
  size_t entries = 0;
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *slab = &net->slabs[i];
    unsigned low = bound(b, i, 0), high = n - bound(b, i, 1);
    for (size_t j = 0; j < slab->space.count; j++)
      for (unsigned k = 0; k <= n; k++) {
        net->z.starts[loft_at(net, i, j, k)] = entries;
        if (k >= low && k <= high)
          inner_row(&b->inner[i], j, k - low, &net->z, &entries);
        else if (k > 0 && k <= l && i > 0)
          joint_row(&b->joints[i - 1], 1, slab->gap, j, k, &net->z, &entries);
        else if (k < n && k >= n - l && i + 1 < net->slab_count)
          joint_row(&b->joints[i], 0, slab->gap, j, n - k, &net->z, &entries);
      }
  }
  net->z.starts[net->z.rows] = entries;
  return entries;
}

/* The contours, also under what unknowns add to them. */
static void fill_offsets(const builder *b) {
  loft_net *net = b->net;
  for (size_t i = 0; i < net->slab_count; i++) {
    const loft_slab *slab = &net->slabs[i];
    unsigned low = bound(b, i, 0), high = net->degree - bound(b, i, 1);
    for (size_t j = 0; j < slab->space.count; j++)
      for (unsigned k = 0; k <= net->degree; k++)
        for (unsigned x = 0; x < 2; x++)
          net->offset[2 * loft_at(net, i, j, k) + x] = k < low    ? slab->end[0][2 * j + x]
                                                       : k > high ? slab->end[1][2 * j + x]
                                                                  : 0;
  }
}

/* c_1 and c_(n - 1) of the outermost patches from the slopes given there. */
static batten_status add_slopes(const builder *b, unsigned end) {
  loft_net *net = b->net;
  if (!b->stack->slopes[end]) return BATTEN_OK;
  size_t i = end ? net->slab_count - 1 : 0;
  const loft_slab *slab = &net->slabs[i];
  const loft_contour *contour = &b->stack->contours[end ? b->stack->count - 1 : 0];
  loft_matrix m = {0};
  double *slopes = batten_alloc_array(b->ctx, slab->space.count, 2 * sizeof *slopes);
  batten_status st = slopes ? loft_insertion(b->ctx, &contour->space, &slab->space, &m) : BATTEN_E_NOMEM;
  if (st >= 0) {
    loft_matrix_apply(&m, b->stack->slopes[end], slopes);
    double step = (end ? -slab->gap : slab->gap) / net->degree;
    for (size_t j = 0; j < slab->space.count; j++)
      for (unsigned x = 0; x < 2; x++)
        net->offset[2 * loft_at(net, i, j, end ? net->degree - 1 : 1) + x] += step * slopes[2 * j + x];
  }
  loft_matrix_free(b->ctx, &m);
  batten_free(b->ctx, slopes);
  return st;
}

/* ---- the net ------------------------------------------------------------------------------------- */

void loft_net_free(batten_context *ctx, loft_net *net) {
  batten_free(ctx, net->start);
  loft_matrix_free(ctx, &net->z);
  batten_free(ctx, net->offset);
  *net = (loft_net){0};
}

static batten_status make_starts(batten_context *ctx, loft_net *net) {
  size_t rows = 0, bytes;
  net->start = batten_alloc_array(ctx, net->slab_count + 1, sizeof *net->start);
  if (!net->start) return BATTEN_E_NOMEM;
  for (size_t i = 0; i <= net->slab_count; i++) {
    net->start[i] = rows;
    size_t own = 0;
    if (i < net->slab_count) batten_mul(net->slabs[i].space.count, net->degree + 1, &own);
    batten_add(rows, own, &rows);
  }
  /* Unknowns are fewer than rows, of both coordinates they have indices of 32 bits. */
  if (!batten_mul(rows, 2 * sizeof *net->offset, &bytes) || rows > UINT32_MAX / 2)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "contours: %zu patches of too many control points; give fewer knots",
                       net->slab_count);
  net->z.rows = rows;
  return BATTEN_OK;
}

/* Unknowns in the order of z, those of a patch and of a contour by control points. */
static batten_status make_unknowns(builder *b) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < b->net->slab_count && st >= 0; i++) {
    if (i > 0) st = make_joint(b, i);
    if (st >= 0) st = make_inner(b, i);
  }
  return st;
}

static batten_status make_matrix(builder *b) {
  loft_net *net = b->net;
  net->z.columns = b->unknowns;
  net->z.starts = batten_alloc_array(b->ctx, net->z.rows + 1, sizeof *net->z.starts);
  net->offset = batten_alloc_array(b->ctx, net->z.rows, 2 * sizeof *net->offset);
  if (!net->z.starts || !net->offset) return BATTEN_E_NOMEM;
  size_t entries = fill_rows(b);
  net->z.values = batten_alloc_array(b->ctx, entries, sizeof *net->z.values);
  net->z.indices = batten_alloc_array(b->ctx, entries, sizeof *net->z.indices);
  if (!net->z.values || !net->z.indices) return BATTEN_E_NOMEM;
  fill_rows(b);
  return BATTEN_OK;
}

batten_status loft_net_make(batten_context *ctx, const loft_stack *stack, const loft_slab *slabs, unsigned degree,
                            loft_net *out) {
  loft_net net = {.degree = degree, .smoothness = stack->smoothness, .slab_count = stack->count - 1, .slabs = slabs};
  builder b = {.ctx = ctx, .stack = stack, .net = &net};
  size_t count = net.slab_count;
  batten_status st = BATTEN_E_NOMEM;
  b.joints = batten_alloc_array(ctx, count, sizeof *b.joints);
  b.inner = batten_alloc_array(ctx, count, sizeof *b.inner);
  if (b.joints) memset(b.joints, 0, count * sizeof *b.joints);
  if (b.inner) memset(b.inner, 0, count * sizeof *b.inner);
  if (!b.joints || !b.inner) goto done;
  st = make_starts(ctx, &net);
  if (st >= 0) st = make_unknowns(&b);
  if (st >= 0) st = make_matrix(&b);
  if (st >= 0) fill_offsets(&b);
  for (unsigned end = 0; end < 2 && st >= 0; end++) st = add_slopes(&b, end);
  if (st >= 0) {
    *out = net;
    net = (loft_net){0};
  }
done:
  for (size_t i = 0; i < count; i++) {
    if (b.inner) loft_matrix_free(ctx, &b.inner[i].basis);
    if (!b.joints) continue;
    loft_space_free(ctx, &b.joints[i].space);
    loft_matrix_free(ctx, &b.joints[i].left.basis);
    for (size_t e = 0; e < 2; e++) loft_matrix_free(ctx, &b.joints[i].insertion[e]);
  }
  batten_free(ctx, b.inner);
  batten_free(ctx, b.joints);
  loft_net_free(ctx, &net);
  return st;
}

void loft_net_expand(const loft_net *net, const double *y, double *control) {
  loft_matrix_apply(&net->z, y, control);
  for (size_t k = 0; k < 2 * net->z.rows; k++) control[k] += net->offset[k];
}
