/* What the files of the interior point share: the iterate on the equilibrated problem, the regularised Newton system
 * with refinement, the polish on the active set, and proofs that there is no solution. */
#ifndef BATTEN_QP_INTERIOR_H
#define BATTEN_QP_INTERIOR_H

#include "kkt.h"
#include "scaled.h"
#include "twice.h"

/* Of each row, which sides it has. */
enum { IP_EQUAL = 0, IP_LOWER = 1, IP_UPPER = 2, IP_BOTH = 3 };

/* Relative residuals of a point, in the units of the engine's rows and objective, and the largest of them. merit: the
 * largest against what the limits allow, 1 = there. */
typedef struct ip_figures {
  double primal, dual, gap, largest, merit;
  double size; /* of the scaled objective, as the gap is judged */
} ip_figures;

enum { IP_KRYLOV = 6 }; /* vectors for where refinement stalls */

/* The system  (H + rho) dx - rows' dy = r1,   rows dx + w dy = r2,   and the vectors to solve it with. */
typedef struct ip_newton {
  const qp_scaled *s;
  qp_kkt kkt;
  double rho;              /* of the system */
  double *w;               /* [m] > 0 */
  double *d;               /* [n] diagonal of the factored system */
  double *factored_w;      /* [general] */
  double *unit;            /* [m] weight of a row's residual: what it changes in y */
  double *q1, *q2;         /* [n], [m] residual, then correction */
  double *ax;              /* [m] rows at dx of the last solve */
  double *best_x, *best_y; /* [n], [m] */
  double *hx;              /* [n] scratch */
  double *krylov;          /* [2 IP_KRYLOV + 1][n + m] */
  bool sharp;              /* refine until the residual of the unknowns' equations is below that of r1, too */
  bool trusted;            /* the last solve that was checked needed no refinement */
  size_t factorizations;
} ip_newton;

batten_status ip_newton_new(batten_context *ctx, const qp_scaled *s, ip_newton *out);
void ip_newton_free(batten_context *ctx, ip_newton *k);
/* Factors with w as set; the factored system has at least rho_least and w_least, whatever rho and w are. */
void ip_newton_factor(ip_newton *k, double rho_least, double w_least);
/* dx [n], dy [m]; r1, r2 are kept. Refines until the residual is below enough of r, or as far as it goes. Returns
 * what is left, relative. ahead: the solution is only looked at, so that it goes unchecked as long as others did
 * without refinement. */
double ip_newton_solve(ip_newton *k, double enough, bool ahead, const double *r1, const double *r2, double *dx,
                       double *dy);

/* Figures of x, y: y_k > 0 pushes from the lower side. rd [n] := H x + g - rows'y, ax [m] := rows at x. */
ip_figures ip_judge(const qp_scaled *s, const qp_limits *limits, const double *x, const double *y,
                    double *rd, double *ax);

/* Solves on the guessed active set, corrects the guess, and replaces x, y, active where that is better, until the
 * largest relative residual is below enough. Returns the figures of what is then there. x, y scaled. */
typedef struct ip_polish_work {
  double *x, *y, *dx, *dy, *r1, *r2; /* [n] or [m] */
  qp_twice *sum;                     /* [n] */
  signed char *tried;
} ip_polish_work;
ip_figures ip_polish(ip_newton *k, const qp_limits *limits, ip_polish_work *work, ip_figures before, double enough,
                     double *x, double *y, signed char *active, size_t rounds);

/* Whether y (x) points to a proof that there is no feasible point (no minimum); then the sharpened proof [m] ([n]) is
 * in proof, scaled as y and x are. Uses k's matrix: it has to be factored anew afterwards. */
bool ip_prove_infeasible(ip_newton *k, ip_polish_work *work, const double *y, double *proof);
bool ip_prove_unbounded(ip_newton *k, ip_polish_work *work, const double *x, double *proof);

#endif
