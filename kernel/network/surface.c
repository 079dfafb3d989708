/* The handle of a finished network: making it, and what can be asked of it without calculation. See surface.h. */
#include "surface.h"

#include "base/checked.h"
#include "mesh/mesh_inner.h"

#include <string.h>

void batten_network_free(batten_network *network) {
  if (!network) return;
  batten_context *ctx = network->ctx;
  batten_free(ctx, network->where);
  batten_free(ctx, network->degrees);
  batten_free(ctx, network->owner);
  batten_free(ctx, network->first);
  batten_free(ctx, network->spare);
  batten_free(ctx, network->points);
  batten_free(ctx, network->sharp);
  batten_free(ctx, network->twin);
  batten_free(ctx, network->creases);
  batten_free(ctx, network->triangles);
  batten_free(ctx, network->vertices);
  batten_free(ctx, network);
}

/* ---- adjacency ---------------------------------------------------------------------------------- */

static uint32_t lower_end(const uint32_t *triangles, uint32_t h) {
  uint32_t a = triangles[h], b = triangles[net_next(h)];
  return a < b ? a : b;
}
static uint32_t higher_end(const uint32_t *triangles, uint32_t h) {
  uint32_t a = triangles[h], b = triangles[net_next(h)];
  return a < b ? b : a;
}

/* order: half-edges by their ends, those of one edge together. */
static batten_status pair_half_edges(batten_context *ctx, size_t half_edges, const uint32_t *triangles,
                                     const uint32_t *order, uint32_t *twin) {
  for (size_t i = 0, n; i < half_edges; i += n) {
    uint32_t low = lower_end(triangles, order[i]), high = higher_end(triangles, order[i]);
    if (low == high)
      return batten_fail(ctx, BATTEN_E_INVALID, "triangles[%lu]: corner %lu twice; remove the triangle",
                         (unsigned long)(order[i] / 3), (unsigned long)low);
    n = 1;
    while (i + n < half_edges && lower_end(triangles, order[i + n]) == low &&
           higher_end(triangles, order[i + n]) == high)
      n++;
    if (n > 2)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "triangles[%lu], [%lu], [%lu]: share the edge %lu-%lu; an edge joins two at most",
                         (unsigned long)(order[i] / 3), (unsigned long)(order[i + 1] / 3),
                         (unsigned long)(order[i + 2] / 3), (unsigned long)low, (unsigned long)high);
    if (n == 2 && triangles[order[i]] == triangles[order[i + 1]])
      return batten_fail(
          ctx, BATTEN_E_INVALID, "triangles[%lu], [%lu]: pass the edge %lu-%lu the same way; turn one of them",
          (unsigned long)(order[i] / 3), (unsigned long)(order[i + 1] / 3), (unsigned long)low, (unsigned long)high);
    twin[order[i]] = n == 2 ? order[i + 1] : NET_NONE;
    if (n == 2) twin[order[i + 1]] = order[i];
  }
  return BATTEN_OK;
}

/* First place in order whose edge is not before (low, high). */
static size_t find_edge(size_t half_edges, const uint32_t *triangles, const uint32_t *order, uint32_t low,
                        uint32_t high) {
  size_t from = 0, to = half_edges;
  while (from < to) {
    size_t mid = from + (to - from) / 2;
    uint32_t a = lower_end(triangles, order[mid]), b = higher_end(triangles, order[mid]);
    if (a < low || (a == low && b < high))
      from = mid + 1;
    else
      to = mid;
  }
  return from;
}

static batten_status mark_creases(batten_context *ctx, batten_network *n, const uint32_t *order) {
  size_t half_edges = 3 * n->face_count;
  memset(n->sharp, 0, n->face_count);
  for (size_t c = 0; c < n->crease_count; c++) {
    uint32_t a = n->creases[2 * c], b = n->creases[2 * c + 1], low = a < b ? a : b, high = a < b ? b : a;
    size_t at = find_edge(half_edges, n->triangles, order, low, high);
    if (at == half_edges || lower_end(n->triangles, order[at]) != low || higher_end(n->triangles, order[at]) != high)
      return batten_fail(ctx, BATTEN_E_INVALID, "creases[%zu]: %lu-%lu is no edge of a triangle; remove it", c,
                         (unsigned long)a, (unsigned long)b);
    uint32_t h = order[at], twin = n->twin[h];
    n->sharp[h / 3] |= (unsigned char)(1u << h % 3);
    if (twin != NET_NONE) n->sharp[twin / 3] |= (unsigned char)(1u << twin % 3);
  }
  return BATTEN_OK;
}

