/* Interior point with proximal regularisation [Pougkakiotis, Gondzio, Comput. Optim. Appl. 78 (2021) 307; Schwan,
 * Jiang, Kuhn, Jones, arXiv:2304.00290]: Mehrotra's predictor and corrector [SIAM J. Optim. 2 (1992) 575] on the
 * proximal method of multipliers.
 *
 *   row - lower - tl = 0,  upper - row - tu = 0,  tl vl = tu vu = mu,  H x + g = rows'(vl - vu)
 *
 * Every step is the Newton step of the proximal subproblem around the present point:
 *   (H + rho) dx - rows' dy = ..,  rows dx + w dy = ..,   w = t/v + delta  (delta alone for equalities)
 * which exists whatever the rows and however flat the objective; rho and delta fall with mu. The end is a solve on
 * the active set that the multipliers show. */
#include "interior.h"

#include <string.h>

#include "base/checked.h"

/* Relative residuals of Newton systems: for a look ahead, and for a step to take. */
static const double ROUGH = 1e-3, FINE = 1e-6;

typedef struct ip {
  const qp_scaled *s;
  ip_newton newton;
  const qp_limits *limits;
  size_t sides; /* finite one-sided inequalities */
  double delta;
  unsigned char *kind;                               /* [m] */
  double *x, *dx, *rd, *r1, *best_x;                 /* [n] */
  double *y, *tl, *tu, *vl, *vu, *ax, *rl, *ru;      /* [m] */
  double *dy, *dtl, *dtu, *dvl, *dvu, *cl, *cu, *r2; /* [m] */
  double *best_y;
  double *kept_x, *kept_rows; /* [n], [6 m]: the step from dy on */
  ip_polish_work work;
  double lag_primal, lag_dual; /* residuals before the last step */
  double mu;
  double error; /* relative, of the last step's equations */
  ip_figures figures, best;
  bool have_best;
} ip;

/* ---- figures ---- */

static double larger(double a, double b) { return !(b <= a) ? b : a; } /* keeps NaN */

/* The residual against what is allowed. */
static double against(const qp_limits *limits, double residual, double size) {
  const double ROUNDING = 4e-15;
  double allowed = limits->tolerance * (1 + size), asked = limits->absolute + limits->relative * size;
  if (asked > 0) allowed = qp_larger(asked < allowed ? asked : allowed, ROUNDING * (1 + size));
  return residual / allowed;
}

ip_figures ip_judge(const qp_scaled *s, const qp_limits *limits, const double *x, const double *y, double *rd,
                    double *ax) {
  ip_figures f = {0};
  double scale_primal = 0, scale_dual = 0, quadratic = 0, linear = 0, gap = 0;
  qp_scaled_rows(s, x, ax);
  /* gap = x'rd + sum y (row - side): sums of what is small, where the two values would cancel */
  for (size_t k = 0; k < s->m; k++) {
    double at = ax[k], miss = qp_larger(s->lower[k] - at, at - s->upper[k]);
    if (!(miss <= 0)) f.primal = larger(f.primal, miss / s->f[k]);
    scale_primal = qp_larger(scale_primal, fabs(at) / s->f[k]);
    double side = y[k] > 0 ? s->lower[k] : s->upper[k];
    if (y[k] != 0 && isfinite(side)) gap += y[k] * (at - side);
    if (y[k] != 0 && !isfinite(side)) f.dual = larger(f.dual, fabs(y[k]) * s->f[k] / s->cost);
  }
  qp_scaled_hessian(s, x, rd);
  for (size_t j = 0; j < s->n; j++) {
    quadratic += x[j] * rd[j];
    linear += s->g[j] * x[j];
    scale_dual = qp_larger(scale_dual, qp_larger(fabs(rd[j]), fabs(s->g[j])) / (s->e[j] * s->cost));
    rd[j] += s->g[j];
  }
  qp_scaled_add(s, -1, y, rd);
  for (size_t j = 0; j < s->n; j++) {
    f.dual = larger(f.dual, fabs(rd[j]) / (s->e[j] * s->cost));
    gap += x[j] * rd[j];
  }
  double value = quadratic / 2 + linear;
  f.gap = fabs(gap) / s->cost;
  f.merit = larger(against(limits, f.primal, scale_primal),
                   larger(against(limits, f.dual, scale_dual), against(limits, f.gap, fabs(value) / s->cost)));
  f.primal /= 1 + scale_primal;
  f.dual /= 1 + scale_dual;
  f.gap /= 1 + fabs(value) / s->cost;
  f.size = s->cost + fabs(value);
  f.largest = larger(f.primal, larger(f.dual, f.gap));
  return f;
}

