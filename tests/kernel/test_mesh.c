/* Mesh storage, named fields, vertex normals. */
#include <batten/mesh.h>

#include "mesh_shapes.h"
#include "tap.h"

static void test_create(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, 4, tetra_vertices, 4, tetra_triangles, &mesh), ctx);
  T_CHECK(batten_mesh_vertex_count(mesh) == 4 && batten_mesh_triangle_count(mesh) == 4, "sizes");
  T_CHECK(batten_mesh_vertices(mesh) != tetra_vertices &&
              !memcmp(batten_mesh_vertices(mesh), tetra_vertices, sizeof tetra_vertices) &&
              !memcmp(batten_mesh_triangles(mesh), tetra_triangles, sizeof tetra_triangles),
          "copied");
  batten_mesh_free(mesh);
  batten_mesh_free(NULL);
  mesh = NULL;
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &mesh), ctx);
  T_CHECK(batten_mesh_vertex_count(mesh) == 0 && batten_mesh_triangle_count(mesh) == 0, "empty mesh");
  T_OK(batten_mesh_vertex_normals(ctx, mesh, NULL), ctx);
  T_OK(batten_mesh_set_field(ctx, mesh, "nothing", 2, NULL), ctx);
  batten_mesh_free(mesh);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");

  mesh = NULL;
  double bad[12];
  memcpy(bad, tetra_vertices, sizeof bad);
  bad[7] = NAN;
  uint32_t worse[12];
  memcpy(worse, tetra_triangles, sizeof worse);
  worse[5] = 4;
  T_CHECK(batten_mesh_create(NULL, 0, NULL, 0, NULL, &mesh) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_mesh_create(ctx, 0, NULL, 0, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_mesh_create(ctx, 4, NULL, 0, NULL, &mesh), BATTEN_E_INVALID, ctx, "vertices: NULL; give 4");
  T_STATUS(batten_mesh_create(ctx, 4, tetra_vertices, 4, NULL, &mesh), BATTEN_E_INVALID, ctx, "triangles: NULL");
  T_STATUS(batten_mesh_create(ctx, 4, bad, 4, tetra_triangles, &mesh), BATTEN_E_INVALID, ctx, "vertices[2][1]: nan");
  T_STATUS(batten_mesh_create(ctx, 4, tetra_vertices, 4, worse, &mesh), BATTEN_E_INVALID, ctx,
           "triangles[1][2]: index 4, but there are 4 vertices");
  T_STATUS(batten_mesh_create(ctx, (size_t)1 << 33, tetra_vertices, 4, tetra_triangles, &mesh), BATTEN_E_TOO_LARGE,
           ctx, "vertex_count");
  T_STATUS(batten_mesh_create(ctx, 4, tetra_vertices, (size_t)1 << 31, tetra_triangles, &mesh), BATTEN_E_TOO_LARGE,
           ctx, "triangle_count");
  T_CHECK(!mesh && batten_bytes_in_use(ctx) == 0, "failures leave the result alone");
  batten_context_free(ctx);
}

