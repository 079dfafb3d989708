/* Last digits of the interior point: the equality constrained problem of the active set that multipliers and slacks
 * show, solved by the proximal method of multipliers (so that dependent rows do not matter), and the guess corrected
 * as in a primal-dual active set method. A result is kept only if its figures are better. See interior.h. */
#include <string.h>

#include "interior.h"

static const double NEVER = 1e30; /* w of rows that are not active: as good as no row */

/* Residuals of the problem with the active rows as equations, in twice the working precision, without which they
 * would be rounding long before x and y are. Returns their size. */
static double residuals(const qp_scaled *s, const ip_polish_work *p) {
  double size = 0;
  for (size_t j = 0; j < s->n; j++) {
    p->sum[j] = (qp_twice){-s->g[j], 0};
    for (size_t e = s->h.starts[j]; e < s->h.starts[j + 1]; e++)
      qp_twice_add_product(&p->sum[j], -s->h.values[e], p->x[s->h.indices[e]]);
  }
  for (size_t k = 0; k < s->m; k++) {
    qp_twice left = {p->tried[k] == QP_UPPER ? s->upper[k] : s->lower[k], 0};
    p->r2[k] = 0;
    if (!p->tried[k]) continue;
    if (k < s->general) {
      for (size_t e = s->c.starts[k]; e < s->c.starts[k + 1]; e++) {
        qp_twice_add_product(&left, -s->c.values[e], p->x[s->c.indices[e]]);
        qp_twice_add_product(&p->sum[s->c.indices[e]], s->c.values[e], p->y[k]);
      }
    } else {
      qp_twice_add(&left, -p->x[s->column[k - s->general]]);
      qp_twice_add(&p->sum[s->column[k - s->general]], p->y[k]);
    }
    p->r2[k] = qp_twice_value(left);
    size = qp_larger(size, fabs(p->r2[k]));
  }
  for (size_t j = 0; j < s->n; j++) {
    p->r1[j] = qp_twice_value(p->sum[j]);
    size = qp_larger(size, fabs(p->r1[j]));
  }
  return size;
}

static void solve(ip_newton *k, ip_polish_work *p) {
  const double REGULARIZATION = 1e-9;
  const int ROUNDS = 8;
  const qp_scaled *s = k->s;
  double before = INFINITY;
  k->rho = REGULARIZATION;
  for (size_t i = 0; i < s->m; i++) k->w[i] = p->tried[i] ? REGULARIZATION : NEVER;
  ip_newton_factor(k, 0, 0);
  for (int round = 0; round < ROUNDS; round++) {
    double size = residuals(s, p);
    if (!(size < 0.5 * before)) break;
    before = size;
    ip_newton_solve(k, 1e-14, false, p->r1, p->r2, p->dx, p->dy);
    for (size_t j = 0; j < s->n; j++) p->x[j] += p->dx[j];
    for (size_t i = 0; i < s->m; i++)
      if (p->tried[i]) p->y[i] += p->dy[i];
  }
}

/* Drops rows whose multipliers pull, takes those that are violated; returns how many. ax: rows at x. */
static size_t change(const qp_scaled *s, ip_polish_work *p, const double *ax) {
  size_t changes = 0;
  for (size_t k = 0; k < s->m; k++) {
    signed char now = p->tried[k];
    if (now == QP_EQUAL) continue;
    double room = 1e-12 * (1 + fabs(ax[k]));
    if ((now == QP_LOWER && p->y[k] < 0) || (now == QP_UPPER && p->y[k] > 0))
      now = QP_FREE;
    else if (!now && ax[k] < s->lower[k] - room)
      now = QP_LOWER;
    else if (!now && ax[k] > s->upper[k] + room)
      now = QP_UPPER;
    if (now != p->tried[k]) changes++;
    if (!now) p->y[k] = 0;
    p->tried[k] = now;
  }
  return changes;
}

ip_figures ip_polish(ip_newton *k, const qp_limits *limits, ip_polish_work *p, ip_figures before, double enough,
                     double *x, double *y, signed char *active, size_t rounds) {
  const qp_scaled *s = k->s;
  ip_figures best = before;
  const size_t most = s->m / 4;
  memcpy(p->tried, active, s->m);
  memcpy(p->x, x, s->n * sizeof *x);
  for (size_t i = 0; i < s->m; i++) p->y[i] = active[i] ? y[i] : 0;
  for (size_t round = 0; round < rounds; round++) {
    solve(k, p);
    ip_figures f = ip_judge(s, limits, p->x, p->y, p->r1, p->r2);
    if (f.merit < best.merit) {
      best = f;
      memcpy(x, p->x, s->n * sizeof *x);
      memcpy(y, p->y, s->m * sizeof *y);
      memcpy(active, p->tried, s->m);
    }
    if (best.largest <= enough || !isfinite(f.merit)) break;
    size_t changes = change(s, p, p->r2);
    if (changes == 0 || changes > most) break; /* right, or too far off for this to end soon */
  }
  return best;
}
