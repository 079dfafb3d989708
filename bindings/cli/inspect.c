/* batten inspect: what is in a file, and its measures. */
#include "cli.h"
#include "curves.h"
#include "inspect.h"
#include "network.h"
#include "qp.h"
#include "surface.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const cli_option table[] = {
    CLI_OPTION_REPORT, CLI_OPTION_THREADS, CLI_OPTION_QUIET, CLI_OPTION_HELP, {0},
};

static void print_help(void) {
  printf(
      "usage: batten inspect FILE [OPTIONS]\n\n"
      "Tells what is in a file: points, a mesh (its measures, whether it is closed and manifold, triangles that "
      "cross),\n"
      "a network of Bezier triangles (continuity across its edges, curvature), a B-spline surface (whether it is "
      "convex),\n"
      "planar B-spline curves (lengths, areas, curvature, inflections), a solid or a carrier saved by batten,\n"
      "sections of a solid, a scene of the algebra of solids (its nodes, its box),\n"
      "a quadratic program (its sizes, which engine would solve it).\n\n");
  cli_options_print(table);
  printf("\nexample:\n\n  batten inspect mesh.ply --report mesh.json\n");
}

/* ---- kinds --------------------------------------------------------------------------------------- */

/* In text that parts them, each in its plane; 0 where that is not so. */
static size_t count_contours(cli_run *run, const char *path) {
  batten_contours contours = {0};
  size_t count = batten_read_contours(run->ctx, path, &contours) < 0 ? 0 : contours.count;
  batten_contours_free(run->ctx, &contours);
  return count;
}

static batten_status tell_points(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_cloud cloud = {0};
  batten_status st = batten_read_points(run->ctx, path, NULL, &cloud);
  if (st < 0) return st;
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < cloud.count * cloud.n; i++) {
    lower[i % cloud.n] = fmin(lower[i % cloud.n], cloud.points[i]);
    upper[i % cloud.n] = fmax(upper[i % cloud.n], cloud.points[i]);
  }
  size_t contours = count_contours(run, path);
  cli_run_clear(run);
  cli_report_count(r, "dimension", cloud.n);
  cli_report_count(r, "points", cloud.count);
  if (contours > 1)
    cli_report_count(r, "contours", contours);
  else
    cli_report_null(r, "contours");
  cli_report_bool(r, "normals", cloud.normals != NULL);
  cli_report_bool(r, "parameters", cloud.parameters != NULL);
  cli_report_bool(r, "weights", cloud.weights != NULL);
  if (print)
    cli_line("points", "%zu, %s%s%s%s", cloud.count, cloud.n == 2 ? "plane" : "in space",
             cloud.normals ? ", with normals" : "", cloud.parameters ? ", with parameters" : "",
             cloud.weights ? ", with weights" : "");
  if (print && contours > 1) cli_line("contours", "%zu, each in a plane", contours);
  inspect_box(r, print && cloud.count, cloud.n, lower, upper);
  batten_cloud_free(run->ctx, &cloud);
  return st;
}

static batten_status tell_mesh(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures m;
  size_t crossing;
  batten_status st = batten_read_mesh(run->ctx, path, &mesh);
  if (st < 0) return st;
  st = batten_mesh_measure(run->ctx, mesh, &m);
  if (st >= 0) st = batten_mesh_self_intersections(run->ctx, mesh, &crossing);
  if (st >= 0) {
    cli_run_clear(run);
    cli_report_count(r, "dimension", 3);
    cli_report_mesh(r, &m, &crossing);
    if (print) {
      cli_print_mesh(&m);
      cli_line("triangles", "angles %.1f .. %.1f degrees, %.1f %% with all of them above 20; %zu pairs cross",
               m.angle_min_deg, m.angle_max_deg, 100 * m.angles_above_20deg, crossing);
      cli_line("edges", "%.4g .. %.4g, mean %.4g", m.edge_min, m.edge_max, m.edge_mean);
      cli_line("centroid", "%.6g  %.6g  %.6g", m.centroid[0], m.centroid[1], m.centroid[2]);
    }
    cli_report_box(r, 3, m.lower, m.upper);
  }
  batten_mesh_free(mesh);
  return st;
}

static batten_status tell_network(cli_run *run, const char *path, bool print, cli_report *r) {
  unsigned samples = batten_network_options_default().check_samples;
  batten_network *network = NULL;
  batten_network_measures m;
  batten_network_continuity c;
  batten_status st = batten_read_network(run->ctx, path, &network);
  if (st < 0) return st;
  st = batten_network_measure(run->ctx, network, &m);
  if (st >= 0) st = batten_network_measure_continuity(run->ctx, network, samples, &c);
  if (st >= 0) {
    cli_run_clear(run);
    cli_report_count(r, "dimension", 3);
    cli_report_count(r, "vertices", batten_network_vertex_count(network));
    cli_report_count(r, "faces", batten_network_face_count(network));
    cli_report_count(r, "patches", batten_network_patch_count(network));
    network_report_measures(&m, &c, r);
    if (print) {
      cli_line("network", "%zu vertices, %zu facets, %zu patches", batten_network_vertex_count(network),
               batten_network_face_count(network), batten_network_patch_count(network));
      network_print_measures(&m, &c);
    }
  }
  batten_network_free(network);
  return st;
}

