/* Boxes of the domain on which the reference surface is convex enough for linear inequalities.
 *
 * Span pairs are the first boxes. One on which the inequalities would be too near to what the reference has is
 * halved: the cones of derivatives become narrow like the box, the cross products come near to one normal, and the
 * matrices near to the second fundamental form there, so that bisection ends when that is definite. */
#include "convex/boxes.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "mesh/vec.h"

/* Bernstein coefficients, rows of `width`, from degree to degree + 1, in place. */
static void raise_degree(unsigned degree, unsigned width, double *rows) {
  for (unsigned i = degree + 1; i > 0; i--)
    for (unsigned j = 0; j < width; j++) {
      double part = (double)i / (degree + 1), own = i <= degree ? rows[i * width + j] : 0;
      rows[i * width + j] = part * rows[(i - 1) * width + j] + (1 - part) * own;
    }
}

static void axis_rows(const bspline *axis, size_t span, double lower, double upper, convex_axis_rows *out) {
  unsigned d = axis->degree, width = d + 1;
  bspline_rows(axis, span, 0, lower, upper, out->value);
  bspline_rows(axis, span, 1, lower, upper, out->first);
  memcpy(out->first_raised, out->first, d * width * sizeof *out->first);
  raise_degree(d - 1, width, out->first_raised);
  bspline_rows(axis, span, 2, lower, upper, out->second_raised);
  raise_degree(d - 2, width, out->second_raised);
  raise_degree(d - 1, width, out->second_raised);
}

/* half [width0][count1] = points times rows1, along v. */
static void along_v(unsigned width0, unsigned width1, unsigned count1, double (*points)[3], const double *rows1,
                    double (*half)[3]) {
  for (unsigned i = 0; i < width0; i++)
    for (unsigned s = 0; s < count1; s++) {
      double sum[3] = {0};
      for (unsigned j = 0; j < width1; j++)
        for (int k = 0; k < 3; k++) sum[k] += rows1[s * width1 + j] * points[i * width1 + j][k];
      memcpy(half[i * count1 + s], sum, sizeof sum);
    }
}

/* out [count0][count1] = rows0 times half, along u. */
static void along_u(unsigned width0, unsigned count0, unsigned count1, double (*half)[3], const double *rows0,
                    double (*out)[3]) {
  for (unsigned r = 0; r < count0; r++)
    for (unsigned s = 0; s < count1; s++) {
      double sum[3] = {0};
      for (unsigned i = 0; i < width0; i++)
        for (int k = 0; k < 3; k++) sum[k] += rows0[r * width0 + i] * half[i * count1 + s][k];
      memcpy(out[r * count1 + s], sum, sizeof sum);
    }
}

/* Takes from the second derivatives what they have along x_u and x_v, by least squares over the box and as seen along
 * its normal. */
static void remove_along(convex_patch *p, size_t net) {
  const double *g = p->normal;
  double normal[3] = {0}, right[3][2] = {{0}};
  for (size_t i = 0; i < net; i++) {
    const double *u = p->raised[0][i], *v = p->raised[1][i];
    double gu = vec_dot(g, u), gv = vec_dot(g, v);
    normal[0] += vec_dot(u, u) - gu * gu;
    normal[1] += vec_dot(u, v) - gu * gv;
    normal[2] += vec_dot(v, v) - gv * gv;
    for (int h = 0; h < 3; h++) {
      double gw = vec_dot(g, p->second[h][i]);
      right[h][0] += vec_dot(p->second[h][i], u) - gw * gu;
      right[h][1] += vec_dot(p->second[h][i], v) - gw * gv;
    }
  }
  double det = normal[0] * normal[2] - normal[1] * normal[1];
  for (int h = 0; h < 3; h++) {
    double *along = p->along[h];
    along[0] = det > 0 ? (normal[2] * right[h][0] - normal[1] * right[h][1]) / det : 0;
    along[1] = det > 0 ? (normal[0] * right[h][1] - normal[1] * right[h][0]) / det : 0;
    for (size_t i = 0; i < net; i++)
      for (int k = 0; k < 3; k++) p->second[h][i][k] -= along[0] * p->raised[0][i][k] + along[1] * p->raised[1][i][k];
  }
}

