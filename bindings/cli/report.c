/* Reports: a flat JSON object of figures, the keys of docs/report.md; and the short lines on stdout. */
#include "cli.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void cli_report_open(cli_report *r) { *r = (cli_report){.object = json_object()}; }
void cli_report_close(cli_report *r) { json_decref(r->object); }

static void set(cli_report *r, const char *key, json_t *value) {
  if (!value || json_object_set_new(r->object, key, value) != 0) r->failed = true;
}

void cli_report_number(cli_report *r, const char *key, double value) {
  set(r, key, isfinite(value) ? json_real(value) : json_null());
}
void cli_report_count(cli_report *r, const char *key, size_t value) { set(r, key, json_integer((json_int_t)value)); }
void cli_report_integer(cli_report *r, const char *key, long long value) { set(r, key, json_integer(value)); }
void cli_report_bool(cli_report *r, const char *key, bool value) { set(r, key, json_boolean(value)); }
void cli_report_null(cli_report *r, const char *key) { set(r, key, json_null()); }

/* A list of numbers, or of counts where those are given. */
static void set_list(cli_report *r, const char *key, size_t count, const double *numbers, const size_t *counts) {
  json_t *list = json_array();
  for (size_t i = 0; list && i < count; i++) {
    json_t *item = counts                 ? json_integer((json_int_t)counts[i])
                   : isfinite(numbers[i]) ? json_real(numbers[i])
                                          : json_null();
    if (json_array_append_new(list, item) != 0) r->failed = true;
  }
  set(r, key, list);
}
void cli_report_numbers(cli_report *r, const char *key, size_t count, const double *values) {
  set_list(r, key, count, values, NULL);
}
void cli_report_counts(cli_report *r, const char *key, size_t count, const size_t *values) {
  set_list(r, key, count, NULL, values);
}

/* File names may hold bytes that are not UTF-8; JSON may not. */
void cli_report_text(cli_report *r, const char *key, const char *value) {
  if (!value) {
    cli_report_null(r, key);
    return;
  }
  json_t *text = json_string(value);
  if (!text) {
    size_t length = strlen(value);
    char *plain = malloc(length + 1);
    if (plain)
      for (size_t i = 0; i <= length; i++) plain[i] = (unsigned char)value[i] > 126 ? '?' : value[i];
    text = plain ? json_string(plain) : NULL;
    free(plain);
  }
  set(r, key, text);
}

void cli_report_box(cli_report *r, unsigned n, const double *lower, const double *upper) {
  static const char *const names[] = {"box_x_min", "box_x_max", "box_y_min", "box_y_max", "box_z_min", "box_z_max"};
  for (unsigned k = 0; k < n; k++) {
    cli_report_number(r, names[2 * k], lower[k]);
    cli_report_number(r, names[2 * k + 1], upper[k]);
  }
}

void cli_report_centroid(cli_report *r, const double centroid[3]) {
  static const char *const names[] = {"centroid_x", "centroid_y", "centroid_z"};
  for (size_t k = 0; k < 3; k++) cli_report_number(r, names[k], centroid[k]);
}

static const char *status_word(batten_status status) {
  switch (status) {
    case BATTEN_OK:
      return "ok";
    case BATTEN_W_ACCURACY:
      return "accuracy";
    case BATTEN_W_AMBIGUOUS:
      return "ambiguous";
    case BATTEN_W_CLIPPED:
      return "clipped";
    case BATTEN_W_STOPPED:
      return "stopped";
    case BATTEN_W_SHAPE:
      return "shape";
    default:
      return "failed";
  }
}

void cli_report_common(cli_report *r, const cli_run *run, batten_status status) {
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  cli_report_text(r, "batten_version", batten_version());
  cli_report_text(r, "blas", blas);
  cli_report_count(r, "blas_threads", batten_blas_threads());
  cli_report_count(r, "threads", run->threads);
  cli_report_text(r, "status", status_word(status));
  cli_report_text(r, "status_text", batten_status_text(status));
  cli_report_number(r, "time_total_s", batten_now() - run->started);
  cli_report_count(r, "peak_bytes", batten_bytes_peak(run->ctx));
}

