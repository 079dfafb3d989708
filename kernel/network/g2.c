/* Optimised first and second derivatives at the nodes.   [Kolb, Pottmann, Seidel 1995, section 5]
 *
 * Curves (quintic) and cross fields (cubic) depend linearly on the nodes' x = (p, q, r, m, n); see ribbon.c. Wanted
 * is the x with the least sum over edges of |E|^-weight_power (int |C''|^2 dt + field_weight int |d''|^2 dt). Each of
 * the vectors on which an edge depends, first and second derivative of curve and field at both ends, is
 * fix + (row . x) w, w being the normal of its node's frame, so with K the integrals of products of the basis
 *   A += K_ab (w_a . w_b) row_a row_b',   rhs -= K_ab (fix_b . w_a) row_a.
 * Three directions of edges settle a node by the curves alone, two with the field. What is left of rounding's size
 * at nodes with fewer is settled by 1e-12 |E|^4 (r^2 + 2 m^2 + n^2) on top, whose unit is that of the rest.
 *
 * Constraints leave x = origin + columns y; unknowns that are not there get the equation y = 0. Each node adds up its
 * own row of blocks over its own spokes: no two tasks write to the same place. */
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "network/fan.h"
#include "network/fill.h"
#include "sparse/block.h"

enum { ITEMS_PER_TASK = 256, CG_MOST = 500 };

/* Residuals: wanted, and enough: nodes that the safety term alone settles leave some 1e-12. */
static const double SAFETY = 1e-12, TOLERANCE = 1e-13, ENOUGH = 1e-10;

/* Integrals over [0, 1] of products of second derivatives of the quintics with value 1 - 0 over the edge (E), first
 * (T) and second derivative (S) 1 at one end; the other end's are mirrored, T outgoing. */
static const double TT = 192. / 35, TS = 11. / 35, SS = 3. / 35;
static const double T_T = -108. / 35, T_S = -4. / 35, S_S = 1. / 70; /* one end with the other */
static const double ET = -60. / 7, ES = -3. / 7;
/* The same of cubics with value (H) or first derivative (D) 1 at one end; both along the run. */
static const double HH = 12, HD = 6, DD = 4, H_H = -12, H_D = 6, D_H = -6, D_D = 2;

/* T, S, H, D of one end of an edge: fix + (row . y) w. */
typedef struct end_terms {
  double row[4][5];
  double fix[4][3];
  const double *w;
} end_terms;

typedef struct g2_job {
  const net_topology *t;
  const batten_network_options *opt;
  const double *normals;
  net_node *nodes;
  net_local *local;
  double *forms; /* [nodes][3] for L3 and L4, else NULL */
  block_matrix a;
  double *rhs, *y; /* [nodes][5] */
  double *part;    /* [tasks] */
  size_t *counts;  /* [tasks] */
} g2_job;

static size_t task_count(size_t items) { return (items + ITEMS_PER_TASK - 1) / ITEMS_PER_TASK; }
static size_t task_end(size_t index, size_t items) {
  size_t end = (index + 1) * ITEMS_PER_TASK;
  return end < items ? end : items;
}

/* ---- one edge ----------------------------------------------------------------------------------- */

static void freedom(const g2_job *job, uint32_t node, double origin[5], double columns[5][5], unsigned *dof) {
  const net_constraint *c = job->t->constraint;
  net_node_freedom(c ? c + node : NULL, &job->nodes[node], origin, columns, dof);
}

/* Takes rows in x to rows in y. */
static void constrain(const g2_job *job, uint32_t node, end_terms *out) {
  double origin[5], columns[5][5], row[5];
  unsigned dof;
  freedom(job, node, origin, columns, &dof);
  for (int a = 0; a < 4; a++) {
    double fixed = 0;
    memcpy(row, out->row[a], sizeof row);
    memset(out->row[a], 0, sizeof row);
    for (int k = 0; k < 5; k++) {
      fixed += row[k] * origin[k];
      for (unsigned y = 0; y < dof; y++) out->row[a][y] += row[k] * columns[k][y];
    }
    for (int k = 0; k < 3; k++) out->fix[a][k] += fixed * out->w[k];
  }
}

