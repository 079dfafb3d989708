/* The fair fill: normals and curvatures at all vertices, and the inner control points of all patches, such that the
 * integral of |grad II|^2 over the filled surface is least; and its linear variant.
 *
 * The paper's functionals are quadratic in the unknowns because the metric is frozen; their extremals have peaks of
 * curvature at vertices that lie off. Here the surface itself is measured, in its own metric, by a quantity that is 0
 * on spheres, cylinders and planes (fair_residual.c). It is a sum of squares, and nearly 0 where all is well:
 * Gauss-Newton. Five unknowns at each node are enough, since curves and fields follow the normals (fair_facet.c);
 * joints are exact for all of their values. Each pass: equations of every facet, without the inner unknowns; one
 * sparse Cholesky; a step, after which frames turn with their normals.
 *
 * A step is taken when the energy falls and no more facets are irregular than before. Otherwise damping grows:
 * around the facets that would turn irregular or that alone make the energy rise, or everywhere. So nothing that
 * comes out is worse than the start. Facets that are next to singular, as rough scans have them from the start, count
 * by the logarithm of their energy, and by as much in the equations: a few that cannot be mended do not hold up all
 * others.
 *
 * The linear variant freezes normal, connection and metric of the last pass and the tangents' directions, so that the
 * map from unknowns to control points is affine and the rows are linear: a quadratic functional like the paper's, but
 * in the metric of the filled surface and without its bias against spheres. Two solves. */
#include <string.h>

#include "base/checked.h"
#include "fair.h"
#include "normals.h"

enum {
  ITEMS_PER_PART = 4, /* facets at some 20 us at least */
  TRIALS_MAX = 12,    /* of damping in a pass */
  TURNED = 50,        /* irregular facets that weigh as much as a corner that is turned over: never worth it */
  LINEAR_PASSES = 2
};

static const double DAMPING_MIN = 1e-6, DAMPING_FIRST = 1e-3, DAMPING_FACTOR = 5, DAMPING_FALL = 25;
/* Added around facets that would turn irregular: shortens their step to a few parts in a hundred in four trials. */
static const double GUARD_FIRST = 0.3, GUARD_FACTOR = 10;
/* Facets that rise by more than this part of the largest rise are damped by themselves. */
static const double RISE_SHARE = 0.1;
/* A facet counts as irregular where the degree 7 fill would refuse it, and when the area of the parameters, turned to
 * the corners' normals, falls below this part of its mean. */
static const double REGULAR_MIN = 0.02;
/* Residuals' rounding in parts of 1 / edge^3 with coordinates of about 1: below it a mesh is flat. */
static const double ROUNDING = 1e-12;
/* A facet's energy counts in full up to this over its area: a hundred times that of the hardest bends. Above, where
 * its patch is next to singular, only the logarithm does, so that it does not outweigh all others. */
static const double SINGULAR = 1e3;
static const double LITTLE = 1e-3;      /* part of the energy that ties may cost where all is done */
static const double ENERGY_MAX = 1e200; /* for what is not finite */
/* Of the integral of |II|^4: a sphere whose curvature is off by some parts in a thousand has as much energy. */
static const double VISIBLE = 1e-4;

typedef struct fair_state {
  net_node *nodes;
  net_local *local;
  double (*inner)[3][3];    /* [faces] displacements */
  double *energy;           /* [faces] */
  unsigned char *irregular; /* [faces] 0: regular */
  double counted;           /* sum of energies as they count */
  size_t irregular_count;
} fair_state;

typedef struct fair_job {
  batten_context *ctx;
  const net_topology *t;
  batten_network_options opt;
  fair_model model;
  fair_tables *tables;
  fair_scratch *scratch; /* [FAIR_PARTS_MAX] or fewer */
  fair_state now, next;
  fair_equations *equations; /* [faces] */
  double *reduced;           /* [faces][FAIR_REDUCED] */
  fair_freedom *freedom;     /* [nodes] */
  double *cap;               /* [faces] energies that count in full */
  double *guard;             /* [nodes] damping beside that of all */
  double damping;
  block_matrix matrix;
  block_plan *plan;
  double *step; /* [nodes][5] */
  double (*out)[FAIR_NET][3];
} fair_job;