/* Residuals and figures at the present point. */
static void residuals(ip *p) {
  const qp_scaled *s = p->s;
  double sum = 0;
  for (size_t k = 0; k < s->m; k++)
    if (p->kind[k] != IP_EQUAL) p->y[k] = p->vl[k] - p->vu[k];
  p->figures = ip_judge(s, p->limits, p->x, p->y, p->rd, p->ax);
  for (size_t k = 0; k < s->m; k++) {
    double ax = p->ax[k];
    p->rl[k] = p->ru[k] = 0;
    if (p->kind[k] == IP_EQUAL) p->rl[k] = ax - s->lower[k];
    if (p->kind[k] & IP_LOWER) p->rl[k] = ax - s->lower[k] - p->tl[k], sum += p->tl[k] * p->vl[k];
    if (p->kind[k] & IP_UPPER) p->ru[k] = s->upper[k] - ax - p->tu[k], sum += p->tu[k] * p->vu[k];
  }
  p->mu = p->sides ? sum / (double)p->sides : 0;
}

/* ---- steps ---- */

/* Sets w of the Newton system. */
static void weights(ip *p) {
  double *w = p->newton.w;
  for (size_t k = 0; k < p->s->m; k++) {
    double wl = p->kind[k] & IP_LOWER ? p->tl[k] / p->vl[k] + p->delta : 0;
    double wu = p->kind[k] & IP_UPPER ? p->tu[k] / p->vu[k] + p->delta : 0;
    switch (p->kind[k]) {
      case IP_EQUAL:
        w[k] = p->delta;
        break;
      case IP_BOTH:
        w[k] = wl * (wu / (wl + wu));
        break;
      default:
        w[k] = wl + wu;
        break; /* the other is 0 */
    }
  }
}

/* The step that brings residuals to zero and v t to cl, cu beyond their present value: v dt + t dv = c. */
static void step(ip *p, double enough, bool ahead) {
  const qp_scaled *s = p->s;
  for (size_t k = 0; k < s->m; k++) {
    double ql = -p->rl[k], qu = -p->ru[k], r = ql;
    if (p->kind[k] & IP_LOWER) r = ql += p->cl[k] / p->vl[k];
    if (p->kind[k] & IP_UPPER) r = -(qu += p->cu[k] / p->vu[k]);
    if (p->kind[k] == IP_BOTH) {
      double wl = p->tl[k] / p->vl[k] + p->delta, wu = p->tu[k] / p->vu[k] + p->delta, sum = wl + wu;
      r = ql * (wu / sum) - qu * (wl / sum);
    }
    p->r2[k] = r;
  }
  for (size_t j = 0; j < s->n; j++) p->r1[j] = -p->rd[j];
  p->error = ip_newton_solve(&p->newton, enough, ahead, p->r1, p->r2, p->dx, p->dy);
  for (size_t k = 0; k < s->m; k++) {
    double adx = p->newton.ax[k], tl = p->tl[k], vl = p->vl[k], tu = p->tu[k], vu = p->vu[k];
    if (p->kind[k] == IP_LOWER) p->dvl[k] = p->dy[k];
    if (p->kind[k] == IP_UPPER) p->dvu[k] = -p->dy[k];
    if (p->kind[k] == IP_BOTH) {
      /* From the row where that is well determined: on the side that is further from active. */
      double wl = tl / vl + p->delta, wu = tu / vu + p->delta;
      if (wl > wu) {
        p->dvl[k] = (-p->rl[k] + p->cl[k] / vl - adx) / wl;
        p->dvu[k] = p->dvl[k] - p->dy[k];
      } else {
        p->dvu[k] = (-p->ru[k] + p->cu[k] / vu + adx) / wu;
        p->dvl[k] = p->dvu[k] + p->dy[k];
      }
    }
    if (p->kind[k] & IP_LOWER)
      p->dtl[k] = tl < vl ? (p->cl[k] - tl * p->dvl[k]) / vl : adx + p->rl[k] + p->delta * p->dvl[k];
    if (p->kind[k] & IP_UPPER)
      p->dtu[k] = tu < vu ? (p->cu[k] - tu * p->dvu[k]) / vu : -adx + p->ru[k] + p->delta * p->dvu[k];
  }
}

