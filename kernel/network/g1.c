/* Optimised normals [Kolb, Pottmann, Seidel 1995, section 3].
 *
 * Seen from the frame (u, v, w) of a node the surface is a function with slopes x = (p, q) there, and the curve of an
 * edge leaves it with T = t + (g . x) w, t = g_u u + g_v v being the local parameter. Curves are cubics,
 *   C = V_i + E phi + T_ij h0 + T_ji h1,   phi = 3 t^2 - 2 t^3, h0 = t (1 - t)^2, h1 = t^2 (1 - t),
 * so that a functional that is quadratic in the curves has its least value where a linear system holds: with
 * K_ab = <a, b> for a, b of phi, h0, h1, and c = w_i . w_j,
 *   K_00 alpha_ij + c K_01 alpha_ji = -K_01 w_i . t_ji - K_phi0 w_i . E,   alpha_ij = g_ij . x_i,
 * times g_ij and summed over the edges of a node. An edge's part of the matrix has |c K_01| <= K_00 / 2 for the
 * simple functional: with the diagonal blocks D, D^-1 A has its eigenvalues in [1/2, 3/2] for whatever mesh and
 * weights, and conjugate gradients gain a factor 3.7 with each step.
 *
 * The new normals w - p u - q v make new frames, and so on until they stay. At the end x = 0: curves are then the
 * cubics of t alone, whose tangents lie in the planes of the last normals whether or not the end was reached.
 *
 * Each node adds up its own row over its own spokes: no two tasks write to one place, sums have one order. */
#include <string.h>

#include "base/checked.h"
#include "network/fan.h"
#include "network/normals.h"
#include "sparse/block.h"

enum { ITEMS_PER_TASK = 1024, CG_MOST = 200 };

/* 45 degrees: no normal turns by more in a pass. Where the iteration converges, turns become smaller from pass to
 * pass. Where edges span a third of a sphere and more it may not: normals come to rest for some passes, then run off
 * and fold the network. So when the largest turn grows it becomes the bound, which is halved with this and every
 * later pass: the normals at fault stay near their place of rest, the others, which converge faster than that, are
 * free. */
static const double TURN_MAX = 0.78539816339744830962;

/* ---- functionals ---------------------------------------------------------------------------------- */

/* K of an edge, its weight included. */
typedef struct edge_terms {
  double k00, k01, k11, kf0, kf1;
} edge_terms;

static double edge_weight(double square, double power) {
  if (power == 0) return 1;
  if (power == 3) return 1 / (square * sqrt(square));
  return pow(square, -0.5 * power);
}

/* Integral of |C''|^2 dt. */
static void simple_terms(double weight, edge_terms *out) {
  *out = (edge_terms){4 * weight, -2 * weight, 4 * weight, -6 * weight, 6 * weight};
}

/* C'' runs straight from a to b: nothing cancels but in these. */
static double simple_energy(const double *e, const double (*t)[3]) {
  double sum = 0;
  for (int k = 0; k < 3; k++) {
    double a = 6 * e[k] - 4 * t[0][k] + 2 * t[1][k], b = 2 * t[0][k] - 4 * t[1][k] - 6 * e[k];
    sum += (a * a + a * b + b * b) / 3;
  }
  return sum;
}

/* Integral of |D C|^2 ds by Gauss's rule, D being the second derivative by the arc length of the curve that t alone
 * makes: where the iteration ends that is the curve itself, and the integral that of its curvature's square. */
