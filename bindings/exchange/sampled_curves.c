/* Planar curves as points on them: CSV, and polylines for VTK. */
#include "curves.h"
#include "vtk.h"
#include "write.h"

#include "base/checked.h"

#include <math.h>

/* ---- sampling ---------------------------------------------------------------------------------------- */

void bx_free_samples(batten_context *ctx, bx_curve_samples *samples) {
  batten_free(ctx, samples->starts);
  batten_free(ctx, samples->parameters);
  batten_free(ctx, samples->points);
  *samples = (bx_curve_samples){0};
}

/* Appends the parameters of a curve. */
static batten_status append(batten_context *ctx, bx_curve_samples *s, size_t i, const batten_curve *curve,
                            double tolerance) {
  double *parameters = NULL, *grown = NULL;
  size_t count = 0, end = 0;
  batten_status st = batten_curve_sample(ctx, curve, tolerance, &count, &parameters);
  if (st != BATTEN_OK) return st;
  if (batten_add(s->starts[i], count, &end)) grown = batten_realloc_array(ctx, s->parameters, end, sizeof *grown);
  if (grown) {
    s->parameters = grown;
    for (size_t k = 0; k < count; k++) grown[s->starts[i] + k] = parameters[k];
    s->starts[i + 1] = end;
  } else {
    st = BATTEN_E_NOMEM;
  }
  batten_free(ctx, parameters);
  return st;
}

batten_status bx_sample_curves(batten_context *ctx, const bx_curve_set *set, double tolerance,
                               bx_curve_samples *out) {
  bx_curve_samples s = {.starts = batten_alloc_array(ctx, set->count + 1, sizeof *s.starts)};
  batten_status st = s.starts ? BATTEN_OK : BATTEN_E_NOMEM;
  if (s.starts) s.starts[0] = 0;
  for (size_t i = 0; st == BATTEN_OK && i < set->count; i++) {
    st = append(ctx, &s, i, set->curves[i], tolerance);
    if (st == BATTEN_OK) st = batten_progress(ctx, "sample", (double)(i + 1) / (double)set->count);
  }
  if (st == BATTEN_OK) {
    s.points = batten_alloc_array(ctx, s.starts[set->count], sizeof *s.points);
    if (!s.points) st = BATTEN_E_NOMEM;
  }
  for (size_t i = 0; st == BATTEN_OK && i < set->count; i++)
    st = batten_curve_evaluate(ctx, set->curves[i], s.starts[i + 1] - s.starts[i], s.parameters + s.starts[i],
                               s.points + s.starts[i]);
  if (st == BATTEN_OK)
    *out = s;
  else
    bx_free_samples(ctx, &s);
  return st;
}

/* ---- CSV --------------------------------------------------------------------------------------------- */

void bx_write_csv_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *s) {
  bx_put_text(w, set->planes ? "curve,t,x,y,z,curvature\n" : "curve,t,x,y,curvature\n");
  for (size_t i = 0; i < set->count; i++)
    for (size_t k = s->starts[i]; k < s->starts[i + 1] && bx_goes_on(w, k, s->starts[set->count]); k++) {
      double place[3];
      bx_curve_place(set, i, s->points[k].point, place);
      bx_print(w, "%zu,", i);
      bx_put_number(w, s->parameters[k]);
      for (int c = 0; c < (set->planes ? 3 : 2); c++) {
        bx_put_u8(w, ',');
        bx_put_number(w, place[c]);
      }
      bx_put_u8(w, ',');
      if (isfinite(s->points[k].curvature))
        bx_put_number(w, s->points[k].curvature);
      else
        bx_put_text(w, "nan"); /* where the curve has no tangent */
      bx_put_u8(w, '\n');
    }
}

/* ---- VTK --------------------------------------------------------------------------------------------- */

