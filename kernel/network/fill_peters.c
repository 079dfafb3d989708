/* One quintic a facet.  [after Peters 1991: Smooth interpolation of a mesh of curves; 1990: Local smooth surface
 * interpolation, the vertex enclosure problem]
 *
 * At a node with curves of derivatives T_e, counter-clockwise, and normal curvatures c_e = n . C_e''(0), let x_e be
 * the normal part of the twist S_uv of the patch between curves e and e + 1. Tangent planes that agree along curve e
 * to first order ask for
 *   A_e x_(e-1) + A_(e-1) x_e = g_e c_e,   A_e = n . (T_e x T_(e+1)),   g_e = n . (T_(e-1) x T_(e+1)).
 * With y_e = x_e / A_e that is y_(e-1) + y_e = r_e: around a node of an odd number of facets one solution, of an even
 * number none but for one condition on the curves, then a line of them; of an open fan always a line. The condition
 * holds when all c_e = II(T_e, T_e) of one form, and then x_e = II(T_e, T_(e+1)) solves. So a form is fitted, its
 * twists are corrected by as little as possible, and what cannot be met is spread by least squares.
 *
 * Row 1 of a patch along an edge is R = 5 (f - c), quartic: the derivative towards the third corner less what runs
 * along. Its ends and their neighbours come from derivatives and twists. Its middle is that of the cubic of these,
 * moved along the mean of the normals of both patches at the middle of the edge, so that both have that one: normals
 * agree at three places of each edge. 15 control points of the boundary, 3 twists, 3 middles: none is left. */
#include "network/fill_peters.h"

#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "network/fan.h"

enum { NODES_PER_TASK = 512, FACES_PER_TASK = 128 };
/* Sines of the angle between neighbouring curves below which a node keeps the twists of the form. */
static const double SINE_MIN = 1e-6;

typedef struct peters_job {
  const net_topology *t;
  const double *normals;
  const net_local *local;
  double *twists;   /* [3 faces], by outgoing half-edge of the sector's first curve */
  double *areas;    /* [3 faces] A of the sector */
  double *sums;     /* [3 faces] r of the sector's first curve, then y */
  double *residual; /* [nodes] */
  double (*out)[21][3];
} peters_job;

/* Derivative at the start (end = 0) or end (1) of half-edge h, outgoing. */
static const double *derivative(const net_topology *t, const net_local *local, uint32_t h, unsigned end) {
  uint32_t e = t->edge[h];
  return local[e].t[end ^ (t->half[e] != h)];
}

/* C''(0) of the cubic that leaves a towards b with derivatives ta, tb, both outgoing. */
static void second(const double *a, const double *b, const double *ta, const double *tb, double *out) {
  for (int x = 0; x < 3; x++) out[x] = 6 * (b[x] - a[x]) + 2 * tb[x] - 4 * ta[x];
}

/* ---- nodes ----------------------------------------------------------------------------------------- */

typedef struct spoke_curve {
  const double *t;
  double bend; /* n . C''(0) */
} spoke_curve;

static spoke_curve curve_of(const peters_job *job, uint32_t node, net_spoke s) {
  const net_topology *t = job->t;
  double c[3];
  spoke_curve out = {derivative(t, job->local, s.half, s.in), 0};
  second(t->points + 3 * (size_t)t->node_vertex[node], t->points + 3 * (size_t)net_spoke_vertex(t, s), out.t,
         derivative(t, job->local, s.half, !s.in), c);
  out.bend = vec_dot(job->normals + 3 * (size_t)node, c);
  return out;
}

/* The form (r, sqrt2 m, n) with II(T_e, T_e) nearest to c_e: long curves count more than the angles between them. */
static void fit_form(const peters_job *job, uint32_t node, const net_node *frame, double form[3]) {
  double a[9] = {0}, b[3] = {0}, values[3], vectors[9];
  for (net_spoke s = net_spoke_first(job->t, node); s.half != NET_NONE; s = net_spoke_next(job->t, s)) {
    spoke_curve c = curve_of(job, node, s);
    double x = vec_dot(c.t, frame->u), y = vec_dot(c.t, frame->v);
    double row[3] = {x * x, sqrt(2) * x * y, y * y};
    for (int i = 0; i < 3; i++) {
      b[i] += row[i] * c.bend;
      for (int j = 0; j < 3; j++) a[3 * i + j] += row[i] * row[j];
    }
  }
  memset(form, 0, 3 * sizeof *form);
  batten_eigen_symmetric(3, a, values, vectors);
  for (int i = 0; i < 3; i++) {
    if (!(values[i] > 1e-8 * values[2])) continue; /* fewer than three directions: the smallest form */
    double part = vec_dot(vectors + 3 * i, b) / values[i];
    for (int k = 0; k < 3; k++) form[k] += part * vectors[3 * i + k];
  }
}