static double beltrami_terms(const double *e, const double (*t)[3], double weight, edge_terms *out) {
  static const double places[4] = {0.1834346424956498049, 0.5255324099163289858, 0.7966664774136267396,
                                   0.9602898564975362317};
  static const double weights[4] = {0.3626837833783619830, 0.3137066458778872873, 0.2223810344533744705,
                                    0.1012285362903762591};
  double slowest = 1e-3 * vec_norm(e), energy = 0;
  *out = (edge_terms){0};
  for (int i = 0; i < 8; i++) {
    double x = 0.5 + (i % 2 ? 0.5 : -0.5) * places[i / 2];
    double first[3] = {6 * x * (1 - x), (1 - x) * (1 - 3 * x), x * (2 - 3 * x)};
    double second[3] = {6 - 12 * x, 6 * x - 4, 2 - 6 * x}, d1[3], d2[3], d[3];
    for (int k = 0; k < 3; k++) {
      d1[k] = first[0] * e[k] + first[1] * t[0][k] + first[2] * t[1][k];
      d2[k] = second[0] * e[k] + second[1] * t[0][k] + second[2] * t[1][k];
    }
    double speed = fmax(vec_norm(d1), slowest), square = speed * speed, along = vec_dot(d1, d2) / (square * square);
    for (int a = 0; a < 3; a++) d[a] = second[a] / square - along * first[a];
    double w = 0.5 * weights[i / 2] * speed * weight;
    out->k00 += w * d[1] * d[1];
    out->k01 += w * d[1] * d[2];
    out->k11 += w * d[2] * d[2];
    out->kf0 += w * d[0] * d[1];
    out->kf1 += w * d[0] * d[2];
    for (int k = 0; k < 3; k++) {
      double bend = d[0] * e[k] + d[1] * t[0][k] + d[2] * t[1][k];
      energy += w * bend * bend;
    }
  }
  return energy;
}

/* ---- one pass ------------------------------------------------------------------------------------- */

typedef struct g1_job {
  const net_topology *t;
  const batten_network_options *opt;
  batten_network_length length; /* of the pass in hand */
  double *normals;              /* [nodes][3] */
  net_node *nodes;              /* [nodes] */
  double *forms;                /* [nodes][3] for L3 and L4, else NULL */
  net_local *local;             /* [edges] */
  edge_terms *terms;            /* [edges] of the Laplace-Beltrami functional, else NULL */
  block_matrix a;
  double *rhs, *x;    /* [nodes][2] */
  double turn_max;    /* radians, of this pass */
  double *part;       /* [tasks] */
  size_t *substitute; /* [tasks] */
} g1_job;

static size_t task_count(size_t items) { return (items + ITEMS_PER_TASK - 1) / ITEMS_PER_TASK; }
static size_t task_end(size_t index, size_t items) {
  size_t end = (index + 1) * ITEMS_PER_TASK;
  return end < items ? end : items;
}

static net_node_kind kind_of(const net_topology *t, size_t node) {
  return t->constraint ? t->constraint[node].kind : NET_FREE;
}

static void edge_chord(const net_topology *t, size_t e, double *chord) {
  uint32_t h = t->half[e];
  vec_sub(t->points + (size_t)3 * t->triangles[net_next(h)], t->points + (size_t)3 * t->triangles[h], chord);
}

/* Lengths that ask for curvatures. */
static bool is_curved(batten_network_length length) {
  return length == BATTEN_LENGTH_L3 || length == BATTEN_LENGTH_L4;
}

static void make_frames(void *arg, size_t index) {
  g1_job *job = arg;
  const net_topology *t = job->t;
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, t->nodes); i++) {
    bool creased = kind_of(t, i) == NET_CREASED;
    net_frame(job->normals + 3 * i, creased ? t->constraint[i].d[0] : NULL, &job->nodes[i]);
    if (is_curved(job->length)) net_curvature_estimate(t, (uint32_t)i, &job->nodes[i], job->forms + 3 * i);
  }
}

static void make_tangents(void *arg, size_t index) {
  g1_job *job = arg;
  const net_topology *t = job->t;
  batten_network_options opt = *job->opt;
  opt.length = job->length;
  double energy = 0, power = opt.weight_power;
  size_t substitutes = 0;
  for (size_t e = index * ITEMS_PER_TASK; e < task_end(index, t->edges); e++) {
    net_local *local = &job->local[e];
    double chord[3];
    edge_chord(t, e, chord);
    substitutes += net_tangent_edge(t, &opt, job->nodes, job->forms, (uint32_t)e, local);
    const double(*tangents)[3] = (const double(*)[3])local->t;
    double square = vec_dot(chord, chord);
    /* The cube of the length makes weights mean the same for both functionals. */
    energy += job->terms ? beltrami_terms(chord, tangents, edge_weight(square, power - 3), &job->terms[e])
                         : edge_weight(square, power) * simple_energy(chord, tangents);
  }
  job->part[index] = energy;
  job->substitute[index] = substitutes;
}

/* g of a node at an end of an edge, 0 where its constraint leaves no freedom. */
static void slopes(const g1_job *job, uint32_t node, bool crease, const double *tangent, double *g) {
  const net_node *frame = &job->nodes[node];
  net_node_kind kind = kind_of(job->t, node);
  g[0] = kind == NET_FREE ? vec_dot(tangent, frame->u) : 0;
  g[1] = kind == NET_FREE || (kind == NET_CREASED && !crease) ? vec_dot(tangent, frame->v) : 0;
}

