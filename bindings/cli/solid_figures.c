/* Figures of `batten solid`: fields on the mesh, the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "solid.h"

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

batten_status solid_add_fields(solid_work *w) {
  enum { BATCH = 4096 };
  batten_context *ctx = w->run.ctx;
  size_t V = batten_mesh_vertex_count(w->mesh);
  const double *vertices = batten_mesh_vertices(w->mesh);
  double *gradient = batten_alloc_array(ctx, V, 3 * sizeof *gradient);
  double *hessian = batten_alloc_array(ctx, BATCH, 9 * sizeof *hessian);
  double *mean = batten_alloc_array(ctx, V, sizeof *mean), *gauss = batten_alloc_array(ctx, V, sizeof *gauss);
  w->color = batten_alloc_array(ctx, V, sizeof *w->color);
  batten_status st = gradient && hessian && mean && gauss && w->color ? BATTEN_OK : BATTEN_E_NOMEM;
  w->gradient_min = INFINITY;
  w->gradient_max = 0;
  for (size_t first = 0; st >= 0 && first < V; first += BATCH) {
    size_t count = V - first < BATCH ? V - first : BATCH;
    st = batten_progress(ctx, "fields", (double)first / (double)V);
    if (st >= 0)
      st = batten_solid_evaluate(ctx, w->solid, count, vertices + 3 * first, NULL, gradient + 3 * first, hessian);
    for (size_t i = 0; st >= 0 && i < count; i++) {
      double outward[3], bent[9], *g = gradient + 3 * (first + i);
      for (size_t k = 0; k < 3; k++) outward[k] = -g[k];
      for (size_t k = 0; k < 9; k++) bent[k] = -hessian[9 * i + k];
      curvatures(outward, bent, &mean[first + i], &gauss[first + i]);
      double size = hypot(hypot(g[0], g[1]), g[2]);
      w->gradient_min = fmin(w->gradient_min, size);
      w->gradient_max = fmax(w->gradient_max, size);
      w->color[first + i] = w->request->color == SOLID_MEAN    ? mean[first + i]
                            : w->request->color == SOLID_GAUSS ? gauss[first + i]
                                                               : size;
    }
  }
  if (st >= 0) st = batten_mesh_set_field(ctx, w->mesh, "gradient", 3, gradient);
  if (st >= 0) st = batten_mesh_set_field(ctx, w->mesh, "mean_curvature", 1, mean);
  if (st >= 0) st = batten_mesh_set_field(ctx, w->mesh, "gaussian_curvature", 1, gauss);
  batten_free(ctx, gauss);
  batten_free(ctx, mean);
  batten_free(ctx, hessian);
  batten_free(ctx, gradient);
  return st;
}

const double *solid_color_values(const solid_work *w) { return w->request->color == SOLID_PLAIN ? NULL : w->color; }

/* ---- report -------------------------------------------------------------------------------------- */

static const char *orientation_name(batten_orientation_used o) {
  return o == BATTEN_ORIENTATION_GIVEN ? "given" : o == BATTEN_ORIENTATION_ESTIMATED ? "estimated" : "none";
}
static const char *sign_name(batten_sign_state s) {
  return s == BATTEN_SIGN_CLEAN ? "clean" : s == BATTEN_SIGN_CURED ? "cured" : "ambiguous";
}
static const char *orient_data_name(batten_orient_data d) {
  return d == BATTEN_ORIENT_DATA_GRADIENTS ? "gradients" : d == BATTEN_ORIENT_DATA_PAIRS ? "pairs" : "none";
}
static const char *orient_method_name(batten_orient_method m) {
  return m == BATTEN_ORIENT_METHOD_ENERGY ? "energy" : m == BATTEN_ORIENT_METHOD_PLANES ? "planes" : "none";
}

static const char *carrier_name(const solid_work *w) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(batten_solid_carrier(w->solid), &parts);
  return batten_carrier_kind_name(parts.kind);
}

