/* A solid's surface, pictures and files. See body.h. */
#include "body.h"

#include <math.h>
#include <string.h>

/* ---- command line -------------------------------------------------------------------------------- */

body_request body_request_default(void) {
  return (body_request){.surface = batten_polygonize_options_default(), .picture = batten_picture_options_default()};
}

static bool take_sharp(const char *v, double *degrees) {
  if (!cli_parse_number("--sharp", v, 0, 170, degrees)) return false;
  if (*degrees == 0 || *degrees >= 15) return true;
  cli_error("--sharp: %g; give 15 to 170 degrees, or 0", *degrees);
  return false;
}

bool body_take(cli_request *common, body_request *q, int key, const char *v) {
  static const char *const colors[] = {"none", "gradient", "mean", "gauss", NULL};
  int word = 0;
  switch (key) {
    case 'o':
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SURFACE, v);
    case BODY_KEY_PICTURE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_PICTURE, v);
    case BODY_KEY_SAVE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SOLID, v);
    case BODY_KEY_CELL:
      return cli_parse_number("--cell", v, 1e-300, INFINITY, &q->surface.cell);
    case BODY_KEY_BOX:
      q->box = v;
      return true;
    case BODY_KEY_COLOR:
      if (!cli_parse_word("--color", v, colors, &word)) return false;
      q->color = (body_color)word;
      return true;
    case BODY_KEY_SHARP:
      return take_sharp(v, &q->surface.sharp_deg);
    case BODY_KEY_DOTS:
      q->dots = true;
      return true;
    default:
      return cli_take_picture(&q->picture, key, v);
  }
}

static unsigned count_numbers(const char *text) {
  unsigned n = 1;
  for (; *text; text++) n += *text == ',';
  return n;
}

int body_check(body *b, unsigned n) {
  body_request *q = b->request;
  if (!cli_outputs_check_dimension(&b->common->outputs, n)) return CLI_USAGE;
  if (!q->box) return CLI_DONE;
  double box[6];
  if (count_numbers(q->box) != 2 * n) {
    cli_error("--box: '%s' is not the %u numbers of two corners", q->box, 2 * n);
    return CLI_USAGE;
  }
  if (!cli_parse_numbers("--box", q->box, 2 * n, box)) return CLI_USAGE;
  for (unsigned k = 0; k < n; k++) {
    q->surface.lower[k] = box[k];
    q->surface.upper[k] = box[n + k];
    if (box[k] < box[n + k]) continue;
    cli_error("--box: '%s': the first corner must be below the second", q->box);
    return CLI_USAGE;
  }
  return CLI_DONE;
}

/* ---- surface ------------------------------------------------------------------------------------- */

void body_note(body *b, batten_status st) {
  if (st <= 0) return;
  cli_run_warn(b->run, st);
  if (b->status == BATTEN_OK) b->status = st;
}

/* Cut where the command line says, else around all of the solid: sections' ends reach beyond their points, the only
 * ones that the polygoniser knows of. A tree's box is tight; as large a margin would only be searched in vain. */
static void choose_box(body *b, unsigned n) {
  batten_polygonize_options *o = &b->request->surface;
  batten_solid_kind kind = batten_solid_kind_of(b->solid);
  double margin = 0;
  if (kind == BATTEN_SOLID_SPLINE) return;
  for (unsigned k = 0; k < n; k++)
    if (o->lower[k] < o->upper[k]) return;
  batten_solid_box(b->solid, o->lower, o->upper);
  for (unsigned k = 0; k < n; k++) margin = fmax(margin, 0.25 * (o->upper[k] - o->lower[k]));
  if (kind == BATTEN_SOLID_TREE) margin = 2 * o->cell;
  for (unsigned k = 0; k < n; k++) {
    o->lower[k] -= margin;
    o->upper[k] += margin;
  }
}