/* ---- loops ---------------------------------------------------------------------------------------------- */

typedef void fair_body(fair_job *job, fair_scratch *scratch, size_t item);

typedef struct fair_loop {
  fair_job *job;
  size_t items, parts;
  fair_body *body;
} fair_loop;

static size_t parts_of(size_t items) {
  size_t parts = (items + ITEMS_PER_PART - 1) / ITEMS_PER_PART;
  return parts < FAIR_PARTS_MAX ? parts : FAIR_PARTS_MAX;
}

static void run_part(void *arg, size_t part) {
  const fair_loop *loop = arg;
  size_t share = loop->items / loop->parts, rest = loop->items % loop->parts;
  size_t first = share * part + (part < rest ? part : rest), last = first + share + (part < rest);
  for (size_t i = first; i < last; i++) loop->body(loop->job, &loop->job->scratch[part], i);
}

static void run(fair_job *job, size_t items, fair_body *body) {
  fair_loop loop = {job, items, parts_of(items), body};
  batten_parallel(job->ctx, loop.parts, run_part, &loop);
}

/* ---- a state's energy ------------------------------------------------------------------------------------- */

/* What a facet's energy counts, and by its derivative its equations do. */
static double counted(double energy, double cap) { return energy <= cap ? energy : cap * (1 + log(energy / cap)); }

static void gather(const fair_job *job, const fair_state *state, size_t face, fair_facet *out) {
  net_facet_ribbons(job->t, state->nodes, state->local, face, out->corner, out->ribbon);
  memcpy(out->inner, state->inner[face], sizeof out->inner);
}

static void make_tangents(fair_job *job, fair_scratch *scratch, size_t edge) {
  (void)scratch;
  net_tangent_edge(job->t, &job->opt, job->next.nodes, NULL, (uint32_t)edge, &job->next.local[edge]);
}

/* Corners at which the facet lies with its back up: tangents of its sides there in the wrong order. */
static unsigned turned_corners(const fair_facet *facet) {
  unsigned count = 0;
  for (unsigned k = 0; k < 3; k++) {
    double leave[3], arrive[3], up[3];
    vec_sub(facet->ribbon[k].c[1], facet->ribbon[k].c[0], leave);
    vec_sub(facet->ribbon[(k + 2) % 3].c[4], facet->ribbon[k].c[0], arrive);
    vec_cross(leave, arrive, up);
    if (!(vec_dot(up, facet->corner[k].w) > 0)) count++;
  }
  return count;
}

static void measure_face(fair_job *job, fair_scratch *scratch, size_t face) {
  fair_state *s = &job->next;
  fair_facet facet;
  gather(job, s, face, &facet);
  bool regular = net_fill_degree7(facet.corner, facet.ribbon, scratch->points);
  fair_facet_net(&facet, scratch->net);
  double up[3], energy = 0, least = INFINITY, mean = 0;
  for (int x = 0; x < 3; x++) up[x] = facet.corner[0].w[x] + facet.corner[1].w[x] + facet.corner[2].w[x];
  vec_normalize(up);
  for (unsigned g = 0; g < FAIR_POINTS; g++) {
    double r[FAIR_ROWS], normal[3];
    fair_residual(job->tables, (const double(*)[FAIR_NET])scratch->net, g, FAIR_FROZEN, r, NULL, normal);
    for (unsigned a = 0; a < FAIR_ROWS; a++) energy += r[a] * r[a];
    double upward = vec_dot(normal, up);
    least = fmin(least, upward);
    mean += upward / FAIR_POINTS;
  }
  s->energy[face] = energy <= ENERGY_MAX ? energy : ENERGY_MAX;
  bool fine = regular && energy <= ENERGY_MAX && least > REGULAR_MIN * fabs(mean);
  s->irregular[face] = (unsigned char)(!fine + TURNED * turned_corners(&facet));
}

/* Of job->next, from its nodes and displacements. */
static void measure(fair_job *job) {
  fair_state *s = &job->next;
  run(job, job->t->edges, make_tangents);
  run(job, job->t->faces, measure_face);
  s->counted = 0;
  s->irregular_count = 0;
  for (size_t f = 0; f < job->t->faces; f++) {
    s->counted += counted(s->energy[f], job->cap[f]);
    s->irregular_count += s->irregular[f];
  }
}