static double form_at(const net_node *frame, const double form[3], const double *a, const double *b) {
  double au = vec_dot(a, frame->u), av = vec_dot(a, frame->v), bu = vec_dot(b, frame->u), bv = vec_dot(b, frame->v);
  return form[0] * au * bu + form[1] / sqrt(2) * (au * bv + av * bu) + form[2] * av * bv;
}

/* Twists and areas of the sectors; true when no two neighbouring curves are (nearly) along one line or in the wrong
 * order. */
static bool sectors(const peters_job *job, uint32_t node, const net_node *frame, const double form[3]) {
  bool good = true;
  for (net_spoke s = net_spoke_first(job->t, node), next; s.half != NET_NONE && !s.in; s = next) {
    next = net_spoke_next(job->t, s);
    net_spoke second_spoke = next.half == NET_NONE ? net_spoke_first(job->t, node) : next;
    const double *a = curve_of(job, node, s).t, *b = curve_of(job, node, second_spoke).t;
    double cross[3];
    vec_cross(a, b, cross);
    job->twists[s.half] = form_at(frame, form, a, b);
    job->areas[s.half] = vec_dot(job->normals + 3 * (size_t)node, cross);
    good &= job->areas[s.half] > SINE_MIN * vec_norm(a) * vec_norm(b);
  }
  return good;
}

/* r of one curve, less what the form's twists meet. */
static double right_side(const peters_job *job, uint32_t node, net_spoke before, net_spoke s, net_spoke after) {
  spoke_curve c = curve_of(job, node, s);
  const double *a = curve_of(job, node, before).t, *b = curve_of(job, node, after).t;
  double cross[3], left = job->areas[before.half], right = job->areas[s.half];
  vec_cross(a, b, cross);
  double span = vec_dot(job->normals + 3 * (size_t)node, cross);
  return (span * c.bend - right * job->twists[before.half] - left * job->twists[s.half]) / (left * right);
}

/* Corrects the form's twists of one node. */
static void enclose(const peters_job *job, uint32_t node) {
  const net_topology *t = job->t;
  net_node frame = {0};
  double form[3], *r = job->sums;
  job->residual[node] = 0;
  net_frame(job->normals + 3 * (size_t)node, NULL, &frame);
  fit_form(job, node, &frame, form);
  if (!sectors(job, node, &frame, form)) return;

  /* r of the curves between two sectors, and the alternating sum that must vanish around an even number of facets:
     a miss m_e of curve e's equation counts sign m_e / (A_(e-1) A_e) in it, and the sum of squares is to be least. */
  net_spoke first = net_spoke_first(t, node), last = first;
  size_t facets = 0;
  for (net_spoke s = first; s.half != NET_NONE && !s.in; s = net_spoke_next(t, s)) {
    last = s;
    facets++;
  }
  bool closed = net_spoke_next(t, last).half == NET_NONE;
  double alternating = 0, weights = 0, sign = 1;
  net_spoke before = last;
  for (net_spoke s = first, next; s.half != NET_NONE && !s.in; before = s, s = next, sign = -sign) {
    next = net_spoke_next(t, s);
    if (s.half == first.half && !closed) continue;
    r[s.half] = right_side(job, node, before, s, next.half == NET_NONE ? first : next);
    alternating += sign * r[s.half];
    double w = 1 / (job->areas[before.half] * job->areas[s.half]);
    weights += w * w;
  }
  if (closed && facets % 2 == 0) {
    before = last;
    sign = 1;
    for (net_spoke s = first, next; s.half != NET_NONE; before = s, s = next, sign = -sign) {
      next = net_spoke_next(t, s);
      double w = 1 / (job->areas[before.half] * job->areas[s.half]), miss = sign * alternating * w / weights;
      r[s.half] -= miss * w;
      double unit = vec_norm(curve_of(job, node, before).t) * vec_norm(curve_of(job, node, s).t) *
                    vec_norm(curve_of(job, node, s).t) *
                    vec_norm(curve_of(job, node, next.half == NET_NONE ? first : next).t);
      job->residual[node] = fmax(job->residual[node], fabs(miss) / unit);
    }
  }

  /* y_0 = 0, y_s = r_s - y_(s-1); then the part that alternates: by the last equation, or for the least twists. */
  double r_first = closed ? r[first.half] : 0, y = 0, product = 0, square = 0;
  sign = 1;
  for (net_spoke s = first; s.half != NET_NONE && !s.in; s = net_spoke_next(t, s), sign = -sign) {
    double area = job->areas[s.half];
    y = s.half == first.half ? 0 : r[s.half] - y;
    r[s.half] = y;
    product += sign * area * area * y;
    square += area * area;
  }
  double start = closed && facets % 2 == 1 ? (r_first - y) / 2 : -product / square;
  sign = 1;
  for (net_spoke s = first; s.half != NET_NONE && !s.in; s = net_spoke_next(t, s), sign = -sign)
    job->twists[s.half] += job->areas[s.half] * (r[s.half] + sign * start);
}