/* Order is needed for finding twins and creases only. */
static batten_status find_adjacency(batten_context *ctx, batten_network *n, const uint32_t *twin) {
  size_t half_edges = 3 * n->face_count;
  if (twin && half_edges) memcpy(n->twin, twin, half_edges * sizeof *twin);
  if (twin && !n->crease_count) return BATTEN_OK;
  uint32_t *order = batten_alloc_array(ctx, half_edges, sizeof *order);
  if (!order) return BATTEN_E_NOMEM;
  batten_status st = batten_mesh_sort_edges(ctx, n->vertex_count, n->face_count, n->triangles, order);
  if (st == BATTEN_OK && !twin) st = pair_half_edges(ctx, half_edges, n->triangles, order, n->twin);
  if (st == BATTEN_OK && n->crease_count) st = mark_creases(ctx, n, order);
  batten_free(ctx, order);
  return st;
}

/* ---- making ------------------------------------------------------------------------------------- */

/* The network's mesh; no patches yet. */
static batten_status make_mesh(batten_context *ctx, size_t vertex_count, const double *vertices, size_t face_count,
                               const uint32_t *triangles, const uint32_t *twin, size_t crease_count,
                               const uint32_t *creases, batten_network **out) {
  if (vertex_count > UINT32_MAX - 1 || face_count > (UINT32_MAX - 1) / 3)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu vertices, %zu triangles; at most %zu, %zu", vertex_count,
                       face_count, (size_t)UINT32_MAX - 1, (size_t)(UINT32_MAX - 1) / 3);
  batten_network *n = batten_alloc(ctx, sizeof *n);
  if (!n) return BATTEN_E_NOMEM;
  *n = (batten_network){
      .ctx = ctx, .vertex_count = vertex_count, .face_count = face_count, .crease_count = crease_count};
  n->vertices = batten_alloc_array(ctx, vertex_count, 3 * sizeof *n->vertices);
  n->triangles = batten_alloc_array(ctx, face_count, 3 * sizeof *n->triangles);
  n->twin = batten_alloc_array(ctx, face_count, 3 * sizeof *n->twin);
  n->creases = batten_alloc_array(ctx, crease_count, 2 * sizeof *n->creases);
  if (crease_count) n->sharp = batten_alloc_array(ctx, face_count, 1);
  batten_status st = BATTEN_E_NOMEM;
  if (!n->vertices || !n->triangles || !n->twin || !n->creases || (crease_count && !n->sharp)) goto done;
  if (vertex_count) memcpy(n->vertices, vertices, vertex_count * 3 * sizeof *vertices);
  if (face_count) memcpy(n->triangles, triangles, face_count * 3 * sizeof *triangles);
  if (crease_count) memcpy(n->creases, creases, crease_count * 2 * sizeof *creases);
  st = find_adjacency(ctx, n, twin);
  if (st < 0) goto done;
  *out = n;
  n = NULL;
done:
  batten_network_free(n);
  return st;
}

static batten_status too_many_patches(batten_context *ctx, size_t count) {
  return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu patches; at most %zu", count, (size_t)UINT32_MAX - 1);
}

batten_status net_surface_new(batten_context *ctx, size_t vertex_count, const double *vertices, size_t face_count,
                              const uint32_t *triangles, const uint32_t *twin, size_t crease_count,
                              const uint32_t *creases, unsigned degree, unsigned parts, batten_network **out) {
  size_t patches;
  if (!batten_mul(face_count, parts, &patches) || patches > UINT32_MAX - 1) return too_many_patches(ctx, patches);
  batten_network *n = NULL;
  batten_status st = make_mesh(ctx, vertex_count, vertices, face_count, triangles, twin, crease_count, creases, &n);
  if (st < 0) return st;
  n->degree = degree;
  n->parts = parts;
  n->patch_count = patches;
  n->points = batten_alloc_array(ctx, patches, 3 * triangular_count(degree) * sizeof *n->points);
  if (!n->points) {
    batten_network_free(n);
    return BATTEN_E_NOMEM;
  }
  *out = n;
  return BATTEN_OK;
}

/* Tables for so many patches; false: not all there. */
static bool make_tables(batten_context *ctx, size_t faces, size_t patches, batten_network *n) {
  n->first = batten_alloc_array(ctx, faces + 1, sizeof *n->first);
  n->owner = batten_alloc_array(ctx, patches, sizeof *n->owner);
  n->degrees = batten_alloc_array(ctx, patches, 1);
  n->where = batten_alloc_array(ctx, patches, sizeof *n->where);
  return n->first && n->owner && n->degrees && n->where;
}