/* Fast sums where the solid has many centres, a tenth of what the surface is settled to. */
static batten_status open_evaluator(body *b) {
  batten_status st = batten_solid_evaluator_new(b->run->ctx, b->solid, b->request->evaluation,
                                                0.1 * b->request->surface.accuracy, &b->evaluator);
  if (st < 0) return st;
  body_note(b, st);
  b->evaluation = batten_solid_evaluator_get_info(b->evaluator);
  if (b->evaluation.method == BATTEN_EVALUATE_FAST) return BATTEN_OK;
  batten_solid_evaluator_free(b->evaluator);
  b->evaluator = NULL;
  return BATTEN_OK;
}

static void close_evaluator(body *b) {
  if (b->evaluator) b->evaluation = batten_solid_evaluator_get_info(b->evaluator);
  batten_solid_evaluator_free(b->evaluator);
  b->evaluator = NULL;
}

/* Measures and fields of b->mesh. */
static batten_status look_at_mesh(body *b) {
  batten_context *ctx = b->run->ctx;
  batten_status st = body_add_fields(b);
  close_evaluator(b); /* its memory, for what follows */
  b->self_intersections = b->surface.self_intersections; /* counted on this very mesh */
  return st < 0 ? st : batten_mesh_measure(ctx, b->mesh, &b->measures);
}

batten_status body_mesh(body *b, double cell) {
  double start = batten_now();
  batten_context *ctx = b->run->ctx;
  batten_polygonize_options *o = &b->request->surface;
  size_t count;
  const double *seeds = batten_solid_points(b->solid, &count);
  unsigned n = batten_solid_dimension(b->solid);
  if (o->cell == 0) o->cell = cell;
  choose_box(b, n);
  batten_status st = open_evaluator(b);
  if (st < 0) return st;
  batten_field field = b->evaluator ? batten_solid_evaluator_field(b->evaluator) : batten_solid_field(b->solid);
  st = n == 2 ? batten_trace_outline(ctx, &field, count, seeds, o, &b->outline, &b->surface)
              : batten_polygonize(ctx, &field, count, seeds, o, &b->mesh, &b->surface);
  b->time_surface_s = batten_now() - start;
  body_note(b, st);
  if (st >= 0 && b->mesh) st = look_at_mesh(b);
  close_evaluator(b);
  return st;
}

/* ---- files --------------------------------------------------------------------------------------- */

static batten_status draw(body *b, const char *path) {
  batten_picture_options o = b->request->picture;
  size_t count;
  const double *points = batten_solid_points(b->solid, &count);
  if (b->request->dots || (b->outline && batten_solid_kind_of(b->solid) == BATTEN_SOLID_SPLINE)) {
    o.points = points;
    o.point_count = count;
  }
  if (b->outline) return batten_picture_outline(b->run->ctx, b->outline, &o, path);
  static const char *const labels[] = {NULL, "|grad f|", "mean curvature", "Gaussian curvature"};
  o.colors = body_color_values(b);
  o.color_label = labels[b->request->color];
  return batten_picture_mesh(b->run->ctx, b->mesh, &o, path);
}

batten_status body_write(body *b) {
  double start = batten_now();
  batten_context *ctx = b->run->ctx;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < b->common->outputs.count && st >= 0; i++) {
    const cli_output *f = &b->common->outputs.items[i];
    const char *path = f->staged ? f->staged : f->target;
    if (f->kind == CLI_OUTPUT_SURFACE)
      st = b->outline ? batten_write_outline(ctx, b->outline, path) : batten_write_mesh(ctx, b->mesh, path);
    else if (f->kind == CLI_OUTPUT_SOLID)
      st = batten_save_solid(ctx, b->solid, path);
    else if (f->kind == CLI_OUTPUT_PICTURE)
      st = draw(b, path);
  }
  b->time_write_s = batten_now() - start;
  return st;
}

int body_finish(body *b, const cli_report *report) {
  bool ok = cli_report_write(report, &b->common->outputs);
  cli_run_clear(b->run);
  if (cli_interrupted()) return cli_run_failed(b->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&b->common->outputs) ? CLI_DONE : CLI_FAILED;
}

void body_free(body *b) {
  close_evaluator(b);
  batten_outline_free(b->outline);
  batten_mesh_free(b->mesh);
  if (b->run->ctx) batten_free(b->run->ctx, b->color);
}
