/* The proof that a curve bends one way on a stretch.
 *
 * g = [x', x''] has to be positive: all its Bernstein coefficients on a piece are, by more than their errors, or the
 * piece is bisected. A coefficient at a piece's end is a value of g; one that is not positive beyond its error stays
 * so, and ends the proof.
 *
 * Where g vanishes at s = 0, as it does at inflections, g = g_0 + s q and q has to be positive instead: its
 * coefficients are q_(i-1) = n / i (g_i - g_0). With q >= k > 0 nearby and g_0 >= -z then g > 0 beyond s = z / k, and
 * with g' > 0 up to there, which coefficients tell as well, g has one zero at most. That the one side's g grows away
 * from s = 0 while the other side's, negative by then, does so too leaves exactly one zero in all where g is
 * continuous. Elsewhere (knots at which x'' may jump, the ends of closed curves) z is below what the rounding of the
 * control points has left open.
 *
 * The margin is that of curvature / rho = f / |x'|^3, f = g or q / share, |x'| from above by its coefficients. A
 * piece is done when its bound is within a tenth of the least that can be proven at places that were met, which falls
 * while the proof goes on: what was proven before holds all the more. Errors are taken off from both, so that
 * bisection always leads there. */
#include "certify.h"

#include <math.h>
#include <string.h>

/* Share of the least that is proven, and pieces of a stretch after which any bound above 0 is as good. */
static const double SHARE = 0.905;
enum { PATIENCE = 1 << 14 };
/* Of a stretch: no zero may be further from where it is wanted, whatever rounding leaves open. */
static const double FAR = 0.25;

/* What a stretch adds to the pieces. */
typedef struct task {
  certify_proof *proof;
  const certify_stretch *stretch;
  double z, factor; /* factor: from f / |a|^3 to curvature / rho */
  size_t patience;
} task;

/* |a_k|^3 from above. */
static double cube_above(const bend *b, unsigned k) {
  double x = fabs(b->a[k][0]) + b->a_error[k], y = fabs(b->a[k][1]) + b->a_error[k];
  double square = (x * x + y * y) * CERTIFY_UP + CERTIFY_TINY;
  return square * sqrt(square) * CERTIFY_UP;
}

/* Curvature / rho of f; a huge one is cut. */
static double scaled(double f, double cube, double factor) {
  double value = f / cube * factor;
  return isnan(value) ? 0 : fmax(fmin(value, 0x1p1000), -0x1p1000);
}

/* What q has to exceed at and beyond s > 0 for g to be positive. */
static double taken_off(const task *t, double s) { return t->z > 0 && s > 0 ? t->z / s * CERTIFY_UP : 0; }

/* Looks at an end of the piece. False when f is not large enough there beyond its error. */
static bool look(task *t, const certify_piece *p, bool upper) {
  certify_proof *proof = t->proof;
  const bend *b = &p->b;
  unsigned i = upper ? b->n : 0;
  double s = p->lower + (upper ? p->width : 0), cube = cube_above(b, upper ? b->m : 0);
  double provable = b->g[i] - b->g_error[i] - taken_off(t, s);
  double met = scaled(b->g[i], cube, t->factor);
  if (met < proof->least) {
    proof->least = met;
    proof->least_at = (1 - s) * t->stretch->from + s * t->stretch->to;
  }
  proof->target = fmin(proof->target, scaled(provable, cube, t->factor));
  return provable > 0;
}

/* Whether s q grows on the piece [0, w]: its coefficients are i q_(i-1) times a constant. */
static bool grows(const bend *b) {
  for (unsigned i = 0; i <= b->n; i++) {
    double up = (i + 1) * b->g[i], down = i > 0 ? i * b->g[i - 1] : 0;
    double error = (i + 1) * b->g_error[i] + (i > 0 ? i * b->g_error[i - 1] : 0);
    if (!(up - down > (error + 4 * CERTIFY_EPS * (fabs(up) + fabs(down))) * CERTIFY_UP + CERTIFY_TINY)) return false;
  }
  return true;
}

