/* Figures of a solid's surface: fields on the mesh, the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "body.h"

/* ---- fields -------------------------------------------------------------------------------------- */

/* Curvatures of the level set of F = -f through a point, from F's gradient g and Hessian h: F grows outwards, so
 * a ball of radius R has mean curvature 1 / R and Gaussian 1 / R^2.   [Goldman 2005, section 4] */
static void curvatures(const double g[3], const double h[9], double *mean, double *gauss) {
  double g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
  double hg[3], ghg = 0;
  for (size_t k = 0; k < 3; k++) {
    hg[k] = h[3 * k] * g[0] + h[3 * k + 1] * g[1] + h[3 * k + 2] * g[2];
    ghg += g[k] * hg[k];
  }
  double trace = h[0] + h[4] + h[8];
  *mean = (g2 * trace - ghg) / (2 * g2 * sqrt(g2));
  double adjugate[6] = {h[4] * h[8] - h[5] * h[7], h[2] * h[7] - h[1] * h[8], h[1] * h[5] - h[2] * h[4],
                        h[0] * h[8] - h[2] * h[6], h[2] * h[3] - h[0] * h[5], h[0] * h[4] - h[1] * h[3]};
  double sum = adjugate[0] * g[0] * g[0] + adjugate[3] * g[1] * g[1] + adjugate[5] * g[2] * g[2] +
               2 * (adjugate[1] * g[0] * g[1] + adjugate[2] * g[0] * g[2] + adjugate[4] * g[1] * g[2]);
  *gauss = sum / (g2 * g2);
}

batten_status body_add_fields(body *b) {
  enum { BATCH = 4096 };
  batten_context *ctx = b->run->ctx;
  size_t V = batten_mesh_vertex_count(b->mesh);
  const double *vertices = batten_mesh_vertices(b->mesh);
  double *gradient = batten_alloc_array(ctx, V, 3 * sizeof *gradient);
  double *hessian = batten_alloc_array(ctx, BATCH, 9 * sizeof *hessian);
  double *mean = batten_alloc_array(ctx, V, sizeof *mean), *gauss = batten_alloc_array(ctx, V, sizeof *gauss);
  b->color = batten_alloc_array(ctx, V, sizeof *b->color);
  batten_status st = gradient && hessian && mean && gauss && b->color ? BATTEN_OK : BATTEN_E_NOMEM;
  b->gradient_min = INFINITY;
  b->gradient_max = 0;
  for (size_t first = 0; st >= 0 && first < V; first += BATCH) {
    size_t count = V - first < BATCH ? V - first : BATCH;
    st = batten_progress(ctx, "fields", (double)first / (double)V);
    if (st >= 0)
      st = batten_solid_evaluate(ctx, b->solid, count, vertices + 3 * first, NULL, gradient + 3 * first, hessian);
    for (size_t i = 0; st >= 0 && i < count; i++) {
      double outward[3], bent[9], *g = gradient + 3 * (first + i);
      for (size_t k = 0; k < 3; k++) outward[k] = -g[k];
      for (size_t k = 0; k < 9; k++) bent[k] = -hessian[9 * i + k];
      curvatures(outward, bent, &mean[first + i], &gauss[first + i]);
      double size = hypot(hypot(g[0], g[1]), g[2]);
      b->gradient_min = fmin(b->gradient_min, size);
      b->gradient_max = fmax(b->gradient_max, size);
      b->color[first + i] = b->request->color == BODY_MEAN    ? mean[first + i]
                            : b->request->color == BODY_GAUSS ? gauss[first + i]
                                                              : size;
    }
  }
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "gradient", 3, gradient);
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "mean_curvature", 1, mean);
  if (st >= 0) st = batten_mesh_set_field(ctx, b->mesh, "gaussian_curvature", 1, gauss);
  batten_free(ctx, gauss);
  batten_free(ctx, mean);
  batten_free(ctx, hessian);
  batten_free(ctx, gradient);
  return st;
}

