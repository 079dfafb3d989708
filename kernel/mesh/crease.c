/* Points on kinks of f = 0, by Newton's method with a tangent plane from each side.
 *
 * At a kink itself a gradient says little: it is that of one side, or of none. So the planes come from points of the
 * sheets at a distance w from the kink, one sample in each sheet, stepped onto f = 0 along its own gradient. The next
 * x minimises the squared distances to the planes and, among these points, the way from the last x (Kobbelt, Botsch,
 * Schwanecke, Seidel 2001, "Feature sensitive surface extraction from volume data"): by eigenvalues, those that are
 * near 0 left out. Curved sheets leave their planes by w^2, so that w may shrink with x. What turns smoothly, if
 * fast, is told from a kink by this: its normals come together as w shrinks. How far it shrank before is kept, with
 * the place that was known then. Samples lie on the surface, since off it the gradients of some fields (R-functions,
 * distances around edges) belong to no sheet. */
#include "crease.h"

#include "base/checked.h"
#include "basis/eigen3.h"
#include "project.h"
#include "vec.h"

#include <string.h>

static const double RANK_MIN = 0.01; /* eigenvalue over the largest: normals 12 degrees apart */
static const double SAME_MIN = 0.7;  /* cosine between normals of a sheet in two rounds */
static const double SHRINK = 0.25;   /* of w in a round */

/* Moves x to the nearest point, within the faces, on the planes (normal, through p); false unless they meet in a
 * point (three sheets) or a line. */
static bool meet(const batten_crease *c, const double (*p)[3], double *x) {
  double m[9] = {0}, right[3] = {0}, values[3], vectors[9], used = 0;
  for (unsigned i = 0; i < c->sheets; i++) {
    double n[3], off = 0;
    for (unsigned k = 0; k < 3; k++) {
      off += c->normal[i][k] * (p[i][k] - x[k]);
      n[k] = batten_on_face(c->faces, k) ? 0 : c->normal[i][k];
    }
    for (unsigned k = 0; k < 3; k++) {
      right[k] += off * n[k];
      for (unsigned l = 0; l < 3; l++) m[3 * k + l] += n[k] * n[l];
    }
  }
  batten_eigen_symmetric(3, m, values, vectors);
  for (unsigned i = 0; i < 3; i++) {
    if (!(values[i] > RANK_MIN * values[2])) continue;
    double along = vec_dot(vectors + 3 * i, right) / values[i];
    for (unsigned k = 0; k < 3; k++)
      if (!batten_on_face(c->faces, k)) x[k] += along * vectors[3 * i + k];
    used++;
  }
  return used == c->sheets;
}

/* The part of from in the plane across the unit vector n, as a unit vector. */
static bool tangential(const double *from, const double *n, double *out) {
  double off = vec_dot(from, n);
  for (int k = 0; k < 3; k++) out[k] = from[k] - off * n[k];
  return vec_normalize(out);
}

/* Directions from x into the sheets: across the edge, or towards the homes, around a corner and on the box. */
bool batten_crease_aside(batten_crease *c) {
  double line[3] = {0, 0, 0}, to_home[3];
  if (c->sheets == 2) {
    vec_cross(c->normal[0], c->normal[1], line);
    if (!vec_normalize(line)) return false;
  }
  for (unsigned i = 0; i < c->sheets; i++) {
    double n[3];
    vec_sub(c->home[i], c->x, to_home);
    if (c->sheets == 3 || c->faces) {
      for (unsigned k = 0; k < 3; k++) n[k] = batten_on_face(c->faces, k) ? 0 : c->normal[i][k];
      if (!vec_normalize(n) || !tangential(to_home, n, c->aside[i])) return false;
      continue;
    }
    vec_cross(line, c->normal[i], c->aside[i]);
    double side = vec_dot(c->aside[i], to_home);
    for (int k = 0; k < 3 && side < 0; k++) c->aside[i][k] = -c->aside[i][k];
  }
  /* Both edges bend the same way: the crease is convex, or concave, seen from each side. */
  return c->sheets == 3 || (vec_dot(c->aside[0], c->normal[1]) < 0) == (vec_dot(c->aside[1], c->normal[0]) < 0);
}

bool batten_crease_meet(batten_crease *c) {
  double x[3];
  memcpy(x, c->x, sizeof x);
  if (!meet(c, (const double(*)[3])c->home, x)) return false;
  memcpy(c->x, x, sizeof x);
  return batten_crease_aside(c);
}