static void swap_states(fair_job *job) {
  fair_state before = job->now;
  job->now = job->next;
  job->next = before;
}

static double double_area(const net_topology *t, size_t face) {
  const uint32_t *v = t->triangles + 3 * face;
  double n[3];
  vec_triangle_normal(t->points + 3 * (size_t)v[0], t->points + 3 * (size_t)v[1], t->points + 3 * (size_t)v[2], n);
  return vec_norm(n);
}

/* Two energies to compare with: what rounding alone gives, and the integral of |II|^4, of the same dimension, which
 * says how much of |grad II|^2 the eye could see. */
static void energy_scales(const fair_job *job, double *rounding, double *visible) {
  const net_topology *t = job->t;
  *rounding = *visible = 0;
  for (size_t f = 0; f < t->faces; f++) {
    double area = double_area(t, f), r = ROUNDING / (area * sqrt(area));
    *rounding += area * r * r;
    double bent = 0;
    for (unsigned k = 0; k < 3; k++) {
      const double *x = job->now.nodes[t->node[3 * f + k]].x;
      double square = x[2] * x[2] + 2 * x[3] * x[3] + x[4] * x[4];
      bent += area / 6 * square * square;
    }
    *visible += fmin(bent, job->cap[f]);
  }
  *visible *= VISIBLE;
}

/* ---- a step ------------------------------------------------------------------------------------------------ */

static void make_equations(fair_job *job, fair_scratch *scratch, size_t face) {
  fair_equations *to = &job->equations[face];
  fair_facet facet;
  gather(job, &job->now, face, &facet);
  fair_facet_net(&facet, scratch->net);
  fair_facet_axes(job->tables, (const double(*)[FAIR_NET])scratch->net, to->axes);
  fair_facet_slopes(job->t, &job->opt, job->now.local, face, &facet, job->model == FAIR_LINEAR, scratch->slopes);
  fair_equations_make(job->tables, job->model, (const double(*)[3])facet.inner, scratch, to);
  double weight = fmin(1, job->cap[face] / job->now.energy[face]);
  bool finite = batten_first_nonfinite(FAIR_PACKED, to->products) == FAIR_PACKED;
  for (size_t i = 0; i < FAIR_PACKED && weight < 1; i++) to->products[i] *= weight;
  if (!finite) memset(to->products, 0, sizeof to->products);
}

static void make_freedom(fair_job *job, fair_scratch *scratch, size_t node) {
  (void)scratch;
  double origin[5];
  fair_freedom *to = &job->freedom[node];
  net_node_freedom(job->t->constraint ? &job->t->constraint[node] : NULL, &job->now.nodes[node], origin, to->columns,
                   &to->dof);
}

static double face_damping(const fair_job *job, size_t face, double corner[3]) {
  double least = INFINITY;
  for (unsigned k = 0; k < 3; k++) {
    double guard = job->guard[job->t->node[3 * face + k]];
    least = fmin(least, guard);
    corner[k] = job->damping + guard;
  }
  return job->damping + least;
}

static void reduce_face(fair_job *job, fair_scratch *scratch, size_t face) {
  double corner[3], damping = face_damping(job, face, corner);
  fair_equations_reduce(&job->equations[face], damping, corner, scratch, job->reduced + FAIR_REDUCED * face);
}

static void move_node(fair_job *job, fair_scratch *scratch, size_t i) {
  (void)scratch;
  const net_node *from = &job->now.nodes[i];
  net_node *to = &job->next.nodes[i];
  const fair_freedom *freedom = &job->freedom[i];
  double *y = job->step + 5 * i, step[5] = {0};
  for (unsigned k = 0; k < 5; k++)
    for (unsigned c = 0; c < freedom->dof; c++) step[k] += freedom->columns[k][c] * y[c];
  memcpy(y, step, sizeof step);
  if (job->model == FAIR_LINEAR) {
    *to = *from;
    for (unsigned k = 0; k < 5; k++) to->x[k] += step[k];
    fair_node_upright(to, to);
  } else {
    fair_node_turn(from, step, to);
  }
  fair_node_constrain(job->t->constraint ? &job->t->constraint[i] : NULL, to);
}