/* The part of alpha that keeps v + alpha dv >= 0; divides only where it must. */
static double room(double alpha, double v, double dv) { return v + alpha * dv < 0 ? -v / dv : alpha; }

/* Largest steps in [0, 1] that keep slacks and multipliers >= 0. */
static void longest(const ip *p, double *primal, double *dual) {
  double a = 1, b = 1;
  for (size_t k = 0; k < p->s->m; k++) {
    if (p->kind[k] & IP_LOWER) a = room(a, p->tl[k], p->dtl[k]), b = room(b, p->vl[k], p->dvl[k]);
    if (p->kind[k] & IP_UPPER) a = room(a, p->tu[k], p->dtu[k]), b = room(b, p->vu[k], p->dvu[k]);
  }
  *primal = a;
  *dual = b;
}

/* mu after steps a, b. */
static double mu_after(const ip *p, double a, double b) {
  double sum = 0;
  for (size_t k = 0; k < p->s->m; k++) {
    if (p->kind[k] & IP_LOWER) sum += (p->tl[k] + a * p->dtl[k]) * (p->vl[k] + b * p->dvl[k]);
    if (p->kind[k] & IP_UPPER) sum += (p->tu[k] + a * p->dtu[k]) * (p->vu[k] + b * p->dvu[k]);
  }
  return p->sides ? sum / (double)p->sides : 0;
}

static void aim_zero(ip *p) {
  for (size_t k = 0; k < p->s->m; k++) p->cl[k] = -p->tl[k] * p->vl[k], p->cu[k] = -p->tu[k] * p->vu[k];
}

/* Mehrotra's second order term and centring, from the predictor. */
static void aim_centre(ip *p, double target) {
  for (size_t k = 0; k < p->s->m; k++) {
    p->cl[k] = target - p->tl[k] * p->vl[k] - p->dtl[k] * p->dvl[k];
    p->cu[k] = target - p->tu[k] * p->vu[k] - p->dtu[k] * p->dvu[k];
  }
}

/* Gondzio's correction: products of a trial point a little further out, brought back into [beta, 1/beta] target. */
static double bring_back(double product, double target) {
  const double BETA = 0.1;
  double low = BETA * target, high = target / BETA;
  if (product < low) return low - product;
  if (product > high) return qp_larger(high - product, -high);
  return 0;
}

static void aim_correct(ip *p, double target, double a, double b) {
  for (size_t k = 0; k < p->s->m; k++) {
    p->cl[k] += bring_back((p->tl[k] + a * p->dtl[k]) * (p->vl[k] + b * p->dvl[k]), target);
    p->cu[k] += bring_back((p->tu[k] + a * p->dtu[k]) * (p->vu[k] + b * p->dvu[k]), target);
  }
}

static void advance(ip *p, double a, double b) {
  for (size_t j = 0; j < p->s->n; j++) p->x[j] += a * p->dx[j];
  for (size_t k = 0; k < p->s->m; k++) {
    if (p->kind[k] == IP_EQUAL) p->y[k] += b * p->dy[k];
    if (p->kind[k] & IP_LOWER) p->tl[k] += a * p->dtl[k], p->vl[k] += b * p->dvl[k];
    if (p->kind[k] & IP_UPPER) p->tu[k] += a * p->dtu[k], p->vu[k] += b * p->dvu[k];
  }
}

/* ---- start ---- */

/* Whether every unknown has curvature of its own, as in a least squares fit. */
static bool is_curved(const qp_scaled *s) {
  const double LEAST = 1e-3;
  double low = INFINITY, high = 0;
  for (size_t j = 0; j < s->n; j++) {
    double diagonal = 0;
    for (size_t e = s->h.starts[j]; e < s->h.starts[j + 1]; e++)
      if (s->h.indices[e] == j) diagonal = s->h.values[e];
    low = fmin(low, diagonal);
    high = qp_larger(high, diagonal);
  }
  return low > LEAST * high;
}

/* Mehrotra's start: least squares for the rows with unit weights, then slacks and multipliers moved inwards.
 * Multipliers of a least squares fit under rows that are nearly dependent (differences, say) are much larger than
 * those of unit weights; started too small, they keep steps of the slacks short for long. */
