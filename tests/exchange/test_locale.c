/* A host whose locale has a decimal comma: what is read and written is the same, bit by bit, as under "C".
 *
 * The locale is one that is installed, or one that localedef makes in a scratch folder. */
#define _XOPEN_SOURCE 700 /* setenv */
#include "files.h"
#include "number.h"

#include <locale.h>

static bool has_comma(void) { return *localeconv()->decimal_point == ','; }

static bool set_comma_locale(const scratch *s) {
  static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "fr_FR"};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
    if (setlocale(LC_ALL, names[i]) && has_comma()) return true;
  char command[300], folder[300];
  if (!getcwd(folder, sizeof folder - 100)) return false;
  snprintf(folder + strlen(folder), 100, "/%s", s->path);
  snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >%s/log 2>&1", s->path, s->path);
  if (system(command)) return false;
  setenv("LOCPATH", folder, 1);
  return setlocale(LC_ALL, "de_DE.UTF-8") && has_comma();
}

/* Everything that has numbers in text, written to files NAME-0 (under C) or NAME-1. */
static void write_all(batten_context *ctx, scratch *s, const batten_mesh *mesh, const batten_carrier *carrier,
                      int which) {
  static const char *const extensions[] = {"obj", "off", "ply", "vtp"};
  char name[32];
  for (size_t i = 0; i < 4; i++) {
    snprintf(name, sizeof name, "mesh-%d.%s", which, extensions[i]);
    T_OK(batten_write_mesh(ctx, mesh, scratch_file(s, name)), ctx);
  }
  snprintf(name, sizeof name, "carrier-%d.json", which);
  T_OK(batten_save_carrier(ctx, carrier, scratch_file(s, name)), ctx);
  double g[] = {0.1, -2.5e-7}, upper[] = {1.75, INFINITY};
  batten_qp_file qp = {
      .problem = {.struct_size = sizeof qp.problem, .n = 2, .g = g, .constant = 0.3, .x_upper = upper}};
  for (size_t i = 0; i < 2; i++) {
    snprintf(name, sizeof name, "qp-%d.%s", which, i ? "json" : "qps");
    T_OK(batten_write_qp(ctx, &qp, scratch_file(s, name)), ctx);
    batten_qp_file back = {0};
    T_OK(batten_read_qp(ctx, s->name, &back), ctx);
    T_CHECK(!memcmp(back.problem.g, g, sizeof g) && back.problem.x_upper[0] == 1.75, "%s: the same bits", name);
    batten_qp_file_free(ctx, &back);
  }
}

/* A curve, and the points on it that come back as a contour. */
static void write_curve(batten_context *ctx, scratch *s, int which) {
  static const char *const extensions[] = {"json", "step", "igs", "svg", "csv"};
  static const double knots[] = {0, 0, 0, 0.1, 1, 1, 1}, points[] = {0.25, 0.5, 1.5, 2.75, 3.1, -1e-7, 0.3, 0.7};
  batten_curve *curve = NULL;
  batten_contours back = {0};
  char name[32];
  T_OK(batten_curve_create(ctx, &(batten_curve_form){2, 7, knots, points, 0}, &curve), ctx);
  for (size_t i = 0; i < 5; i++) {
    snprintf(name, sizeof name, "curve-%d.%s", which, extensions[i]);
    T_OK(batten_write_curves(
             ctx, 1, (const batten_curve *const *)&curve,
             &(batten_write_curves_options){.struct_size = sizeof(batten_write_curves_options), .name = "curve"},
             scratch_file(s, name)),
         ctx);
  }
  T_OK(batten_read_contours(ctx, s->name, &back), ctx);
  T_CHECK(back.count == 1 && back.points[0] == 0.25 && back.points[1] == 0.5, "%s: the same bits", name);
  batten_contours_free(ctx, &back);
  snprintf(name, sizeof name, "curve-%d.json", which);
  batten_curves curves = {0};
  T_OK(batten_read_curves(ctx, scratch_file(s, name), &curves), ctx);
  T_CHECK(curves.count == 1 && !memcmp(batten_curve_get(curves.curves[0]).control_points, points, sizeof points),
          "%s: the same bits", name);
  batten_curves_free(ctx, &curves);
  batten_curve_free(curve);
}