static void enclose_some(void *arg, size_t task) {
  const peters_job *job = arg;
  size_t from = task * NODES_PER_TASK, to = from + NODES_PER_TASK;
  for (size_t node = from; node < to && node < job->t->nodes; node++) enclose(job, (uint32_t)node);
}

batten_status net_peters_twists(batten_context *ctx, const net_topology *t, const double *normals,
                                const net_local *local, double *twists, double *residual) {
  size_t sectors_count = 3 * t->faces, count = 0;
  double *work =
      batten_add(2 * sectors_count, t->nodes, &count) ? batten_alloc_array(ctx, count, sizeof *work) : NULL;
  if (!work) return batten_fail(ctx, BATTEN_E_NOMEM, "twists: no memory for %zu numbers", count);
  peters_job job = {.t = t, .normals = normals, .local = local, .twists = twists, .areas = work};
  job.sums = work + sectors_count;
  job.residual = work + 2 * sectors_count;
  batten_parallel(ctx, (t->nodes + NODES_PER_TASK - 1) / NODES_PER_TASK, enclose_some, &job);
  if (residual) *residual = 0;
  for (size_t node = 0; residual && node < t->nodes; node++) *residual = fmax(*residual, job.residual[node]);
  batten_free(ctx, work);
  return BATTEN_OK;
}

/* ---- facets ---------------------------------------------------------------------------------------- */

/* What a facet's rows are made of. */
typedef struct facet {
  const double *corner[3], *normal[3];
  const double *leave[3], *arrive[3]; /* of edge k: derivative at its start, and outgoing at its end */
  double twist[3][3];
} facet;

/* Part of a along b: h with a = k d + h b, d orthogonal to b. */
static double along(const double *a, const double *b) {
  double square = vec_dot(b, b);
  return square > 0 ? vec_dot(a, b) / square : 0;
}

/* The twist at corner i with the normal part given. Its tangential part is such that along both of the facet's edges
 * there R' = k' d + k d' + h' C' + h C'' has its share along the curve, for k and h linear and a d whose derivative
 * is normal to the surface: tau . T = (h C''(0) + (1 + h') T) . T. */
static void make_twist(facet *f, unsigned i, double normal_part) {
  unsigned j = (i + 1) % 3, l = (i + 2) % 3;
  const double *t[2] = {f->leave[i], f->arrive[l]};      /* from i towards j, towards l */
  const double *far[2] = {f->arrive[i], f->leave[l]};    /* the same curves' other ends */
  const double *beyond[2] = {f->leave[j], f->arrive[j]}; /* there, along the third edge: from j, from l */
  const double *end[2] = {f->corner[j], f->corner[l]}, *n = f->normal[i];
  double side[2], solved[2] = {0};
  for (unsigned k = 0; k < 2; k++) {
    double c[3], h0 = along(t[!k], t[k]), h1 = -along(beyond[k], far[k]);
    second(f->corner[i], end[k], t[k], far[k], c);
    side[k] = h0 * vec_dot(c, t[k]) + (1 + h1 - h0) * vec_dot(t[k], t[k]);
  }
  double aa = vec_dot(t[0], t[0]), bb = vec_dot(t[1], t[1]), ab = vec_dot(t[0], t[1]), det = aa * bb - ab * ab;
  if (det > SINE_MIN * SINE_MIN * aa * bb) {
    solved[0] = (bb * side[0] - ab * side[1]) / det;
    solved[1] = (aa * side[1] - ab * side[0]) / det;
  }
  for (int x = 0; x < 3; x++) f->twist[i][x] = solved[0] * t[0][x] + solved[1] * t[1][x] + normal_part * n[x];
}

static void gather(const peters_job *job, size_t face, facet *out) {
  const net_topology *t = job->t;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face) + k;
    out->corner[k] = t->points + 3 * (size_t)t->triangles[h];
    out->normal[k] = job->normals + 3 * (size_t)t->node[h];
    out->leave[k] = derivative(t, job->local, h, 0);
    out->arrive[k] = derivative(t, job->local, h, 1);
  }
  for (unsigned k = 0; k < 3; k++) make_twist(out, k, job->twists[3 * face + k]);
}