static void start(ip *p) {
  const double FURTHER = 30;
  p->newton.rho = 0.1, p->delta = 1e-6;
  const qp_scaled *s = p->s;
  double low_t = INFINITY, low_v = INFINITY;
  for (size_t k = 0; k < s->m; k++) {
    p->newton.w[k] = p->kind[k] == IP_EQUAL ? p->delta : 1;
    double lo = s->lower[k], hi = s->upper[k];
    p->r2[k] = p->kind[k] == IP_BOTH ? fmin(qp_larger(0, lo), hi) : p->kind[k] == IP_UPPER ? hi : lo;
  }
  for (size_t j = 0; j < s->n; j++) p->r1[j] = -s->g[j];
  ip_newton_factor(&p->newton, 0, 0);
  ip_newton_solve(&p->newton, FINE, false, p->r1, p->r2, p->x, p->y);
  qp_scaled_rows(s, p->x, p->ax);
  for (size_t k = 0; k < s->m; k++) {
    double y = p->y[k];
    p->tl[k] = p->ax[k] - s->lower[k], p->tu[k] = s->upper[k] - p->ax[k];
    p->vl[k] = p->kind[k] == IP_BOTH ? qp_larger(y, 0) : y, p->vu[k] = p->kind[k] == IP_BOTH ? qp_larger(-y, 0) : -y;
    if (p->kind[k] & IP_LOWER) low_t = fmin(low_t, p->tl[k]), low_v = fmin(low_v, p->vl[k]);
    if (p->kind[k] & IP_UPPER) low_t = fmin(low_t, p->tu[k]), low_v = fmin(low_v, p->vu[k]);
  }
  double shift_t = qp_larger(-1.5 * low_t, 0), shift_v = qp_larger(-1.5 * low_v, 0), product = 0, sum_t = 0,
         sum_v = 0;
  for (size_t k = 0; k < s->m; k++) {
    p->tl[k] += shift_t, p->tu[k] += shift_t, p->vl[k] += shift_v, p->vu[k] += shift_v;
    if (p->kind[k] & IP_LOWER) product += p->tl[k] * p->vl[k], sum_t += p->tl[k], sum_v += p->vl[k];
    if (p->kind[k] & IP_UPPER) product += p->tu[k] * p->vu[k], sum_t += p->tu[k], sum_v += p->vu[k];
  }
  double more_t = sum_v > 0 ? product / sum_v / 2 : 0, more_v = sum_t > 0 ? product / sum_t / 2 : 0;
  more_t = qp_larger(more_t, shift_t + low_t < 1e-3 ? 1 : 0);
  more_v = qp_larger(more_v, shift_v + low_v < 1e-3 ? 1 : 0);
  double further = is_curved(s) ? FURTHER : 1;
  for (size_t k = 0; k < s->m; k++) {
    p->tl[k] += more_t, p->tu[k] += more_t, p->vl[k] += more_v, p->vu[k] += more_v;
    if (k < s->general) p->vl[k] *= further, p->vu[k] *= further;
    if (!(p->kind[k] & IP_LOWER)) p->tl[k] = p->vl[k] = 0;
    if (!(p->kind[k] & IP_UPPER)) p->tu[k] = p->vu[k] = 0;
  }
}

/* ---- memory ---- */

static void classify(ip *p) {
  const qp_scaled *s = p->s;
  for (size_t k = 0; k < s->m; k++) {
    bool low = isfinite(s->lower[k]), high = isfinite(s->upper[k]);
    p->kind[k] =
        s->lower[k] == s->upper[k] ? IP_EQUAL : (unsigned char)((low ? IP_LOWER : 0) | (high ? IP_UPPER : 0));
    p->sides += p->kind[k] == IP_EQUAL ? 0 : (size_t)low + high;
  }
}

enum { VECTORS_N = 9, VECTORS_M = 20, KEPT_M = 6 };