/* turn: 1 where the run begins, -1 where it ends. The field may be that of either side: the same integral. */
static void end_make(const g2_job *job, uint32_t node, uint32_t e, unsigned end, double length, double turn,
                     end_terms *out) {
  const net_node *frame = &job->nodes[node];
  const double *t = job->local[e].t[end], *s = job->local[e].s[end], *bend = net_edge_bend(job->t, e, end);
  double a = vec_dot(t, frame->u), b = vec_dot(t, frame->v), c = vec_dot(s, frame->u), d = vec_dot(s, frame->v);
  double left[3];
  vec_cross(frame->w, t, left);
  double scale = turn * length / vec_norm(left);
  for (int k = 0; k < 3; k++) left[k] *= scale;
  double f = vec_dot(left, frame->u), g = vec_dot(left, frame->v), speed = vec_dot(t, t);
  double first[5] = {a, b, 0, 0, 0}, second[5] = {c, d, a * a, 2 * a * b, b * b};
  double across[5] = {f, g, 0, 0, 0}, rate[5] = {0, 0, turn * a * f, turn * (a * g + b * f), turn * b * g};
  out->w = frame->w;
  memcpy(out->row[0], first, sizeof first);
  memcpy(out->row[1], second, sizeof second);
  memcpy(out->row[2], across, sizeof across);
  memcpy(out->row[3], rate, sizeof rate);
  memcpy(out->fix[0], t, 3 * sizeof *t);
  memcpy(out->fix[1], s, 3 * sizeof *s);
  memcpy(out->fix[2], left, sizeof left);
  memset(out->fix[3], 0, sizeof out->fix[3]);
  if (bend) {
    memset(out->row, 0, 2 * sizeof *out->row);
    for (int k = 0; k < 3; k++) out->fix[1][k] += speed * bend[k];
  }
  if (job->t->constraint && job->t->constraint[node].kind != NET_FREE) constrain(job, node, out);
}

static double edge_weight(double length, double power) {
  if (power == 0) return 1;
  if (power == 3) return 1 / (length * length * length);
  return pow(length, -power);
}

static void edge_chord(const net_topology *t, uint32_t e, unsigned end, double *chord) {
  uint32_t from = t->half[e], to = net_next(from);
  vec_sub(t->points + 3 * (size_t)t->triangles[end ? from : to],
          t->points + 3 * (size_t)t->triangles[end ? to : from], chord);
}

/* K of T, S, H, D at one end with themselves, and with those at the other end. Curve and field do not mix. */
static void integrals(double curve, double field, double own[4][4], double other[4][4]) {
  const double near[4][4] = {{curve * TT, curve * TS, 0, 0},
                             {curve * TS, curve * SS, 0, 0},
                             {0, 0, field * HH, field * HD},
                             {0, 0, field * HD, field * DD}};
  const double far[4][4] = {{curve * T_T, curve * T_S, 0, 0},
                            {curve * T_S, curve * S_S, 0, 0},
                            {0, 0, field * H_H, field * H_D},
                            {0, 0, field * D_H, field * D_D}};
  memcpy(own, near, sizeof near);
  memcpy(other, far, sizeof far);
}

/* ---- the system --------------------------------------------------------------------------------- */

/* A += rows' K rows of the other end, scaled. */
static void add_block(const double k[4][4], double scale, const end_terms *i, const end_terms *j, double *block) {
  double right[4][5];
  for (int a = 0; a < 4; a++) {
    int b = a & 2; /* T, S: 0, 1; H, D: 2, 3 */
    for (int y = 0; y < 5; y++) right[a][y] = scale * (k[a][b] * j->row[b][y] + k[a][b + 1] * j->row[b + 1][y]);
  }
  for (int x = 0; x < 5; x++)
    for (int a = 0; a < 4; a++)
      for (int y = 0; y < 5; y++) block[5 * x + y] += i->row[a][x] * right[a][y];
}

