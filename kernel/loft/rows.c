/* Separators, and the inequalities that they give.   [eq. 10, 11]
 *
 * A turn is no linear function of the unknowns. But when a direction w(zeta) is fixed beforehand, that the leg p
 * before the vertex stays to the right of it, and the leg q behind it to the left, is linear, and so are the limits
 * further away: with [a, b] = a_1 b_2 - a_2 b_1 and R(angle) a rotation
 *
 *   [R(lower/2) p, w] >= 0,  [w, R(upper/2) p] >= 0,  [R(lower/2) w, q] >= 0,  [q, R(upper/2) w] >= 0
 *
 * leave p between w turned by -upper/2 and by -lower/2, q likewise beyond w, and the turn between lower and upper:
 * for whatever w. Each is one inequality for every Bernstein coefficient of a product of degree n + 4.
 *
 * w halves the turns of the last surface; a polynomial through its directions at five heights. Fixed directions would
 * not do: legs may turn by more from contour to contour than the polygon does at the vertex. Where that surface turns
 * to the wrong side, directions of the legs are moved first so that they turn to the right one: else w of
 * neighbouring vertices come in the wrong order, and no leg fits between them. On shorter pieces of zeta coefficients
 * say no more than the product itself. */
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "loft_inner.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1, SIDES = 4, PRODUCTS = ORDER + LOFT_FIELD, SWEEPS = 400 };

static const double PI = 3.14159265358979323846;

/* By how much turns are to hold in inequalities better than they must, as a part of what the contours have to spare.
 */
static const double BETTER = 0.25;
/* Directions of legs are moved until turns have this part of what they would have if they turned evenly. */
static const double EVEN = 0.1;
/* By which inequalities are raised, radians, where the contours turn by more than a hundred times that. */
static const double INSIDE = 1e-7;

/* ---- directions --------------------------------------------------------------------------------- */

static size_t nodes_of(unsigned depth) { return ((size_t)LOFT_FIELD << depth) + 1; }

void loft_directions_free(batten_context *ctx, loft_directions *d) {
  batten_free(ctx, d->turned);
  *d = (loft_directions){.turned = NULL};
}

static void value_at(unsigned n, double (*leg)[2], double zeta, double out[2]) {
  double left[ORDER][2], right[ORDER][2];
  bezier_split(n, 2, leg[0], zeta, left[0], right[0]);
  out[0] = right[0][0];
  out[1] = right[0][1];
}

/* The turn at vertex v when directions turn evenly from contour to contour. */
static double even_turn(const loft_slab *slab, size_t v, double zeta) {
  return (1 - zeta) * loft_turn(slab, 0, v) + zeta * loft_turn(slab, 1, v);
}

static double even_angle(const loft_slab *slab, size_t v, double zeta) {
  return (1 - zeta) * slab->angle[0][v] + zeta * slab->angle[1][v];
}

/* Moves the legs beside one vertex, the shorter one more, when its turn does not hold. */
static bool straighten(const loft_slab *slab, size_t v, double zeta, const loft_bound *bound, double *turned) {
  size_t next = v + 1 < loft_legs(&slab->space) ? v + 1 : 0;
  double even = even_turn(slab, v, zeta), turn = even + turned[next] - turned[v];
  double lower = bound->lower > 0 ? fmax(bound->lower, EVEN * even) : bound->lower;
  double upper = bound->upper < 0 ? fmin(bound->upper, EVEN * even) : bound->upper;
  double move = turn < lower ? lower - turn : turn > upper ? upper - turn : 0;
  if (move == 0) return false;
  double before = slab->length[0][v] + slab->length[1][v], after = slab->length[0][next] + slab->length[1][next];
  turned[v] -= move * after / (before + after);
  turned[next] += move * before / (before + after);
  return fabs(move) > 1e-6;
}

