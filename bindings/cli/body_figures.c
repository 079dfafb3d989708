/* Figures of a solid's surface: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "body.h"

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