/* Unknowns that are not there, or that no edge asks for, are 0 by themselves: with a diagonal of the row's size they
 * change no eigenvalue bound. */
static void settle_diagonal(net_node_kind kind, double *d) {
  double trace = d[0] + d[3];
  bool definite = d[0] * d[3] - d[1] * d[2] > 1e-12 * trace * trace;
  if (kind == NET_FREE && definite) return;
  double size = trace > 0 ? trace : 1;
  if (kind == NET_CREASED && d[3] > 0) size = d[3];
  d[0] = d[3] = size;
  d[1] = d[2] = 0;
}

static void assemble_node(g1_job *job, uint32_t i) {
  const net_topology *t = job->t;
  double *diagonal = block_matrix_at(&job->a, i, i), rhs[2] = {0}, sum[3] = {0};
  const double *wi = job->nodes[i].w;
  for (net_spoke s = net_spoke_first(t, i); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    uint32_t e = t->edge[s.half];
    unsigned end = net_spoke_end(t, s);
    bool crease = t->kind[e] == NET_CREASE;
    if (crease && kind_of(t, i) != NET_FREE) continue;
    uint32_t j = net_edge_node(t, e, !end, 0);
    const net_local *local = &job->local[e];
    double chord[3], gi[2], gj[2];
    edge_chord(t, e, chord);
    edge_terms k;
    if (job->terms) {
      k = job->terms[e];
    } else {
      simple_terms(edge_weight(vec_dot(chord, chord), job->opt->weight_power), &k);
    }
    slopes(job, i, crease, local->t[end], gi);
    slopes(job, j, crease, local->t[!end], gj);
    double own = end ? k.k11 : k.k00, fixed = end ? k.kf1 : k.kf0;
    double r = -k.k01 * vec_dot(wi, local->t[!end]) - fixed * vec_dot(wi, chord);
    double *block = block_matrix_at(&job->a, i, j), cross = k.k01 * vec_dot(wi, job->nodes[j].w);
    for (int a = 0; a < 2; a++) {
      rhs[a] += r * gi[a];
      for (int b = 0; block && b < 2; b++) block[2 * a + b] = cross * (gi[a] * gj[b]);
    }
    sum[0] += own * gi[0] * gi[0];
    sum[1] += own * gi[0] * gi[1];
    sum[2] += own * gi[1] * gi[1];
  }
  diagonal[0] = sum[0];
  diagonal[1] = diagonal[2] = sum[1];
  diagonal[3] = sum[2];
  settle_diagonal(kind_of(t, i), diagonal);
  memcpy(job->rhs + (size_t)2 * i, rhs, sizeof rhs);
}

static void assemble(void *arg, size_t index) {
  g1_job *job = arg;
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, job->t->nodes); i++) assemble_node(job, (uint32_t)i);
}

/* Tangent of the angle between unit vectors, of 90 degrees at most. */
static double turn_of(const double *from, const double *to) {
  double across[3];
  vec_cross(from, to, across);
  return vec_norm(across) / fmax(vec_dot(from, to), 1e-3);
}

/* New normals; part: the largest turn asked for. */
static void turn_normals(void *arg, size_t index) {
  g1_job *job = arg;
  const net_topology *t = job->t;
  double most = 0, steepest = tan(job->turn_max);
  for (size_t i = index * ITEMS_PER_TASK; i < task_end(index, t->nodes); i++) {
    const double *x = job->x + 2 * i;
    const net_node *node = &job->nodes[i];
    double *normal = job->normals + 3 * i;
    if (kind_of(t, i) == NET_CORNER) continue;
    double slope = sqrt(x[0] * x[0] + x[1] * x[1]), scale = slope > steepest ? steepest / slope : 1;
    for (int k = 0; k < 3; k++) normal[k] = node->w[k] - scale * (x[0] * node->u[k] + x[1] * node->v[k]);
    vec_normalize(normal);
    net_normal_constrain(t->constraint ? t->constraint + i : NULL, normal);
    if (net_normal_guard(t, (uint32_t)i, normal)) slope = turn_of(node->w, normal);
    most = fmax(most, slope);
  }
  job->part[index] = atan(most);
}