batten_status loft_directions_make(batten_context *ctx, const loft_net *net, const double *control, size_t i,
                                   double margin, unsigned depth, loft_directions *out) {
  const loft_slab *slab = &net->slabs[i];
  size_t legs = loft_legs(&slab->space), vertices = loft_vertices(&slab->space), nodes = nodes_of(depth);
  loft_directions d = {.slab = i, .depth = depth, .whole = true};
  loft_bound bound;
  d.turned = batten_alloc_array(ctx, nodes * legs, sizeof *d.turned);
  if (!d.turned) return BATTEN_E_NOMEM;
  for (size_t v = 0; v < legs; v++) {
    double leg[ORDER][2];
    loft_leg(net, control, i, v, leg);
    for (size_t r = 0; r < nodes; r++) {
      double zeta = (double)r / (double)(nodes - 1), at[2];
      value_at(net->degree, leg, zeta, at);
      double off = remainder(atan2(at[1], at[0]) - even_angle(slab, v, zeta), 2 * PI);
      d.turned[r * legs + v] = isnan(off) ? 0 : off;
    }
  }
  for (size_t v = 0; v < vertices && d.whole; v++)
    d.whole = !loft_bound_of(slab, v, margin, &bound) || loft_shortage(net, control, i, v, &bound) == 0;
  for (size_t r = 1; r + 1 < nodes && !d.whole; r++) {
    double zeta = (double)r / (double)(nodes - 1);
    bool moved = true;
    for (int sweep = 0; sweep < SWEEPS && moved; sweep++) {
      moved = false;
      for (size_t k = 0; k < vertices; k++) {
        size_t v = sweep % 2 ? vertices - 1 - k : k;
        if (loft_bound_of(slab, v, margin, &bound) && straighten(slab, v, zeta, &bound, d.turned + r * legs))
          moved = true;
      }
    }
  }
  *out = d;
  return BATTEN_OK;
}

/* ---- pieces ------------------------------------------------------------------------------------- */

void loft_pieces_free(batten_context *ctx, loft_pieces *p) {
  batten_free(ctx, p->all);
  *p = (loft_pieces){.all = NULL};
}

/* The polynomial through directions [LOFT_FIELD + 1] at equal distances. */
static void interpolate(double (*at)[2], double (*w)[2]) {
  static const double through[LOFT_FIELD + 1][LOFT_FIELD + 1] = {{36, 0, 0, 0, 0},
                                                                 {-39, 144, -108, 48, -9},
                                                                 {26, -128, 240, -128, 26},
                                                                 {-9, 48, -108, 144, -39},
                                                                 {0, 0, 0, 0, 36}};
  for (unsigned k = 0; k <= LOFT_FIELD; k++)
    for (unsigned x = 0; x < 2; x++) {
      double sum = 0;
      for (unsigned j = 0; j <= LOFT_FIELD; j++) sum += through[k][j] * at[j][x];
      w[k][x] = sum / 36;
    }
}

/* Halves the turn, on the part index of 2^depth. */
static void separator(const loft_net *net, const loft_directions *d, size_t v, unsigned depth, size_t index,
                      double (*w)[2]) {
  const loft_slab *slab = &net->slabs[d->slab];
  size_t legs = loft_legs(&slab->space), nodes = nodes_of(d->depth), step = (size_t)1 << (d->depth - depth);
  size_t next = v + 1 < legs ? v + 1 : 0;
  double at[LOFT_FIELD + 1][2];
  for (size_t j = 0; j <= LOFT_FIELD; j++) {
    size_t r = (LOFT_FIELD * index + j) * step;
    double zeta = (double)r / (double)(nodes - 1);
    const double *turned = d->turned + r * legs;
    double angle = even_angle(slab, v, zeta) + (even_turn(slab, v, zeta) + turned[v] + turned[next]) / 2;
    at[j][0] = cos(angle);
    at[j][1] = sin(angle);
  }
  interpolate(at, w);
}

/* Inequality `side` as sign [leg, turned w]: which leg, 0 or 1, sign and angle. */
static unsigned side_of(const loft_bound *bound, unsigned side, double *sign, double *angle) {
  *sign = side == 0 || side == 3 ? 1 : -1;
  double half = (side % 2 ? bound->upper : bound->lower) / 2;
  *angle = side < 2 ? -half : half;
  return side / 2;
}

static double leg_length(const loft_slab *slab, size_t v) { return (slab->length[0][v] + slab->length[1][v]) / 2; }

/* w turned and divided by the leg's length, times a sign. */
static void turned_field(const loft_piece *piece, unsigned side, double length, double (*u)[2]) {
  double sign, angle;
  side_of(&piece->bound, side, &sign, &angle);
  double c = cos(angle) * sign / length, s = sin(angle) * sign / length;
  for (unsigned k = 0; k <= LOFT_FIELD; k++) {
    u[k][0] = c * piece->w[k][0] - s * piece->w[k][1];
    u[k][1] = s * piece->w[k][0] + c * piece->w[k][1];
  }
}

static double product_weight(unsigned n, unsigned k, unsigned q) {
  return bezier_binomial[n][k] * bezier_binomial[LOFT_FIELD][q];
}