const double *body_color_values(const body *b) { return b->request->color == BODY_PLAIN ? NULL : b->color; }

/* ---- report -------------------------------------------------------------------------------------- */

/* Keys of space in the plane and the other way round are null: every report has every key. */
static void report_plane(const body *b, cli_report *r) {
  static const char *const space_only[] = {"mesh_vertices",
                                           "mesh_edges",
                                           "mesh_triangles",
                                           "mesh_components",
                                           "mesh_euler",
                                           "mesh_genus",
                                           "mesh_closed",
                                           "mesh_manifold",
                                           "mesh_oriented",
                                           "mesh_boundary_loops",
                                           "mesh_self_intersections",
                                           "mesh_angle_min_deg",
                                           "mesh_angle_max_deg",
                                           "mesh_angles_above_20deg",
                                           "mesh_edge_mean",
                                           "volume"};
  static const char *const space_last[] = {"centroid_x", "centroid_y", "centroid_z", "inertia_xx", "inertia_yy",
                                           "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz"};
  size_t vertices = 0, closed_loops = 0, loops = batten_outline_loop_count(b->outline);
  for (size_t l = 0; l < loops; l++) {
    size_t count;
    int closed;
    batten_outline_loop(b->outline, l, &count, &closed);
    vertices += count;
    closed_loops += closed != 0;
  }
  for (size_t i = 0; i < sizeof space_only / sizeof *space_only; i++) cli_report_null(r, space_only[i]);
  cli_report_number(r, "area", batten_outline_area(b->outline));
  for (size_t i = 0; i < sizeof space_last / sizeof *space_last; i++) cli_report_null(r, space_last[i]);
  cli_report_null(r, "gradient_min");
  cli_report_null(r, "gradient_max");
  cli_report_count(r, "outline_loops", loops);
  cli_report_count(r, "outline_vertices", vertices);
  cli_report_bool(r, "outline_closed", loops > 0 && closed_loops == loops);
  cli_report_number(r, "outline_length", batten_outline_length(b->outline));
}

void body_report(const body *b, cli_report *r) {
  cli_report_count(r, "evaluations", b->surface.evaluations);
  cli_report_count(r, "seeds_missed", b->surface.seeds_missed);
  cli_report_number(r, "cell", b->surface.cell);
  cli_report_number(r, "surface_distance_max", b->surface.distance_max);
  cli_report_bool(r, "surface_clipped", b->surface.clipped != 0);
  cli_report_count(r, "crease_vertices", b->surface.crease_vertices);
  if (b->outline) {
    report_plane(b, r);
    return;
  }
  cli_report_mesh(r, &b->measures, &b->self_intersections);
  cli_report_number(r, "gradient_min", b->gradient_min);
  cli_report_number(r, "gradient_max", b->gradient_max);
  cli_report_null(r, "outline_loops");
  cli_report_null(r, "outline_vertices");
  cli_report_null(r, "outline_closed");
  cli_report_null(r, "outline_length");
}

/* ---- summary ------------------------------------------------------------------------------------- */

void body_print(const body *b) {
  if (b->outline) {
    size_t loops = batten_outline_loop_count(b->outline);
    cli_line("outline", "%zu loop%s", loops, loops == 1 ? "" : "s");
    cli_line("area", "%.6g", batten_outline_area(b->outline));
    cli_line("length", "%.6g", batten_outline_length(b->outline));
  } else {
    cli_print_mesh(&b->measures);
  }
}

void body_print_end(const body *b, const char *name, double seconds, double time_read_s) {
  cli_line("time", "%.2f s: %s %.2f, surface %.2f, files %.2f", batten_now() - b->run->started, name, seconds,
           b->time_surface_s, time_read_s + b->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(b->run->ctx) / 1e6);
  for (size_t k = 0; k < b->common->outputs.count; k++)
    cli_line(k ? "" : "written", "%s", b->common->outputs.items[k].path);
}