static batten_status ip_new(batten_context *ctx, const qp_scaled *s, ip *p) {
  size_t n = s->n, m = s->m;
  ip_polish_work *w = &p->work;
  double **of_n[VECTORS_N] = {&p->x, &p->dx, &p->rd, &p->r1, &p->best_x, &w->x, &w->dx, &w->r1, &p->kept_x};
  double **of_m[VECTORS_M] = {&p->y,   &p->tl,  &p->tu,  &p->vl, &p->vu, &p->ax, &p->rl,     &p->ru, &p->dy, &p->dtl,
                              &p->dtu, &p->dvl, &p->dvu, &p->cl, &p->cu, &p->r2, &p->best_y, &w->y,  &w->dy, &w->r2};
  double *at = batten_alloc_array(ctx, VECTORS_N * n + (VECTORS_M + KEPT_M) * m, sizeof *at);
  if (!at) return BATTEN_E_NOMEM;
  memset(at, 0, (VECTORS_N * n + (VECTORS_M + KEPT_M) * m) * sizeof *at);
  for (size_t v = 0; v < VECTORS_N; v++, at += n) *of_n[v] = at;
  for (size_t v = 0; v < VECTORS_M; v++, at += m) *of_m[v] = at;
  p->kept_rows = at;
  w->sum = batten_alloc_array(ctx, n, sizeof *w->sum);
  if (!w->sum) return BATTEN_E_NOMEM;
  p->kind = batten_alloc_array(ctx, m, 2);
  if (!p->kind) return BATTEN_E_NOMEM;
  w->tried = (signed char *)p->kind + m;
  classify(p);
  return ip_newton_new(ctx, s, &p->newton);
}

static void ip_free(batten_context *ctx, ip *p) {
  ip_newton_free(ctx, &p->newton);
  batten_free(ctx, p->kind);
  batten_free(ctx, p->work.sum);
  batten_free(ctx, p->x);
}

/* ---- the method ---- */

static void keep_best(ip *p) {
  if (p->have_best && !(p->figures.merit < p->best.merit)) return;
  p->best = p->figures;
  p->have_best = true;
  memcpy(p->best_x, p->x, p->s->n * sizeof *p->x);
  memcpy(p->best_y, p->y, p->s->m * sizeof *p->y);
}

/* Regularisation: less where it held a residual up (the last step, of length a, left more than it should have), more
 * where the systems could not be solved with it. */
static void regularize(ip *p, size_t count, double a, double b) {
  const double START = 1e-6, LEAST = 1e-14, LAG = 0.1, WRONG = 1e-2;
  double primal = 0, dual = 0;
  for (size_t k = 0; k < p->s->m; k++) primal = qp_larger(primal, qp_larger(fabs(p->rl[k]), fabs(p->ru[k])));
  for (size_t j = 0; j < p->s->n; j++) dual = qp_larger(dual, fabs(p->rd[j]));
  if (count == 0)
    p->newton.rho = p->delta = START;
  else {
    if (primal > (1 - a + LAG) * p->lag_primal) p->delta = qp_larger(p->delta / 10, LEAST);
    if (dual > (1 - b + LAG) * p->lag_dual) p->newton.rho = qp_larger(p->newton.rho / 10, LEAST);
    if (p->error > WRONG) {
      p->delta = fmin(100 * p->delta, START);
      p->newton.rho = fmin(100 * p->newton.rho, START);
    }
  }
  p->lag_primal = primal;
  p->lag_dual = dual;
}

/* Lengthens the step by further right sides, each as cheap as a solve, as long as that pays. The step's six vectors
 * by row lie one behind the other. */
static void correct_centrality(ip *p, double target, double *a, double *b) {
  const int MOST = 3;
  const double FURTHER = 0.08, WORTH = 0.02;
  /* Where a factorization costs little more than a solve, only what is really short is worth a corrector. */
  const double LONG = p->newton.kkt.cheap ? 1.5 : 1.9;
  size_t bytes_n = p->s->n * sizeof(double), bytes_m = 6 * p->s->m * sizeof(double);
  for (int c = 0; c < MOST && *a + *b < LONG; c++) {
    double a0 = *a, b0 = *b;
    memcpy(p->kept_x, p->dx, bytes_n);
    memcpy(p->kept_rows, p->dy, bytes_m);
    aim_correct(p, target, fmin(1, (1 + FURTHER) * a0 + FURTHER), fmin(1, (1 + FURTHER) * b0 + FURTHER));
    step(p, FINE, false);
    longest(p, a, b);
    if (*a + *b >= a0 + b0 + WORTH) continue;
    *a = a0;
    *b = b0;
    memcpy(p->dx, p->kept_x, bytes_n);
    memcpy(p->dy, p->kept_rows, bytes_m);
    return;
  }
}