/* The first piece where f = q >= least > 0: whether g grows up to its zero, which is near enough. */
static bool locate(task *t, const certify_piece *p, double least) {
  const certify_stretch *s = t->stretch;
  double z = t->z * CERTIFY_UP, reach = z / least * CERTIFY_UP;
  bool near = z <= s->allowed || reach * s->share * CERTIFY_UP <= s->slack;
  if (!near || !(reach <= fmin(p->width, FAR)) || !grows(&p->b)) return false;
  double error = (s->offset + reach * fabs(s->to - s->from)) * CERTIFY_UP;
  t->proof->error = fmax(t->proof->error, error);
  return true;
}

/* -1: no part of the piece can be proven, 0: to be bisected, 1: proven. */
static int judge(task *t, certify_piece *p) {
  certify_proof *proof = t->proof;
  const bend *b = &p->b;
  bool first = t->stretch->zero && p->lower == 0;
  double least = INFINITY, cube = 0;
  proof->pieces++;
  if (p->depth > proof->depth) proof->depth = p->depth;
  bool lower = look(t, p, false), upper = look(t, p, true);
  if (!lower || !upper) return -1;
  for (unsigned i = 0; i <= b->n; i++) least = fmin(least, b->g[i] - b->g_error[i]);
  for (unsigned k = 0; k <= b->m; k++) cube = fmax(cube, cube_above(b, k));
  least = (least - taken_off(t, p->lower)) / CERTIFY_UP;
  if (!(least > 0)) return 0;
  double bound = scaled(least, cube, t->factor) / CERTIFY_UP;
  bool enough = bound >= SHARE * proof->target || p->depth == proof->depth_max || proof->pieces > t->patience;
  if (!enough || (first && !locate(t, p, least))) return 0;
  proof->bound = fmin(proof->bound, bound);
  return 1;
}

/* Depth first. All pieces of the stack have been judged. */
static void bisect(task *t) {
  certify_proof *proof = t->proof;
  certify_piece *stack = proof->stack;
  size_t count = 1;
  while (count > 0 && !proof->failed) {
    certify_piece *p = &stack[count - 1], *other = p + 1;
    if (p->depth == proof->depth_max) {
      proof->failed = true;
      return;
    }
    bend_split(&p->b, 0.5, &other->b);
    p->width *= 0.5;
    p->depth++;
    other->depth = p->depth;
    other->width = p->width;
    other->lower = p->lower + p->width;
    int verdict[2] = {judge(t, p), judge(t, other)};
    proof->failed = verdict[0] < 0 || verdict[1] < 0;
    if (verdict[0] > 0) *p = *other;
    count = count + 1 - (size_t)(verdict[0] > 0) - (size_t)(verdict[1] > 0);
  }
}

/* q in the place of g. False where g is of degree 0. */
static bool divide_by_s(bend *b) {
  unsigned n = b->n;
  if (n == 0) return false;
  double c = b->g[0], error = b->g_error[0];
  for (unsigned i = 1; i <= n; i++) {
    double factor = (double)n / i, size = factor * (fabs(b->g[i]) + fabs(c));
    b->g[i - 1] = factor * (b->g[i] - c);
    b->g_error[i - 1] = (factor * (b->g_error[i] + error) + 4 * CERTIFY_EPS * size) * CERTIFY_UP + CERTIFY_TINY;
  }
  b->n = n - 1;
  return true;
}

/* From f / |a|^3 to curvature / rho, not too large; an exponent beyond what products bear is cut, or tells nothing.
 */
static double factor_of(const certify_stretch *s) {
  int exponent = s->b.exponent > 900 ? 900 : s->b.exponent;
  double factor = exponent < -900 ? 0 : ldexp(1, exponent);
  return s->zero ? factor / s->share / CERTIFY_UP : factor;
}

void curve_prove(certify_proof *proof, certify_stretch *stretch) {
  task t = {.proof = proof, .stretch = stretch, .factor = factor_of(stretch), .patience = proof->pieces + PATIENCE};
  certify_piece *whole = &proof->stack[0];
  *whole = (certify_piece){.b = stretch->b, .width = 1};
  if (stretch->zero) {
    t.z = fmax(0, whole->b.g_error[0] - whole->b.g[0]);
    if (!divide_by_s(&whole->b)) proof->failed = true;
  }
  int verdict = judge(&t, whole);
  if (verdict < 0) proof->failed = true;
  if (verdict == 0) bisect(&t);
}