/* C(m, r), m up to 13. */
static double choose(unsigned m, unsigned r) {
  if (m <= BEZIER_DEGREE_MAX) return bezier_binomial[m][r];
  return (r > 0 ? bezier_binomial[m - 1][r - 1] : 0) + (r < m ? bezier_binomial[m - 1][r] : 0);
}

/* Coefficients of [leg, u], leg [n + 1] on the piece. */
static void products(unsigned n, double (*leg)[2], double (*u)[2], double *out) {
  for (unsigned r = 0; r <= n + LOFT_FIELD; r++) out[r] = 0;
  for (unsigned k = 0; k <= n; k++)
    for (unsigned q = 0; q <= LOFT_FIELD; q++) out[k + q] += product_weight(n, k, q) * loft_cross(leg[k], u[q]);
  for (unsigned r = 0; r <= n + LOFT_FIELD; r++) out[r] /= choose(n + LOFT_FIELD, r);
}

/* Values of all inequalities of a piece, less their lower sides. */
static void piece_values(const loft_net *net, const double *control, const loft_piece *piece,
                         double (*values)[PRODUCTS]) {
  const loft_slab *slab = &net->slabs[piece->slab];
  unsigned n = net->degree;
  size_t legs = loft_legs(&slab->space);
  for (unsigned side = 0; side < SIDES; side++) {
    double leg[ORDER][2], left[ORDER][2], right[ORDER][2], u[LOFT_FIELD + 1][2];
    size_t v = piece->vertex + side / 2;
    if (v >= legs) v = 0;
    loft_leg(net, control, piece->slab, v, leg);
    bezier_split(n, 2, leg[0], piece->from, left[0], right[0]);
    bezier_split(n, 2, right[0], (piece->to - piece->from) / (1 - piece->from), left[0], leg[0]);
    turned_field(piece, side, leg_length(slab, v), u);
    products(n, left, u, values[side]);
    for (unsigned r = 0; r <= n + LOFT_FIELD; r++) values[side][r] -= piece->inside;
  }
}

/* Coefficients r of a piece that are the contours' alone. */
static bool given(const loft_piece *piece, unsigned n, unsigned r) {
  return (r == 0 && piece->from == 0) || (r == n + LOFT_FIELD && piece->to == 1);
}

static double smallest(unsigned n, const loft_piece *piece, double (*values)[PRODUCTS]) {
  double least = INFINITY;
  for (unsigned side = 0; side < SIDES; side++)
    for (unsigned r = 0; r <= n + LOFT_FIELD; r++)
      if (!given(piece, n, r)) least = fmin(least, values[side][r]);
  return least;
}

static bool reserve_piece(batten_context *ctx, loft_pieces *p) {
  if (p->count < p->room) return true;
  size_t room = p->room + p->room / 2 + 16;
  loft_piece *larger = batten_realloc_array(ctx, p->all, room, sizeof *larger);
  if (!larger) return false;
  p->all = larger;
  p->room = room;
  return true;
}

/* A bound that inequalities ask for: a part better than what must hold. */
static loft_bound better(const loft_slab *slab, size_t v, const loft_bound *bound) {
  double turns[2] = {loft_turn(slab, 0, v), loft_turn(slab, 1, v)};
  double least = fmin(turns[0], turns[1]), most = fmax(turns[0], turns[1]);
  double low = fmin(BETTER * fabs(bound->lower), (least - bound->lower) / 2);
  double high = fmin(BETTER * fabs(bound->upper), (bound->upper - most) / 2);
  return (loft_bound){bound->lower + fmin(low, BETTER / 10), bound->upper - fmin(high, BETTER / 10)};
}

batten_status loft_pieces_add(batten_context *ctx, const loft_net *net, const double *control,
                              const loft_directions *d, size_t v, double margin, unsigned least, size_t group,
                              loft_pieces *out, bool *strict) {
  const loft_slab *slab = &net->slabs[d->slab];
  loft_piece piece = {.slab = d->slab, .vertex = v, .group = group};
  loft_bound bound;
  *strict = true;
  if (!loft_bound_of(slab, v, margin, &bound)) return BATTEN_OK;
  piece.bound = better(slab, v, &bound);
  double smaller = fmin(fabs(loft_turn(slab, 0, v)), fabs(loft_turn(slab, 1, v)));
  piece.turn = slab->wanted[v] == LOFT_FREE ? 1 : smaller;
  piece.inside = fmin(INSIDE, piece.turn / 100);
  bool bisect = loft_shortage(net, control, d->slab, v, &bound) == 0;
  unsigned depth = 0;
  size_t index = 0;
  while (index < (size_t)1 << depth) {
    piece.from = ldexp((double)index, -(int)depth);
    piece.to = ldexp((double)index + 1, -(int)depth);
    separator(net, d, v, depth, index, piece.w);
    double values[SIDES][PRODUCTS];
    piece_values(net, control, &piece, values);
    bool holds = smallest(net->degree, &piece, values) >= 0;
    if (depth < d->depth && (depth < least || (bisect && !holds))) {
      depth++;
      index *= 2;
      continue;
    }
    if (!holds) *strict = false;
    if (!reserve_piece(ctx, out)) return BATTEN_E_NOMEM;
    out->all[out->count++] = piece;
    for (index++; depth > 0 && index % 2 == 0; depth--) index /= 2;
  }
  return BATTEN_OK;
}