batten_status net_surface_split(batten_network *network, size_t count, const uint32_t *faces, unsigned degree) {
  batten_context *ctx = network->ctx;
  if (count == 0) return BATTEN_OK;
  size_t patches = network->face_count + 2 * count, size = 3 * triangular_count(degree);
  if (patches > UINT32_MAX - 1) return too_many_patches(ctx, patches);
  batten_network t = {0};
  t.spare = batten_alloc_array(ctx, 3 * count, size * sizeof *t.spare);
  if (!t.spare || !make_tables(ctx, network->face_count, patches, &t)) {
    batten_free(ctx, t.spare);
    batten_free(ctx, t.first);
    batten_free(ctx, t.owner);
    batten_free(ctx, t.degrees);
    batten_free(ctx, t.where);
    return BATTEN_E_NOMEM;
  }
  uint32_t p = 0;
  for (size_t f = 0, next = 0; f < network->face_count; f++) {
    bool splits = next < count && faces[next] == f;
    t.first[f] = p;
    for (unsigned part = 0; part < (splits ? 3u : 1u); part++, p++) {
      t.owner[p] = (uint32_t)f;
      t.degrees[p] = (unsigned char)(splits ? degree : network->degree);
      t.where[p] = splits ? t.spare + (3 * next + part) * size : net_surface_points(network, f)[0];
    }
    next += splits;
  }
  t.first[network->face_count] = p;
  network->spare = t.spare;
  network->first = t.first;
  network->owner = t.owner;
  network->degrees = t.degrees;
  network->where = t.where;
  network->patch_count = patches;
  network->degree = 0;
  return BATTEN_OK;
}

size_t net_surface_bytes(size_t vertex_count, size_t face_count, size_t crease_count, unsigned degree, unsigned parts,
                         size_t split_faces, unsigned split_degree) {
  size_t sum = sizeof(batten_network), patches, more;
  const size_t tables = sizeof(uint32_t) + 1 + sizeof(double *);
  bool fits = batten_mul(face_count, parts, &patches);
  fits = batten_mul(vertex_count, 3 * sizeof(double), &more) && batten_add(sum, more, &sum) && fits;
  fits = batten_mul(face_count, 6 * sizeof(uint32_t), &more) && batten_add(sum, more, &sum) && fits;
  if (crease_count)
    fits = batten_mul(crease_count, 2 * sizeof(uint32_t), &more) && batten_add(sum, more, &sum) &&
           batten_add(sum, face_count, &sum) && fits;
  fits = batten_mul(patches, 3 * triangular_count(degree) * sizeof(double), &more) && batten_add(sum, more, &sum) &&
         fits;
  if (split_faces) {
    fits = batten_mul(split_faces, 9 * triangular_count(split_degree) * sizeof(double) + 2 * tables, &more) &&
           batten_add(sum, more, &sum) && fits;
    fits = batten_mul(face_count, tables + sizeof(uint32_t), &more) && batten_add(sum, more, &sum) && fits;
  }
  return fits ? sum : SIZE_MAX;
}

/* ---- from parts --------------------------------------------------------------------------------- */

static batten_status check_patch(batten_context *ctx, const batten_network_patch *patch, size_t index) {
  if (patch->degree < 1 || patch->degree > TRIANGULAR_DEGREE)
    return batten_fail(ctx, BATTEN_E_INVALID, "patches[%zu].degree: %u; give 1 to %d", index, patch->degree,
                       TRIANGULAR_DEGREE);
  if (!patch->control_points)
    return batten_fail(ctx, BATTEN_E_INVALID, "patches[%zu].control_points: NULL; give %zu", index,
                       triangular_count(patch->degree));
  size_t numbers = 3 * triangular_count(patch->degree);
  size_t bad = batten_first_nonfinite(numbers, patch->control_points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "patches[%zu].control_points[%zu][%zu]: %g; give finite coordinates",
                       index, bad / 3, bad % 3, patch->control_points[bad]);
  return BATTEN_OK;
}

