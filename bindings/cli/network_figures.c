/* Figures of `batten network`: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdio.h>

#include "network.h"

const char *network_fill_name(batten_network_fill fill) {
  static const char *const names[] = {"auto",   "fair",    "fair-linear", "ss", "ss-classic",
                                      "peters", "degree7", "degree6",     "pn"};
  return (size_t)fill < sizeof names / sizeof *names ? names[fill] : "unknown";
}

/* ---- report -------------------------------------------------------------------------------------- */

static void report_joints(cli_report *r, const char *const keys[5], const batten_joint_figures *j) {
  bool any = j->samples > 0;
  cli_report_number(r, keys[0], any ? j->normal_max_deg : NAN);
  cli_report_number(r, keys[1], any ? j->normal_rms_deg : NAN);
  cli_report_number(r, keys[2], any ? j->normal_p99_deg : NAN);
  cli_report_number(r, keys[3], any ? j->curvature_jump_max : NAN);
  cli_report_number(r, keys[4], any ? j->curvature_jump_rms : NAN);
}

void network_report_measures(const batten_network_measures *m, const batten_network_continuity *c, cli_report *r) {
  static const char *const smooth[] = {"normal_jump_max_deg", "normal_jump_rms_deg", "normal_jump_p99_deg",
                                       "curvature_jump_max", "curvature_jump_rms"};
  static const char *const inner[] = {"inner_jump_max_deg", "inner_jump_rms_deg", "inner_jump_p99_deg",
                                      "inner_curvature_jump_max", "inner_curvature_jump_rms"};
  static const char *const crease[] = {"crease_jump_max_deg", "crease_jump_rms_deg", "crease_jump_p99_deg",
                                       "crease_curvature_jump_max", "crease_curvature_jump_rms"};
  cli_report_count(r, "boundary_edges", m->boundary_edges);
  cli_report_count(r, "components", m->components);
  cli_report_bool(r, "closed", m->closed != 0);
  cli_report_integer(r, "euler", m->euler);
  cli_report_integer(r, "genus", m->genus);
  report_joints(r, smooth, &c->smooth);
  report_joints(r, inner, &c->inner);
  report_joints(r, crease, &c->crease);
  cli_report_number(r, "gap_max", fmax(fmax(c->smooth.gap_max, c->inner.gap_max), c->crease.gap_max));
  cli_report_number(r, "corner_gap_max", c->corner_gap_max);
  cli_report_number(r, "K_min", m->gauss_min);
  cli_report_number(r, "K_max", m->gauss_max);
  cli_report_number(r, "K_p1", m->gauss_p01);
  cli_report_number(r, "K_p2", m->gauss_p02);
  cli_report_number(r, "K_p50", m->gauss_p50);
  cli_report_number(r, "K_p98", m->gauss_p98);
  cli_report_number(r, "K_p99", m->gauss_p99);
  cli_report_number(r, "H_min", m->mean_min);
  cli_report_number(r, "H_max", m->mean_max);
  cli_report_number(r, "K_integral", m->gauss_integral);
  cli_report_number(r, "fairness", m->fairness);
  cli_report_number(r, "regularity_min", m->regularity_min);
  cli_report_count(r, "irregular_patches", m->irregular_patches);
  cli_report_number(r, "area", m->area);
  cli_report_number(r, "volume", m->volume);
  cli_report_centroid(r, m->centroid);
  cli_report_box(r, 3, m->lower, m->upper);
}

static void report_prepared(const network_work *w, cli_report *r) {
  const network_prepared *p = &w->prepared;
  cli_report_count(r, "faces_read", p->faces_read);
  cli_report_count(r, "welded_vertices", p->repair.welded_vertices);
  cli_report_count(r, "split_vertices", p->repair.split_vertices);
  cli_report_count(r, "removed_vertices", p->repair.removed_vertices);
  cli_report_count(r, "removed_triangles", p->repair.removed_triangles);
  cli_report_count(r, "swapped_edges", p->repair.swapped_edges);
  cli_report_count(r, "turned_triangles", p->repair.turned_triangles);
  cli_report_number(r, "smooth_lambda", p->smooth_lambda);
  cli_report_number(r, "decimate_distance", p->decimate_distance);
}