bool convex_patch_set(convex_patch *p, const convex_space *space, const double *reference, const convex_box *box) {
  unsigned m = space->axis[0].degree, n = space->axis[1].degree;
  assert(m <= CONVEX_DEGREE && n <= CONVEX_DEGREE);
  p->space = space;
  for (int k = 0; k < 2; k++) axis_rows(&space->axis[k], box->span[k], box->lower[k], box->upper[k], &p->rows[k]);
  for (unsigned i = 0; i <= m; i++)
    memcpy(p->points[i * (n + 1)], reference + ((box->span[0] - m + i) * space->axis[1].count + box->span[1] - n) * 3,
           (n + 1) * sizeof *p->points);

  double half[CONVEX_NET][3];
  const convex_axis_rows *u = &p->rows[0], *v = &p->rows[1];
  along_v(m + 1, n + 1, n + 1, p->points, v->value, half);
  along_u(m + 1, m, n + 1, half, u->first, p->first_u);
  along_u(m + 1, m + 1, n + 1, half, u->first_raised, p->raised[0]);
  along_u(m + 1, m + 1, n + 1, half, u->second_raised, p->second[0]);
  along_v(m + 1, n + 1, n, p->points, v->first, half);
  along_u(m + 1, m + 1, n, half, u->value, p->first_v);
  along_v(m + 1, n + 1, n + 1, p->points, v->first_raised, half);
  along_u(m + 1, m + 1, n + 1, half, u->value, p->raised[1]);
  along_u(m + 1, m + 1, n + 1, half, u->first_raised, p->second[1]);
  along_v(m + 1, n + 1, n + 1, p->points, v->second_raised, half);
  along_u(m + 1, m + 1, n + 1, half, u->value, p->second[2]);

  double mean[2][3] = {{0}};
  for (unsigned i = 0; i < m * (n + 1); i++)
    for (int k = 0; k < 3; k++) mean[0][k] += p->first_u[i][k];
  for (unsigned i = 0; i < (m + 1) * n; i++)
    for (int k = 0; k < 3; k++) mean[1][k] += p->first_v[i][k];
  if (!vec_normalize(mean[0]) || !vec_normalize(mean[1])) return false;
  vec_cross(mean[0], mean[1], p->normal);
  if (!vec_normalize(p->normal) || !convex_cone_bound(m * (n + 1), p->first_u, p->normal, &p->cone[0]) ||
      !convex_cone_bound((m + 1) * n, p->first_v, p->normal, &p->cone[1]))
    return false;
  remove_along(p, (m + 1) * (n + 1));
  return true;
}

/* M^(-1/2) of [a, b; b, c], up to a factor: by Cayley and Hamilton the root is (M + sqrt(det) I) over a number. */
static bool inverse_root(double a, double b, double c, double root[3]) {
  double det = a * c - b * b;
  if (!(a > 0 && c > 0 && det > 0)) return false;
  double s = sqrt(det), t = sqrt(a + c + 2 * s);
  root[0] = (c + s) / (t * s);
  root[1] = -b / (t * s);
  root[2] = (a + s) / (t * s);
  return true;
}

/* Forms of the directions z_a = root (cos, sin)(a pi / P), divided by cos(pi / P), their value at M. */
static void make_forms(unsigned directions, const double root[3], double scale, double (*form)[3]) {
  double z[2][2], angle = acos(-1) / directions;
  for (unsigned a = 0; a <= directions; a++) {
    double c = cos(a * angle), s = sin(a * angle), *now = z[a % 2], *before = z[(a + 1) % 2];
    now[0] = root[0] * c + root[1] * s;
    now[1] = root[1] * c + root[2] * s;
    if (a == 0) continue;
    form[a - 1][0] = scale * now[0] * before[0];
    form[a - 1][1] = scale * (now[0] * before[1] + now[1] * before[0]);
    form[a - 1][2] = scale * now[1] * before[1];
  }
}

