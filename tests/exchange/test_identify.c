/* What files are told to hold. */
#include "files.h"

static const struct {
  const char *name, *text;
  batten_file_kind kind;
} cases[] = {
    {"a.xyz", "1 2 3\n", BATTEN_FILE_POINTS},
    {"a.csv", "", BATTEN_FILE_POINTS},
    {"a.stl", "solid\n", BATTEN_FILE_MESH},
    {"faces.ply", "ply\nformat ascii 1.0\nelement vertex 0\nelement face 1\nend_header\n", BATTEN_FILE_MESH},
    {"none.ply", "ply\nformat ascii 1.0\nelement vertex 0\nelement face 0\nend_header\n", BATTEN_FILE_POINTS},
    {"unnamed", "ply\r\nformat ascii 1.0\r\nelement vertex 0\r\nend_header\r\n", BATTEN_FILE_POINTS},
    {"a.obj", "v 1 2 3\nvn 0 0 1\n", BATTEN_FILE_POINTS},
    {"faces.obj", "# f 1 2 3\nv 1 2 3\nf 1 1 1\n", BATTEN_FILE_MESH},
    {"a.off", "OFF\n# c\n2 0 0\n", BATTEN_FILE_POINTS},
    {"unnamed.2", "OFF\n3 1 0\n", BATTEN_FILE_MESH},
    {"a.json", "{\"batten\": \"solid\", \"version\": 1}", BATTEN_FILE_SOLID},
    {"b.json", " {\n\t\"batten\" :\"carrier\"}", BATTEN_FILE_CARRIER},
    {"c.json", "\xef\xbb\xbf{\"batten\": \"shell\"}", BATTEN_FILE_DOCUMENT},
    {"c.json", "{\"batten\": \"curve\", \"version\": 1}", BATTEN_FILE_CURVES},
    {"c.json", "{\n\"batten\":\"contours\"}", BATTEN_FILE_CURVES},
    {"qp.json", "{\"batten\": \"qp\", \"version\": 1}", BATTEN_FILE_QP},
    {"s.json", "{\"batten\": \"qp_solution\", \"version\": 1}", BATTEN_FILE_DOCUMENT},
    {"n.json", "{\"batten\": \"network\", \"version\": 1}", BATTEN_FILE_NETWORK},
    {"p.json", "{\"batten\": \"surface\", \"version\": 1}", BATTEN_FILE_SURFACE},
    {"a.step", "ISO-10303-21;", BATTEN_FILE_UNKNOWN},
    {"a.QPS", "NAME\n", BATTEN_FILE_QP},
    {"a.sif", "", BATTEN_FILE_QP},
    {"a.mat", "MATLAB", BATTEN_FILE_QP},
    {"unnamed.3", "{\"batten\": \"solid\"", BATTEN_FILE_SOLID},
    {"d.json", "{\"other\": 1}", BATTEN_FILE_UNKNOWN},
    {"e.json", "", BATTEN_FILE_UNKNOWN},
    {"f.json", "{\"batten", BATTEN_FILE_UNKNOWN},
    {"a.vtp", "<?xml version=\"1.0\"?>", BATTEN_FILE_UNKNOWN},
    {"a.png", "\x89PNG", BATTEN_FILE_UNKNOWN},
};
enum { CASES = sizeof cases / sizeof cases[0] };

static batten_status identify_again(batten_context *ctx, void *arg) {
  batten_file_kind kind;
  return batten_file_identify(ctx, arg, &kind);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  for (size_t i = 0; i < CASES; i++) {
    batten_file_kind kind = (batten_file_kind)77;
    file_write(scratch_file(&s, cases[i].name), cases[i].text, strlen(cases[i].text));
    batten_status st = batten_file_identify(ctx, s.name, &kind);
    T_CHECK(st == BATTEN_OK && kind == cases[i].kind, "%s: %s, kind %d", cases[i].name,
            st ? batten_error(ctx) : "told", (int)kind);
  }
  batten_file_kind kind = BATTEN_FILE_MESH;
  file_write(scratch_file(&s, "bad.ply"), "no", 2);
  T_STATUS(batten_file_identify(ctx, s.name, &kind), BATTEN_E_FORMAT, ctx, "a PLY file begins with the line 'ply'");
  T_STATUS(batten_file_identify(ctx, "none.json", &kind), BATTEN_E_IO, ctx, "none.json: cannot open");
  T_STATUS(batten_file_identify(ctx, s.path, &kind), BATTEN_E_IO, ctx, "Is a directory; name a file in it");
  T_STATUS(batten_file_identify(ctx, NULL, &kind), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_file_identify(ctx, s.path, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(kind == BATTEN_FILE_MESH, "the result is untouched");
  char path[400];
  snprintf(path, sizeof path, "%s", scratch_file(&s, "faces.ply"));
  t_fail_every_allocation("telling PLY", identify_again, path);
  t_cancel_every_progress("telling PLY", identify_again, path);
  scratch_close(&s);
  batten_context_free(ctx);
  return t_done();
}