/* ---- the iteration -------------------------------------------------------------------------------- */

static void prepare_pass(batten_context *ctx, g1_job *job, double *energy, size_t *substitutes) {
  size_t tasks = task_count(job->t->edges);
  batten_parallel(ctx, task_count(job->t->nodes), make_frames, job);
  batten_parallel(ctx, tasks, make_tangents, job);
  *energy = 0;
  *substitutes = 0;
  for (size_t i = 0; i < tasks; i++) {
    *energy += job->part[i];
    *substitutes += job->substitute[i];
  }
}

static double move_normals(batten_context *ctx, g1_job *job) {
  size_t tasks = task_count(job->t->nodes);
  batten_parallel(ctx, tasks, turn_normals, job);
  double most = 0;
  for (size_t i = 0; i < tasks; i++) most = fmax(most, job->part[i]);
  return most;
}

static size_t count_unknowns(const net_topology *t) {
  size_t unknowns = 0;
  for (size_t i = 0; i < t->nodes; i++) unknowns += kind_of(t, i) == NET_FREE ? 2 : kind_of(t, i) == NET_CREASED;
  return unknowns;
}

/* Pairs of nodes that share a curve which both can move. */
static batten_status make_pattern(batten_context *ctx, g1_job *job) {
  const net_topology *t = job->t;
  uint32_t *pairs = batten_alloc_array(ctx, t->edges, 2 * sizeof *pairs);
  if (!pairs) return BATTEN_E_NOMEM;
  size_t count = 0;
  for (uint32_t e = 0; e < t->edges; e++) {
    uint32_t i = net_edge_node(t, e, 0, 0), j = net_edge_node(t, e, 1, 0);
    bool crease = t->kind[e] == NET_CREASE;
    if (crease && (kind_of(t, i) != NET_FREE || kind_of(t, j) != NET_FREE)) continue;
    pairs[2 * count] = i;
    pairs[2 * count++ + 1] = j;
  }
  batten_status st = block_matrix_new(ctx, t->nodes, 2, count, pairs, &job->a);
  batten_free(ctx, pairs);
  return st;
}

static batten_status solve_direct(batten_context *ctx, g1_job *job, block_plan *plan, net_figures *figures) {
  size_t n = 2 * job->t->nodes;
  batten_status st = block_factor(ctx, plan, &job->a, NULL);
  if (st < 0) return st;
  memcpy(job->x, job->rhs, n * sizeof *job->x);
  block_solve(ctx, plan, job->x);
  double *product = batten_alloc_array(ctx, n, sizeof *product), error = 0, size = 0;
  if (!product) return BATTEN_E_NOMEM;
  block_matrix_apply(ctx, &job->a, job->x, product);
  for (size_t k = 0; k < n; k++) {
    error += (job->rhs[k] - product[k]) * (job->rhs[k] - product[k]);
    size += job->rhs[k] * job->rhs[k];
  }
  figures->residual = size > 0 ? sqrt(error / size) : 0;
  batten_free(ctx, product);
  return st;
}

static batten_status solve_cg(batten_context *ctx, g1_job *job, double tolerance, net_figures *figures) {
  block_cg_figures cg = {0};
  memset(job->x, 0, 2 * job->t->nodes * sizeof *job->x);
  batten_status st = block_cg(ctx, &job->a, job->rhs, tolerance, CG_MOST, "normals", job->x, &cg);
  figures->cg_iterations += cg.iterations;
  figures->residual = cg.residual;
  return st;
}

/* Relative residual to which a pass is solved: normals are then off by a hundredth of what ends the iteration, if
 * they turn no further than in the pass before. One pass alone is solved as well as it can be. */
static double pass_tolerance(const batten_network_options *opt, double turn) {
  double tolerance = opt->normal_passes > 1 ? 0.01 * opt->normal_tol_rad / turn : 0;
  return fmin(fmax(tolerance, 1e-12), 1e-3);
}

/* Slopes from the frames and local parameters at hand. */
static batten_status solve_pass(batten_context *ctx, g1_job *job, block_plan *plan, double turn,
                                net_figures *figures) {
  batten_status st =
      batten_progress(ctx, "normals", (double)figures->normal_passes / (double)job->opt->normal_passes);
  if (st < 0) return st;
  batten_parallel(ctx, task_count(job->t->nodes), assemble, job);
  return plan ? solve_direct(ctx, job, plan, figures) : solve_cg(ctx, job, pass_tolerance(job->opt, turn), figures);
}