/* Predictor and corrector; *a, *b: longest steps of x and t, of y and v. */
static void direction(ip *p, double *a, double *b) {
  const double TOO_WRONG = 0.1, LEAST = 1e-6, SMALL = 1e-4, ROUNDING = 1e-15;
  weights(p);
  p->newton.sharp = p->figures.largest < SMALL && p->figures.dual > ROUNDING;
  ip_newton_factor(&p->newton, 0, 0);
  aim_zero(p);
  step(p, ROUGH, true);
  if (p->error > TOO_WRONG) {
    ip_newton_factor(&p->newton, LEAST, LEAST);
    step(p, ROUGH, false);
  }
  longest(p, a, b);
  if (p->sides == 0) {
    step(p, FINE, false);
    return;
  }
  double both = fmin(*a, *b), ratio = mu_after(p, both, both) / p->mu;
  double sigma = fmin(1, qp_larger(1e-8, ratio * ratio * ratio));
  /* Below what the gap asks for, products only lose digits while residuals are still on their way. */
  double least = 1e-4 * p->limits->tolerance * p->figures.size / (double)p->sides;
  double target = qp_larger(sigma * p->mu, least);
  aim_centre(p, target);
  step(p, FINE, false);
  longest(p, a, b);
  correct_centrality(p, target, a, b);
}

/* Until the limits are met; unless strictly, the relative tolerance will do. */
static batten_status iterate(batten_context *ctx, ip *p, bool strictly, size_t *count) {
  const double NEARLY = 1e-8;                /* residuals that no problem without solution reaches */
  const size_t patience = strictly ? 5 : 30; /* steps without a better point or smaller mu */
  size_t idle = 0;
  double mark = INFINITY, least_mu = INFINITY; /* of the last progress worth the name */
  double a = 0, b = 0;
  for (;; ++*count) {
    residuals(p);
    keep_best(p);
    if (p->best.merit <= 1 || (!strictly && p->best.largest <= p->limits->tolerance)) return BATTEN_OK;
    idle++;
    if (p->best.merit < 0.9 * mark || p->mu < 0.5 * least_mu) {
      mark = fmin(mark, p->best.merit);
      least_mu = fmin(least_mu, p->mu);
      idle = 0;
    }
    if (idle > patience || !isfinite(p->figures.merit)) return BATTEN_W_ACCURACY;
    batten_status st = qp_limits_check(ctx, p->limits, *count, 1 - 1 / (1 + 0.1 * (double)*count));
    if (st < 0) return st;
    if (p->figures.primal > NEARLY && ip_prove_infeasible(&p->newton, &p->work, p->y, p->work.y))
      return BATTEN_E_INFEASIBLE;
    if (p->figures.dual > NEARLY && ip_prove_unbounded(&p->newton, &p->work, p->x, p->work.x))
      return BATTEN_E_UNBOUNDED;
    regularize(p, *count, a, b);
    direction(p, &a, &b);
    double inward = qp_larger(0.99, 1 - p->mu);
    a = a < 1 ? a * inward : 1, b = b < 1 ? b * inward : 1;
    advance(p, a, b);
  }
}

/* Active where the multiplier is larger than the slack. */
static void guess(const ip *p, const double *x, const double *y, double *ax, signed char *active) {
  const qp_scaled *s = p->s;
  qp_scaled_rows(s, x, ax);
  for (size_t k = 0; k < s->m; k++) {
    if (p->kind[k] == IP_EQUAL)
      active[k] = QP_EQUAL;
    else if (y[k] > 0 && y[k] > ax[k] - s->lower[k])
      active[k] = QP_LOWER;
    else if (y[k] < 0 && -y[k] > s->upper[k] - ax[k])
      active[k] = QP_UPPER;
    else
      active[k] = QP_FREE;
  }
}

/* The caller's working set may be the answer already. */
static bool try_warm(ip *p, const qp_point *point) {
  const size_t ROUNDS = 4;
  const double ENOUGH = 1e-13;
  const qp_scaled *s = p->s;
  bool warm = false;
  for (size_t k = 0; k < s->m; k++) warm |= point->active[k] == QP_LOWER || point->active[k] == QP_UPPER;
  if (!warm) return false;
  for (size_t j = 0; j < s->n; j++) p->best_x[j] = point->have_x ? point->x[j] / s->e[j] : 0;
  for (size_t k = 0; k < s->m; k++) {
    bool has = p->kind[k] == IP_EQUAL || (p->kind[k] & (point->active[k] == QP_UPPER ? IP_UPPER : IP_LOWER));
    point->active[k] = p->kind[k] == IP_EQUAL ? QP_EQUAL : has ? point->active[k] : QP_FREE;
  }
  ip_figures none = {.largest = INFINITY, .merit = INFINITY};
  p->best = ip_polish(&p->newton, p->limits, &p->work, none, ENOUGH, p->best_x, p->best_y, point->active, ROUNDS);
  p->have_best = p->best.merit < INFINITY;
  return p->best.merit <= 1;
}