/* ---- rows --------------------------------------------------------------------------------------- */

size_t loft_rows_each(const loft_net *net) { return SIDES * (net->degree + LOFT_FIELD + 1); }

void loft_rows_free(batten_context *ctx, loft_rows *r) {
  batten_free(ctx, r->group);
  batten_free(ctx, r->lower);
  batten_free(ctx, r->values);
  batten_free(ctx, r->indices);
  batten_free(ctx, r->starts);
  *r = (loft_rows){.columns = r->columns};
}

static bool grow(batten_context *ctx, void *array, size_t count, size_t size) {
  void **block = array;
  void *larger = batten_realloc_array(ctx, *block, count, size);
  if (larger) *block = larger;
  return larger != NULL;
}

static batten_status reserve_row(batten_context *ctx, loft_rows *r, size_t entries) {
  bool all = true;
  if (r->rows == r->row_room) {
    size_t room = r->row_room + r->row_room / 2 + 64;
    all = grow(ctx, &r->lower, room, sizeof *r->lower) && grow(ctx, &r->group, room, sizeof *r->group) &&
          grow(ctx, &r->starts, room + 1, sizeof *r->starts);
    if (all) r->row_room = room;
  }
  if (all && r->entries + entries > r->entry_room) {
    size_t room = r->entries + entries + r->entry_room / 2;
    all = grow(ctx, &r->indices, room, sizeof *r->indices) && grow(ctx, &r->values, room, sizeof *r->values);
    if (all) r->entry_room = room;
  }
  return all ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* One leg's control points by the unknowns that they depend on. */
typedef struct leg_table {
  size_t count;      /* unknowns */
  uint32_t *columns; /* [count] ascending */
  double *table;     /* [n + 1][count] */
  double offset[ORDER][2];
} leg_table;

static int compare_columns(const void *a, const void *b) {
  uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
  return x < y ? -1 : x > y;
}

static size_t find_column(const leg_table *t, uint32_t column) {
  size_t low = 0, high = t->count;
  while (low + 1 < high) {
    size_t middle = (low + high) / 2;
    if (t->columns[middle] <= column)
      low = middle;
    else
      high = middle;
  }
  return low;
}

static batten_status leg_table_make(batten_context *ctx, const loft_net *net, size_t i, size_t v, leg_table *t) {
  const loft_space *space = &net->slabs[i].space;
  unsigned n = net->degree;
  size_t ends[2] = {v, v + 1}, room = 0, count = 0;
  if (space->closed && ends[1] == space->count) ends[1] = 0;
  for (int e = 0; e < 2; e++)
    room += net->z.starts[loft_at(net, i, ends[e], n) + 1] - net->z.starts[loft_at(net, i, ends[e], 0)];
  t->columns = batten_alloc_array(ctx, room, sizeof *t->columns);
  t->table = batten_alloc_array(ctx, room, (n + 1) * sizeof *t->table);
  if (!t->columns || !t->table) return BATTEN_E_NOMEM;
  for (int e = 0; e < 2; e++)
    for (size_t at = net->z.starts[loft_at(net, i, ends[e], 0)]; at < net->z.starts[loft_at(net, i, ends[e], n) + 1];
         at++)
      t->columns[count++] = net->z.indices[at];
  if (count > 0) qsort(t->columns, count, sizeof *t->columns, compare_columns);
  t->count = 0;
  for (size_t k = 0; k < count; k++)
    if (k == 0 || t->columns[k] != t->columns[k - 1]) t->columns[t->count++] = t->columns[k];
  memset(t->table, 0, t->count * (n + 1) * sizeof *t->table);
  for (unsigned k = 0; k <= n; k++) {
    for (unsigned x = 0; x < 2; x++)
      t->offset[k][x] =
          net->offset[2 * loft_at(net, i, ends[1], k) + x] - net->offset[2 * loft_at(net, i, ends[0], k) + x];
    for (int e = 0; e < 2; e++) {
      size_t row = loft_at(net, i, ends[e], k);
      for (size_t at = net->z.starts[row]; at < net->z.starts[row + 1]; at++)
        t->table[k * t->count + find_column(t, net->z.indices[at])] += e ? net->z.values[at] : -net->z.values[at];
    }
  }
  return BATTEN_OK;
}

static void leg_table_free(batten_context *ctx, leg_table *t) {
  batten_free(ctx, t->table);
  batten_free(ctx, t->columns);
}

/* Coefficient r of [leg on the piece, u] as sum_k g_k . e_k of the whole leg's control points. */
static void coefficient(unsigned n, const loft_piece *piece, double (*u)[2], unsigned r, double (*g)[2]) {
  double part[ORDER][2], total = choose(n + LOFT_FIELD, r);
  for (unsigned k = 0; k <= n; k++) {
    part[k][0] = part[k][1] = 0;
    if (k > r || r - k > LOFT_FIELD) continue;
    double weight = product_weight(n, k, r - k) / total;
    part[k][0] = weight * u[r - k][1];
    part[k][1] = -weight * u[r - k][0];
  }
  for (unsigned j = 0; j <= n; j++) {
    double unit[ORDER] = {0}, left[ORDER], right[ORDER];
    unit[j] = 1;
    bezier_split(n, 1, unit, piece->from, left, right);
    bezier_split(n, 1, right, (piece->to - piece->from) / (1 - piece->from), left, unit);
    g[j][0] = g[j][1] = 0;
    for (unsigned k = 0; k <= n; k++)
      for (unsigned x = 0; x < 2; x++) g[j][x] += left[k] * part[k][x];
  }
}

static batten_status add_row(batten_context *ctx, unsigned n, const leg_table *t, double (*g)[2],
                             const loft_piece *piece, loft_rows *rows) {
  batten_status st = reserve_row(ctx, rows, 2 * t->count);
  if (st < 0) return st;
  double given = 0;
  for (unsigned k = 0; k <= n; k++) given += g[k][0] * t->offset[k][0] + g[k][1] * t->offset[k][1];
  if (rows->rows == 0) rows->starts[0] = 0;
  for (size_t p = 0; p < t->count; p++)
    for (unsigned x = 0; x < 2; x++) {
      double sum = 0;
      for (unsigned k = 0; k <= n; k++) sum += g[k][x] * t->table[k * t->count + p];
      if (sum == 0) continue;
      rows->indices[rows->entries] = 2 * t->columns[p] + x;
      rows->values[rows->entries++] = sum;
    }
  if (rows->entries == rows->starts[rows->rows]) return BATTEN_OK;
  rows->lower[rows->rows] = piece->inside - given;
  rows->group[rows->rows++] = piece->group;
  rows->starts[rows->rows] = rows->entries;
  return BATTEN_OK;
}

batten_status loft_rows_add(batten_context *ctx, const loft_net *net, const double *control, loft_piece *piece,
                            double below, double near, loft_rows *rows) {
  const loft_slab *slab = &net->slabs[piece->slab];
  unsigned n = net->degree;
  size_t legs = loft_legs(&slab->space);
  double values[SIDES][PRODUCTS];
  batten_status st = BATTEN_OK;
  piece_values(net, control, piece, values);
  if (!(smallest(n, piece, values) < below)) return BATTEN_OK;
  for (unsigned half = 0; half < 2 && st >= 0; half++) {
    size_t v = piece->vertex + half < legs ? piece->vertex + half : 0;
    leg_table table = {.count = 0};
    for (unsigned side = 2 * half; side < 2 * half + 2 && st >= 0; side++) {
      double u[LOFT_FIELD + 1][2], g[ORDER][2];
      turned_field(piece, side, leg_length(slab, v), u);
      for (unsigned r = 0; r <= n + LOFT_FIELD && st >= 0; r++) {
        uint64_t bit = (uint64_t)1 << (side * (n + LOFT_FIELD + 1) + r);
        if (given(piece, n, r) || !(values[side][r] < near) || (piece->used & bit)) continue;
        if (!table.columns) st = leg_table_make(ctx, net, piece->slab, v, &table);
        if (st < 0) break;
        coefficient(n, piece, u, r, g);
        st = add_row(ctx, n, &table, g, piece, rows);
        piece->used |= bit;
      }
    }
    leg_table_free(ctx, &table);
  }
  return st;
}
