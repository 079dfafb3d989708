/* The interior point's Newton system: factored with regularisation, solved with refinement on rows and unknowns
 * separately, bounds included, so that neither condensing nor regularising costs accuracy. See interior.h. */
#include <string.h>

#include "interior.h"

batten_status ip_newton_new(batten_context *ctx, const qp_scaled *s, ip_newton *out) {
  size_t n = s->n, m = s->m;
  *out = (ip_newton){.s = s};
  double *block = batten_alloc_array(ctx, 4 * n + 6 * m, sizeof *block);
  if (!block) return BATTEN_E_NOMEM;
  out->w = block;
  out->factored_w = block + m;
  out->q2 = block + 2 * m;
  out->best_y = block + 3 * m;
  out->unit = block + 4 * m;
  out->ax = block + 5 * m;
  out->d = block + 6 * m;
  out->q1 = out->d + n;
  out->best_x = out->d + 2 * n;
  out->hx = out->d + 3 * n;
  out->krylov = batten_alloc_array(ctx, n + m, (2 * IP_KRYLOV + 1) * sizeof *out->krylov);
  if (!out->krylov) return BATTEN_E_NOMEM;
  return qp_kkt_new(ctx, &s->h, &s->c, &out->kkt);
}

void ip_newton_free(batten_context *ctx, ip_newton *k) {
  qp_kkt_free(ctx, &k->kkt);
  batten_free(ctx, k->krylov);
  batten_free(ctx, k->w);
  *k = (ip_newton){0};
}

void ip_newton_factor(ip_newton *k, double rho_least, double w_least) {
  const qp_scaled *s = k->s;
  const double CONDENSED = 1e-12; /* 1/w beyond this leaves too little of H in what is condensed */
  double rho = qp_larger(k->rho, rho_least);
  if (k->kkt.bordered) w_least = qp_larger(w_least, CONDENSED);
  for (size_t j = 0; j < s->n; j++) k->d[j] = rho;
  for (size_t i = 0; i < s->m; i++) {
    k->factored_w[i] = qp_larger(k->w[i], w_least);
    k->unit[i] = 1 / qp_larger(1, k->w[i]);
  }
  for (size_t i = s->general; i < s->m; i++) k->d[s->column[i - s->general]] += 1 / k->factored_w[i];
  qp_kkt_factor(&k->kkt, k->d, k->factored_w);
  k->factorizations++;
}

static double largest_of(size_t count, const double *v) {
  double most = 0;
  for (size_t i = 0; i < count; i++) most = qp_larger(most, fabs(v[i]));
  return most;
}

/* q := r - system (dx, dy), r NULL: 0; ax: rows at dx. Returns its size: rows count by what they change in y. */
static double residual(ip_newton *k, double *of_unknowns, const double *r1, const double *r2, const double *dx,
                       const double *dy, const double *ax) {
  const qp_scaled *s = k->s;
  double size = 0;
  for (size_t j = 0; j < s->n; j++) k->q1[j] = (r1 ? r1[j] : 0) - qp_csr_dot(&s->h, j, dx) - k->rho * dx[j];
  qp_scaled_add(s, 1, dy, k->q1);
  for (size_t i = 0; i < s->m; i++) {
    k->q2[i] = (r2 ? r2[i] : 0) - ax[i] - k->w[i] * dy[i];
    size = qp_larger(size, fabs(k->q2[i]) * k->unit[i]);
  }
  *of_unknowns = largest_of(s->n, k->q1);
  return qp_larger(size, *of_unknowns);
}

/* The same at dx = 0, dy = 0. */
static double start_residual(ip_newton *k, const double *r1, const double *r2) {
  const qp_scaled *s = k->s;
  double size = 0;
  for (size_t j = 0; j < s->n; j++) {
    k->q1[j] = r1[j];
    size = qp_larger(size, fabs(r1[j]));
  }
  for (size_t i = 0; i < s->m; i++) {
    k->q2[i] = r2[i];
    size = qp_larger(size, fabs(r2[i]) * k->unit[i]);
  }
  return size;
}

/* Adds the factored system's solution for q to dx, dy, and rows at it to ax. */
static void correct(ip_newton *k, double *dx, double *dy, double *ax) {
  const qp_scaled *s = k->s;
  for (size_t i = s->general; i < s->m; i++) k->q1[s->column[i - s->general]] += k->q2[i] / k->factored_w[i];
  qp_kkt_solve(&k->kkt, k->q1, k->q2, ax);
  for (size_t j = 0; j < s->n; j++) dx[j] += k->q1[j];
  for (size_t i = 0; i < s->general; i++) dy[i] -= k->q2[i];
  for (size_t i = s->general; i < s->m; i++) {
    double x = k->q1[s->column[i - s->general]];
    dy[i] += (k->q2[i] - x) / k->factored_w[i];
    ax[i] += x;
  }
}

static double product(const ip_newton *k, const double *a, const double *b) {
  size_t n = k->s->n, m = k->s->m;
  double sum = 0;
  for (size_t j = 0; j < n; j++) sum += a[j] * b[j];
  for (size_t i = 0; i < m; i++) sum += a[n + i] * b[n + i] * k->unit[i] * k->unit[i];
  return sum;
}

static void copy_scaled(size_t count, double factor, const double *from, double *to) {
  for (size_t i = 0; i < count; i++) to[i] = factor * from[i];
}