/* Patches in the order of the faces, one (part 0) or three (1, 2, 3) each; *points: how many they have. */
static batten_status check_patches(batten_context *ctx, size_t faces, size_t count,
                                   const batten_network_patch *patches, size_t *points) {
  if (count && !patches) return batten_fail(ctx, BATTEN_E_INVALID, "patches: NULL; give %zu", count);
  if (count > UINT32_MAX - 1) return too_many_patches(ctx, count);
  size_t p = 0;
  *points = 0;
  for (size_t f = 0; f < faces; f++) {
    unsigned first = p < count && patches[p].part ? 1 : 0, parts = first ? 3 : 1;
    for (unsigned k = 0; k < parts; k++, p++) {
      if (p >= count)
        return batten_fail(ctx, BATTEN_E_INVALID, "patches: %zu, which end before part %u of face %zu; give the rest",
                           count, first + k, f);
      if (patches[p].face != f || patches[p].part != first + k)
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "patches[%zu]: part %u of face %lu; expected part %u of face %zu: patches go in the order "
                           "of the faces, one (part 0) or three (1, 2, 3) each",
                           p, patches[p].part, (unsigned long)patches[p].face, first + k, f);
      batten_status st = check_patch(ctx, &patches[p], p);
      if (st < 0) return st;
      if (!batten_add(*points, triangular_count(patches[p].degree), points))
        return batten_fail(ctx, BATTEN_E_TOO_LARGE, "patches[%zu]: too many control points", p);
    }
  }
  if (p < count)
    return batten_fail(ctx, BATTEN_E_INVALID, "patches[%zu]: after the last of %zu faces; remove it", p, faces);
  return BATTEN_OK;
}

static void copy_patches(const batten_network_patch *patches, batten_network *n) {
  size_t at = 0;
  for (size_t p = 0; p < n->patch_count; p++) {
    size_t numbers = 3 * triangular_count(patches[p].degree);
    memcpy(n->points + at, patches[p].control_points, numbers * sizeof(double));
    if (!n->degree) {
      n->where[p] = n->points + at;
      n->degrees[p] = (unsigned char)patches[p].degree;
      n->owner[p] = patches[p].face;
      if (patches[p].part <= 1) n->first[patches[p].face] = (uint32_t)p;
    }
    at += numbers;
  }
  if (!n->degree) n->first[n->face_count] = (uint32_t)n->patch_count;
}

batten_status batten_network_create(batten_context *ctx, size_t vertex_count, const double *vertices,
                                    size_t triangle_count, const uint32_t *triangles, size_t patch_count,
                                    const batten_network_patch *patches, size_t crease_count, const uint32_t *creases,
                                    batten_network **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the address of the result");
  size_t points = 0;
  batten_status st = batten_mesh_check_arrays(ctx, vertex_count, vertices, triangle_count, triangles);
  if (st < 0) return st;
  if (crease_count && !creases) return batten_fail(ctx, BATTEN_E_INVALID, "creases: NULL; give %zu", crease_count);
  st = check_patches(ctx, triangle_count, patch_count, patches, &points);
  if (st < 0) return st;
  bool even = true;
  for (size_t p = 1; p < patch_count; p++)
    even = even && patches[p].degree == patches[0].degree && !patches[p].part == !patches[0].part;
  batten_network *n = NULL;
  st = make_mesh(ctx, vertex_count, vertices, triangle_count, triangles, NULL, crease_count, creases, &n);
  if (st < 0) return st;
  n->patch_count = patch_count;
  n->degree = !even ? 0 : patch_count ? patches[0].degree : 1;
  n->parts = patch_count && patches[0].part ? 3 : 1;
  n->points = batten_alloc_array(ctx, points, 3 * sizeof *n->points);
  if (!n->points || (!even && !make_tables(ctx, triangle_count, patch_count, n))) {
    batten_network_free(n);
    return BATTEN_E_NOMEM;
  }
  copy_patches(patches, n);
  *out = n;
  return BATTEN_OK;
}

/* ---- questions ---------------------------------------------------------------------------------- */

size_t batten_network_vertex_count(const batten_network *network) { return network->vertex_count; }
size_t batten_network_face_count(const batten_network *network) { return network->face_count; }
size_t batten_network_patch_count(const batten_network *network) { return network->patch_count; }
size_t batten_network_crease_count(const batten_network *network) { return network->crease_count; }
const double *batten_network_vertices(const batten_network *network) { return network->vertices; }
const uint32_t *batten_network_triangles(const batten_network *network) { return network->triangles; }
const uint32_t *batten_network_creases(const batten_network *network) { return network->creases; }

batten_network_patch batten_network_get_patch(const batten_network *network, size_t index) {
  if (index >= network->patch_count) return (batten_network_patch){0};
  return (batten_network_patch){.degree = net_surface_degree(network, index),
                                .face = (uint32_t)net_surface_face(network, index),
                                .part = net_surface_part(network, index),
                                .control_points = net_surface_points(network, index)[0]};
}

unsigned batten_network_face_patches(const batten_network *network, size_t face, size_t *first) {
  if (face >= network->face_count) return 0;
  if (first) *first = net_surface_first(network, face);
  return net_surface_parts(network, face);
}
