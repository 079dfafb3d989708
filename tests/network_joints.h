/* Joints of patches judged from the control points alone, by plain de Casteljau: shares no code with the fills. */
#ifndef NETWORK_JOINTS_H
#define NETWORK_JOINTS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Point and first derivatives by u and v of a patch of degree n <= 12 at the barycentric place (a, b, c). */
static inline void joint_evaluate(unsigned n, const double (*net)[3], const double *place, double *point, double *du,
                                  double *dv) {
  double work[91][3];
  memcpy(work, net, (n + 1) * (n + 2) / 2 * sizeof *work);
  for (unsigned m = n; m > 0; m--) {
    if (m == 1)
      for (int x = 0; x < 3; x++) {
        du[x] = n * (work[1][x] - work[0][x]);
        dv[x] = n * (work[2][x] - work[0][x]);
      }
    for (unsigned k = 0, to = 0, from = 0; k < m; k++, from++)
      for (unsigned j = 0; j + k < m; j++, to++, from++)
        for (int x = 0; x < 3; x++)
          work[to][x] =
              place[0] * work[from][x] + place[1] * work[from + 1][x] + place[2] * work[from + m + 1 - k][x];
  }
  memcpy(point, work[0], sizeof work[0]);
}

static inline void joint_cross(const double *a, const double *b, double *out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

typedef struct joint_figures {
  double gap, angle_deg; /* largest */
  double jacobian;       /* least |S_u x S_v| over the mean, on the joints */
  double sum;
  size_t samples;
} joint_figures;

/* Edge p of one patch (from corner p to p + 1) against edge q of another, run the other way. */
static inline void joint_measure(unsigned n, const double (*left)[3], unsigned p, unsigned m,
                                 const double (*right)[3], unsigned q, unsigned samples, joint_figures *out) {
  for (unsigned i = 0; i < samples; i++) {
    double t = (double)i / (samples - 1), a[3] = {0}, b[3] = {0};
    double s[2][3], u[2][3], v[2][3], normal[2][3], both[3], gap = 0, product = 0;
    a[p] = 1 - t;
    a[(p + 1) % 3] = t;
    b[q] = t;
    b[(q + 1) % 3] = 1 - t;
    joint_evaluate(n, left, a, s[0], u[0], v[0]);
    joint_evaluate(m, right, b, s[1], u[1], v[1]);
    joint_cross(u[0], v[0], normal[0]);
    joint_cross(u[1], v[1], normal[1]);
    joint_cross(normal[0], normal[1], both);
    for (int x = 0; x < 3; x++) {
      gap += (s[0][x] - s[1][x]) * (s[0][x] - s[1][x]);
      product += normal[0][x] * normal[1][x];
    }
    double sine = sqrt(both[0] * both[0] + both[1] * both[1] + both[2] * both[2]);
    double angle = atan2(sine, product) * (180 / 3.14159265358979323846);
    double size = sqrt(normal[0][0] * normal[0][0] + normal[0][1] * normal[0][1] + normal[0][2] * normal[0][2]);
    if (!(sqrt(gap) <= out->gap)) out->gap = sqrt(gap);
    if (!(angle <= out->angle_deg)) out->angle_deg = angle;
    if (out->samples == 0 || size < out->jacobian) out->jacobian = size;
    out->sum += size;
    out->samples++;
  }
}

/* A network's patches, one (split[f] = 0) or three a facet. */
typedef struct joint_patches {
  unsigned degree;               /* of single patches */
  unsigned split_degree;         /* of thirds */
  const double (*single)[36][3]; /* [faces] */
  const double (*thirds)[3][28][3];
  const unsigned char *split;
} joint_patches;

static inline const double (*joint_patch(const joint_patches *s, size_t face, unsigned edge, unsigned *degree,
                                         unsigned *own_edge))[3] {
  bool split = s->split[face];
  *degree = split ? s->split_degree : s->degree;
  *own_edge = split ? 0 : edge;
  return split ? s->thirds[face][edge] : s->single[face];
}

/* Over all inner edges of the mesh that `skip` (may be NULL) does not name, and inside split facets. */
static inline joint_figures joint_measure_all(const joint_patches *s, size_t faces, const uint32_t *twin,
                                              const bool *skip, unsigned samples) {
  joint_figures out = {0};
  for (size_t h = 0; h < 3 * faces; h++) {
    unsigned n, m, p, q;
    if (s->split[h / 3]) {
      const double(*third)[28][3] = s->thirds[h / 3];
      joint_measure(s->split_degree, third[h % 3], 1, s->split_degree, third[(h + 1) % 3], 2, samples, &out);
    }
    if (twin[h] == UINT32_MAX || twin[h] < h || (skip && skip[h])) continue;
    const double(*left)[3] = joint_patch(s, h / 3, (unsigned)(h % 3), &n, &p);
    const double(*right)[3] = joint_patch(s, twin[h] / 3, twin[h] % 3, &m, &q);
    joint_measure(n, left, p, m, right, q, samples, &out);
  }
  out.jacobian /= out.samples ? out.sum / (double)out.samples : 1;
  return out;
}

#endif