/* What one side of an edge adds to the row of the node at one end; with the curve's part or without. */
static void add_edge(g2_job *job, uint32_t e, unsigned end, unsigned side, bool curve, double *diagonal,
                     double *rhs) {
  const net_topology *t = job->t;
  uint32_t i = net_edge_node(t, e, end, side), j = net_edge_node(t, e, !end, side);
  end_terms near, far;
  double chord[3], own[4][4], other[4][4];
  edge_chord(t, e, end, chord);
  double square = vec_dot(chord, chord), length = sqrt(square);
  double weight = edge_weight(length, job->opt->weight_power);
  end_make(job, i, e, end, length, 1, &near);
  end_make(job, j, e, !end, length, -1, &far);
  integrals(curve ? weight : 0, weight * job->opt->field_weight, own, other);
  add_block((const double(*)[4])own, 1, &near, &near, diagonal);
  add_block((const double(*)[4])other, vec_dot(near.w, far.w), &near, &far, block_matrix_at(&job->a, i, j));
  double chords[4] = {curve ? weight * ET : 0, curve ? weight * ES : 0, 0, 0};
  for (int a = 0; a < 4; a++) {
    double r = chords[a] * vec_dot(chord, near.w);
    for (int b = 0; b < 4; b++)
      r += own[a][b] * vec_dot(near.fix[b], near.w) + other[a][b] * vec_dot(far.fix[b], near.w);
    for (int y = 0; y < 5; y++) rhs[y] -= r * near.row[a][y];
  }
}

/* The safety term at a node of which `safety` is the factor. */
static void settle_diagonal(const g2_job *job, uint32_t node, double safety, double *diagonal, double *rhs) {
  const double part[5] = {0, 0, 1, 2, 1};
  double origin[5], columns[5][5];
  unsigned dof;
  freedom(job, node, origin, columns, &dof);
  for (unsigned y = 0; y < dof; y++)
    for (int k = 2; k < 5; k++) {
      rhs[y] -= safety * part[k] * columns[k][y] * origin[k];
      for (unsigned z = 0; z < dof; z++) diagonal[5 * y + z] += safety * part[k] * columns[k][y] * columns[k][z];
    }
  for (unsigned y = dof; y < 5; y++) diagonal[6 * y] = 1;
}

static void assemble_node(g2_job *job, uint32_t node) {
  const net_topology *t = job->t;
  double *diagonal = block_matrix_at(&job->a, node, node), *rhs = job->rhs + 5 * (size_t)node, safety = 0;
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    uint32_t e = t->edge[s.half];
    unsigned end = net_spoke_end(t, s), sides = t->kind[e] == NET_CREASE ? 2 : 1;
    for (unsigned side = 0; side < sides; side++)
      if (net_edge_node(t, e, end, side) == node) add_edge(job, e, end, side, side == 0, diagonal, rhs);
    double chord[3];
    edge_chord(t, e, end, chord);
    double square = vec_dot(chord, chord);
    safety += SAFETY * square * square * edge_weight(sqrt(square), job->opt->weight_power);
  }
  settle_diagonal(job, node, safety, diagonal, rhs);
}

static void assemble_nodes(void *arg, size_t index) {
  g2_job *job = arg;
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, job->t->nodes); i++) assemble_node(job, (uint32_t)i);
}

/* x from y. */
static void place_nodes(void *arg, size_t index) {
  g2_job *job = arg;
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, job->t->nodes); i++) {
    double origin[5], columns[5][5];
    unsigned dof;
    freedom(job, (uint32_t)i, origin, columns, &dof);
    for (int k = 0; k < 5; k++) {
      job->nodes[i].x[k] = origin[k];
      for (unsigned y = 0; y < dof; y++) job->nodes[i].x[k] += columns[k][y] * job->y[5 * i + y];
    }
    job->counts[index] += dof;
  }
}

/* ---- the functional ----------------------------------------------------------------------------- */

