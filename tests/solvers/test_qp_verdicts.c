/* Problems without a solution, made from their proofs: a row that contradicts a random combination of others, a
 * direction along which nothing holds, an eigenvalue below 0. Every engine must name them and prove it; what is wrong
 * by 1e-6 of the sizes as surely as what is wrong by their whole. */
#include <batten/qp.h>

#include "tap.h"

enum { ENGINES = 4 };

static double uniform(uint64_t *seed) { return t_uniform(seed) - 0.5; }
static double *vector(size_t count, uint64_t *seed) {
  double *v = malloc((count + 1) * sizeof *v);
  for (size_t i = 0; i < count; i++) v[i] = uniform(seed);
  return v;
}
static double product(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t j = 0; j < n; j++) sum += a[j] * b[j];
  return sum;
}

/* How many of the engines give the status, their proof being one up to `rounding`. */
typedef struct tally {
  size_t tried, missed;
  double worst;
} tally;

static void ask(batten_context *ctx, const batten_qp_problem *p, batten_status expected, uint64_t number,
                double (*flaw)(const batten_qp_problem *, const batten_qp_solution *), tally *t) {
  size_t n = p->n, m = p->c ? p->c->rows : 0;
  double *proof = calloc(m + 2 * n, sizeof *proof);
  for (int engine = 0; engine < ENGINES; engine++) {
    batten_qp_options o = batten_qp_options_default();
    o.engine = (batten_qp_engine)engine;
    batten_qp_solution s = {.certificate = proof, .ray = proof + m + n};
    batten_status st = batten_qp_solve(ctx, p, &o, NULL, &s, NULL);
    t->tried++;
    if (st == expected) {
      t->worst = fmax(t->worst, flaw(p, &s));
      continue;
    }
    t->missed++;
    printf("# number %llu, engine %d, n %zu, m %zu: %s, %s\n", (unsigned long long)number, engine, n, m,
           batten_status_name(st), st ? batten_error(ctx) : "");
  }
  free(proof);
}

/* |C'y| relative to |C|'|y|, and how far the sum of sides is from 1. */
static double certificate_flaw(const batten_qp_problem *p, const batten_qp_solution *s) {
  double worst = 0, sides = 0;
  for (size_t i = 0; i < p->c->rows; i++)
    if (s->certificate[i] != 0) sides += s->certificate[i] * p->lower[i];
  for (size_t j = 0; j < p->n; j++) {
    long double sum = s->certificate[p->c->rows + j], size = 0;
    for (size_t i = 0; i < p->c->rows; i++) {
      long double term = (long double)s->certificate[i] * p->c->dense[i * p->n + j];
      sum += term, size += fabsl(term);
    }
    worst = fmax(worst, (double)(fabsl(sum) / (size + 1e-300L)));
  }
  return fmax(worst, 1e-6 * fabs(sides - 1));
}

static void test_infeasible(batten_context *ctx, size_t count) {
  tally t = {0};
  for (uint64_t q = 0; q < count; q++) {
    uint64_t seed = 77 * q + 5;
    size_t n = 2 + t_random(&seed) % 40, m = n + 5 + t_random(&seed) % 200, last = m - 1,
           of = 1 + t_random(&seed) % (n + 3);
    double *c = vector(m * n, &seed), *lower = vector(m, &seed), *h = calloc(n * n, sizeof *h), *g = vector(n, &seed);
    double size = pow(10, 3 * t_uniform(&seed)), *x = vector(n, &seed), sum = 0;
    for (size_t i = 0; i < n; i++) h[i * n + i] = pow(10, -4 * t_uniform(&seed));
    for (size_t i = 0; i < m; i++) lower[i] = size * product(n, c + i * n, x) - (double)(i % 3) * t_uniform(&seed);
    memset(c + last * n, 0, n * sizeof *c);
    for (size_t e = 0; e < of; e++) {
      size_t i = t_random(&seed) % last;
      double factor = pow(10, 2 * t_uniform(&seed) - 1);
      for (size_t j = 0; j < n; j++) c[last * n + j] -= factor * c[i * n + j];
      sum += factor * lower[i];
    }
    lower[last] = -sum + pow(10, -6 * t_uniform(&seed));
    batten_matrix rows = batten_matrix_dense(m, n, c), hessian = batten_matrix_dense(n, n, h);
    batten_qp_problem p = batten_qp_problem_default(n);
    p.h = &hessian, p.g = g, p.c = &rows, p.lower = lower;
    ask(ctx, &p, BATTEN_E_INFEASIBLE, q, certificate_flaw, &t);
    free(x), free(g), free(h), free(lower), free(c);
  }
  T_CHECK(t.missed == 0, "infeasible: %zu of %zu missed", t.missed, t.tried);
  T_RATIO(t.worst, 1e-12, "the proofs' flaws");
}

