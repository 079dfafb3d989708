/* Proofs that a problem has no solution, from where the interior point's iterates go: multipliers that grow without
 * end point to  rows'y = 0, y'sides > 0,  unknowns to a ray  H d = 0, rows d in the recession cone, g'd < 0.  Both
 * are then projected on the equations that they nearly satisfy, because whoever judges them wants these up to
 * rounding. */
#include <float.h>
#include <string.h>

#include "interior.h"

static const double NEARLY = 1e-6; /* relative: worth the projection */
static const double ROUNDING = 1e-15;
static const double PROVEN = 1e-12; /* relative: rounding, with the caller's scaling undone */

static double largest(size_t count, const double *v) {
  double top = 0;
  for (size_t i = 0; i < count; i++) top = qp_larger(top, fabs(v[i]));
  return top;
}

/* to := rows'y; returns its largest entry relative to that of |rows|'|y|. size [n] scratch. */
static double combination(const qp_scaled *s, const double *y, double *to, double *size) {
  for (size_t j = 0; j < s->n; j++) to[j] = size[j] = 0;
  qp_scaled_add(s, 1, y, to);
  for (size_t k = 0; k < s->general; k++)
    for (size_t e = s->c.starts[k]; e < s->c.starts[k + 1]; e++) size[s->c.indices[e]] += fabs(y[k] * s->c.values[e]);
  for (size_t k = s->general; k < s->m; k++) size[s->column[k - s->general]] += fabs(y[k]);
  double top = largest(s->n, size);
  return top > 0 ? largest(s->n, to) / top : 0;
}

/* sum y_k side_k relative to sum |y_k side_k|; negative when a side is missing. */
static double support(const qp_scaled *s, const double *y) {
  double sum = 0, size = 0;
  for (size_t k = 0; k < s->m; k++) {
    if (y[k] == 0) continue;
    double side = y[k] > 0 ? s->lower[k] : s->upper[k];
    if (!isfinite(side)) return -1;
    sum += y[k] * side;
    size += fabs(y[k] * side);
  }
  return size > 0 ? sum / size : -1;
}

static void drop_impossible(const qp_scaled *s, double *y) {
  double top = largest(s->m, y);
  for (size_t k = 0; k < s->m; k++)
    if (fabs(y[k]) < 1e-10 * top || !isfinite(y[k] > 0 ? s->lower[k] : s->upper[k])) y[k] = 0;
}

bool ip_prove_infeasible(ip_newton *k, ip_polish_work *work, const double *y, double *proof) {
  const double STRONG = 1e8;
  const qp_scaled *s = k->s;
  double top = largest(s->m, y);
  if (!(top > 0) || !isfinite(top)) return false;
  for (size_t i = 0; i < s->m; i++) proof[i] = y[i] / top;
  drop_impossible(s, proof);
  if (support(s, proof) <= 1e-9 || !(combination(s, proof, work->r1, k->hx) < NEARLY)) return false;
  k->rho = 1 / STRONG;
  for (size_t i = 0; i < s->m; i++) k->w[i] = proof[i] != 0 ? 1 / (STRONG * fabs(proof[i])) : 1e30;
  ip_newton_factor(k, 0, 0);
  memset(work->r2, 0, s->m * sizeof *work->r2);
  double left = INFINITY;
  for (int round = 0; round < 4; round++) {
    left = combination(s, proof, work->r1, k->hx);
    if (left < PROVEN) break;
    ip_newton_solve(k, 1e-14, false, work->r1, work->r2, work->dx, work->dy);
    for (size_t i = 0; i < s->m; i++)
      if (proof[i] != 0) proof[i] += work->dy[i];
    drop_impossible(s, proof);
  }
  return left < PROVEN && support(s, proof) > 1e-9;
}

/* Largest violation of the recession cone by d, in rows (ax: rows at d), and of H d = 0 (hd). */
static double outside(const qp_scaled *s, const double *ax, const double *hd) {
  double worst = largest(s->n, hd);
  for (size_t k = 0; k < s->m; k++) {
    if (isfinite(s->lower[k])) worst = qp_larger(worst, -ax[k]);
    if (isfinite(s->upper[k])) worst = qp_larger(worst, ax[k]);
  }
  return worst;
}

static double slope(const qp_scaled *s, const double *d) {
  double sum = 0, size = 0;
  for (size_t j = 0; j < s->n; j++) sum += s->g[j] * d[j], size += fabs(s->g[j] * d[j]);
  return size > 0 ? sum / size : 0;
}

bool ip_prove_unbounded(ip_newton *k, ip_polish_work *work, const double *x, double *proof) {
  double *hd = work->r1, *ad = work->r2;
  const qp_scaled *s = k->s;
  double top = largest(s->n, x);
  if (!(top > 0) || !isfinite(top)) return false;
  for (size_t j = 0; j < s->n; j++) proof[j] = fabs(x[j]) < 1e-10 * top ? 0 : x[j] / top;
  qp_scaled_rows(s, proof, ad);
  qp_scaled_hessian(s, proof, hd);
  if (slope(s, proof) > -1e-9 || !(outside(s, ad, hd) < NEARLY)) return false;
  /* On the rows that d hardly leaves, and where H is not zero, project. */
  k->rho = 1e-8;
  for (size_t i = 0; i < s->m; i++)
    k->w[i] = fabs(ad[i]) < NEARLY || (isfinite(s->lower[i]) && isfinite(s->upper[i])) ? 1e-8 : 1e30;
  ip_newton_factor(k, 0, 0);
  for (int round = 0; round < 4; round++) {
    for (size_t j = 0; j < s->n; j++) hd[j] = -hd[j];
    for (size_t i = 0; i < s->m; i++) ad[i] = k->w[i] < 1 ? -ad[i] : 0;
    ip_newton_solve(k, 1e-14, false, hd, ad, work->dx, work->dy);
    for (size_t j = 0; j < s->n; j++) proof[j] += work->dx[j];
    qp_scaled_rows(s, proof, ad);
    qp_scaled_hessian(s, proof, hd);
    if (outside(s, ad, hd) < ROUNDING) break;
  }
  /* an entry that is rounding has no share in a ray, but where a row has no other it is all that the judge sees */
  top = largest(s->n, proof);
  for (size_t j = 0; j < s->n; j++)
    if (fabs(proof[j]) <= (double)s->n * DBL_EPSILON * top) proof[j] = 0;
  qp_scaled_rows(s, proof, ad);
  qp_scaled_hessian(s, proof, hd);
  return outside(s, ad, hd) < PROVEN * top && slope(s, proof) < -1e-9;
}