/* int |f|^2 dt of f in Bernstein form, degree n <= 3. */
static double integral_square(unsigned n, const double (*f)[3]) {
  double sum = 0;
  for (unsigned a = 0; a <= n; a++)
    for (unsigned b = 0; b <= n; b++)
      sum += bezier_binomial[n][a] * bezier_binomial[n][b] / bezier_binomial[2 * n][a + b] * vec_dot(f[a], f[b]);
  return sum / (2 * n + 1);
}

/* Second derivative of a polynomial [n + 1][3], n <= 5. */
static double bending(unsigned n, const double (*c)[3]) {
  double first[5][3], second[4][3], factor = n * (n - 1);
  bezier_difference(n, 3, c[0], first[0]);
  bezier_difference(n - 1, 3, first[0], second[0]);
  return factor * factor * integral_square(n - 2, (const double(*)[3])second);
}

static void measure_edges(void *arg, size_t index) {
  g2_job *job = arg;
  const net_topology *t = job->t;
  double sum = 0, field = job->opt->field_weight;
  for (size_t e = index * ITEMS_PER_TASK; e < task_end(index, t->edges); e++) {
    uint32_t h = t->half[e];
    net_ribbon ribbon;
    double chord[3];
    edge_chord(t, (uint32_t)e, 0, chord);
    net_half_ribbon(t, job->nodes, job->local, h, &ribbon);
    double energy = bending(5, (const double(*)[3])ribbon.c) + field * bending(3, (const double(*)[3])ribbon.d);
    if (t->kind[e] == NET_CREASE && t->twin[h] != NET_NONE) {
      net_half_ribbon(t, job->nodes, job->local, t->twin[h], &ribbon);
      energy += field * bending(3, (const double(*)[3])ribbon.d);
    }
    sum += energy * edge_weight(vec_norm(chord), job->opt->weight_power);
  }
  job->part[index] = sum;
}

static double measure(batten_context *ctx, g2_job *job) {
  size_t tasks = task_count(job->t->edges);
  double sum = 0;
  batten_parallel(ctx, tasks, measure_edges, job);
  for (size_t i = 0; i < tasks; i++) sum += job->part[i];
  return sum;
}

/* ---- the phases --------------------------------------------------------------------------------- */

static void make_frames(void *arg, size_t index) {
  g2_job *job = arg;
  const net_constraint *c = job->t->constraint;
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, job->t->nodes); i++) {
    net_frame(job->normals + 3 * i, c && c[i].kind == NET_CREASED ? c[i].d[0] : NULL, &job->nodes[i]);
    if (job->forms) net_curvature_estimate(job->t, (uint32_t)i, &job->nodes[i], job->forms + 3 * i);
  }
}

static void make_tangents(void *arg, size_t index) {
  g2_job *job = arg;
  for (size_t e = index * ITEMS_PER_TASK; e < task_end(index, job->t->edges); e++)
    job->counts[index] += net_tangent_edge(job->t, job->opt, job->nodes, job->forms, (uint32_t)e, &job->local[e]);
}

static size_t count_up(batten_context *ctx, g2_job *job, size_t items, void (*task)(void *, size_t)) {
  size_t tasks = task_count(items), sum = 0;
  memset(job->counts, 0, tasks * sizeof *job->counts);
  batten_parallel(ctx, tasks, task, job);
  for (size_t i = 0; i < tasks; i++) sum += job->counts[i];
  return sum;
}

/* Blocks of all pairs of nodes that share an edge on one of its sides. */
static batten_status make_matrix(batten_context *ctx, g2_job *job) {
  const net_topology *t = job->t;
  size_t count = 0;
  uint32_t(*pairs)[2] = batten_alloc_array(ctx, t->edges + t->crease_edges, sizeof *pairs);
  if (!pairs) return BATTEN_E_NOMEM;
  for (uint32_t e = 0; e < t->edges; e++) {
    bool both = t->kind[e] == NET_CREASE && t->twin[t->half[e]] != NET_NONE;
    for (unsigned side = 0; side < 1u + both; side++, count++)
      for (unsigned end = 0; end < 2; end++) pairs[count][end] = net_edge_node(t, e, end, side);
  }
  batten_status st = block_matrix_new(ctx, t->nodes, 5, count, &pairs[0][0], &job->a);
  batten_free(ctx, pairs);
  return st;
}