bool batten_crease_between(batten_crease *c) {
  double line[3], a[3], b[3];
  for (int k = 0; k < 3; k++) c->x[k] = 0.5 * c->home[0][k] + 0.5 * c->home[1][k];
  if (!batten_crease_meet(c)) return false;
  vec_sub(c->home[0], c->x, a);
  vec_sub(c->home[1], c->x, b);
  if (!c->faces) {
    vec_cross(c->normal[0], c->normal[1], line);
    vec_normalize(line);
    double along_a = vec_dot(a, line), along_b = vec_dot(b, line);
    double off_a = sqrt(fmax(0, vec_dot(a, a) - along_a * along_a));
    double off_b = sqrt(fmax(0, vec_dot(b, b) - along_b * along_b));
    if (!(off_a + off_b > 0)) return false;
    double s = along_a + (along_b - along_a) * (off_a / (off_a + off_b));
    for (int k = 0; k < 3; k++) c->x[k] += s * line[k];
  }
  return vec_distance(c->home[0], c->x) + vec_distance(c->home[1], c->x) < 3 * vec_distance(c->home[0], c->home[1]);
}

/* A sample beside an edge that belongs to neither of its sheets: with the third one x may be a corner. */
static bool add_sheet(batten_crease *c, double (*p)[3], const double *n, const double *at, double cosine) {
  if (c->sheets != 2 || c->faces || vec_dot(n, c->normal[0]) > cosine || vec_dot(n, c->normal[1]) > cosine)
    return false;
  memcpy(c->normal[2], n, 3 * sizeof *n);
  memcpy(c->home[2], at, 3 * sizeof *at);
  memcpy(p[2], at, 3 * sizeof *at);
  c->sheets = 3;
  return true;
}

static bool bends(const batten_crease *c, double angle) {
  double least = 1;
  for (unsigned i = 0; i < c->sheets; i++)
    for (unsigned j = 0; j < i; j++) least = fmin(least, vec_dot(c->normal[i], c->normal[j]));
  return least <= cos(angle);
}

/* What samples at x + w aside tell; first: third sheets may come in. */
static bool update(batten_crease *c, double w, const double *values, const double *gradients, double angle,
                   int round) {
  double p[3][3], x[3];
  bool grown = false;
  unsigned sheets = c->sheets;
  for (unsigned i = 0; i < sheets; i++) {
    const double *g = gradients + 3 * i;
    double n[3], q[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) n[k] = -g[k];
    if (!vec_normalize(n)) return false;
    double off = values[i] / vec_norm(g);
    for (int k = 0; k < 3; k++) q[k] = c->x[k] + w * c->aside[i][k] + off * n[k];
    if (vec_dot(n, c->normal[i]) < SAME_MIN) {
      if (grown || round > 1 || !add_sheet(c, p, n, q, cos(angle))) return false;
      grown = true;
      memcpy(p[i], c->x, sizeof x); /* its plane as it was */
      continue;
    }
    if (!(fabs(off) < w)) return false;
    memcpy(p[i], q, sizeof q);
    memcpy(c->normal[i], n, sizeof n);
  }
  if (!bends(c, round == 0 ? 0.6 * angle : angle)) return false;
  memcpy(x, c->x, sizeof x);
  if (!meet(c, (const double(*)[3])p, x) || !(vec_distance(x, c->x) < (grown ? 8 : 4) * w)) return false;
  memcpy(c->x, x, sizeof x);
  return batten_crease_aside(c);
}

static bool is_refined(const batten_crease *c, unsigned char round) { return c->found && c->rounds == round; }

batten_status batten_crease_refine(batten_sampler *sampler, size_t count, batten_crease *creases, double edge,
                                   double angle) {
  batten_context *ctx = sampler->ctx;
  double w = edge;
  double *points = NULL, *values = NULL, *gradients = NULL;
  batten_status st = BATTEN_E_NOMEM;
  if (count == 0) return BATTEN_OK;
  if (!(points = batten_alloc_array(ctx, count, 9 * sizeof *points)) ||
      !(values = batten_alloc_array(ctx, count, 3 * sizeof *values)) ||
      !(gradients = batten_alloc_array(ctx, count, 9 * sizeof *gradients)))
    goto done;
  st = BATTEN_OK;
  for (size_t j = 0; j < count; j++) creases[j].rounds = 0;
  for (unsigned char round = 0; st >= 0 && round < BATTEN_CREASE_ROUNDS; round++) {
    size_t samples = 0;
    w *= SHRINK;
    for (size_t j = 0; j < count; j++)
      for (unsigned i = 0; is_refined(creases + j, round) && i < creases[j].sheets; i++, samples++)
        for (unsigned k = 0; k < 3; k++) points[3 * samples + k] = creases[j].x[k] + w * creases[j].aside[i][k];
    st = batten_sampler_gradients(sampler, samples, points, values, gradients);
    samples = 0;
    for (size_t j = 0; st >= 0 && j < count; j++) {
      batten_crease *c = creases + j;
      if (!is_refined(c, round)) continue;
      const batten_crease before = *c;
      if (update(c, w, values + samples, gradients + 3 * samples, angle, round)) {
        c->rounds++;
      } else {
        *c = before;
        c->found = round > 0 && bends(c, angle);
      }
      samples += before.sheets;
    }
  }
done:
  batten_free(ctx, gradients);
  batten_free(ctx, values);
  batten_free(ctx, points);
  return st;
}
