/* Writes the quadratic programs of tests/qp_scenes.h to files for qp_peers.py, so that peers get the very numbers
 * that the benchmark in C solves. Usage: qp-problems FOLDER Format, all in doubles: n; A, H, C as rows, columns,
 * entries (-1: dense), then values row by row, or starts, columns and values (absent: 0 0 0); b, g, lower, upper,
 * x_lower, x_upper as length (absent: 0) and values. */
#include "qp_scenes.h"

static void put(FILE *file, const double *values, size_t count) { fwrite(values, sizeof *values, count, file); }
static void put_number(FILE *file, double value) { put(file, &value, 1); }

static void put_vector(FILE *file, const double *values, size_t count) {
  put_number(file, values ? (double)count : 0);
  if (values) put(file, values, count);
}

static void put_matrix(FILE *file, const batten_matrix *m) {
  put_number(file, m ? (double)m->rows : 0);
  put_number(file, m ? (double)m->columns : 0);
  put_number(file, !m ? 0 : m->dense ? -1 : (double)m->starts[m->rows]);
  if (!m) return;
  if (m->dense) {
    put(file, m->dense, m->rows * m->columns);
    return;
  }
  for (size_t i = 0; i <= m->rows; i++) put_number(file, (double)m->starts[i]);
  for (size_t k = 0; k < m->starts[m->rows]; k++) put_number(file, m->indices[k]);
  put(file, m->values, m->starts[m->rows]);
}

static int write_scene(const char *folder, const char *name, qp_scene *s) {
  char path[4096];
  snprintf(path, sizeof path, "%s/%s.qp", folder, name);
  FILE *file = fopen(path, "wb");
  if (!file) {
    fprintf(stderr, "%s: cannot be written\n", path);
    qp_scene_free(s);
    return 1;
  }
  const batten_qp_problem *p = &s->problem;
  size_t m = p->c ? p->c->rows : 0;
  put_number(file, (double)p->n);
  put_matrix(file, p->a);
  put_matrix(file, p->h);
  put_matrix(file, p->c);
  put_vector(file, p->b, p->a ? p->a->rows : 0);
  put_vector(file, p->g, p->n);
  put_vector(file, p->lower, m);
  put_vector(file, p->upper, m);
  put_vector(file, p->x_lower, p->n);
  put_vector(file, p->x_upper, p->n);
  printf("%s: %zu unknowns, %zu rows\n", name, p->n, m);
  qp_scene_free(s);
  return fclose(file) != 0;
}

int main(int argc, char **argv) {
  static const size_t banded[] = {1000, 10000};
  char name[64];
  int failed = 0;
  if (argc != 2) {
    fprintf(stderr, "usage: qp-problems FOLDER\n");
    return 2;
  }
  for (size_t size = 0; size < 4; size++) {
    qp_scene *s = qp_scene_patch(size, false, 1);
    snprintf(name, sizeof name, "patch-%05zu", s->c.rows);
    failed |= write_scene(argv[1], name, s);
  }
  for (size_t q = 0; q < 2; q++) {
    snprintf(name, sizeof name, "curve-%05zu", banded[q]);
    failed |= write_scene(argv[1], name, qp_scene_curve(banded[q] / 2, 0.3, 1));
    snprintf(name, sizeof name, "convex-%05zu", banded[q]);
    failed |= write_scene(argv[1], name, qp_scene_convex(banded[q], 2, 0.1, 1));
  }
  return failed;
}