static batten_status iterate(batten_context *ctx, g1_job *job, block_plan *plan, net_figures *figures) {
  batten_status worst = BATTEN_OK;
  bool grown = false;
  job->turn_max = TURN_MAX;
  for (unsigned pass = 0;; pass++) {
    prepare_pass(ctx, job, &figures->energy, &figures->clamped);
    if (pass == 0) figures->energy_start = figures->energy;
    figures->normal_passes = pass;
    double turned = fmin(figures->normal_change, job->turn_max);
    if (pass == job->opt->normal_passes || (pass > 0 && turned < job->opt->normal_tol_rad)) return worst;
    double before = figures->normal_change;
    batten_status st = solve_pass(ctx, job, plan, pass ? before : TURN_MAX, figures);
    if (st < 0) return st;
    if (st > worst) worst = st;
    figures->normal_change = move_normals(ctx, job);
    grown |= pass > 0 && figures->normal_change > before;
    if (grown) job->turn_max = 0.5 * fmin(job->turn_max, before);
  }
}

/* Lengths by curvatures follow the normals so violently (by a third of their value, where the estimates of two ends
 * do not go together) that with them nothing converges, and a single pass with them loses half of what the others
 * gained. So they make the curves, but not the normals: those are optimised with L2. */
static batten_status optimise(batten_context *ctx, g1_job *job, block_plan *plan, net_figures *figures) {
  bool curved = is_curved(job->opt->length);
  job->length = curved ? BATTEN_LENGTH_L2 : job->opt->length;
  batten_status st = iterate(ctx, job, plan, figures);
  if (st < 0 || !curved) return st;
  job->length = job->opt->length;
  prepare_pass(ctx, job, &figures->energy, &figures->clamped);
  return st;
}

/* What a pass works on; passes = 0 needs no system. */
static batten_status take_memory(batten_context *ctx, g1_job *job) {
  const net_topology *t = job->t;
  const batten_network_options *opt = job->opt;
  size_t tasks = task_count(t->nodes > t->edges ? t->nodes : t->edges);
  bool beltrami = opt->functional == BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI;
  if (!(job->nodes = batten_alloc_array(ctx, t->nodes, sizeof *job->nodes)) ||
      !(job->part = batten_alloc_array(ctx, tasks, sizeof *job->part)) ||
      !(job->substitute = batten_alloc_array(ctx, tasks, sizeof *job->substitute)) ||
      (is_curved(opt->length) && !(job->forms = batten_alloc_array(ctx, t->nodes, 3 * sizeof *job->forms))) ||
      (beltrami && !(job->terms = batten_alloc_array(ctx, t->edges, sizeof *job->terms))))
    return BATTEN_E_NOMEM;
  if (opt->normal_passes == 0) return BATTEN_OK;
  if (!(job->rhs = batten_alloc_array(ctx, t->nodes, 2 * sizeof *job->rhs)) ||
      !(job->x = batten_alloc_array(ctx, t->nodes, 2 * sizeof *job->x)))
    return BATTEN_E_NOMEM;
  return make_pattern(ctx, job);
}

batten_status net_g1(batten_context *ctx, const net_topology *t, const batten_network_options *opt, double *normals,
                     net_local *local, net_figures *figures) {
  g1_job job = {.t = t, .opt = opt, .normals = normals, .local = local};
  block_plan *plan = NULL;
  *figures = (net_figures){.unknowns = opt->normal_passes ? count_unknowns(t) : 0};
  batten_status st = take_memory(ctx, &job);
  if (st == BATTEN_OK && opt->normal_passes && opt->solver == BATTEN_NETWORK_DIRECT)
    st = block_plan_new(ctx, &job.a, BLOCK_AUTO, &plan);
  if (st == BATTEN_OK) st = optimise(ctx, &job, plan, figures);
  block_plan_free(ctx, plan);
  block_matrix_free(ctx, &job.a);
  batten_free(ctx, job.x);
  batten_free(ctx, job.rhs);
  batten_free(ctx, job.terms);
  batten_free(ctx, job.forms);
  batten_free(ctx, job.substitute);
  batten_free(ctx, job.part);
  batten_free(ctx, job.nodes);
  return st;
}