/* R along edge k, and R, C' (up to their lengths) and the patch's normal in its middle. */
typedef struct row {
  double r[5][3], middle[3], normal[3];
} row;

static void make_row(const facet *f, unsigned k, row *out) {
  unsigned j = (k + 1) % 3, l = (k + 2) % 3;
  double run[3];
  for (int x = 0; x < 3; x++) {
    double at_start = f->twist[k][x] - f->leave[k][x], at_end = f->arrive[k][x] - f->twist[j][x]; /* R' */
    out->r[0][x] = f->arrive[l][x];
    out->r[4][x] = f->leave[j][x];
    out->r[1][x] = out->r[0][x] + at_start / 4;
    out->r[3][x] = out->r[4][x] - at_end / 4;
    out->r[2][x] = 0.5 * ((out->r[0][x] + out->r[4][x]) + (at_start - at_end) / 3);
    out->middle[x] = ((out->r[0][x] + out->r[4][x]) + 4 * (out->r[1][x] + out->r[3][x]) + 6 * out->r[2][x]) / 16;
    /* C'(1/2) of the cubic */
    run[x] = 1.5 * (f->corner[j][x] - f->corner[k][x]) - 0.25 * (f->leave[k][x] - f->arrive[k][x]);
  }
  vec_cross(run, out->middle, out->normal);
  vec_normalize(out->normal);
}

/* out: the quintic of one face; others: rows of the neighbours. */
static void fill(const peters_job *job, size_t face) {
  /* along edge k: points s = 1 .. 4 of the boundary, the twist beside its start, the middle of row 1 */
  static const unsigned char rim[3][4] = {{1, 2, 3, 4}, {10, 14, 17, 19}, {18, 15, 11, 6}};
  static const unsigned char tip[3] = {0, 5, 20}, beside[3] = {7, 9, 16}, middle[3] = {8, 13, 12};
  const net_topology *t = job->t;
  double(*out)[3] = job->out[face];
  facet own, other;
  row rows, beyond;
  gather(job, face, &own);
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face) + k, twin = t->twin[h];
    const double *a = own.corner[k], *b = own.corner[(k + 1) % 3], *ta = own.leave[k], *tb = own.arrive[k];
    make_row(&own, k, &rows);
    if (twin != NET_NONE && t->kind[t->edge[h]] == NET_SMOOTH) {
      double n[3];
      gather(job, twin / 3, &other);
      make_row(&other, twin % 3, &beyond);
      for (int x = 0; x < 3; x++) n[x] = rows.normal[x] + beyond.normal[x];
      vec_normalize(n);
      double off = 16. / 6 * vec_dot(n, rows.middle);
      for (int x = 0; x < 3; x++) rows.r[2][x] -= off * n[x];
    }
    for (int x = 0; x < 3; x++) {
      double c1 = a[x] + ta[x] / 3, c2 = b[x] + tb[x] / 3; /* the cubic a, c1, c2, b in degrees 5 and 4 */
      out[tip[k]][x] = a[x];
      out[rim[k][0]][x] = a[x] + ta[x] / 5;
      out[rim[k][1]][x] = 0.1 * (a[x] + 6 * c1 + 3 * c2);
      out[rim[k][2]][x] = 0.1 * (b[x] + 6 * c2 + 3 * c1);
      out[rim[k][3]][x] = b[x] + tb[x] / 5;
      out[beside[k]][x] = a[x] + 0.2 * (ta[x] + own.arrive[(k + 2) % 3][x]) + 0.05 * own.twist[k][x];
      out[middle[k]][x] = 0.5 * (c1 + c2) + 0.2 * rows.r[2][x];
    }
  }
}

static void fill_some(void *arg, size_t task) {
  const peters_job *job = arg;
  size_t from = task * FACES_PER_TASK, to = from + FACES_PER_TASK;
  for (size_t face = from; face < to && face < job->t->faces; face++) fill(job, face);
}

batten_status net_fill_peters(batten_context *ctx, const net_topology *t, const double *normals,
                              const net_local *local, double (*out)[21][3]) {
  double *twists = batten_alloc_array(ctx, 3 * t->faces, sizeof *twists);
  if (!twists) return batten_fail(ctx, BATTEN_E_NOMEM, "twists: no memory for %zu numbers", 3 * t->faces);
  batten_status st = net_peters_twists(ctx, t, normals, local, twists, NULL);
  if (st == BATTEN_OK) {
    peters_job job = {.t = t, .normals = normals, .local = local, .twists = twists, .out = out};
    batten_parallel(ctx, (t->faces + FACES_PER_TASK - 1) / FACES_PER_TASK, fill_some, &job);
  }
  batten_free(ctx, twists);
  return st;
}
