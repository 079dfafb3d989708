/* Networks of every kind as STEP and IGES files, and on stdout the manifest that judge.cpp reads.
 *   files FOLDER */
#include <batten/exchange.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "exchange/networks.h"
#include "network_scenes.h"

typedef struct batch {
  batten_context *ctx;
  const char *folder;
  bool failed;
} batch;

static const char *const form_names[3] = {"trimmed", "quads", "degenerate"};

static bool done(batch *b, batten_status st, const char *what) {
  if (st >= 0) return true;
  fprintf(stderr, "%s: %s: %s\n", what, batten_status_name(st), batten_error(b->ctx));
  b->failed = true;
  return false;
}

/* What is known of a network beside itself. */
typedef struct known {
  const char *name;
  size_t solids;
  double volume; /* NaN: by quadrature */
  double angle;  /* between the normals of neighbours, degrees; NaN: there are kinks */
  bool large;    /* the default form in STEP alone: reading takes its time */
} known;

/* All forms in both formats. Lengths are millimetres there, which a unit of centimetres is ten of. */
static void write_files(batch *b, const batten_network *network, const known *k) {
  size_t patches = batten_network_patch_count(network);
  batten_network_measures m = {0};
  if (!done(b, batten_network_measure(b->ctx, network, &m), k->name)) return;
  for (int form = 0; form < (k->large ? 1 : 3); form++)
    for (int iges = 0; iges < (k->large ? 1 : 2); iges++) {
      char path[600];
      batten_write_network_options o = batten_write_network_options_default();
      o.form = (batten_cad_form)form;
      o.schema = form == 1 ? BATTEN_STEP_AP242 : BATTEN_STEP_AP214;
      o.unit = form == 2 ? BATTEN_UNIT_CM : BATTEN_UNIT_MM;
      snprintf(path, sizeof path, "%s/%s-%s.%s", b->folder, k->name, form_names[form], iges ? "igs" : "step");
      if (!done(b, batten_write_network(b->ctx, network, &o, path), path)) return;
      double scale = form == 2 ? 10 : 1, volume = isnan(k->volume) ? m.volume : k->volume;
      printf("%s %zu %zu %.17g %.17g %.17g\n", path, (form == 1 ? 3 : 1) * patches, iges ? 0 : k->solids,
             k->solids == 0 ? NAN : scale * scale * scale * volume, scale * scale * m.area, k->angle);
    }
}

/* ---- surfaces that are known ---------------------------------------------------------------------------- */

static void write_flat(batch *b) {
  batten_network *network = NULL;
  if (!done(b, network_of(b->ctx, map_flat, 4, tetrahedron, 4, tetrahedron_faces, 5, true, &network), "flat")) return;
  write_files(b, network, &(known){"tetrahedron", 1, 1, NAN, false});
  batten_network_free(network);
}

static void write_paraboloid(batch *b) {
  double vertices[3 * 25];
  uint32_t triangles[3 * 32];
  size_t faces = network_grid(4, vertices, triangles);
  batten_network *network = NULL;
  if (!done(b, network_of(b->ctx, map_paraboloid, 25, vertices, faces, triangles, 7, false, &network), "paraboloid"))
    return;
  write_files(b, network, &(known){"paraboloid", 0, NAN, 1e-9, false});
  batten_network_free(network);
}

/* A solid with two voids, one of them wrongly oriented, a solid in a void, and another one beside, inside out. */
static void write_nested(batch *b) {
  static const struct {
    double size, shift;
    bool turned;
  } parts[] = {{8, 0, false}, {2, -1, true}, {2, 1.5, false}, {0.5, -1, false}, {1, 40, true}};
  enum { PARTS = sizeof parts / sizeof parts[0] };
  double vertices[12 * PARTS], volume = 512 - 8 - 8 + 0.125 + 1;
  uint32_t triangles[12 * PARTS];
  for (size_t i = 0; i < PARTS; i++)
    for (size_t k = 0; k < 12; k++) {
      size_t c = k % 3;
      double centre = (tetrahedron[c] + tetrahedron[3 + c] + tetrahedron[6 + c] + tetrahedron[9 + c]) / 4;
      vertices[12 * i + k] = centre + parts[i].size * (tetrahedron[k] - centre) + (c == 0 ? parts[i].shift : 0);
      triangles[12 * i + k] = (uint32_t)(4 * i) + tetrahedron_faces[parts[i].turned ? k - c + 2 - c : k];
    }
  batten_network *network = NULL;
  if (!done(b, network_of(b->ctx, map_flat, 4 * PARTS, vertices, 4 * PARTS, triangles, 3, false, &network), "nested"))
    return;
  write_files(b, network, &(known){"nested", 3, volume, NAN, false});
  batten_network_free(network);
}

/* ---- surfaces that are made ------------------------------------------------------------------------------ */

static void write_built(batch *b, const char *name, scene_mesh scene, batten_network_fill fill, double crease_deg,
                        size_t solids) {
  batten_network_options o = batten_network_options_default();
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  o.fill = fill;
  o.crease_angle_deg = crease_deg;
  batten_status st = batten_mesh_create(b->ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh);
  if (st >= 0) st = batten_network_build(b->ctx, mesh, &o, &network, NULL);
  if (done(b, st, name))
    write_files(b, network,
                &(known){.name = name,
                         .solids = solids,
                         .volume = NAN,
                         .angle = fill == BATTEN_FILL_PN || crease_deg > 0 ? NAN : 1e-9,
                         .large = scene.triangles > 100});
  batten_network_free(network);
  batten_mesh_free(mesh);
  scene_mesh_free(&scene);
}

int main(int argc, char **argv) {
  batch b = {.folder = argc > 1 ? argv[1] : "."};
  if (batten_context_new(NULL, &b.ctx) < 0) return 1;
  write_flat(&b);
  write_paraboloid(&b);
  write_nested(&b);
  write_built(&b, "octahedron-fair", scene_mesh_octahedron_shifted(0.35, 0.2), BATTEN_FILL_FAIR, 0, 1);
  write_built(&b, "sphere-degree7", scene_mesh_sphere_irregular(), BATTEN_FILL_DEGREE7, 0, 1);
  write_built(&b, "torus-quartics", scene_mesh_torus_10_6(), BATTEN_FILL_SS, 0, 1);
  write_built(&b, "genus3-degree6", scene_mesh_genus3(), BATTEN_FILL_DEGREE6, 0, 1);
  write_built(&b, "graph-degree7", scene_mesh_graph_7(), BATTEN_FILL_DEGREE7, 0, 0);
  write_built(&b, "icosahedron-pn", scene_mesh_icosahedron(), BATTEN_FILL_PN, 0, 1);
  write_built(&b, "octahedron-quartics", scene_mesh_octahedron(), BATTEN_FILL_SS, 0, 1);
  write_built(&b, "cube-creases", scene_mesh_cube_26(), BATTEN_FILL_DEGREE7, 40, 1);
  batten_context_free(b.ctx);
  return b.failed;
}