/* *y = A^-1 rhs by Cholesky. */
static batten_status solve_direct(batten_context *ctx, g2_job *job) {
  block_plan *plan = NULL;
  batten_status st = block_plan_new(ctx, &job->a, BLOCK_AUTO, &plan);
  if (st >= 0) st = block_factor(ctx, plan, &job->a, NULL);
  if (st >= 0) {
    memcpy(job->y, job->rhs, 5 * job->t->nodes * sizeof *job->y);
    block_solve(ctx, plan, job->y);
  }
  block_plan_free(ctx, plan);
  return st;
}

/* Conjugate gradients also tell the residual of the direct solution, and have nothing else left to do. AUTO leaves
 * large systems to them: no mesh needs more than a few dozen iterations. */
static batten_status solve(batten_context *ctx, g2_job *job, net_figures *figures) {
  block_cg_figures cg = {0};
  batten_network_solver solver = job->opt->solver;
  bool direct =
      solver == BATTEN_NETWORK_DIRECT || (solver == BATTEN_NETWORK_AUTO && job->t->nodes < NET_DIRECT_NODES);
  batten_status st = direct ? solve_direct(ctx, job) : BATTEN_OK;
  if (st >= 0) st = block_cg(ctx, &job->a, job->rhs, TOLERANCE, CG_MOST, "network", job->y, &cg);
  figures->cg_iterations += cg.iterations;
  figures->residual = cg.residual;
  return st == BATTEN_W_ACCURACY && cg.residual <= ENOUGH ? BATTEN_OK : st;
}

static bool take(batten_context *ctx, g2_job *job) {
  const net_topology *t = job->t;
  size_t most = t->edges > t->nodes ? t->edges : t->nodes, unknowns;
  if (!batten_mul(t->nodes, 5, &unknowns)) return false;
  bool forms = job->opt->length == BATTEN_LENGTH_L3 || job->opt->length == BATTEN_LENGTH_L4;
  if (forms && !(job->forms = batten_alloc_array(ctx, t->nodes, 3 * sizeof *job->forms))) return false;
  return (job->rhs = batten_alloc_array(ctx, unknowns, sizeof *job->rhs)) &&
         (job->y = batten_alloc_array(ctx, unknowns, sizeof *job->y)) &&
         (job->part = batten_alloc_array(ctx, task_count(most), sizeof *job->part)) &&
         (job->counts = batten_alloc_array(ctx, task_count(most), sizeof *job->counts));
}

batten_status net_g2(batten_context *ctx, const net_topology *t, const batten_network_options *opt,
                     const double *normals, net_node *nodes, net_local *local, net_figures *figures) {
  g2_job job = {.t = t, .opt = opt, .normals = normals, .nodes = nodes, .local = local};
  batten_status st = BATTEN_E_NOMEM;
  if (!take(ctx, &job)) goto done;
  if ((st = batten_progress(ctx, "network", 0)) < 0) goto done;
  batten_parallel(ctx, task_count(t->nodes), make_frames, &job);
  figures->clamped += count_up(ctx, &job, t->edges, make_tangents);

  if ((st = make_matrix(ctx, &job)) < 0) goto done;
  memset(job.rhs, 0, 5 * t->nodes * sizeof *job.rhs);
  memset(job.y, 0, 5 * t->nodes * sizeof *job.y);
  figures->unknowns = count_up(ctx, &job, t->nodes, place_nodes);
  figures->energy_start = measure(ctx, &job);
  batten_parallel(ctx, task_count(t->nodes), assemble_nodes, &job);
  if ((st = solve(ctx, &job, figures)) < 0) goto done;
  count_up(ctx, &job, t->nodes, place_nodes);
  figures->energy = measure(ctx, &job);

done:
  block_matrix_free(ctx, &job.a);
  batten_free(ctx, job.forms);
  batten_free(ctx, job.rhs);
  batten_free(ctx, job.y);
  batten_free(ctx, job.part);
  batten_free(ctx, job.counts);
  return st;
}
