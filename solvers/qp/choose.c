/* Which engine: by estimated floating point operations and by the memory that is left. See driver.h. */
#include "driver.h"

#include "base/checked.h"

/* Below, the dense engines win whatever the rows are, and an ordering of the unknowns costs more than it tells. */
static const size_t ALWAYS_DENSE = 48;
/* Beyond, a dense engine is not tried for want of something better: some ten seconds. */
static const double AFFORDABLE = 3e10;

/* Beyond, a dense engine is no alternative at all: some minutes. */
static const double HOPELESS = 30 * 3e10;

static qp_cost saturated_sum(qp_cost a, qp_cost b) {
  qp_cost sum = {0, a.flops + b.flops};
  batten_add(a.bytes, b.bytes, &sum.bytes);
  return sum;
}

/* The objective's factor and what making it takes: QR of k rows by blocks, or Cholesky. */
static qp_cost factor_cost(const qp_objective *o) {
  size_t n = o->n, rows = o->k, all, bytes;
  size_t block = 4 * n > 512 ? 4 * n : 512; /* see objective.c */
  double squares = (double)n * (double)n;
  if (rows > block) rows = block;
  /* r, root of H, triangle, stacked triangles; the block of rows */
  if (!batten_add(5 * n, rows, &all) || !batten_mul3(all, n + 1, sizeof(double), &bytes)) bytes = SIZE_MAX;
  return (qp_cost){bytes, 2 * (double)o->k * squares + (o->problem->h ? squares * (double)n : 0)};
}

static batten_status interior_cost(batten_context *ctx, const qp_task *task, qp_cost *cost) {
  qp_sparse objective;
  batten_matrix h;
  void *memory = NULL;
  size_t before = batten_bytes_in_use(ctx);
  batten_status st = qp_objective_sparse(ctx, task->objective, &objective, &h, &memory);
  if (st < 0) return st;
  size_t held = batten_bytes_in_use(ctx) - before;
  st = qp_interior_cost(ctx, &h, task->rows, cost);
  if (st >= 0) *cost = saturated_sum(*cost, (qp_cost){held, 0});
  batten_free(ctx, memory);
  return st;
}

batten_status qp_choose(batten_context *ctx, const qp_task *task, const batten_qp_options *o, bool exactly,
                        qp_plan *plan) {
  size_t n = task->rows->n, left = batten_bytes_available(ctx);
  const qp_cost impossible = {SIZE_MAX, INFINITY};
  qp_cost cost[BATTEN_QP_INTERIOR + 1] = {impossible, impossible, impossible, impossible}, factor;
  factor = factor_cost(task->objective);
  cost[BATTEN_QP_DUAL] = saturated_sum(factor, qp_dual_cost(task->rows));
  cost[BATTEN_QP_PRIMAL] = saturated_sum(factor, qp_primal_cost(task->rows));
  bool hopeless = cost[BATTEN_QP_DUAL].bytes > left || cost[BATTEN_QP_DUAL].flops > HOPELESS;
  hopeless = hopeless && (cost[BATTEN_QP_PRIMAL].bytes > left || cost[BATTEN_QP_PRIMAL].flops > HOPELESS);
  bool asked = !o->hand_over && (o->engine == BATTEN_QP_DUAL || o->engine == BATTEN_QP_PRIMAL);
  if (!exactly && (hopeless || asked)) {
    cost[BATTEN_QP_INTERIOR] = (qp_cost){0, AFFORDABLE}; /* whatever it costs, or never asked: not worth an
                                                        ordering to know */
  } else if (exactly || n > ALWAYS_DENSE) {
    batten_status st = interior_cost(ctx, task, &cost[BATTEN_QP_INTERIOR]);
    if (st < 0 && st != BATTEN_E_TOO_LARGE) return st;
  }
  if (n <= ALWAYS_DENSE) cost[BATTEN_QP_INTERIOR].flops = AFFORDABLE; /* the last resort */
  if (!exactly && n <= ALWAYS_DENSE) cost[BATTEN_QP_INTERIOR].bytes = 0;
  *plan =
      (qp_plan){.dense_affordable = cost[BATTEN_QP_DUAL].bytes <= left && cost[BATTEN_QP_DUAL].flops <= AFFORDABLE};

  bool taken[BATTEN_QP_INTERIOR + 1] = {false};
  if (o->engine != BATTEN_QP_AUTO) {
    plan->engine[plan->count++] = o->engine;
    taken[o->engine] = true;
  }
  while (plan->count == 0 || (o->hand_over && plan->count < sizeof plan->engine / sizeof *plan->engine)) {
    int best = BATTEN_QP_AUTO;
    for (int e = BATTEN_QP_PRIMAL; e <= BATTEN_QP_INTERIOR; e++)
      if (!taken[e] && cost[e].bytes <= left && (best == BATTEN_QP_AUTO || cost[e].flops < cost[best].flops))
        best = e;
    if (best == BATTEN_QP_AUTO || (plan->count > 0 && cost[best].flops > AFFORDABLE)) break;
    plan->engine[plan->count++] = (batten_qp_engine)best;
    taken[best] = true;
  }
  if (plan->count == 0) plan->engine[plan->count++] = n > ALWAYS_DENSE ? BATTEN_QP_INTERIOR : BATTEN_QP_DUAL;
  for (size_t i = 0; i < plan->count; i++) {
    plan->flops[i] = cost[plan->engine[i]].flops;
    if (cost[plan->engine[i]].bytes > plan->bytes) plan->bytes = cost[plan->engine[i]].bytes;
  }
  return BATTEN_OK;
}