void network_report(const network_work *w, cli_report *r) {
  const batten_network_info *i = &w->info;
  cli_report_text(r, "command", "network");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "input", w->request->common.input);
  report_prepared(w, r);
  cli_report_text(r, "fill", network_fill_name(i->fill));
  cli_report_text(r, "continuity", i->continuity == 1 ? "G1" : "G2");
  cli_report_count(r, "vertices", i->vertices);
  cli_report_count(r, "edges", i->edges);
  cli_report_count(r, "faces", i->faces);
  cli_report_count(r, "patches", i->patches);
  cli_report_count(r, "crease_edges", i->crease_edges);
  cli_report_count(r, "line_edges", i->line_edges);
  cli_report_count(r, "nodes", i->nodes);
  cli_report_count(r, "unknowns", i->unknowns);
  cli_report_count(r, "normal_passes", i->normal_passes);
  cli_report_number(r, "normal_change_rad", i->normal_change_rad);
  cli_report_count(r, "cg_iterations", i->cg_iterations);
  cli_report_number(r, "residual", i->residual);
  cli_report_count(r, "fallback_faces", i->fallback_faces);
  cli_report_count(r, "clamped_faces", i->clamped_faces);
  cli_report_count(r, "irregular_faces", i->irregular_faces);
  cli_report_count(r, "fairing_passes", i->fairing_passes);
  cli_report_number(r, "energy_start", i->energy_start);
  cli_report_number(r, "energy", i->energy);
  network_report_measures(&w->measures, &w->continuity, r);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_prepare_s", w->time_prepare_s);
  cli_report_number(r, "time_topology_s", i->time_topology_s);
  cli_report_number(r, "time_normals_s", i->time_normals_s);
  cli_report_number(r, "time_network_s", i->time_network_s);
  cli_report_number(r, "time_fill_s", i->time_fill_s);
  cli_report_number(r, "time_check_s", i->time_check_s);
  cli_report_number(r, "time_measure_s", w->time_measure_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

/* ---- summary ------------------------------------------------------------------------------------- */

void network_print_measures(const batten_network_measures *m, const batten_network_continuity *c) {
  cli_line("topology", "%zu component%s, %s, Euler number %ld", m->components, m->components == 1 ? "" : "s",
           m->closed ? "closed" : "open", m->euler);
  double gap = fmax(fmax(fmax(c->smooth.gap_max, c->inner.gap_max), c->crease.gap_max), c->corner_gap_max);
  if (c->smooth.samples || c->inner.samples)
    cli_line("joints", "normals differ by %.1e degrees at most (rms %.1e), sides by %.1e",
             fmax(c->smooth.normal_max_deg, c->inner.samples ? c->inner.normal_max_deg : 0), c->smooth.normal_rms_deg,
             gap);
  else
    cli_line("joints", "none is smooth, sides differ by %.1e", gap);
  if (c->crease.edges)
    cli_line("creases", "%zu edges of up to %.1f degrees", c->crease.edges, c->crease.normal_max_deg);
  cli_line("curvature", "Gaussian %.4g .. %.4g, 2 %% to 98 %% of the area %.4g .. %.4g; jumps by %.3g at most",
           m->gauss_min, m->gauss_max, m->gauss_p02, m->gauss_p98, c->smooth.curvature_jump_max);
  cli_line("regular", m->irregular_patches ? "not proven on %zu patches" : "proven on all patches",
           m->irregular_patches);
  cli_line("area", "%.9g", m->area);
  if (m->closed) cli_line("volume", "%.9g", m->volume);
}

void network_summary(const network_work *w) {
  const batten_network_info *i = &w->info;
  const network_prepared *p = &w->prepared;
  cli_line("mesh", "%zu vertices, %zu edges, %zu triangles", i->vertices, i->edges, i->faces);
  if (p->repair.welded_vertices || p->repair.turned_triangles || p->repair.removed_triangles)
    cli_line("repaired", "%zu vertices welded, %zu triangles turned, %zu dropped", p->repair.welded_vertices,
             p->repair.turned_triangles, p->repair.removed_triangles);
  if (isfinite(p->decimate_distance))
    cli_line("decimated", "from %zu triangles, quadric distance %.3g", p->faces_read, p->decimate_distance);
  cli_line("surface", "%zu patches, fill %s%s", i->patches, network_fill_name(i->fill),
           i->fallback_faces ? ", some facets split" : "");
  if (i->normal_passes) cli_line("normals", "%u passes, last turn %.1e", i->normal_passes, i->normal_change_rad);
  if (i->fairing_passes)
    cli_line("fairing", "%u passes, energy %.4g to %.4g", i->fairing_passes, i->energy_start, i->energy);
  network_print_measures(&w->measures, &w->continuity);
  cli_line("time", "%.2f s: normals %.2f, network %.2f, fill %.2f, check and measures %.2f, files %.2f",
           batten_now() - w->run.started, i->time_normals_s, i->time_network_s, i->time_fill_s,
           i->time_check_s + w->time_measure_s, w->time_read_s + w->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(w->run.ctx) / 1e6);
  for (size_t k = 0; k < w->request->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", w->request->common.outputs.items[k].path);
}