static bool write_report(const cli_report *r, const char *path, const char *shown) {
  char *text = r->failed ? NULL : json_dumps(r->object, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
  if (!text) {
    cli_error("%s: out of memory", shown);
    return false;
  }
  bool to_stdout = strcmp(path, "-") == 0;
  FILE *f = to_stdout ? stdout : fopen(path, "w");
  bool ok = f && fputs(text, f) >= 0 && fputc('\n', f) != EOF;
  if (f) ok = (to_stdout ? fflush(f) : fclose(f)) == 0 && ok;
  if (!ok) cli_error("%s: cannot be written: %s", shown, strerror(errno));
  free(text);
  return ok;
}

bool cli_report_write(const cli_report *r, const cli_outputs *outputs) {
  for (size_t i = 0; i < outputs->count; i++) {
    const cli_output *f = &outputs->items[i];
    if (f->kind == CLI_OUTPUT_REPORT && !write_report(r, f->staged ? f->staged : f->target, f->path)) return false;
  }
  return true;
}

void cli_line(const char *name, const char *format, ...) {
  va_list args;
  va_start(args, format);
  printf("%-14s ", name);
  vprintf(format, args);
  putchar('\n');
  va_end(args);
}

void cli_report_mesh(cli_report *r, const batten_mesh_measures *m, const size_t *self_intersections) {
  cli_report_count(r, "mesh_vertices", m->vertices);
  cli_report_count(r, "mesh_edges", m->edges);
  cli_report_count(r, "mesh_triangles", m->triangles);
  cli_report_count(r, "mesh_components", m->components);
  cli_report_integer(r, "mesh_euler", m->euler);
  if (m->genus >= 0)
    cli_report_integer(r, "mesh_genus", m->genus);
  else
    cli_report_null(r, "mesh_genus");
  cli_report_bool(r, "mesh_closed", m->closed);
  cli_report_bool(r, "mesh_manifold", m->manifold);
  cli_report_bool(r, "mesh_oriented", m->oriented);
  cli_report_count(r, "mesh_boundary_loops", m->boundary_loops);
  if (self_intersections)
    cli_report_count(r, "mesh_self_intersections", *self_intersections);
  else
    cli_report_null(r, "mesh_self_intersections");
  cli_report_number(r, "mesh_angle_min_deg", m->angle_min_deg);
  cli_report_number(r, "mesh_angle_max_deg", m->angle_max_deg);
  cli_report_number(r, "mesh_angles_above_20deg", m->angles_above_20deg);
  cli_report_number(r, "mesh_edge_mean", m->edge_mean);
  cli_report_number(r, "volume", m->volume);
  cli_report_number(r, "area", m->area);
  cli_report_centroid(r, m->centroid);
  cli_report_number(r, "inertia_xx", m->inertia[0][0]);
  cli_report_number(r, "inertia_yy", m->inertia[1][1]);
  cli_report_number(r, "inertia_zz", m->inertia[2][2]);
  cli_report_number(r, "inertia_xy", m->inertia[0][1]);
  cli_report_number(r, "inertia_xz", m->inertia[0][2]);
  cli_report_number(r, "inertia_yz", m->inertia[1][2]);
}

void cli_print_mesh(const batten_mesh_measures *m) {
  cli_line("mesh", "%zu vertices, %zu triangles, %zu component%s", m->vertices, m->triangles, m->components,
           m->components == 1 ? "" : "s");
  if (m->closed && m->manifold && m->genus >= 0)
    cli_line("shape", "closed manifold, genus %ld", m->genus);
  else
    cli_line("shape", "%s%s, %zu boundary loop%s", m->closed ? "closed" : "open", m->manifold ? "" : ", not manifold",
             m->boundary_loops, m->boundary_loops == 1 ? "" : "s");
  if (isfinite(m->volume)) cli_line("volume", "%.6g", m->volume);
  cli_line("area", "%.6g", m->area);
  cli_line("box", "%.6g .. %.6g  x  %.6g .. %.6g  x  %.6g .. %.6g", m->lower[0], m->upper[0], m->lower[1],
           m->upper[1], m->lower[2], m->upper[2]);
}