static void move_inner(fair_job *job, fair_scratch *scratch, size_t face) {
  double corner_damping[3], damping = face_damping(job, face, corner_damping), corner_step[FAIR_OUTER], step[3][3];
  for (unsigned k = 0; k < 3; k++)
    memcpy(corner_step + 5 * k, job->step + 5 * (size_t)job->t->node[3 * face + k], 5 * sizeof *corner_step);
  fair_equations_inner(&job->equations[face], damping, corner_step, scratch, step);
  for (unsigned i = 0; i < 3; i++)
    for (unsigned x = 0; x < 3; x++) job->next.inner[face][i][x] = job->now.inner[face][i][x] + step[i][x];
}

/* job->next from job->now and the damping. SINGULAR: the damping is too small for rounding. */
static batten_status try_step(fair_job *job) {
  run(job, job->t->faces, reduce_face);
  fair_assemble(job->t, job->freedom, job->reduced, &job->matrix, job->step);
  batten_status st = block_factor(job->ctx, job->plan, &job->matrix, NULL);
  if (st < 0) return st;
  block_solve(job->ctx, job->plan, job->step);
  run(job, job->t->nodes, move_node);
  run(job, job->t->faces, move_inner);
  measure(job);
  return BATTEN_OK;
}

static void raise_guard(fair_job *job, size_t face) {
  for (unsigned k = 0; k < 3; k++) {
    double *guard = &job->guard[job->t->node[3 * face + k]];
    *guard = fmax(GUARD_FIRST, fmin(*guard * GUARD_FACTOR, GUARD_FIRST * 1e9));
  }
}

/* More damping around the facets that have turned irregular. */
static void guard_irregular(fair_job *job) {
  for (size_t f = 0; f < job->t->faces; f++)
    if (job->next.irregular[f] > job->now.irregular[f]) raise_guard(job, f);
}

static double rise(const fair_job *job, size_t face) {
  return counted(job->next.energy[face], job->cap[face]) - counted(job->now.energy[face], job->cap[face]);
}

static double rises(const fair_job *job) {
  double sum = 0;
  for (size_t f = 0; f < job->t->faces; f++) sum += fmax(rise(job, f), 0);
  return sum;
}

/* More damping around the few facets without which the sum would not rise, if there are such: next to singular they
 * rise whatever the step, and must not hold up all others. */
static bool guard_risen(fair_job *job) {
  double sum = job->next.counted - job->now.counted, most = 0, share = 0;
  for (size_t f = 0; f < job->t->faces; f++) most = fmax(most, rise(job, f));
  for (size_t f = 0; f < job->t->faces; f++)
    if (rise(job, f) > RISE_SHARE * most) share += rise(job, f);
  if (!(share > sum)) return false;
  for (size_t f = 0; f < job->t->faces; f++)
    if (rise(job, f) > RISE_SHARE * most) raise_guard(job, f);
  return true;
}

/* What the steps make smaller: energies as they count, with those of the ties as they are in this pass. */
static double merit(const fair_job *job, const fair_state *s) {
  double sum = s->counted;
  for (size_t f = 0; f < job->t->faces; f++)
    sum += fair_equations_ties(&job->equations[f], (const double(*)[3])s->inner[f]);
  return sum;
}

/* One pass: *lower tells whether any step could lower the energy. */
static batten_status pass(fair_job *job, bool *lower) {
  bool grown = false;
  *lower = false;
  run(job, job->t->nodes, make_freedom);
  run(job, job->t->faces, make_equations);
  for (size_t i = 0; i < job->t->nodes; i++)
    job->guard[i] = job->guard[i] > GUARD_FIRST ? job->guard[i] / GUARD_FACTOR : 0;
  for (unsigned trial = 0; trial < TRIALS_MAX; trial++) {
    batten_status st = try_step(job);
    if (st < 0 && st != BATTEN_E_SINGULAR) return st;
    bool falls = st >= 0 && merit(job, &job->next) < merit(job, &job->now);
    if (falls && job->next.counted >= job->now.counted) { /* only the ties gain */
      if (rises(job) < LITTLE * job->now.counted) break;
      falls = false;
    }
    *lower = falls && job->next.irregular_count <= job->now.irregular_count;
    if (*lower) {
      swap_states(job);
      job->damping = fmax(DAMPING_MIN, job->damping / (grown ? DAMPING_FACTOR : DAMPING_FALL));
      break;
    }
    if (!falls && job->model == FAIR_FROZEN) { /* no matter how short, its step may not be one down */
      job->model = FAIR_FULL;
      run(job, job->t->faces, make_equations);
    } else if (!falls && !(st >= 0 && trial % 2 && guard_risen(job))) {
      job->damping = fmax(DAMPING_FIRST, DAMPING_FACTOR * job->damping);
      grown = true;
    }
    if (st >= 0) guard_irregular(job);
  }
  return BATTEN_OK;
}

