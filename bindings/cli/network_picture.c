/* The picture of `batten network`: curvature as colour, as in the paper's figures, or lines of light, with the
 * boundaries of the patches. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "network.h"

typedef struct drawing {
  batten_mesh *mesh; /* vertices of each patch for itself: curvature jumps at edges */
  double *lines;     /* isophotes or reflection lines */
  double *edges;     /* [edge_count][2][3] */
  size_t edge_count;
} drawing;

static const double *field(const batten_mesh *mesh, const char *wanted) {
  const char *name;
  size_t components;
  for (size_t i = 0; i < batten_mesh_field_count(mesh); i++) {
    const double *values = batten_mesh_field(mesh, i, &name, &components);
    if (strcmp(name, wanted) == 0) return values;
  }
  return NULL;
}

/* Segments along all edges of the network's mesh, on the surface. */
static batten_status find_edges(const network_work *w, unsigned density, drawing *d) {
  batten_context *ctx = w->run.ctx;
  const batten_network *n = w->network;
  size_t faces = batten_network_face_count(n), places = 3 * faces * (density + 1);
  batten_place *place = batten_alloc_array(ctx, places, sizeof *place);
  batten_surface_point *point = batten_alloc_array(ctx, places, sizeof *point);
  d->edges = batten_alloc_array(ctx, 3 * faces * density, 6 * sizeof *d->edges);
  batten_status st = place && point && d->edges ? BATTEN_OK : BATTEN_E_NOMEM;
  size_t count = 0;
  for (size_t f = 0; st >= 0 && f < faces; f++) {
    size_t first;
    bool whole = batten_network_face_patches(n, f, &first) == 1;
    for (unsigned side = 0; side < 3; side++)
      for (unsigned i = 0; i <= density; i++) {
        double t = (double)i / density;
        batten_place *p = &place[count++];
        if (!whole)
          *p = (batten_place){(uint32_t)(first + side), t, 0};
        else
          *p = (batten_place){(uint32_t)first,
                              side == 0   ? t
                              : side == 1 ? 1 - t
                                          : 0,
                              side == 0   ? 0
                              : side == 1 ? t
                                          : 1 - t};
      }
  }
  if (st >= 0) st = batten_network_evaluate(ctx, n, places, place, point);
  for (size_t i = 0; st >= 0 && i < places; i++) {
    if (i % (density + 1) == 0) continue;
    double *segment = d->edges + 6 * d->edge_count++;
    memcpy(segment, point[i - 1].point, sizeof point->point);
    memcpy(segment + 3, point[i].point, sizeof point->point);
  }
  batten_free(ctx, point);
  batten_free(ctx, place);
  return st;
}

/* Curvatures that differ by less, of the size of the surface, are rounding: what is flat gets one colour. */
static const double equal_curvatures = 1e-9;

static void choose_range(const batten_network_measures *m, bool gauss, batten_picture_options *o) {
  if (o->color_lower < o->color_upper) return; /* as asked for */
  double size = hypot(hypot(m->upper[0] - m->lower[0], m->upper[1] - m->lower[1]), m->upper[2] - m->lower[2]);
  double low = gauss ? m->gauss_p02 : m->mean_min, high = gauss ? m->gauss_p98 : m->mean_max;
  double least = equal_curvatures / (gauss ? size * size : size);
  if (!(isfinite(low) && isfinite(high) && isfinite(least))) return;
  if (high - low < least) {
    o->color_lower = 0.5 * (low + high) - 0.5 * least;
    o->color_upper = 0.5 * (low + high) + 0.5 * least;
  } else if (gauss) {
    o->color_lower = low;
    o->color_upper = high;
  }
}

/* Lines as who looks at the picture would see them: the eye is its camera, and the lights run along its horizon. */
static void light(const batten_picture_options *o, batten_lines_options *l) {
  const double degree = 0.017453292519943295769;
  double azimuth = o->azimuth_deg * degree, elevation = o->elevation_deg * degree;
  double back[3] = {cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)};
  double right[3] = {-sin(azimuth), cos(azimuth), 0};
  for (unsigned k = 0; k < 3; k++) {
    l->direction[(o->up_axis + 1 + k) % 3] = back[k];
    l->light_axis[(o->up_axis + 1 + k) % 3] = right[k];
  }
}

static batten_status color(const network_work *w, drawing *d, batten_picture_options *o) {
  network_color what = w->request->color;
  batten_status st = BATTEN_OK;
  if (what == NETWORK_GAUSS || what == NETWORK_MEAN) {
    bool gauss = what == NETWORK_GAUSS;
    o->colors = field(d->mesh, gauss ? "gauss" : "mean");
    o->color_label = gauss ? "Gaussian curvature" : "mean curvature";
    o->color_map = BATTEN_MAP_RAINBOW;
    choose_range(&w->measures, gauss, o);
  } else if (what != NETWORK_PLAIN) {
    batten_lines_options l = batten_lines_options_default();
    l.kind = what == NETWORK_ISOPHOTES ? BATTEN_LINES_ISOPHOTE : BATTEN_LINES_REFLECTION;
    if (l.kind == BATTEN_LINES_REFLECTION) light(o, &l);
    d->lines = batten_alloc_array(w->run.ctx, batten_mesh_vertex_count(d->mesh), sizeof *d->lines);
    st = d->lines ? batten_network_line_values(w->run.ctx, d->mesh, &l, d->lines) : BATTEN_E_NOMEM;
    o->colors = d->lines;
    o->color_map = BATTEN_MAP_STRIPES;
    o->color_lower = 0; /* the angle of a mirrored ray begins anew after a turn */
    o->color_upper = l.kind == BATTEN_LINES_REFLECTION ? l.count : 0;
  }
  return st;
}

/* A quarter of the pixels that an edge has, about. */
static double picture_fineness(const network_work *w) {
  double pixels = (double)w->request->picture.width * w->request->picture.height;
  return sqrt(pixels / (4 * (double)batten_network_face_count(w->network) + 1));
}

/* So many segments for each edge that the picture is smooth where facets are large. Lines of light follow normals,
 * whose kinks between triangles are seen: they want more. */
static unsigned picture_density(double fineness, bool lines) {
  return (unsigned)fmin(fmax(lines ? fineness : fineness / 4, fmax(1, fmin(fineness, lines ? 6 : 3))),
                        lines ? 64 : 32);
}

/* Where facets are smaller their boundaries would be all that is seen. */
static const double fineness_for_edges = 3;

batten_status network_draw(const network_work *w, const char *path) {
  batten_context *ctx = w->run.ctx;
  drawing d = {0};
  batten_picture_lines edges = {.color = 0x14161b};
  batten_picture_options o = w->request->picture;
  batten_tessellate_options t = batten_tessellate_options_default();
  double fineness = picture_fineness(w);
  t.density =
      picture_density(fineness, w->request->color == NETWORK_ISOPHOTES || w->request->color == NETWORK_REFLECTION);
  t.per_patch = 1;
  batten_status st = batten_network_tessellate(ctx, w->network, &t, &d.mesh);
  if (st >= 0) {
    o.normals = field(d.mesh, "normal");
    st = color(w, &d, &o);
  }
  if (st >= 0 && !w->request->no_edges && fineness >= fineness_for_edges) {
    st = find_edges(w, t.density, &d);
    edges.count = d.edge_count;
    edges.segments = d.edges;
    o.line_count = 1;
    o.lines = &edges;
  }
  if (st >= 0) st = batten_picture_mesh(ctx, d.mesh, &o, path);
  batten_free(ctx, d.edges);
  batten_free(ctx, d.lines);
  batten_mesh_free(d.mesh);
  return st;
}
