/* Triangle meshes: storage, named fields, vertex normals. See <batten/mesh.h>. */
#include "mesh_inner.h"

#include "base/checked.h"
#include "vec.h"

#include <stdbool.h>
#include <string.h>

enum { FIELD_COMPONENTS_MAX = 9 }; /* a 3 x 3 tensor */

void batten_mesh_free(batten_mesh *mesh) {
  if (!mesh) return;
  batten_context *ctx = mesh->ctx;
  for (size_t i = 0; i < mesh->field_count; i++) batten_free(ctx, mesh->fields[i].values);
  batten_free(ctx, mesh->fields);
  batten_free(ctx, mesh->vertices);
  batten_free(ctx, mesh->triangles);
  batten_free(ctx, mesh);
}

batten_status batten_mesh_check_arrays(batten_context *ctx, size_t vertex_count, const double *vertices,
                                       size_t triangle_count, const uint32_t *triangles) {
  if (vertex_count > UINT32_MAX - 1)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "vertex_count: %zu; at most %zu", vertex_count,
                       (size_t)UINT32_MAX - 1);
  if (triangle_count > (UINT32_MAX - 1) / 3)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "triangle_count: %zu; at most %zu", triangle_count,
                       (size_t)(UINT32_MAX - 1) / 3);
  if (vertex_count && !vertices) return batten_fail(ctx, BATTEN_E_INVALID, "vertices: NULL; give %zu", vertex_count);
  if (triangle_count && !triangles)
    return batten_fail(ctx, BATTEN_E_INVALID, "triangles: NULL; give %zu", triangle_count);
  size_t bad = batten_first_nonfinite(3 * vertex_count, vertices);
  if (bad < 3 * vertex_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "vertices[%zu][%zu]: %g; remove the vertex or give finite coordinates",
                       bad / 3, bad % 3, vertices[bad]);
  for (size_t h = 0; h < 3 * triangle_count; h++)
    if (triangles[h] >= vertex_count)
      return batten_fail(ctx, BATTEN_E_INVALID, "triangles[%zu][%zu]: index %lu, but there are %zu vertices", h / 3,
                         h % 3, (unsigned long)triangles[h], vertex_count);
  return BATTEN_OK;
}

batten_status batten_mesh_create(batten_context *ctx, size_t vertex_count, const double *vertices,
                                 size_t triangle_count, const uint32_t *triangles, batten_mesh **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  batten_status st = batten_mesh_check_arrays(ctx, vertex_count, vertices, triangle_count, triangles);
  if (st < 0) return st;
  batten_mesh *mesh = batten_alloc(ctx, sizeof *mesh);
  if (!mesh) return BATTEN_E_NOMEM;
  *mesh = (batten_mesh){.ctx = ctx, .vertex_count = vertex_count, .triangle_count = triangle_count};
  mesh->vertices = batten_alloc_array(ctx, vertex_count, 3 * sizeof *mesh->vertices);
  mesh->triangles = mesh->vertices ? batten_alloc_array(ctx, triangle_count, 3 * sizeof *mesh->triangles) : NULL;
  if (!mesh->triangles) {
    batten_mesh_free(mesh);
    return BATTEN_E_NOMEM;
  }
  if (vertex_count) memcpy(mesh->vertices, vertices, vertex_count * 3 * sizeof *vertices);
  if (triangle_count) memcpy(mesh->triangles, triangles, triangle_count * 3 * sizeof *triangles);
  *out = mesh;
  return BATTEN_OK;
}

size_t batten_mesh_vertex_count(const batten_mesh *mesh) { return mesh->vertex_count; }
size_t batten_mesh_triangle_count(const batten_mesh *mesh) { return mesh->triangle_count; }
const double *batten_mesh_vertices(const batten_mesh *mesh) { return mesh->vertices; }
const uint32_t *batten_mesh_triangles(const batten_mesh *mesh) { return mesh->triangles; }

/* ---- named fields ------------------------------------------------------------------------------- */