/* Where refinement stalls, because the factored system is too far from the wanted one in a few directions: flexible
 * GMRES [Saad, SIAM J. Sci. Comput. 14 (1993) 461] with the factor as preconditioner finds those. Improves dx, dy for
 * which q1, q2 is the residual of size `before`; returns the size that is left. */
static double krylov(ip_newton *k, const double *r1, const double *r2, double *dx, double *dy) {
  enum { DEPTH = IP_KRYLOV };
  const qp_scaled *s = k->s;
  size_t n = s->n, m = s->m, all = n + m, used = 0;
  double h[DEPTH + 1][DEPTH], cosine[DEPTH], sine[DEPTH], beta[DEPTH + 1];
  double ignored, *v = k->krylov, *z = v + (DEPTH + 1) * all;
  copy_scaled(n, 1, k->q1, v);
  copy_scaled(m, 1, k->q2, v + n);
  beta[0] = sqrt(product(k, v, v));
  if (!(beta[0] > 0) || !isfinite(beta[0])) return INFINITY;
  copy_scaled(all, 1 / beta[0], v, v);
  for (; used < DEPTH; used++) {
    double *vi = v + used * all, *next = vi + all, *zi = z + used * all;
    memset(zi, 0, all * sizeof *zi);
    copy_scaled(n, 1, vi, k->q1);
    copy_scaled(m, 1, vi + n, k->q2);
    memset(k->ax, 0, m * sizeof *k->ax);
    correct(k, zi, zi + n, k->ax);
    residual(k, &ignored, NULL, NULL, zi, zi + n, k->ax); /* q := - system z */
    copy_scaled(n, -1, k->q1, next);
    copy_scaled(m, -1, k->q2, next + n);
    for (size_t p = 0; p <= used; p++) {
      double dot = product(k, next, v + p * all);
      h[p][used] = dot;
      for (size_t i = 0; i < all; i++) next[i] -= dot * v[p * all + i];
    }
    double norm = sqrt(product(k, next, next));
    h[used + 1][used] = norm;
    if (norm > 0) copy_scaled(all, 1 / norm, next, next);
    for (size_t p = 0; p < used; p++) {
      double a = h[p][used], b = h[p + 1][used];
      h[p][used] = cosine[p] * a + sine[p] * b;
      h[p + 1][used] = cosine[p] * b - sine[p] * a;
    }
    double a = h[used][used], b = norm, root = hypot(a, b);
    if (!(root > 0) || !isfinite(root)) break;
    cosine[used] = a / root, sine[used] = b / root;
    h[used][used] = root;
    beta[used + 1] = -sine[used] * beta[used];
    beta[used] *= cosine[used];
    if (fabs(beta[used + 1]) <= 1e-13 * beta[0] || norm == 0) {
      used++;
      break;
    }
  }
  for (size_t p = used; p-- > 0;) {
    for (size_t c = p + 1; c < used; c++) beta[p] -= h[p][c] * beta[c];
    beta[p] /= h[p][p];
    for (size_t j = 0; j < n; j++) dx[j] += beta[p] * z[p * all + j];
    for (size_t i = 0; i < m; i++) dy[i] += beta[p] * z[p * all + n + i];
  }
  qp_scaled_rows(s, dx, k->ax);
  return residual(k, &ignored, r1, r2, dx, dy, k->ax);
}

double ip_newton_solve(ip_newton *k, double enough, bool ahead, const double *r1, const double *r2, double *dx,
                       double *dy) {
  const int ROUNDS = 8, CYCLES = 2;
  const double SHARP = 0.1;
  const double TOO_LARGE = qp_larger(1e-9, enough);
  const qp_scaled *s = k->s;
  size_t bytes_n = s->n * sizeof *dx, bytes_m = s->m * sizeof *dy;
  memset(dx, 0, bytes_n);
  memset(dy, 0, bytes_m);
  memset(k->ax, 0, bytes_m);
  double size = start_residual(k, r1, r2), best = size;
  if (size == 0) return 0;
  if (ahead && k->trusted) {
    correct(k, dx, dy, k->ax);
    return enough;
  }
  double left = 0, goal = k->sharp ? SHARP * largest_of(s->n, r1) : INFINITY;
  bool slow = false;
  int cycles = 0;
  for (int round = 0; round < ROUNDS && (best > enough * size || (left > goal && !slow)); round++) {
    memcpy(k->best_x, dx, bytes_n);
    memcpy(k->best_y, dy, bytes_m);
    if (slow && (best <= TOO_LARGE * size || cycles == CYCLES)) break;
    double now;
    if (slow) {
      now = krylov(k, r1, r2, dx, dy);
      cycles++;
    } else {
      correct(k, dx, dy, k->ax);
      now = residual(k, &left, r1, r2, dx, dy, k->ax);
      if (round == 0) k->trusted = now <= enough * size;
    }
    if (!(now < best)) {
      memcpy(dx, k->best_x, bytes_n);
      memcpy(dy, k->best_y, bytes_m);
      qp_scaled_rows(s, dx, k->ax);
      if (slow) break;
      residual(k, &left, r1, r2, dx, dy, k->ax);
      slow = true;
      continue;
    }
    slow = slow || now > 0.3 * best;
    best = now;
  }
  return best / size;
}
