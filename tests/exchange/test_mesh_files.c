/* Meshes: the same tetrahedron in every format, write/read/write, fields, what each file must look like, what is
 * refused, and that nothing half-written stays. */
#include "files.h"

#include <sys/stat.h>

static const double tetrahedron[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

/* Every format with a square (to be cut in two) or the tetrahedron. */
typedef struct sample {
  const char *name, *text;
  size_t vertices, triangles;
  uint32_t first[6]; /* the first two triangles */
} sample;

static const sample samples[] = {
    {"a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n", 4, 2, {0, 1, 2, 0, 2, 3}},
    {"counts.off",
     "COFF 4 4 6\n0 0 0 255 0 0 1\n1 0 0 .1 .1 .1 1\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
     4,
     4,
     {0, 2, 1, 0, 1, 3}},
    {"a.obj",
     "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1 2/1 3//1 4/1/1\nvn 0 0 1\n",
     4,
     2,
     {0, 1, 2, 0, 2, 3}},
    {"back.obj",
     "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\nf -4 \\\n -2 \\\n-1 # c\n",
     4,
     2,
     {0, 1, 2, 0, 2, 3}},
    {"late.obj", "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 2 2 2\nf 1 3 4\n", 4, 2, {0, 1, 2, 0, 2, 3}},
    {"a.ply",
     "ply\nformat ascii 1.0\nelement face 1\nproperty uchar red\nproperty list uchar int vertex_index\n"
     "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement edge 1\nproperty int a\n"
     "end_header\n7 4 0 1 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n1\n",
     4,
     2,
     {0, 1, 2, 0, 2, 3}},
    {"a.stl",
     "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n"
     "facet normal 0 0 0\nouter loop\nvertex 0 0 -0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n"
     "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
     4,
     2,
     {0, 1, 2, 0, 2, 3}},
};
enum { SAMPLES = sizeof samples / sizeof samples[0] };

static void test_samples(batten_context *ctx) {
  for (size_t i = 0; i < SAMPLES; i++) {
    const sample *s = &samples[i];
    batten_mesh *m = NULL;
    batten_status st = mesh_of(ctx, s->name, s->text, strlen(s->text), &m);
    bool ok = st == BATTEN_OK && batten_mesh_vertex_count(m) == s->vertices &&
              batten_mesh_triangle_count(m) == s->triangles &&
              !memcmp(batten_mesh_triangles(m), s->first, sizeof s->first);
    T_CHECK(ok, "%s: %s", s->name, st ? batten_error(ctx) : "vertices and triangles as by hand");
    batten_mesh_free(m);
  }
}

/* With numbers that have all their bits; `far` from the origin as maps are. */
static batten_mesh *make_mesh_at(batten_context *ctx, double far) {
  batten_mesh *m = NULL;
  double x[12], scalar[4] = {0.1, -1e-300, 3e300, -0.0}, vector[12];
  for (int i = 0; i < 12; i++) {
    x[i] = tetrahedron[i] / 3 + far * (i % 3);
    vector[i] = sin(i);
  }
  if (batten_mesh_create(ctx, 4, x, 4, faces, &m) == BATTEN_OK) {
    batten_mesh_set_field(ctx, m, "curvature <mean> & \"more\"", 1, scalar);
    batten_mesh_set_field(ctx, m, "gradient", 3, vector);
  }
  return m;
}

static batten_mesh *make_mesh(batten_context *ctx) { return make_mesh_at(ctx, 7e6); }

static void test_round_trip(batten_context *ctx, scratch *s, const char *extension, bool exact) {
  /* far away, single precision would weld the corners */
  batten_mesh *m = make_mesh_at(ctx, exact ? 7e6 : 1), *back = NULL, *again = NULL;
  char first[400], second[400], name[32];
  snprintf(name, sizeof name, "first.%s", extension);
  snprintf(first, sizeof first, "%s", scratch_file(s, name));
  snprintf(name, sizeof name, "second.%s", extension);
  snprintf(second, sizeof second, "%s", scratch_file(s, name));
  T_OK(batten_write_mesh(ctx, m, first), ctx);
  T_OK(batten_read_mesh(ctx, first, &back), ctx);
  T_OK(batten_write_mesh(ctx, back, second), ctx);
  T_OK(batten_read_mesh(ctx, second, &again), ctx);
  size_t bytes = sizeof(double) * 12;
  T_CHECK(!memcmp(batten_mesh_vertices(back), batten_mesh_vertices(again), bytes) &&
              (!exact || !memcmp(batten_mesh_vertices(m), batten_mesh_vertices(back), bytes)),
          "%s: coordinates", extension);
  /* STL has lost the numbering: its vertices are in the order of the facets. */
  T_CHECK(
      batten_mesh_triangle_count(back) == 4 && (!exact || !memcmp(batten_mesh_triangles(back), faces, sizeof faces)),
      "%s: triangles", extension);
  if (strcmp(extension, "ply")) {
    T_CHECK(files_equal(first, second), "%s: written, read, written: the same bytes", extension);
  } else {
    size_t fields = batten_mesh_field_count(back), components;
    const char *field = "";
    const double *values = fields == 4 ? batten_mesh_field(back, 3, &field, &components) : NULL;
    T_CHECK(values && !strcmp(field, "gradient_2") && components == 1 && values[3] == sin(11),
            "ply: fields come back");
    T_CHECK(files_equal(first, second), "ply: written, read, written: the same bytes");
  }
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  T_CHECK(batten_file_identify(ctx, first, &kind) == BATTEN_OK && kind == BATTEN_FILE_MESH, "%s: told to be a mesh",
          extension);
  batten_mesh_free(m);
  batten_mesh_free(back);
  batten_mesh_free(again);
}

/* Offsets of the appended blocks, each with its size in front, one behind the other up to the end. */
static void test_vtk(batten_context *ctx, scratch *s, const char *name, unsigned arrays) {
  batten_mesh *m = make_mesh(ctx);
  T_OK(batten_write_mesh(ctx, m, scratch_file(s, name)), ctx);
  size_t size;
  unsigned char *bytes = file_read(s->name, &size);
  bytes[size] = 0;
  char *text = (char *)bytes, *data = strstr(text, "<AppendedData encoding=\"raw\">\n_");
  uint64_t expected = 0;
  unsigned found = 0;
  for (char *at = text; data && (at = strstr(at, "offset=\"")) && at < data; found++) {
    at += 8;
    uint64_t offset = strtoull(at, NULL, 10), block = 0;
    T_CHECK(offset == expected, "%s: array %u begins at %llu", name, found, (unsigned long long)offset);
    const unsigned char *head = (unsigned char *)data + 31 + offset;
    for (int i = 0; i < 8; i++) block |= (uint64_t)head[i] << (8 * i);
    expected = offset + 8 + block;
  }
  T_CHECK(found == arrays && data && !strcmp(data + 31 + expected, "\n  </AppendedData>\n</VTKFile>\n"),
          "%s: %u arrays fill the appended data", name, found);
  T_CHECK(strstr(text, "Name=\"curvature &lt;mean&gt; &amp; &quot;more&quot;\" NumberOfComponents=\"1\""),
          "%s: names of fields are escaped", name);
  free(bytes);
  batten_mesh_free(m);
}

static void test_bytes(batten_context *ctx, scratch *s) {
  batten_mesh *m = NULL;
  T_OK(batten_mesh_create(ctx, 4, tetrahedron, 4, faces, &m), ctx);
  T_OK(batten_write_mesh(ctx, m, scratch_file(s, "t.off")), ctx);
  size_t size;
  unsigned char *bytes = file_read(s->name, &size);
  static const char off[] = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  T_CHECK(size == sizeof off - 1 && !memcmp(bytes, off, size), "OFF of the tetrahedron, byte by byte");
  free(bytes);
  T_OK(batten_write_mesh(ctx, m, scratch_file(s, "t.stl")), ctx);
  bytes = file_read(s->name, &size);
  float normal_z;
  memcpy(&normal_z, bytes + 84 + 8, 4);
  T_CHECK(size == 84 + 4 * 50 && bytes[80] == 4 && normal_z == -1,
          "STL: size, count, normal (little-endian machine)");
  free(bytes);
  batten_mesh_free(m);
}

static void test_write_failures(batten_context *ctx, scratch *s) {
  batten_mesh *m = make_mesh(ctx);
  size_t before = scratch_count(s);
  T_STATUS(batten_write_mesh(ctx, m, scratch_file(s, "a.3mf")), BATTEN_E_INVALID, ctx,
           "written as .ply .obj .off .stl .vtp .vtu .vtk");
  T_STATUS(batten_write_mesh(ctx, m, scratch_file(s, "a.ply.gz")), BATTEN_E_INVALID, ctx, "written as .ply");
  T_STATUS(batten_write_mesh(ctx, m, scratch_file(s, "none/a.ply")), BATTEN_E_IO, ctx, "make the directory first");
  T_STATUS(batten_write_mesh(ctx, m, NULL), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_write_mesh(ctx, NULL, "a.ply"), BATTEN_E_INVALID, ctx, "mesh: NULL");
  mkdir(scratch_file(s, "folder.ply"), 0777);
  T_STATUS(batten_write_mesh(ctx, m, s->name), BATTEN_E_IO, ctx, "name a file in it");
  rmdir(s->name);
  T_CHECK(scratch_count(s) == before, "no file is left by what is refused");
  if (!access("/dev/full", W_OK)) {
    if (symlink("/dev/full", scratch_file(s, "full.obj"))) t_line(false, "the test makes a link");
    T_STATUS(batten_write_mesh(ctx, m, s->name), BATTEN_E_IO, ctx, "cannot write: No space left on device");
    unlink(s->name);
  } else {
    t_skip("a full disk", "no /dev/full");
  }
  /* An old file is replaced as a whole, keeps its mode, and is reached through links. */
  char real[400], link[400];
  snprintf(real, sizeof real, "%s", scratch_file(s, "real.off"));
  snprintf(link, sizeof link, "%s", scratch_file(s, "link.off"));
  file_write(real, "old", 3);
  chmod(real, 0640);
  if (symlink("real.off", link)) t_line(false, "the test makes a link");
  T_OK(batten_write_mesh(ctx, m, link), ctx);
  struct stat info;
  T_CHECK(!lstat(link, &info) && S_ISLNK(info.st_mode) && !stat(real, &info) && info.st_size > 3 &&
              (info.st_mode & 0777) == 0640,
          "a file behind a link is replaced, the link and the mode stay");
  double huge[9] = {1e300, 0, 0, 0, 1, 0, 0, 0, 1};
  batten_mesh *large = NULL;
  T_OK(batten_mesh_create(ctx, 3, huge, 1, faces + 1, &large), ctx);
  if (large)
    T_STATUS(batten_write_mesh(ctx, large, scratch_file(s, "huge.stl")), BATTEN_E_INVALID, ctx,
             "vertices[0]: 1e+300 is too large for the single precision");
  batten_mesh_free(large);
  batten_mesh_free(m);
}

static batten_status read_sample(batten_context *ctx, void *arg) {
  const sample *s = arg;
  batten_mesh *m = NULL;
  batten_status st = mesh_of(ctx, s->name, s->text, strlen(s->text), &m);
  batten_mesh_free(m);
  return st;
}

typedef struct write_job {
  const batten_mesh *mesh;
  const char *path;
} write_job;

static batten_status write_again(batten_context *ctx, void *arg) {
  const write_job *job = arg;
  return batten_write_mesh(ctx, job->mesh, job->path);
}

/* The blocks of the header's text and the numbers behind it, big endian. */
static void test_vtk_legacy(batten_context *ctx, scratch *s) {
  batten_mesh *m = make_mesh(ctx);
  T_OK(batten_write_mesh(ctx, m, scratch_file(s, "a.vtk")), ctx);
  size_t size = 0, vertices = batten_mesh_vertex_count(m), triangles = batten_mesh_triangle_count(m);
  char *bytes = (char *)file_read(s->name, &size), line[80];
  bytes[size] = 0;
  const char *points = strstr(bytes, " double\n");
  snprintf(line, sizeof line, "DATASET POLYDATA\nPOINTS %zu double\n", vertices);
  T_CHECK(points && strstr(bytes, line) && strncmp(bytes, "# vtk DataFile Version 3.0\n", 27) == 0, "header");
  double second = batten_mesh_vertices(m)[3];
  unsigned char big[8];
  uint64_t bits;
  memcpy(&bits, &second, sizeof bits);
  for (int i = 0; i < 8; i++) big[i] = (unsigned char)(bits >> (56 - 8 * i));
  T_CHECK(points && memcmp(points + 8 + 24, big, 8) == 0, "x of the second vertex, big endian");
  snprintf(line, sizeof line, "\nPOLYGONS %zu %zu\n", triangles, 4 * triangles);
  const char *polygons = points ? points + 8 + 24 * vertices : NULL;
  T_CHECK(polygons && memcmp(polygons, line, strlen(line)) == 0, "triangles follow the points");
  const unsigned char *corners = polygons ? (const unsigned char *)polygons + strlen(line) : NULL;
  T_CHECK(corners && corners[3] == 3 && corners[7] == batten_mesh_triangles(m)[0], "three corners");
  free(bytes);
  batten_mesh_free(m);
}

static batten_status read_back(batten_context *ctx, void *arg) {
  const write_job *job = arg;
  batten_mesh *m = NULL;
  batten_status st = batten_read_mesh(ctx, job->path, &m);
  batten_mesh_free(m);
  return st;
}

static void test_lost_memory(batten_context *ctx, scratch *s) {
  for (size_t i = 0; i < SAMPLES; i++)
    t_fail_every_allocation(samples[i].name, read_sample, (void *)(uintptr_t)&samples[i]);
  batten_mesh *m = make_mesh(ctx);
  write_job job = {m, scratch_file(s, "job.ply")};
  T_OK(batten_write_mesh(ctx, m, job.path), ctx);
  size_t files = scratch_count(s);
  t_fail_every_allocation("writing PLY", write_again, &job);
  t_fail_every_allocation("reading PLY with fields", read_back, &job);
  t_cancel_every_progress("reading PLY", read_back, &job);
  T_CHECK(scratch_count(s) == files, "no part files are left");
  batten_mesh_free(m);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_samples(ctx);
  test_round_trip(ctx, &s, "ply", true);
  test_round_trip(ctx, &s, "obj", true);
  test_round_trip(ctx, &s, "off", true);
  test_round_trip(ctx, &s, "stl", false);
  test_vtk(ctx, &s, "a.vtp", 5);
  test_vtk(ctx, &s, "a.vtu", 6);
  test_vtk_legacy(ctx, &s);
  test_bytes(ctx, &s);
  test_write_failures(ctx, &s);
  test_lost_memory(ctx, &s);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