static void test_fields(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_mesh *mesh = NULL;
  batten_mesh_create(ctx, 4, tetra_vertices, 4, tetra_triangles, &mesh);
  T_CHECK(batten_mesh_field_count(mesh) == 0 && !batten_mesh_field(mesh, 0, NULL, NULL), "no field at first");
  double a[4] = {1, 2, 3, 4}, b[12] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  const char *name = NULL;
  size_t components = 0;
  T_OK(batten_mesh_set_field(ctx, mesh, "curvature", 1, a), ctx);
  T_OK(batten_mesh_set_field(ctx, mesh, "gradient", 3, b), ctx);
  const double *got = batten_mesh_field(mesh, 1, &name, &components);
  T_CHECK(
      batten_mesh_field_count(mesh) == 2 && !strcmp(name, "gradient") && components == 3 && !memcmp(got, b, sizeof b),
      "second field read back");
  T_OK(batten_mesh_set_field(ctx, mesh, "curvature", 3, b), ctx);
  got = batten_mesh_field(mesh, 0, &name, &components);
  T_CHECK(batten_mesh_field_count(mesh) == 2 && !strcmp(name, "curvature") && components == 3 && got[11] == 11,
          "a field of the same name is replaced");
  T_STATUS(batten_mesh_set_field(ctx, mesh, "", 1, a), BATTEN_E_INVALID, ctx, "name: empty");
  T_STATUS(batten_mesh_set_field(ctx, mesh, "a", 0, a), BATTEN_E_INVALID, ctx, "components: 0; give 1 to 9");
  T_STATUS(batten_mesh_set_field(ctx, mesh, "a", 10, a), BATTEN_E_INVALID, ctx, "components: 10");
  T_STATUS(batten_mesh_set_field(ctx, mesh, "a", 1, NULL), BATTEN_E_INVALID, ctx, "values: NULL");
  T_STATUS(batten_mesh_set_field(ctx, NULL, "a", 1, a), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_vertex_normals(ctx, mesh, NULL), BATTEN_E_INVALID, ctx, "normals: NULL");
  T_STATUS(batten_mesh_vertex_normals(ctx, NULL, a), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_CHECK(batten_mesh_field_count(mesh) == 2, "failures leave the mesh alone");
  batten_mesh_free(mesh);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
}

/* A cube's corner sees three faces under 90 degrees each, however they are split: (1, 1, 1) / sqrt 3. */
static void test_normals(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (int exponent = -600; exponent <= 600; exponent += 600) {
    double vertices[27], normals[27], worst = 0;
    for (int i = 0; i < 24; i++) vertices[i] = ldexp(cube_vertices[i], exponent);
    vertices[24] = vertices[25] = vertices[26] = 0;
    batten_mesh *mesh = NULL;
    batten_mesh_create(ctx, 9, vertices, 12, cube_triangles, &mesh);
    T_OK(batten_mesh_vertex_normals(ctx, mesh, normals), ctx);
    for (int i = 0; i < 24; i++) worst = fmax(worst, fabs(normals[i] - (cube_vertices[i] > 0 ? 1 : -1) / sqrt(3.0)));
    T_RATIO(worst, 8 * 0x1p-53, "corner normals of a cube of side 2^%d", exponent);
    T_CHECK(normals[24] == 0 && normals[25] == 0 && normals[26] == 0, "no normal at an unused vertex");
    batten_mesh_free(mesh);
  }
  double flat[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2}, normals[9];
  uint32_t triangles[6] = {0, 1, 2, 0, 0, 1};
  batten_mesh *mesh = NULL;
  batten_mesh_create(ctx, 3, flat, 2, triangles, &mesh);
  batten_mesh_vertex_normals(ctx, mesh, normals);
  bool zero = true;
  for (int i = 0; i < 9; i++) zero = zero && normals[i] == 0;
  T_CHECK(zero, "no normals where there is no area");
  batten_mesh_free(mesh);
  batten_context_free(ctx);
}

static batten_status make_mesh(batten_context *ctx, void *arg) {
  double values[8] = {0};
  batten_mesh *mesh = NULL;
  (void)arg;
  batten_status st = batten_mesh_create(ctx, 8, cube_vertices, 12, cube_triangles, &mesh);
  if (st == BATTEN_OK) st = batten_mesh_set_field(ctx, mesh, "a", 1, values);
  if (st == BATTEN_OK) st = batten_mesh_set_field(ctx, mesh, "b", 1, values);
  if (st == BATTEN_OK) st = batten_mesh_set_field(ctx, mesh, "a", 1, values);
  batten_mesh_free(mesh);
  return st;
}

int main(void) {
  test_create();
  test_fields();
  test_normals();
  t_fail_every_allocation("mesh creation", make_mesh, NULL);
  return t_done();
}
