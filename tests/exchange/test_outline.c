/* Outlines as files: a ring of two circles and an arc that the clip box leaves open. */
#include "files.h"

#include <float.h>

/* Ring 0.5 < |x| < 1: positive inside. */
static batten_status ring(const void *user, batten_context *ctx, size_t count, const double *x, double *f, double *g,
                          double *h) {
  (void)user, (void)ctx, (void)h;
  for (size_t i = 0; i < count; i++) {
    double r = hypot(x[2 * i], x[2 * i + 1]);
    double side = r > 0.75 ? -1 : 1;
    if (f) f[i] = r > 0.75 ? 1 - r : r - 0.5;
    for (size_t k = 0; g && k < 2; k++) g[2 * i + k] = r > 0 ? side * x[2 * i + k] / r : 0;
  }
  return BATTEN_OK;
}

static batten_outline *trace(batten_context *ctx, bool clipped) {
  batten_field field = {.dimension = 2, .order = 1, .evaluate = ring};
  const double seeds[6] = {1, 0, 0, 0.5, -1, 0};
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_outline *outline = NULL;
  o.cell = 0.1;
  o.lower[0] = o.lower[1] = -1.3;
  o.upper[0] = clipped ? 0.7 : 1.3;
  o.upper[1] = 1.3;
  batten_status st = batten_trace_outline(ctx, &field, 2, clipped ? seeds + 2 : seeds, &o, &outline, NULL);
  T_CHECK(st >= 0, "the outline%s: %s", clipped ? ", cut by its box" : "", st ? batten_error(ctx) : "traced");
  return outline;
}

static size_t vertices_of(const batten_outline *outline, size_t *open_loops) {
  size_t all = 0;
  *open_loops = 0;
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    int closed;
    batten_outline_loop(outline, i, &count, &closed);
    all += count;
    *open_loops += !closed;
  }
  return all;
}

static size_t count_text(const char *text, const char *part) {
  size_t count = 0;
  for (const char *at = text; (at = strstr(at, part)); at += strlen(part)) count++;
  return count;
}

static char *written(batten_context *ctx, const batten_outline *outline, scratch *s, const char *name) {
  size_t size;
  T_OK(batten_write_outline(ctx, outline, scratch_file(s, name)), ctx);
  char *text = (char *)file_read(s->name, &size);
  text[size] = '\0';
  return text;
}

static void test_text(batten_context *ctx, scratch *s, const batten_outline *outline, const char *name) {
  size_t open_loops, all = vertices_of(outline, &open_loops), loops = batten_outline_loop_count(outline), first_count;
  char *text = written(ctx, outline, s, name);
  batten_cloud back = {0};
  const double *first = batten_outline_loop(outline, 0, &first_count, NULL);
  T_OK(batten_read_points(ctx, s->name, NULL, &back), ctx);
  T_CHECK(back.n == 2 && back.count == all + loops - open_loops &&
              !memcmp(back.points, first, 2 * first_count * sizeof(double)),
          "%s: read back with the same bits", name);
  T_CHECK(count_text(text, "\n\n") == loops - 1, "%s: a blank line between %zu loops", name, loops);
  batten_cloud_free(ctx, &back);
  free(text);
}

static void test_formats(batten_context *ctx, scratch *s, const batten_outline *outline, const char *what) {
  size_t open_loops, all = vertices_of(outline, &open_loops), loops = batten_outline_loop_count(outline);
  test_text(ctx, s, outline, "a.csv");
  test_text(ctx, s, outline, "a.xyz");
  test_text(ctx, s, outline, "a.txt");
  char *text = written(ctx, outline, s, "a.svg");
  T_CHECK(count_text(text, "\nM ") == loops && count_text(text, "\nL ") == all - loops &&
              count_text(text, " Z") == loops - open_loops && strstr(text, "</svg>\n"),
          "%s: svg has %zu loops, %zu open, %zu corners", what, loops, open_loops, all);
  free(text);
  text = written(ctx, outline, s, "a.obj");
  T_CHECK(count_text(text, "\nv ") == all && count_text(text, "\nl ") == loops, "%s: obj lines", what);
  free(text);
  text = written(ctx, outline, s, "a.vtp");
  char part[64];
  snprintf(part, sizeof part, "NumberOfPoints=\"%zu\"", all);
  T_CHECK(strstr(text, part), "%s: vtp names its %zu points", what, all);
  free(text);
}

typedef struct write_job {
  const batten_outline *outline;
  const char *path;
} write_job;

static batten_status write_again(batten_context *ctx, void *arg) {
  const write_job *job = arg;
  return batten_write_outline(ctx, job->outline, job->path);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  batten_outline *outline = trace(ctx, false), *cut = trace(ctx, true);
  size_t open_loops;
  vertices_of(outline, &open_loops);
  T_CHECK(batten_outline_loop_count(outline) == 2 && open_loops == 0, "the ring has two closed loops");
  test_formats(ctx, &s, outline, "ring");
  vertices_of(cut, &open_loops);
  T_CHECK(batten_outline_loop_count(cut) == 2 && open_loops == 1, "cut by its box, one loop is open");
  test_formats(ctx, &s, cut, "cut ring");
  size_t files = scratch_count(&s);
  T_STATUS(batten_write_outline(ctx, outline, scratch_file(&s, "a.stl")), BATTEN_E_INVALID, ctx,
           "written as .svg .csv .xyz .txt .vtp .obj");
  T_STATUS(batten_write_outline(ctx, NULL, "a.svg"), BATTEN_E_INVALID, ctx, "outline: NULL");
  T_STATUS(batten_write_outline(ctx, outline, scratch_file(&s, "none/a.svg")), BATTEN_E_IO, ctx,
           "make the directory");
  write_job job = {outline, scratch_file(&s, "a.svg")};
  t_fail_every_allocation("writing an outline", write_again, &job);
  T_CHECK(scratch_count(&s) == files, "no part files are left");
  scratch_close(&s);
  batten_outline_free(outline);
  batten_outline_free(cut);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
