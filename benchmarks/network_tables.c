/* Surfaces through meshes, by each way of making them: how far their Gaussian curvature is from that of the surface
 * which the vertices were taken from, in Markdown; then the scenes of the paper, method beside method.
 *
 * K is measured on a grid of 15 rows on each patch, with edges and corners. Times are those of one thread, without
 * the check of the joints. */
#include "network_tables.h"

#include <stdio.h>

static int failures, stars;

/* A star: not all facets are proven to have a normal everywhere. */
static void print_range(batten_context *ctx, const table_figures *f) {
  if (f->status < 0) {
    printf(" %s |", batten_status_name(f->status));
    fprintf(stderr, "%s\n", batten_error(ctx));
    failures++;
  } else {
    double lower = f->measures.gauss_min, upper = f->measures.gauss_max;
    bool star = f->info.irregular_faces > 0;
    stars += star;
    /* what is nothing but rounding reads as 0 */
    printf(" %.4g, %.4g%s |", fabs(lower) < 1e-12 ? 0 : lower, fabs(upper) < 1e-12 ? 0 : upper, star ? " *" : "");
  }
  fflush(stdout);
}

static void print_exact(const table_mesh *row) {
  printf("| %s |", row->name);
  if (isnan(row->exact[0]))
    printf(" |");
  else if (row->exact[0] == row->exact[1])
    printf(" %g |", row->exact[0]);
  else
    printf(" %g, %g |", row->exact[0], row->exact[1]);
}

static void print_tables(batten_context *ctx) {
  static table_figures f[TABLE_MESHES][TABLE_WAYS];
  printf("\n| mesh | K of the surface |");
  for (int w = 0; w < TABLE_WAYS; w++) printf(" %s |", table_way_names[w]);
  printf("\n|---|---|");
  for (int w = 0; w < TABLE_WAYS; w++) printf("---|");
  printf("\n");
  for (size_t i = 0; i < TABLE_MESHES; i++) {
    scene_mesh scene = table_meshes[i].make();
    print_exact(&table_meshes[i]);
    for (int w = 0; w < TABLE_WAYS; w++) {
      batten_network_options o = table_options((table_way)w);
      f[i][w] = table_build(ctx, &scene, &o);
      print_range(ctx, &f[i][w]);
    }
    printf("\n");
    scene_mesh_free(&scene);
  }
  printf(
      "\n| mesh | fair: K, 2 .. 98 %% | passes | time, ms | G2 MNN: time, ms | normal jump, degrees: PN | Peters | "
      "largest of the others |\n|---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < TABLE_MESHES; i++) {
    double exact_jump = 0;
    for (int w = 0; w < TABLE_WAYS; w++)
      if (w != TABLE_PN && w != TABLE_PETERS) exact_jump = fmax(exact_jump, f[i][w].info.normal_jump_max_deg);
    printf("| %s | %.3f, %.3f | %u | %.1f | %.1f | %.2g | %.1e | %.1e |\n", table_meshes[i].name,
           f[i][TABLE_FAIR].measures.gauss_p02, f[i][TABLE_FAIR].measures.gauss_p98,
           f[i][TABLE_FAIR].info.fairing_passes, 1e3 * f[i][TABLE_FAIR].time_s, 1e3 * f[i][TABLE_G2_WEIGHTED].time_s,
           f[i][TABLE_PN].info.normal_jump_max_deg, f[i][TABLE_PETERS].info.normal_jump_max_deg, exact_jump);
  }
}

/* ---- the paper's scenes ----------------------------------------------------------------------------- */

static scene_mesh boundary_problem(void) { return scene_mesh_ears(5); }

static void print_scenes(batten_context *ctx) {
  static const struct {
    const char *name;
    scene_mesh (*make)(void);
  } scenes[] = {{"shifted octahedron (figure 4)", table_shifted},
                {"boundary problem (figure 5)", boundary_problem},
                {"panel (figure 6)", scene_mesh_panel},
                {"valve with its curves as lines (figure 7)", scene_mesh_valve}};
  static const table_way ways[] = {TABLE_PLAIN,       TABLE_G1,          TABLE_G1_WEIGHTED, TABLE_G2,
                                   TABLE_G2_WEIGHTED, TABLE_FAIR_LINEAR, TABLE_FAIR};
  for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
    scene_mesh scene = scenes[s].make();
    printf("\n%s: %zu vertices, %zu triangles\n\n", scenes[s].name, scene.vertices, scene.triangles);
    printf(
        "| way | K | K, 2 .. 98 %% | integral of \\|grad II\\|^2 | normal jump, degrees | facets in three | time, ms "
        "|\n|---|---|---|---|---|---|---|\n");
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
      batten_network_options o = table_options(ways[w]);
      o.line_count = scene.lines;
      o.line_starts = scene.line_starts;
      o.line_vertices = scene.line_vertices;
      table_figures f = table_build(ctx, &scene, &o);
      printf("| %s |", table_way_names[ways[w]]);
      print_range(ctx, &f);
      printf(" %.3g, %.3g | %.3g | %.1e | %zu | %.1f |\n", f.measures.gauss_p02, f.measures.gauss_p98,
             f.measures.fairness, f.info.normal_jump_max_deg, f.info.fallback_faces, 1e3 * f.time_s);
    }
    scene_mesh_free(&scene);
  }
}

int main(void) {
  batten_context_options o = batten_context_options_default();
  batten_context *ctx = NULL;
  o.threads = 1;
  if (batten_context_new(&o, &ctx) < 0) return 1;
  printf("batten %s\n", batten_version());
  print_tables(ctx);
  print_scenes(ctx);
  if (stars) printf("\n`*`: not all facets are proven to have a normal everywhere.\n");
  batten_context_free(ctx);
  return failures != 0;
}