/* The point, or the proof, in the engine's units. */
static void deliver(const ip *p, batten_status st, qp_point *point) {
  const double FEASIBLE = 1e-9;
  const qp_scaled *s = p->s;
  if (st == BATTEN_E_UNBOUNDED)
    for (size_t j = 0; j < s->n; j++) point->ray[j] = p->work.x[j] * s->e[j];
  else
    for (size_t j = 0; j < s->n; j++) point->x[j] = p->best_x[j] * s->e[j];
  const double *y = st == BATTEN_E_INFEASIBLE ? p->work.y : p->best_y;
  if (st != BATTEN_E_UNBOUNDED)
    for (size_t k = 0; k < s->m; k++) point->y[k] = y[k] * s->f[k] / s->cost;
  point->have_x = p->have_best && p->best.primal <= FEASIBLE && st != BATTEN_E_INFEASIBLE;
}

batten_status qp_interior(batten_context *ctx, const qp_sparse *objective, const qp_rows *rows,
                          const qp_limits *limits, qp_point *point) {
  const size_t POLISH_ROUNDS = 3;
  const double POLISHED = 1e-15;
  qp_scaled s = {0};
  ip p = {.s = &s, .limits = limits};
  size_t count = 0;
  batten_status st = qp_scaled_new(ctx, objective, rows, &s);
  if (st < 0) goto done;
  st = ip_new(ctx, &s, &p);
  if (st < 0) goto done;
  if (!try_warm(&p, point)) {
    start(&p);
    /* The solve on the active set mostly finds the last digits sooner than further steps do. */
    for (int strictly = 0; strictly < 2; strictly++) {
      st = iterate(ctx, &p, strictly, &count);
      guess(&p, p.best_x, p.best_y, p.ax, point->active);
      if (st < 0) break;
      double rho = p.newton.rho;
      p.best =
          ip_polish(&p.newton, limits, &p.work, p.best, POLISHED, p.best_x, p.best_y, point->active, POLISH_ROUNDS);
      p.newton.rho = rho;
      if (p.best.merit <= 1) st = BATTEN_OK;
      if (p.best.merit <= 1 || st != BATTEN_OK) break;
    }
  }
  point->iterations += count;
  point->factorizations += p.newton.factorizations;
  deliver(&p, st, point);
done:
  ip_free(ctx, &p);
  qp_scaled_free(ctx, &s);
  return st;
}

batten_status qp_interior_cost(batten_context *ctx, const batten_matrix *h, const qp_rows *rows, qp_cost *out) {
  const double STEPS = 25, FLOPS_OF_STEP_PER_ENTRY = 40;
  qp_scaled s = {0};
  qp_kkt kkt = {0};
  double *zero = batten_alloc_array(ctx, rows->n, sizeof *zero);
  if (!zero) return BATTEN_E_NOMEM;
  for (size_t j = 0; j < rows->n; j++) zero[j] = 0;
  qp_sparse objective = {.n = rows->n, .h = h, .g = zero};
  batten_status st = qp_scaled_new(ctx, &objective, rows, &s);
  if (st < 0) goto done;
  st = qp_kkt_new(ctx, &s.h, &s.c, &kkt);
  if (st < 0) goto done;
  size_t vectors = (VECTORS_N + 6) * s.n + (VECTORS_M + KEPT_M + 4) * s.m + (2 * IP_KRYLOV + 1) * (s.n + s.m);
  size_t entries = s.h.starts[s.n] + s.c.starts[s.general] + s.n + s.m;
  out->bytes = s.bytes + kkt.bytes + vectors * sizeof(double) + 2 * s.m;
  out->flops = STEPS * (kkt.flops + FLOPS_OF_STEP_PER_ENTRY * (double)entries);
done:
  qp_kkt_free(ctx, &kkt);
  qp_scaled_free(ctx, &s);
  batten_free(ctx, zero);
  return st;
}