batten_status batten_mesh_set_field(batten_context *ctx, batten_mesh *mesh, const char *name, size_t components,
                                    const double *values) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh) return batten_fail(ctx, BATTEN_E_INVALID, "mesh: NULL; give a mesh");
  if (!name || !*name) return batten_fail(ctx, BATTEN_E_INVALID, "name: empty; give the field a name");
  if (components < 1 || components > FIELD_COMPONENTS_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "components: %zu; give 1 to %d", components, FIELD_COMPONENTS_MAX);
  if (!values && mesh->vertex_count)
    return batten_fail(ctx, BATTEN_E_INVALID, "values: NULL; give %zu for each of %zu vertices", components,
                       mesh->vertex_count);
  size_t count = mesh->vertex_count * components, length = strlen(name) + 1, bytes; /* count < 2^36 */
  if (!batten_add(count * sizeof *values, length, &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "name: %zu characters", length);
  double *block = batten_alloc(mesh->ctx, bytes);
  if (!block) return BATTEN_E_NOMEM;
  if (count) memcpy(block, values, count * sizeof *values);
  char *copy = (char *)(block + count);
  memcpy(copy, name, length);

  size_t at = 0;
  while (at < mesh->field_count && strcmp(mesh->fields[at].name, name) != 0) at++;
  if (at == mesh->field_count) {
    mesh_field *grown = batten_realloc_array(mesh->ctx, mesh->fields, mesh->field_count + 1, sizeof *grown);
    if (!grown) {
      batten_free(mesh->ctx, block);
      return BATTEN_E_NOMEM;
    }
    mesh->fields = grown;
    mesh->field_count++;
  } else {
    batten_free(mesh->ctx, mesh->fields[at].values);
  }
  mesh->fields[at] = (mesh_field){components, block, copy};
  return BATTEN_OK;
}

size_t batten_mesh_field_count(const batten_mesh *mesh) { return mesh->field_count; }

const double *batten_mesh_field(const batten_mesh *mesh, size_t index, const char **name, size_t *components) {
  if (index >= mesh->field_count) return NULL;
  if (name) *name = mesh->fields[index].name;
  if (components) *components = mesh->fields[index].components;
  return mesh->fields[index].values;
}

/* ---- vertex normals ----------------------------------------------------------------------------- */

enum { NORMALS_TASK = 2048, NORMALS_BLOCK = 32 * NORMALS_TASK }; /* triangles; those held at a time: 3 MB */

typedef struct normals_work {
  const batten_mesh *mesh;
  size_t first, end;   /* of the block */
  double (*facets)[6]; /* its triangles' unit normals, 0 without area, and angles */
} normals_work;

static void facet_of(const double *const *p, double *n, double *angles) {
  double sides[2][3];
  vec_sub(p[1], p[0], sides[0]);
  vec_sub(p[2], p[0], sides[1]);
  /* Unit sides first: their product neither over- nor underflows. */
  bool turned = vec_normalize(sides[0]) && vec_normalize(sides[1]);
  vec_cross(sides[0], sides[1], n);
  if (!turned || !vec_normalize(n)) n[0] = n[1] = n[2] = 0;
  for (int k = 0; k < 3; k++) angles[k] = vec_angle(p[k], p[(k + 1) % 3], p[(k + 2) % 3]);
}

static void facets_task(void *arg, size_t task) {
  const normals_work *w = arg;
  size_t first = w->first + task * NORMALS_TASK;
  size_t end = first + NORMALS_TASK < w->end ? first + NORMALS_TASK : w->end;
  for (size_t t = first; t < end; t++) {
    const double *p[3];
    for (size_t k = 0; k < 3; k++) p[k] = w->mesh->vertices + 3 * (size_t)w->mesh->triangles[3 * t + k];
    facet_of(p, w->facets[t - w->first], w->facets[t - w->first] + 3);
  }
}

batten_status batten_mesh_vertex_normals(batten_context *ctx, const batten_mesh *mesh, double *normals) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh || (!normals && mesh->vertex_count))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and room for its normals",
                       mesh ? "normals" : "mesh");
  normals_work w = {.mesh = mesh};
  const size_t triangles = mesh->triangle_count, room = triangles < NORMALS_BLOCK ? triangles : NORMALS_BLOCK;
  w.facets = batten_alloc_array(ctx, room, sizeof *w.facets);
  if (!w.facets) return BATTEN_E_NOMEM;
  if (mesh->vertex_count) memset(normals, 0, mesh->vertex_count * 3 * sizeof *normals);
  for (; w.first < triangles; w.first = w.end) {
    w.end = triangles - w.first < NORMALS_BLOCK ? triangles : w.first + NORMALS_BLOCK;
    batten_parallel(ctx, (w.end - w.first + NORMALS_TASK - 1) / NORMALS_TASK, facets_task, &w);
    for (size_t t = w.first; t < w.end; t++) { /* one after the other: the sums depend on no threads */
      const double *facet = w.facets[t - w.first];
      for (size_t k = 0; k < 3; k++) {
        double *n = normals + 3 * (size_t)mesh->triangles[3 * t + k];
        for (size_t d = 0; d < 3; d++) n[d] += facet[3 + k] * facet[d];
      }
    }
  }
  for (size_t i = 0; i < mesh->vertex_count; i++) vec_normalize(normals + 3 * i);
  batten_free(ctx, w.facets);
  return BATTEN_OK;
}