static void report_fit(const solid_work *w, cli_report *r) {
  const batten_solid_info *i = &w->info;
  const batten_saddle_info *s = &i->spline.saddle;
  batten_spline_parts parts = {.struct_size = sizeof parts};
  batten_spline_get_parts(batten_solid_spline(w->solid), &parts);
  cli_report_text(r, "carrier", carrier_name(w));
  cli_report_count(r, "order", parts.m);
  cli_report_number(r, "smoothing", w->request->fit.spline.smoothing);
  cli_report_text(r, "method", batten_saddle_method_name(s->method));
  cli_report_count(r, "fallbacks", s->fallbacks);
  cli_report_number(r, "residual_max", i->residual_max);
  cli_report_number(r, "distance_max", i->distance_max);
  cli_report_number(r, "rcond", s->rcond);
  cli_report_number(r, "loo_rms", i->spline.loo_rms);
  cli_report_count(r, "loo_samples", i->spline.loo_samples);
  cli_report_count(r, "refinements", s->refinements);
  cli_report_number(r, "energy", i->spline.energy);
  cli_report_number(r, "spacing", i->spacing);
  cli_report_count(r, "factor_bytes", s->bytes);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_assemble_s", s->time_assemble_s);
  cli_report_number(r, "time_project_s", s->time_project_s);
  cli_report_number(r, "time_factor_s", s->time_factor_s);
  cli_report_number(r, "time_solve_s", s->time_project_s + s->time_factor_s + s->time_solve_s);
  cli_report_number(r, "time_fit_s", i->time_fit_s);
  cli_report_number(r, "time_check_s", i->time_check_s);
  cli_report_number(r, "time_orient_s", i->time_orient_s);
  cli_report_number(r, "time_surface_s", w->time_surface_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

static void report_sign(const solid_work *w, cli_report *r) {
  const batten_solid_info *i = &w->info;
  cli_report_text(r, "orientation", orientation_name(i->orientation));
  cli_report_text(r, "orient_data", orient_data_name(i->orient_data));
  cli_report_text(r, "orient_method", orient_method_name(i->orient_method));
  cli_report_number(r, "orient_lambda", i->orient_lambda);
  cli_report_text(r, "sign_check", sign_name(i->sign));
  cli_report_count(r, "phantom_components", i->check_final.phantom_components);
  cli_report_count(r, "phantom_cells", i->check_final.phantom_cells);
  cli_report_count(r, "weak_gradients", i->check_final.weak_gradients);
  cli_report_count(r, "flipped_neighbours", i->check_final.flipped_neighbours);
  cli_report_bool(r, "inside_out", i->check_final.inside_out != 0);
  cli_report_count(r, "first_phantom_components", i->check.phantom_components);
  cli_report_count(r, "first_phantom_cells", i->check.phantom_cells);
  cli_report_count(r, "first_weak_gradients", i->check.weak_gradients);
  cli_report_count(r, "first_flipped_neighbours", i->check.flipped_neighbours);
}

/* Keys of space in the plane and the other way round are null: every report has every key. */
static void report_plane(const solid_work *w, cli_report *r) {
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
  size_t vertices = 0, closed_loops = 0, loops = batten_outline_loop_count(w->outline);
  for (size_t l = 0; l < loops; l++) {
    size_t count;
    int closed;
    batten_outline_loop(w->outline, l, &count, &closed);
    vertices += count;
    closed_loops += closed != 0;
  }
  for (size_t i = 0; i < sizeof space_only / sizeof *space_only; i++) cli_report_null(r, space_only[i]);
  cli_report_number(r, "area", batten_outline_area(w->outline));
  for (size_t i = 0; i < sizeof space_last / sizeof *space_last; i++) cli_report_null(r, space_last[i]);
  cli_report_null(r, "gradient_min");
  cli_report_null(r, "gradient_max");
  cli_report_count(r, "outline_loops", loops);
  cli_report_count(r, "outline_vertices", vertices);
  cli_report_bool(r, "outline_closed", loops > 0 && closed_loops == loops);
  cli_report_number(r, "outline_length", batten_outline_length(w->outline));
}

void solid_report(const solid_work *w, cli_report *r) {
  double lower[3], upper[3];
  unsigned n = w->cloud.n;
  cli_report_text(r, "command", "solid");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "input", w->request->common.input);
  cli_report_count(r, "dimension", n);
  cli_report_count(r, "points_read", w->info.points_given);
  cli_report_count(r, "points_used", w->info.points_used);
  cli_report_count(r, "duplicates_merged", w->info.duplicates_merged);
  cli_report_bool(r, "normals_read", w->cloud.normals != NULL);
  batten_solid_box(w->solid, lower, upper);
  if (n == 2) lower[2] = upper[2] = NAN;
  cli_report_box(r, 3, lower, upper);
  report_fit(w, r);
  report_sign(w, r);
  cli_report_count(r, "evaluations", w->surface.evaluations);
  cli_report_count(r, "seeds_missed", w->surface.seeds_missed);
  cli_report_number(r, "cell", w->surface.cell);
  cli_report_number(r, "surface_distance_max", w->surface.distance_max);
  cli_report_bool(r, "surface_clipped", w->surface.clipped != 0);
  if (w->outline) {
    report_plane(w, r);
    return;
  }
  cli_report_mesh(r, &w->measures, &w->self_intersections);
  cli_report_number(r, "gradient_min", w->gradient_min);
  cli_report_number(r, "gradient_max", w->gradient_max);
  cli_report_null(r, "outline_loops");
  cli_report_null(r, "outline_vertices");
  cli_report_null(r, "outline_closed");
  cli_report_null(r, "outline_length");
}

/* ---- summary ------------------------------------------------------------------------------------- */

void solid_summary(const solid_work *w) {
  const batten_solid_info *i = &w->info;
  cli_line("points", "%zu used of %zu read%s", i->points_used, i->points_given,
           w->cloud.normals ? ", with normals" : "");
  cli_line("solid", "carrier %s, solver %s, residual %.1e, leave-one-out %.2e", carrier_name(w),
           batten_saddle_method_name(i->spline.saddle.method), i->residual_max, i->spline.loo_rms);
  cli_line("sign", "%s%s%s", sign_name(i->sign), i->orientation == BATTEN_ORIENTATION_NONE ? "" : ", orientation ",
           i->orientation == BATTEN_ORIENTATION_NONE ? "" : orientation_name(i->orientation));
  if (w->outline) {
    size_t loops = batten_outline_loop_count(w->outline);
    cli_line("outline", "%zu loop%s", loops, loops == 1 ? "" : "s");
    cli_line("area", "%.6g", batten_outline_area(w->outline));
    cli_line("length", "%.6g", batten_outline_length(w->outline));
  } else {
    cli_print_mesh(&w->measures);
  }
  cli_line("time", "%.2f s: fit %.2f, surface %.2f, files %.2f", batten_now() - w->run.started,
           i->time_fit_s + i->time_check_s + i->time_orient_s, w->time_surface_s, w->time_read_s + w->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(w->run.ctx) / 1e6);
  for (size_t k = 0; k < w->request->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", w->request->common.outputs.items[k].path);
}