void bx_write_vtp_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *s) {
  vtk_file v = {.w = w};
  size_t points = s->starts[set->count];
  vtk_begin(&v, "PolyData");
  bx_print(w,
           "    <Piece NumberOfPoints=\"%zu\" NumberOfVerts=\"0\" NumberOfLines=\"%zu\" NumberOfStrips=\"0\" "
           "NumberOfPolys=\"0\">\n      <Points>\n",
           points, set->count);
  vtk_declare(&v, "Float64", "Points", 3, points, sizeof(double));
  bx_put_text(w, "      </Points>\n      <PointData>\n");
  vtk_declare(&v, "Float64", "t", 1, points, sizeof(double));
  vtk_declare(&v, "Float64", "curvature", 1, points, sizeof(double));
  bx_put_text(w, "      </PointData>\n      <CellData>\n");
  vtk_declare(&v, "Int64", "curve", 1, set->count, sizeof(int64_t));
  bx_put_text(w, "      </CellData>\n      <Lines>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, points, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, set->count, sizeof(int64_t));
  bx_put_text(w, "      </Lines>\n");
  vtk_begin_appended(&v, "PolyData");
  bx_put_u64(w, (uint64_t)points * 3 * sizeof(double));
  for (size_t i = 0; i < set->count; i++)
    for (size_t k = s->starts[i]; k < s->starts[i + 1] && bx_goes_on(w, k, points); k++) {
      double place[3];
      bx_curve_place(set, i, s->points[k].point, place);
      for (int c = 0; c < 3; c++) bx_put_f64(w, place[c]);
    }
  bx_put_u64(w, (uint64_t)points * sizeof(double));
  for (size_t k = 0; k < points; k++) bx_put_f64(w, s->parameters[k]);
  bx_put_u64(w, (uint64_t)points * sizeof(double));
  for (size_t k = 0; k < points; k++) bx_put_f64(w, s->points[k].curvature);
  bx_put_u64(w, (uint64_t)set->count * sizeof(int64_t));
  for (size_t i = 0; i < set->count; i++) bx_put_u64(w, i);
  bx_put_u64(w, (uint64_t)points * sizeof(int64_t));
  for (size_t k = 0; k < points; k++) bx_put_u64(w, k);
  bx_put_u64(w, (uint64_t)set->count * sizeof(int64_t));
  for (size_t i = 0; i < set->count; i++) bx_put_u64(w, s->starts[i + 1]);
  vtk_end(&v);
}

void bx_write_vtk_curves(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *s) {
  size_t points = s->starts[set->count];
  vtk_legacy_begin(w, points);
  for (size_t i = 0; i < set->count; i++)
    for (size_t k = s->starts[i]; k < s->starts[i + 1] && bx_goes_on(w, k, points); k++) {
      double place[3];
      bx_curve_place(set, i, s->points[k].point, place);
      for (int c = 0; c < 3; c++) vtk_legacy_put_double(w, place[c]);
    }
  bx_print(w, "\nLINES %zu %zu\n", set->count, set->count + points);
  for (size_t i = 0; i < set->count; i++) {
    vtk_legacy_put_int(w, s->starts[i + 1] - s->starts[i]);
    for (size_t k = s->starts[i]; k < s->starts[i + 1]; k++) vtk_legacy_put_int(w, k);
  }
  bx_print(w, "\nCELL_DATA %zu\nSCALARS curve int 1\nLOOKUP_TABLE default\n", set->count);
  for (size_t i = 0; i < set->count; i++) vtk_legacy_put_int(w, i);
  bx_print(w, "\nPOINT_DATA %zu\nFIELD FieldData 2\nt 1 %zu double\n", points, points);
  for (size_t k = 0; k < points; k++) vtk_legacy_put_double(w, s->parameters[k]);
  bx_print(w, "\ncurvature 1 %zu double\n", points);
  for (size_t k = 0; k < points; k++) vtk_legacy_put_double(w, s->points[k].curvature);
  bx_put_u8(w, '\n');
}
