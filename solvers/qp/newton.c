/* The interior point's Newton system: factored with regularisation, solved with refinement on rows and unknowns
 * separately, bounds included, so that neither condensing nor regularising costs accuracy. See interior.h. */
#include <string.h>

#include "interior.h"

batten_status ip_newton_new(batten_context *ctx, const qp_scaled *s, ip_newton *out) {
  size_t n = s->n, m = s->m;
  *out = (ip_newton){.s = s};
  double *block = batten_alloc_array(ctx, 4 * n + 4 * m, sizeof *block);
  if (!block) return BATTEN_E_NOMEM;
  out->w = block;
  out->factored_w = block + m;
  out->q2 = block + 2 * m;
  out->best_y = block + 3 * m;
  out->d = block + 4 * m;
  out->q1 = out->d + n;
  out->best_x = out->d + 2 * n;
  out->hx = out->d + 3 * n;
  return qp_kkt_new(ctx, &s->h, &s->c, &out->kkt);
}

void ip_newton_free(batten_context *ctx, ip_newton *k) {
  qp_kkt_free(ctx, &k->kkt);
  batten_free(ctx, k->w);
  *k = (ip_newton){0};
}

void ip_newton_factor(ip_newton *k, double rho_least, double w_least) {
  const qp_scaled *s = k->s;
  double rho = fmax(k->rho, rho_least);
  for (size_t j = 0; j < s->n; j++) k->d[j] = rho;
  for (size_t i = 0; i < s->general; i++) k->factored_w[i] = fmax(k->w[i], w_least);
  for (size_t i = s->general; i < s->m; i++) k->d[s->column[i - s->general]] += 1 / fmax(k->w[i], w_least);
  for (size_t i = s->general; i < s->m; i++) k->factored_w[i] = fmax(k->w[i], w_least);
  qp_kkt_factor(&k->kkt, k->d, k->factored_w);
  k->factorizations++;
}

/* q := r - system (dx, dy); returns its size: rows count by what they change in y. */
static double residual(ip_newton *k, const double *r1, const double *r2, const double *dx, const double *dy) {
  const qp_scaled *s = k->s;
  double size = 0;
  qp_scaled_hessian(s, dx, k->hx);
  for (size_t j = 0; j < s->n; j++) k->q1[j] = r1[j] - k->hx[j] - k->rho * dx[j];
  qp_scaled_add(s, 1, dy, k->q1);
  qp_scaled_rows(s, dx, k->q2);
  for (size_t i = 0; i < s->m; i++) {
    k->q2[i] = r2[i] - k->q2[i] - k->w[i] * dy[i];
    size = fmax(size, fabs(k->q2[i]) / fmax(1, k->w[i]));
  }
  for (size_t j = 0; j < s->n; j++) size = fmax(size, fabs(k->q1[j]));
  return size;
}

/* Adds the factored system's solution for q. */
static void correct(ip_newton *k, double *dx, double *dy) {
  const qp_scaled *s = k->s;
  for (size_t i = s->general; i < s->m; i++) k->q1[s->column[i - s->general]] += k->q2[i] / k->factored_w[i];
  qp_kkt_solve(&k->kkt, k->q1, k->q2);
  for (size_t j = 0; j < s->n; j++) dx[j] += k->q1[j];
  for (size_t i = 0; i < s->general; i++) dy[i] -= k->q2[i];
  for (size_t i = s->general; i < s->m; i++)
    dy[i] += (k->q2[i] - k->q1[s->column[i - s->general]]) / k->factored_w[i];
}

double ip_newton_solve(ip_newton *k, const double *r1, const double *r2, double *dx, double *dy) {
  const int ROUNDS = 8;
  const double ENOUGH = 1e-14;
  const qp_scaled *s = k->s;
  size_t bytes_n = s->n * sizeof *dx, bytes_m = s->m * sizeof *dy;
  memset(dx, 0, bytes_n);
  memset(dy, 0, bytes_m);
  double size = residual(k, r1, r2, dx, dy), best = size;
  if (size == 0) return 0;
  for (int round = 0; round < ROUNDS; round++) {
    memcpy(k->best_x, dx, bytes_n);
    memcpy(k->best_y, dy, bytes_m);
    correct(k, dx, dy);
    double now = residual(k, r1, r2, dx, dy);
    if (!(now < best)) {
      memcpy(dx, k->best_x, bytes_n);
      memcpy(dy, k->best_y, bytes_m);
      break;
    }
    bool slow = now > 0.3 * best;
    best = now;
    if (best <= ENOUGH * size || slow) break;
  }
  return best / size;
}