static bool same_files(scratch *s, const char *stem, const char *extension) {
  char first[400], name[32];
  snprintf(name, sizeof name, "%s-0.%s", stem, extension);
  snprintf(first, sizeof first, "%s", scratch_file(s, name));
  snprintf(name, sizeof name, "%s-1.%s", stem, extension);
  return files_equal(first, scratch_file(s, name));
}

static void test_reading(batten_context *ctx, scratch *s, const double *x) {
  static const char *const text = "1.5,2.25,-3e-1\n4.5,5.5,6.5\n";
  const double expected[6] = {1.5, 2.25, -0.3, 4.5, 5.5, 6.5};
  batten_cloud c = {0};
  T_OK(points_of(ctx, "a.csv", text, strlen(text), 0, &c), ctx);
  T_CHECK(c.count == 2 && !memcmp(c.points, expected, sizeof expected), "points with points");
  batten_cloud_free(ctx, &c);
  T_STATUS(points_of(ctx, "a.txt", "1,5;2,5\n", 8, 0, &c), BATTEN_E_FORMAT, ctx, "write a point as the decimal sign");
  static const char *const files[] = {"mesh-0.obj", "mesh-0.off", "mesh-0.ply"};
  for (size_t i = 0; i < 3; i++) {
    batten_mesh *mesh = NULL;
    T_OK(batten_read_mesh(ctx, scratch_file(s, files[i]), &mesh), ctx);
    T_CHECK(!memcmp(batten_mesh_vertices(mesh), x, 9 * sizeof *x), "%s: the same bits", files[i]);
    batten_mesh_free(mesh);
  }
  batten_carrier *carrier = NULL;
  T_OK(batten_load_carrier(ctx, scratch_file(s, "carrier-0.json"), &carrier), ctx);
  batten_carrier_parts parts;
  batten_carrier_get_parts(carrier, &parts);
  T_CHECK(!memcmp(parts.parameters, x, 4 * sizeof *x), "a document: the same bits");
  T_CHECK(has_comma(), "the locale is the host's still");
  batten_carrier_free(carrier);
}

static void remove_locale(const scratch *s) {
  char command[200];
  snprintf(command, sizeof command, "rm -rf %s/de_DE.UTF-8", s->path);
  if (system(command)) t_line(false, "the test removes its locale");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  const double x[9] = {0.1, 1.0 / 3, -7e6 / 3, 0.25, 1e-300, 2e300 / 3, 5, -0.0, 0.7};
  const uint32_t t[3] = {0, 1, 2};
  batten_mesh *mesh = NULL;
  batten_carrier *carrier = NULL;
  T_OK(batten_mesh_create(ctx, 3, x, 1, t, &mesh), ctx);
  T_OK(batten_carrier_ball(ctx, 3, x, x[3], &carrier), ctx);
  write_all(ctx, &s, mesh, carrier, 0);
  write_curve(ctx, &s, 0);
  if (set_comma_locale(&s)) {
    char text[BX_NUMBER_SIZE], printed[8];
    snprintf(printed, sizeof printed, "%.1f", 0.5);
    bx_format_number(0.5, text);
    T_CHECK(!strcmp(printed, "0,5") && !strcmp(text, "0.5"), "where printf writes %s, here it is %s", printed, text);
    write_all(ctx, &s, mesh, carrier, 1);
    write_curve(ctx, &s, 1);
    T_CHECK(same_files(&s, "mesh", "obj") && same_files(&s, "mesh", "off") && same_files(&s, "mesh", "ply") &&
                same_files(&s, "mesh", "vtp") && same_files(&s, "carrier", "json") && same_files(&s, "qp", "qps") &&
                same_files(&s, "qp", "json") && same_files(&s, "curve", "json") && same_files(&s, "curve", "step") &&
                same_files(&s, "curve", "igs") && same_files(&s, "curve", "svg") && same_files(&s, "curve", "csv"),
            "the same bytes are written");
    test_reading(ctx, &s, x);
  } else {
    t_skip("a locale with a decimal comma", "none installed, and localedef does not make one");
  }
  setlocale(LC_ALL, "C");
  remove_locale(&s);
  scratch_close(&s);
  batten_mesh_free(mesh);
  batten_carrier_free(carrier);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