static batten_status tell_surface(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_surface *surface = NULL;
  batten_surface_measures m;
  batten_convexity c;
  batten_sections sections;
  bool plane = false;
  batten_status st = batten_read_surface(run->ctx, path, &surface);
  if (st < 0) return st;
  st = batten_surface_measure(run->ctx, surface, &m);
  if (st >= 0) st = batten_surface_certify_convex(run->ctx, surface, NULL, &c);
  if (st >= 0) st = surface_prove_sections(run->ctx, surface, &plane, &sections);
  if (st >= 0) {
    batten_surface_form form = batten_surface_get(surface);
    cli_run_clear(run);
    cli_report_count(r, "dimension", 3);
    surface_report_form(&form, r);
    surface_report_convexity(&c, r);
    surface_report_sections(plane, &sections, r);
    surface_report_measures(&m, r);
    if (print) {
      surface_print_form(&form);
      cli_line("domain", "u %.6g .. %.6g, v %.6g .. %.6g", form.knots[0][0], form.knots[0][form.knot_count[0] - 1],
               form.knots[1][0], form.knots[1][form.knot_count[1] - 1]);
      surface_print_measures(&m);
      surface_print_convexity(&c);
      if (plane) surface_print_sections(&sections);
    }
  }
  batten_surface_free(surface);
  return st;
}

static batten_status tell_curves(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_curves c = {0};
  batten_status st = batten_read_curves(run->ctx, path, &c);
  if (st < 0) return st;
  const batten_curve *const *curves = (const batten_curve *const *)c.curves;
  batten_curve_measures *m = malloc(c.count * sizeof *m);
  if (!m) st = batten_fail(run->ctx, BATTEN_E_NOMEM, "%s: out of memory", path);
  for (size_t i = 0; st >= 0 && i < c.count; i++) st = batten_curve_measure(run->ctx, curves[i], &m[i]);
  if (st >= 0) {
    cli_run_clear(run);
    cli_report_count(r, "dimension", 2);
    cli_report_bool(r, "planes", c.planes != NULL);
    curves_report_form(c.count, curves, r);
    curves_report_measures(c.count, m, r);
    if (print) {
      curves_print_form(c.count, curves);
      curves_print_measures(c.count, m);
    }
  }
  free(m);
  batten_curves_free(run->ctx, &c);
  return st;
}

/* The engine that would be taken, and what it would need. */
static batten_status tell_qp(cli_run *run, const char *path, bool print, cli_report *r) {
  batten_qp_file file = {0};
  batten_qp_engine engine = BATTEN_QP_AUTO;
  qp_counts c;
  size_t bytes = 0;
  batten_status st = batten_read_qp(run->ctx, path, &file);
  if (st < 0) return st;
  qp_count(&file.problem, &c);
  st = batten_qp_bytes(run->ctx, &file.problem, NULL, &bytes, &engine);
  if (st >= 0) {
    cli_run_clear(run);
    qp_report_counts(&c, &file, r);
    cli_report_text(r, "engine", qp_engine_name(engine));
    cli_report_count(r, "bytes_predicted", bytes);
    if (print) {
      qp_print_counts(&c, &file);
      qp_print_ranges(&c);
      cli_line("engine", "%s would be taken, with %.3g MB at most", qp_engine_name(engine), (double)bytes / 1e6);
    }
  }
  batten_qp_file_free(run->ctx, &file);
  return st;
}

/* All options are those that commands share. */
static bool no_option(cli_request *q, int key, const char *value) {
  (void)q, (void)key, (void)value;
  return false;
}

static int work(cli_request *q) {
  static const char *const kinds[] = {"unknown", "points",  "mesh",   "solid",    "carrier",  "quadratic program",
                                      "network", "surface", "curves", "document", "sections", "frep"};
  cli_run run;
  if (!cli_run_open(&run, q->threads, 0, q->quiet)) return CLI_FAILED;
  run.input = q->input;
  run.outputs = &q->outputs;
  cli_report report;
  cli_report_open(&report);
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  batten_status st = batten_file_identify(run.ctx, q->input, &kind);
  bool print = !q->quiet && !cli_outputs_to_stdout(&q->outputs);
  if (st >= 0) {
    cli_report_text(&report, "command", "inspect");
    cli_report_common(&report, &run, st);
    cli_report_text(&report, "input", q->input);
    cli_report_text(&report, "kind", kinds[kind]);
    if (print) cli_line("file", "%s: %s", q->input, kinds[kind]);
    switch (kind) {
      case BATTEN_FILE_POINTS:
        st = tell_points(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_MESH:
        st = tell_mesh(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_SOLID:
        st = inspect_solid(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_CARRIER:
        st = inspect_carrier(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_QP:
        st = tell_qp(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_NETWORK:
        st = tell_network(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_SURFACE:
        st = tell_surface(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_CURVES:
        st = tell_curves(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_SECTIONS:
        st = inspect_sections(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_FREP:
        st = inspect_frep(&run, q->input, print, &report);
        break;
      case BATTEN_FILE_DOCUMENT:
        break;
      case BATTEN_FILE_UNKNOWN:
        st = batten_fail(run.ctx, BATTEN_E_FORMAT,
                         "%s: neither points, a mesh, a quadratic program nor a document of batten", q->input);
    }
  }
  cli_report_number(&report, "time_total_s", batten_now() - run.started);
  cli_report_count(&report, "peak_bytes", batten_bytes_peak(run.ctx));
  int status = st < 0 ? cli_run_failed(&run, st) : CLI_DONE;
  if (status == CLI_DONE && !cli_report_write(&report, &q->outputs)) status = CLI_FAILED;
  if (status == CLI_DONE && !cli_outputs_commit(&q->outputs)) status = CLI_FAILED;
  cli_report_close(&report);
  cli_run_close(&run);
  return status;
}

int cli_inspect(int argc, char **argv) {
  static const cli_command command = {"inspect", "file", table, print_help, no_option, work};
  cli_request q = {0};
  return cli_command_run(&command, &q, argc, argv);
}