double convex_patch_measure(convex_patch *p, int sign, unsigned directions, double delta) {
  convex_cone wide[2] = {convex_cone_widen(&p->cone[0], delta), convex_cone_widen(&p->cone[1], delta)};
  p->ray_count = convex_cone_cross(&wide[0], &wide[1], p->normal, p->rays);
  if (p->ray_count == 0) return -2;

  size_t net = (p->space->axis[0].degree + 1) * (size_t)(p->space->axis[1].degree + 1);
  double ray[3] = {0}, mean[3];
  for (size_t k = 0; k < p->ray_count; k++)
    for (int j = 0; j < 3; j++) ray[j] += p->rays[k][j];
  for (int h = 0; h < 3; h++) {
    double sum[3] = {0};
    for (size_t i = 0; i < net; i++)
      for (int j = 0; j < 3; j++) sum[j] += p->second[h][i][j];
    mean[h] = sign * vec_dot(sum, ray) / ((double)net * (double)p->ray_count);
  }
  /* Divided by its trace, so that rows do not depend on the unit of length. */
  double trace = mean[0] + mean[2], root[3];
  if (!(trace > 0) || !inverse_root(mean[0] / trace, mean[1] / trace, mean[2] / trace, root)) return -1;
  double best = cos(acos(-1) / directions);
  make_forms(directions, root, sign / (trace * best), p->form);

  double least = INFINITY;
  for (size_t k = 0; k < p->ray_count; k++)
    for (size_t i = 0; i < net; i++) {
      double uu = vec_dot(p->second[0][i], p->rays[k]), uv = vec_dot(p->second[1][i], p->rays[k]),
             vv = vec_dot(p->second[2][i], p->rays[k]);
      for (unsigned a = 0; a < directions; a++) {
        double value = p->form[a][0] * uu + p->form[a][1] * uv + p->form[a][2] * vv;
        least = value < least ? value : least;
      }
    }
  return fmax(least, -0.999);
}

/* ---- early refusal ------------------------------------------------------------------------------- */

enum { SAMPLES = 5 }; /* places a span, ends among them */