/* |P d|, C d where it is negative, and g'd + 1, relative to sizes. */
static double ray_flaw(const batten_qp_problem *p, const batten_qp_solution *s) {
  double worst = fabs(product(p->n, p->g, s->ray) + 1) * 1e-3, length = sqrt(product(p->n, s->ray, s->ray));
  const batten_matrix *curved = p->a ? p->a : p->h;
  for (size_t i = 0; i < curved->rows; i++)
    worst = fmax(worst, fabs(product(p->n, curved->dense + i * p->n, s->ray)) / length);
  for (size_t i = 0; p->c && i < p->c->rows; i++)
    worst = fmax(worst, -product(p->n, p->c->dense + i * p->n, s->ray) / length);
  return worst;
}

static void test_unbounded(batten_context *ctx, size_t count) {
  tally t = {0};
  for (uint64_t q = 0; q < count; q++) {
    uint64_t seed = 97 * q + 5;
    size_t n = 3 + t_random(&seed) % 30, m = t_random(&seed) % 100, rank = 1 + t_random(&seed) % (n - 1);
    double *d = vector(n, &seed), *a = vector(rank * n, &seed), *c = vector(m * n, &seed),
           *h = calloc(n * n, sizeof *h);
    double *lower = vector(m, &seed), *g = vector(n, &seed), square = product(n, d, d);
    for (size_t i = 0; i < rank; i++) {
      double along = product(n, a + i * n, d) / square;
      for (size_t j = 0; j < n; j++) a[i * n + j] -= along * d[j];
      for (size_t j = 0; j < n; j++)
        for (size_t k = 0; k < n; k++) h[j * n + k] += a[i * n + j] * a[i * n + k];
    }
    for (size_t i = 0; i < m; i++) { /* a third of the rows is parallel to the ray */
      double along = ((i % 3 ? t_uniform(&seed) : 0) - product(n, c + i * n, d)) / square;
      for (size_t j = 0; j < n; j++) c[i * n + j] += along * d[j];
      lower[i] = -1 - lower[i];
    }
    double along = (product(n, g, d) + 0.5) / square;
    for (size_t j = 0; j < n; j++) g[j] -= along * d[j];
    batten_matrix rows = batten_matrix_dense(m, n, c), hessian = batten_matrix_dense(n, n, h),
                  squares = batten_matrix_dense(rank, n, a);
    batten_qp_problem p = batten_qp_problem_default(n);
    p.g = g;
    if (m > 0) p.c = &rows, p.lower = lower;
    p.h = &hessian;
    ask(ctx, &p, BATTEN_E_UNBOUNDED, q, ray_flaw, &t);
    p.h = NULL, p.a = &squares;
    ask(ctx, &p, BATTEN_E_UNBOUNDED, q, ray_flaw, &t);
    free(g), free(lower), free(h), free(c), free(a), free(d);
  }
  T_CHECK(t.missed == 0, "unbounded: %zu of %zu missed", t.missed, t.tried);
  T_RATIO(t.worst, 1e-12, "the rays' flaws");
}

/* Minus a quarter of d'Hd / d'd must be below what the eigenvalue is: returns how much it is not. */
static double curvature_flaw(const batten_qp_problem *p, const batten_qp_solution *s) {
  long double energy = 0;
  for (size_t i = 0; i < p->n; i++)
    for (size_t j = 0; j < p->n; j++) energy += (long double)s->ray[i] * p->h->dense[i * p->n + j] * s->ray[j];
  return energy < 0 ? 0 : 1;
}

/* H = I - (1 + by) v v' / v'v: indefinite by `by` along v; bounded by a box, so that a minimum exists all the same.
 */
static void test_not_convex(batten_context *ctx, size_t count) {
  tally t = {0};
  for (uint64_t q = 0; q < count; q++) {
    uint64_t seed = 53 * q + 1;
    size_t n = 2 + t_random(&seed) % 60;
    double *v = vector(n, &seed), *g = vector(n, &seed), *h = malloc(n * n * sizeof *h),
           *box = malloc(2 * n * sizeof *box);
    double by = pow(10, -10 * t_uniform(&seed)), square = product(n, v, v);
    for (size_t i = 0; i < n; i++) {
      for (size_t j = 0; j < n; j++) h[i * n + j] = (i == j) - (1 + by) * (v[i] * v[j] / square);
      box[i] = -1, box[n + i] = 1;
    }
    batten_matrix hessian = batten_matrix_dense(n, n, h);
    batten_qp_problem p = batten_qp_problem_default(n);
    p.h = &hessian, p.g = g, p.x_lower = box, p.x_upper = box + n;
    ask(ctx, &p, BATTEN_E_NOT_CONVEX, q, curvature_flaw, &t);
    free(box), free(h), free(g), free(v);
  }
  T_CHECK(t.missed == 0, "not convex, by 1 to 1e-10: %zu of %zu missed", t.missed, t.tried);
  T_CHECK(t.worst == 0, "curvature along the rays is negative");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_infeasible(ctx, 60);
  test_unbounded(ctx, 130);
  test_not_convex(ctx, 100);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