/* ---- begin and end -------------------------------------------------------------------------------------------- */

static batten_status state_make(fair_job *job, fair_state *s) {
  const net_topology *t = job->t;
  s->nodes = batten_alloc_array(job->ctx, t->nodes, sizeof *s->nodes);
  if (s->nodes) s->local = batten_alloc_array(job->ctx, t->edges, sizeof *s->local);
  if (s->local) s->inner = batten_alloc_array(job->ctx, t->faces, sizeof *s->inner);
  if (s->inner) s->energy = batten_alloc_array(job->ctx, t->faces, sizeof *s->energy);
  if (s->energy) s->irregular = batten_alloc_array(job->ctx, t->faces, sizeof *s->irregular);
  return s->irregular ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void state_free(fair_job *job, fair_state *s) {
  batten_free(job->ctx, s->irregular);
  batten_free(job->ctx, s->energy);
  batten_free(job->ctx, s->inner);
  batten_free(job->ctx, s->local);
  batten_free(job->ctx, s->nodes);
}

static batten_status system_make(fair_job *job) {
  const net_topology *t = job->t;
  size_t count = 0;
  uint32_t(*pairs)[2] = batten_alloc_array(job->ctx, t->faces, 3 * sizeof *pairs);
  if (!pairs) return BATTEN_E_NOMEM;
  for (uint32_t h = 0; h < 3 * t->faces; h++, count++) {
    pairs[count][0] = t->node[h];
    pairs[count][1] = t->node[net_next(h)];
  }
  batten_status st = block_matrix_new(job->ctx, t->nodes, 5, count, pairs[0], &job->matrix);
  if (st >= 0) st = block_plan_new(job->ctx, &job->matrix, BLOCK_AUTO, &job->plan);
  batten_free(job->ctx, pairs);
  return st;
}

static batten_status job_make(fair_job *job) {
  const net_topology *t = job->t;
  size_t most = t->edges > t->faces ? t->edges : t->faces;
  if (t->nodes > most) most = t->nodes;
  batten_status st = state_make(job, &job->now);
  if (st >= 0) st = state_make(job, &job->next);
  if (st < 0) return st;
  job->tables = batten_alloc_array(job->ctx, 1, sizeof *job->tables);
  if (job->tables) job->scratch = batten_alloc_array(job->ctx, parts_of(most), sizeof *job->scratch);
  if (job->scratch) job->equations = batten_alloc_array(job->ctx, t->faces, sizeof *job->equations);
  if (job->equations) job->reduced = batten_alloc_array(job->ctx, t->faces, FAIR_REDUCED * sizeof *job->reduced);
  if (job->reduced) job->freedom = batten_alloc_array(job->ctx, t->nodes, sizeof *job->freedom);
  if (job->freedom) job->cap = batten_alloc_array(job->ctx, t->faces, sizeof *job->cap);
  if (job->cap) job->guard = batten_alloc_array(job->ctx, t->nodes, sizeof *job->guard);
  if (job->guard) job->step = batten_alloc_array(job->ctx, t->nodes, 5 * sizeof *job->step);
  if (!job->step) return BATTEN_E_NOMEM;
  memset(job->guard, 0, t->nodes * sizeof *job->guard);
  fair_tables_make(job->tables);
  return system_make(job);
}

static void job_free(fair_job *job) {
  block_plan_free(job->ctx, job->plan);
  block_matrix_free(job->ctx, &job->matrix);
  batten_free(job->ctx, job->step);
  batten_free(job->ctx, job->guard);
  batten_free(job->ctx, job->cap);
  batten_free(job->ctx, job->freedom);
  batten_free(job->ctx, job->reduced);
  batten_free(job->ctx, job->equations);
  batten_free(job->ctx, job->scratch);
  batten_free(job->ctx, job->tables);
  state_free(job, &job->next);
  state_free(job, &job->now);
}

/* Slopes of a network may bend normals further than those that made its tangents were let. */
static void see_triangles(const net_topology *t, uint32_t i, net_node *node) {
  double normal[3], u[3], form[3];
  memcpy(normal, node->w, sizeof normal);
  if (!net_normal_guard(t, i, normal)) return;
  memcpy(u, node->u, sizeof u);
  memcpy(form, node->x + 2, sizeof form);
  net_frame(normal, u, node);
  memcpy(node->x + 2, form, sizeof form);
}

/* The start: upright nodes within their constraints, inner points of least thin plate energy. */
static void begin(fair_job *job, const net_node *nodes) {
  for (size_t i = 0; i < job->t->nodes; i++) {
    fair_node_upright(&nodes[i], &job->next.nodes[i]);
    see_triangles(job->t, (uint32_t)i, &job->next.nodes[i]);
    fair_node_constrain(job->t->constraint ? &job->t->constraint[i] : NULL, &job->next.nodes[i]);
  }
  memset(job->next.inner, 0, job->t->faces * sizeof *job->next.inner);
  for (size_t f = 0; f < job->t->faces; f++) job->cap[f] = SINGULAR / double_area(job->t, f);
  measure(job);
  swap_states(job);
}

static batten_status iterate(fair_job *job, double fair_tol, unsigned passes, unsigned *done) {
  batten_status st = batten_progress(job->ctx, "fair", 0);
  for (*done = 0; st >= 0 && *done < passes;) {
    double rounding, visible, before = job->now.counted, damping = job->damping;
    bool lower;
    energy_scales(job, &rounding, &visible);
    if (job->now.counted <= rounding) break;
    st = pass(job, &lower);
    if (st < 0 || !lower) break;
    ++*done;
    st = batten_progress(job->ctx, "fair", (double)*done / passes);
    bool damped = job->damping > DAMPING_MIN && job->damping >= damping; /* a short step need not be the last */
    if (!damped && before - job->now.counted < fair_tol * (before + visible)) break;
  }
  return st;
}

static void write_face(fair_job *job, fair_scratch *scratch, size_t face) {
  fair_facet facet;
  gather(job, &job->now, face, &facet);
  fair_facet_net(&facet, scratch->net);
  for (unsigned p = 0; p < FAIR_NET; p++)
    for (unsigned x = 0; x < 3; x++) job->out[face][p][x] = scratch->net[x][p];
}

static void finish(fair_job *job, net_node *nodes, double start, unsigned passes, net_figures *figures) {
  run(job, job->t->faces, write_face);
  memcpy(nodes, job->now.nodes, job->t->nodes * sizeof *nodes);
  figures->fairing_passes = passes;
  figures->energy_start = start;
  figures->energy = job->now.counted;
  figures->unknowns = 9 * job->t->faces;
  for (size_t i = 0; i < job->t->nodes; i++) figures->unknowns += job->freedom[i].dof;
}

batten_status net_fair(batten_context *ctx, const net_topology *t, const batten_network_options *opt, bool linear,
                       net_node *nodes, double (*out)[36][3], net_figures *figures) {
  if (t->faces == 0) return BATTEN_OK;
  fair_job job = {.ctx = ctx, .t = t, .opt = *opt, .damping = DAMPING_MIN, .out = out};
  job.model = linear ? FAIR_LINEAR : FAIR_FROZEN;
  /* L3 and L4 need curvatures beforehand, which are unknowns here. */
  if (opt->length != BATTEN_LENGTH_L1) job.opt.length = BATTEN_LENGTH_L2;
  unsigned passes;
  batten_status st = job_make(&job);
  if (st < 0) goto done;
  begin(&job, nodes);
  run(&job, t->nodes, make_freedom);
  double start = job.now.counted;
  st = iterate(&job, opt->fair_tol, linear ? LINEAR_PASSES : opt->fair_passes, &passes);
  if (st >= 0) finish(&job, nodes, start, passes, figures);
done:
  job_free(&job);
  return st;
}