/* x_u, x_v, x_uu, x_uv, x_vv at a place of a span pair from values and derivatives of the basis [3][degree + 1]. */
static void jet(const bspline *axis, const double *points, const double *basis_u, const double *basis_v,
                double (*out)[3]) {
  static const unsigned orders[5][2] = {{1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  unsigned m = axis[0].degree, n = axis[1].degree;
  memset(out, 0, 5 * sizeof *out);
  for (unsigned i = 0; i <= m; i++) {
    double row[3][3] = {{0}};
    for (unsigned j = 0; j <= n; j++)
      for (size_t order = 0; order < 3; order++)
        for (size_t k = 0; k < 3; k++)
          row[order][k] += basis_v[order * (n + 1) + j] * points[(i * axis[1].count + j) * 3 + k];
    for (int h = 0; h < 5; h++)
      for (int k = 0; k < 3; k++) out[h][k] += basis_u[orders[h][0] * (m + 1) + i] * row[orders[h][1]][k];
  }
}

/* Sign of the second fundamental form where it is definite, else 0. */
static int definite(double (*jet)[3]) {
  double normal[3];
  vec_cross(jet[0], jet[1], normal);
  if (!vec_normalize(normal)) return 0;
  double l = vec_dot(jet[2], normal), m = vec_dot(jet[3], normal), n = vec_dot(jet[4], normal);
  if (!(l * n > m * m)) return 0;
  return l > 0 ? 1 : -1;
}

static double sample_place(const bspline *axis, size_t span, int sample) {
  double part = (double)sample / (SAMPLES - 1);
  return (1 - part) * axis->knots[span] + part * axis->knots[span + 1];
}

/* The sign that the form has at all samples, 0 when it is not definite or not the same: most surfaces that are not
 * convex are known by this. */
static int sampled_sign(const convex_space *space, const double *reference) {
  const bspline *axis = space->axis;
  double basis_u[3 * CONVEX_AXIS], basis_v[SAMPLES][3 * CONVEX_AXIS], derivatives[5][3];
  int sign = 0;
  for (size_t nu = bspline_first(&axis[1]); nu < axis[1].count; nu = bspline_next(&axis[1], nu)) {
    for (int s = 0; s < SAMPLES; s++) bspline_basis(&axis[1], nu, sample_place(&axis[1], nu, s), 2, basis_v[s]);
    for (size_t mu = bspline_first(&axis[0]); mu < axis[0].count; mu = bspline_next(&axis[0], mu)) {
      const double *points = reference + ((mu - axis[0].degree) * axis[1].count + nu - axis[1].degree) * 3;
      for (int r = 0; r < SAMPLES; r++) {
        bspline_basis(&axis[0], mu, sample_place(&axis[0], mu, r), 2, basis_u);
        for (int s = 0; s < SAMPLES; s++) {
          jet(axis, points, basis_u, basis_v[s], derivatives);
          int here = definite(derivatives);
          if (here == 0 || (sign != 0 && here != sign)) return 0;
          sign = here;
        }
      }
    }
  }
  return sign;
}

/* ---- subdivision --------------------------------------------------------------------------------- */

/* Cones are widened by 1 at most, 2^-6 at least (slopes; a wide cone lets first derivatives move, and asks for more
 * of second ones), to within a factor of 2^(1/8). */
enum { WIDEST = 0, NARROWEST = -6, REFINEMENTS = 3 };

/* Boxes still to be looked at: each division puts at most four in the place of one, at most 2 * depth_max deep. */
enum { STACK = 3 * 2 * 10 + 1 };

typedef struct search {
  const convex_space *space;
  const double *reference;
  const convex_row_options *opt;
  int sign;
  bool widest;           /* else any delta will do */
  convex_patch patch[2]; /* of the box, and of its halves */
  convex_box stack[STACK];
} search;

/* Whether the box can have cones wider by 2^exponent, with no more rows than `rays` give. */
static bool allows(search *s, convex_patch *patch, double exponent, size_t rays) {
  double value = convex_patch_measure(patch, s->sign, s->opt->directions, exp2(exponent));
  return value >= s->opt->row_share && patch->ray_count <= rays;
}

/* Whether the box is accepted; its widest delta. Whether, and how many rows, does not depend on s->widest. */
static bool accept(search *s, convex_patch *patch, convex_box *box) {
  if (!allows(s, patch, NARROWEST, CONVEX_CROSS_RAYS)) return false;
  size_t m = s->space->axis[0].degree, n = s->space->axis[1].degree, rays = patch->ray_count;
  box->rows = 4 * (m * (n + 1) + (m + 1) * n) + rays * s->opt->directions * (m + 1) * (n + 1);
  if (!s->widest) return true;
  double low = WIDEST;
  while (low > NARROWEST && !allows(s, patch, low, rays)) low--;
  double high = low + 1;
  for (int k = 0; k < REFINEMENTS && low < WIDEST; k++) {
    double middle = (low + high) / 2;
    if (allows(s, patch, middle, rays))
      low = middle;
    else
      high = middle;
  }
  box->delta = exp2(low);
  return true;
}

static void halve(const convex_box *box, int direction, convex_box half[2]) {
  half[0] = half[1] = *box;
  double middle = box->lower[direction] + (box->upper[direction] - box->lower[direction]) / 2;
  half[0].upper[direction] = half[1].lower[direction] = middle;
  half[0].depth[direction] = half[1].depth[direction] = box->depth[direction] + 1;
}

/* How near the worse half comes to being accepted. */
static double promise(search *s, const convex_box half[2]) {
  double worst = INFINITY;
  for (int k = 0; k < 2; k++) {
    double value = -3;
    if (convex_patch_set(&s->patch[1], s->space, s->reference, &half[k]))
      value = convex_patch_measure(&s->patch[1], s->sign, s->opt->directions, exp2(NARROWEST));
    worst = fmin(worst, value);
  }
  return worst;
}

/* Boxes that take the place of one: halves in the direction that helps more, quarters when neither does. Returns
 * their number, 0 at the end of bisection. */
static size_t divide(search *s, const convex_box *box, convex_box parts[4]) {
  bool can[2] = {box->depth[0] < s->opt->depth_max, box->depth[1] < s->opt->depth_max};
  if (!can[0] && !can[1]) return 0;
  convex_box halves[2][2];
  double value[2] = {0};
  for (int d = 0; d < 2; d++)
    if (can[d]) {
      halve(box, d, halves[d]);
      value[d] = promise(s, halves[d]);
    }
  int direction = can[0] && (!can[1] || value[0] > value[1]) ? 0 : 1;
  if (can[0] && can[1] && value[0] == value[1]) {
    halve(&halves[0][0], 1, parts);
    halve(&halves[0][1], 1, parts + 2);
    return 4;
  }
  memcpy(parts, halves[direction], sizeof halves[direction]);
  return 2;
}

typedef struct box_list {
  convex_box *boxes;
  size_t count, capacity, rows;
} box_list;

static batten_status push(batten_context *ctx, box_list *list, const convex_box *box) {
  if (list->count == list->capacity) {
    size_t capacity = list->capacity ? 2 * list->capacity : 64;
    convex_box *grown = batten_realloc_array(ctx, list->boxes, capacity, sizeof *grown);
    if (!grown) return BATTEN_E_NOMEM;
    list->boxes = grown;
    list->capacity = capacity;
  }
  list->boxes[list->count++] = *box;
  return BATTEN_OK;
}

/* Divides one span pair. */
static batten_status cover(batten_context *ctx, search *s, const convex_box *pair, box_list *list, bool *accepted) {
  convex_box *stack = s->stack, parts[4];
  size_t top = 0;
  stack[top++] = *pair;
  *accepted = true;
  while (top > 0 && *accepted) {
    convex_box box = stack[--top];
    if (convex_patch_set(&s->patch[0], s->space, s->reference, &box) && accept(s, &s->patch[0], &box)) {
      list->rows += box.rows;
      *accepted = list->rows <= s->opt->row_limit;
      if (!*accepted && s->opt->limited) *s->opt->limited = true;
      batten_status status = s->widest ? push(ctx, list, &box) : BATTEN_OK;
      if (status < 0) return status;
      continue;
    }
    size_t count = divide(s, &box, parts);
    *accepted = count > 0;
    for (size_t k = count; k-- > 0;) stack[top++] = parts[k]; /* so that they come out in their order */
  }
  return BATTEN_OK;
}

batten_status convex_boxes_make(batten_context *ctx, const convex_space *space, const double *reference,
                                const convex_row_options *opt, bool *accepted, int *sign, convex_box **out,
                                size_t *count) {
  const bspline *axis = space->axis;
  assert(opt->depth_max <= 10 && opt->directions >= 3 && opt->directions <= CONVEX_DIRECTIONS);
  *accepted = false;
  *sign = sampled_sign(space, reference);
  if (*sign == 0) return BATTEN_OK;
  search *s = batten_alloc(ctx, sizeof *s);
  if (!s) return BATTEN_E_NOMEM;
  s->space = space;
  s->reference = reference;
  s->opt = opt;
  s->sign = *sign;
  s->widest = out != NULL;
  box_list list = {0};
  batten_status status = BATTEN_OK;
  *accepted = true;
  for (size_t mu = bspline_first(&axis[0]); *accepted && mu < axis[0].count; mu = bspline_next(&axis[0], mu))
    for (size_t nu = bspline_first(&axis[1]); *accepted && nu < axis[1].count; nu = bspline_next(&axis[1], nu)) {
      convex_box pair = {
          {mu, nu}, {axis[0].knots[mu], axis[1].knots[nu]}, {axis[0].knots[mu + 1], axis[1].knots[nu + 1]}, {0, 0}, 0,
          0};
      status = cover(ctx, s, &pair, &list, accepted);
      if (status < 0) goto done;
    }
  if (*accepted && out) {
    *out = list.boxes;
    *count = list.count;
    list.boxes = NULL;
  }
done:
  batten_free(ctx, list.boxes);
  batten_free(ctx, s);
  return status;
}
