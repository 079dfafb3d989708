/* Points from every format: small files by hand, encodings, gzip, failures of memory, cancelling. */
#include "files.h"

#include <zlib.h>

/* What each small file must give: n, points, normals. */
typedef struct sample {
  const char *name, *text;
  unsigned n;
  size_t count;
  double points[12], normals[12];
  bool has_normals;
} sample;

static const sample samples[] = {
    {"a.xyz", "1 2 3\n4 5 6\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"no_newline.xyz", "1 2 3\n4 5 6", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"crlf.xyz", "1 2 3\r\n4 5 6\r\n\r\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"cr.xyz", "1 2 3\r4 5 6\r", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"bom.csv",
     "\xef\xbb\xbf"
     "1,2,3\n4,5,6\n",
     3,
     2,
     {1, 2, 3, 4, 5, 6},
     {0},
     false},
    {"comments.txt",
     "# hello\n  // more\n% and\n\n 1\t2  3 # here\n4 5 6 // there\n",
     3,
     2,
     {1, 2, 3, 4, 5, 6},
     {0},
     false},
    {"planar.txt", "1 2\n3 4\n5 6\n", 2, 3, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"planar_normals.txt", "1 2 0 1\n3 4 1 0\n", 2, 2, {1, 2, 3, 4}, {0, 1, 1, 0}, true},
    {"normals.xyz", "1 2 3 0 0 1\n4 5 6 0 1 0\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0, 0, 1, 0, 1, 0}, true},
    {"header.csv", "x,y,z\n1,2,3\n4,5,6\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"order.csv", "name;\"Z\";\"y [mm]\";x_mm\n a b;3;2;1\nnan;6;5;4;\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"named_normals.csv", "nx, ny, nz, intensity, x, y, z\n0,0,1,7,1,2,3\n", 3, 1, {1, 2, 3}, {0, 0, 1}, true},
    {"comment_names.asc", "//X Y Z R G B\n1 2 3 255 0 0\n4 5 6 0 0 0\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"comment_normals.txt", "# x y z nx ny nz\n1 2 3 0 0 1\n", 3, 1, {1, 2, 3}, {0, 0, 1}, true},
    {"zero_normals.xyz", "1 2 3 0 0 0\n4 5 6 0 0 0\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"comment_other.txt", "# x y are here\n1 2\n", 2, 1, {1, 2}, {0}, false},
    {"tabs.tsv", "1\t2\t3\n4\t5\t6\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"blanks.csv", "1 , 2 , 3\n4 , 5 , 6 ,\n", 3, 2, {1, 2, 3, 4, 5, 6}, {0}, false},
    {"ascii.ply",
     "ply\nformat ascii 1.0\ncomment x\nelement thing 2\nproperty list uchar int of\nproperty float a\n"
     "element vertex 2\nproperty float y\nproperty uchar red\nproperty double x\nproperty int z\n"
     "property list uchar float weights\nend_header\n0 1\n3 7 8 9 nan\n2 255 1 3 0\n\n5 0 4 6 2 .5 .5\n",
     3,
     2,
     {1, 2, 3, 4, 5, 6},
     {0},
     false},
    {"planar.ply",
     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float nx\n"
     "property float ny\nend_header\n1 2 0 1\n",
     2,
     1,
     {1, 2},
     {0, 1},
     true},
    {"ordered.obj",
     "# c\nmtllib m\nv 1 2 3\nvn 0 0 1\nv 4 5 6\nvn 0 1 0\n",
     3,
     2,
     {1, 2, 3, 4, 5, 6},
     {0, 0, 1, 0, 1, 0},
     true},
    {"corners.obj",
     "v 1 2 3 # c\nv 4 5 6 1\nv 7 8 9 .1 .2 .3\nvn 0 0 1\nvn 0 1 0\nf 1//1 2/5/2 3//1\n",
     3,
     3,
     {1, 2, 3, 4, 5, 6, 7, 8, 9},
     {0, 0, 1, 0, 1, 0, 0, 0, 1},
     true},
    {"some.obj",
     "v 1 2 3\nv 4 5 6\nv 7 8 9\nvn 0 0 1\nf 1//1 2//1 3\n",
     3,
     3,
     {1, 2, 3, 4, 5, 6, 7, 8, 9},
     {0},
     false},
    {"n.off",
     "NOFF # normals\n# comment\n\n2 0 0\n1 2 3 0 0 1\n4 5 6 0 1 0 # end\n",
     3,
     2,
     {1, 2, 3, 4, 5, 6},
     {0, 0, 1, 0, 1, 0},
     true},
    {"bare.off", "1 0 0\n1 2 3\n", 3, 1, {1, 2, 3}, {0}, false},
    {"stc.off", "STCNOFF 1 0 0\n1 2 3 0 0 1 255 0 0 255 .5 .5\n", 3, 1, {1, 2, 3}, {0, 0, 1}, true},
    {"t.stl",
     "solid t\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 4 5 6\nvertex -0 8 9\nendloop\nendfacet\n"
     "FACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 4 5 6\nVERTEX 1 2 3\nVERTEX 0 8 9\nENDLOOP\nENDFACET\nendsolid t\n",
     3,
     3,
     {1, 2, 3, 4, 5, 6, 0, 8, 9},
     {0},
     false},
};
enum { SAMPLES = sizeof samples / sizeof samples[0] };

static bool agrees(const sample *s, const batten_cloud *c) {
  return c->n == s->n && c->count == s->count && !memcmp(c->points, s->points, s->n * s->count * sizeof(double)) &&
         !c->normals == !s->has_normals && !c->parameters && !c->weights &&
         (!c->normals || !memcmp(c->normals, s->normals, s->n * s->count * sizeof(double)));
}

static size_t differing(batten_context *ctx) {
  size_t bad = 0;
  for (size_t i = 0; i < SAMPLES; i++) {
    batten_cloud c = {0};
    batten_status st = points_of(ctx, samples[i].name, samples[i].text, strlen(samples[i].text), 0, &c);
    bool ok = st == BATTEN_OK && agrees(&samples[i], &c);
    if (!ok) printf("# %s: %s, n %u, %zu points\n", samples[i].name, batten_error(ctx), c.n, c.count);
    bad += !ok;
    batten_cloud_free(ctx, &c);
  }
  return bad;
}

static void test_samples(batten_context *ctx) {
  size_t bad = differing(ctx);
  T_CHECK(bad == 0, "%d small files of points, %zu differ", SAMPLES, bad);
}

/* Parameters and weights: two points (1, 2, 3), (4, 5, 6) with what each file has. */
typedef struct parameter_sample {
  const char *name, *text;
  bool parameters, weights;
} parameter_sample;

static const parameter_sample parameter_samples[] = {
    {"a.csv", "x,y,z,u,v\n1,2,3,0.25,0.5\n4,5,6,1,-1\n", true, false},
    {"b.txt", "# u v x y z\n.25 .5 1 2 3\n1 -1 4 5 6\n", true, false},
    {"c.csv", "W;V;U;Z;Y;X;name\n2;.5;.25;3;2;1;a\n0;-1;1;6;5;4;b\n", true, true},
    {"d.txt", "x y z weight\n1 2 3 2\n4 5 6 0\n", false, true},
    {"e.csv", "x,y,z,u,uv\n1,2,3,here,1\n4,5,6,there,1\n", false, false}, /* u alone is another thing */
    {"f.ply",
     "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty double v\nproperty int "
     "w\nproperty float z\nproperty double u\nproperty float weight\nend_header\n1 2 .5 2 3 .25 nan\n"
     "4 5 -1 0 6 1 7\n",
     true, true},
    {"g.ply",
     "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float "
     "weight\nproperty float u\nproperty float s\nproperty float t\nend_header\n1 2 3 2 nan 0 0\n4 5 6 0 1 0 0\n",
     false, true},
};

enum { PARAMETER_SAMPLES = sizeof parameter_samples / sizeof parameter_samples[0] };

static void test_parameters(batten_context *ctx) {
  static const double points[6] = {1, 2, 3, 4, 5, 6}, parameters[4] = {0.25, 0.5, 1, -1}, weights[2] = {2, 0};
  for (size_t i = 0; i < PARAMETER_SAMPLES; i++) {
    const parameter_sample *s = &parameter_samples[i];
    batten_cloud c = {0};
    T_OK(points_of(ctx, s->name, s->text, strlen(s->text), 0, &c), ctx);
    bool right = c.count == 2 && c.n == 3 && c.points && !memcmp(c.points, points, sizeof points) && !c.normals &&
                 !c.parameters == !s->parameters && !c.weights == !s->weights &&
                 (!c.parameters || !memcmp(c.parameters, parameters, sizeof parameters)) &&
                 (!c.weights || !memcmp(c.weights, weights, sizeof weights));
    T_CHECK(right, "%s:%s%s", s->name, s->parameters ? " parameters" : "", s->weights ? " weights" : "");
    batten_cloud_free(ctx, &c);
  }
  batten_cloud c = {0};
  const char *flat = "x y z u v w\n1 2 0 3 4 5\n";
  T_OK(points_of(ctx, "a.txt", flat, strlen(flat), 2, &c), ctx);
  T_CHECK(c.n == 2 && c.points[1] == 2 && c.parameters && c.parameters[1] == 4 && c.weights && c.weights[0] == 5,
          "in the plane");
  batten_cloud_free(ctx, &c);
  T_STATUS(points_of(ctx, "a.csv", "x,y,u,v\n1,2,nan,4\n", 18, 0, &c), BATTEN_E_FORMAT, ctx,
           "a.csv:2: column 3: 'nan'");
  const char *ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float u\n"
      "property float v\nend_header\n1 2 3 inf\n";
  T_STATUS(points_of(ctx, "a.ply", ply, strlen(ply), 0, &c), BATTEN_E_FORMAT, ctx, "a.ply:9: v: 'inf'");
  T_CHECK(c.points == NULL, "the result is untouched");
}

/* The same points as binary PLY in both orders and as binary STL whose header begins with "solid". */
static void test_binary(batten_context *ctx) {
  for (int big = 0; big < 2; big++) {
    unsigned char file[512];
    size_t at = (size_t)snprintf(
        (char *)file, sizeof file,
        "ply\nformat binary_%s_endian 1.0\nelement vertex 2\nproperty double x\n"
        "property float y\nproperty short z\nproperty char c\nproperty list uchar ushort l\nend_header\n",
        big ? "big" : "little");
    for (int i = 0; i < 2; i++) {
      double x = 1.5 - 3 * i;
      float y = 2.25f;
      uint64_t bits64;
      uint32_t bits32;
      uint16_t bits16 = (uint16_t)(-300 + 600 * i);
      memcpy(&bits64, &x, 8);
      memcpy(&bits32, &y, 4);
      for (int k = 0; k < 8; k++) file[at++] = (unsigned char)(bits64 >> (big ? 56 - 8 * k : 8 * k));
      for (int k = 0; k < 4; k++) file[at++] = (unsigned char)(bits32 >> (big ? 24 - 8 * k : 8 * k));
      for (int k = 0; k < 2; k++) file[at++] = (unsigned char)(bits16 >> (big ? 8 - 8 * k : 8 * k));
      file[at++] = 0x80;
      file[at++] = (unsigned char)i;
      for (int k = 0; k < 2 * i; k++) file[at++] = 9;
    }
    batten_cloud c = {0};
    T_OK(points_of(ctx, "b.ply", file, at, 0, &c), ctx);
    const double expected[6] = {1.5, 2.25, -300, -1.5, 2.25, 300};
    T_CHECK(c.count == 2 && c.points && !memcmp(c.points, expected, sizeof expected), "PLY, %s endian",
            big ? "big" : "little");
    batten_cloud_free(ctx, &c);
    size_t wrong = 0;
    for (size_t cut = 0; cut < at; cut++) { /* exact-size blocks, so that a sanitizer sees a byte too far */
      unsigned char *part = malloc(cut ? cut : 1);
      memcpy(part, file, cut);
      wrong += points_of(ctx, "b.ply", part, cut, 0, &c) != BATTEN_E_FORMAT;
      free(part);
    }
    T_CHECK(wrong == 0, "each of the %zu shorter files is refused", at);
  }
  unsigned char stl[84 + 50] = "solid but binary";
  stl[80] = 1;
  for (int i = 0; i < 9; i++) {
    float value = (float)(i * i);
    uint32_t bits;
    memcpy(&bits, &value, 4);
    for (int k = 0; k < 4; k++) stl[84 + 12 + 4 * i + k] = (unsigned char)(bits >> (8 * k));
  }
  batten_cloud c = {0};
  T_OK(points_of(ctx, "b.stl", stl, sizeof stl, 0, &c), ctx);
  T_CHECK(c.count == 3 && c.points[8] == 64, "binary STL that begins with solid");
  batten_cloud_free(ctx, &c);
}

static void test_dimension(batten_context *ctx) {
  batten_cloud c = {0};
  const char *flat = "1 2 0 0 1 0\n3 4 0 1 0 0\n";
  T_OK(points_of(ctx, "a.xyz", flat, strlen(flat), 2, &c), ctx);
  T_CHECK(
      c.n == 2 && c.points[2] == 3 && c.points[3] == 4 && c.normals[0] == 0 && c.normals[1] == 1 && c.normals[2] == 1,
      "n = 2 of points with z = 0");
  batten_cloud_free(ctx, &c);
  T_STATUS(points_of(ctx, "a.xyz", "1 2 0\n1 2 3\n", 12, 2, &c), BATTEN_E_FORMAT, ctx, "points[1]: z = 3, but n = 2");
  T_STATUS(points_of(ctx, "a.xyz", "1 2\n", 4, 3, &c), BATTEN_E_FORMAT, ctx, "x and y only, but n = 3");
  T_STATUS(points_of(ctx, "a.xyz", "1 2 3 4\n", 8, 3, &c), BATTEN_E_FORMAT, ctx, "a.xyz:1: 4 columns without names");
  T_CHECK(c.points == NULL, "the result is untouched");
}

static size_t compress_text(const char *text, size_t size, unsigned char *out, size_t room) {
  z_stream z = {.next_in = (unsigned char *)(uintptr_t)text,
                .avail_in = (unsigned)size,
                .next_out = out,
                .avail_out = (unsigned)room};
  deflateInit2(&z, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  deflate(&z, Z_FINISH);
  deflateEnd(&z);
  return room - z.avail_out;
}

static void test_gzip(batten_context *ctx) {
  enum { N = 20000 };
  char *text = malloc(N * 32);
  size_t size = 0;
  for (int i = 0; i < N; i++) size += (size_t)sprintf(text + size, "%d %d.5 %d\n", i, i * 7 % 1000, -i);
  unsigned char *zip = malloc(N * 32);
  /* two members, as of `cat a.gz b.gz`, then padding */
  size_t half = size / 2, first = compress_text(text, half, zip, N * 16);
  size_t all = first + compress_text(text + half, size - half, zip + first, N * 16);
  memset(zip + all, 0, 100);
  batten_cloud c = {0};
  T_OK(points_of(ctx, "a.xyz.gz", zip, all + 100, 0, &c), ctx);
  T_CHECK(c.count == N && c.points[3 * (N - 1)] == N - 1 && c.points[3 * 7 + 1] == 49.5, "gzip of two members");
  batten_cloud_free(ctx, &c);
  T_STATUS(points_of(ctx, "a.xyz.gz", zip, all - 5, 0, &c), BATTEN_E_FORMAT, ctx, "cut off");
  zip[first / 2] ^= 0xff;
  T_CHECK(points_of(ctx, "a.xyz.gz", zip, all, 0, &c) == BATTEN_E_FORMAT, "damaged gzip: %s", batten_error(ctx));
  zip[first / 2] ^= 0xff;
  zip[first - 8] ^= 1;
  T_STATUS(points_of(ctx, "a.xyz.gz", zip, all, 0, &c), BATTEN_E_FORMAT, ctx, "gzip data are damaged");
  T_CHECK(c.points == NULL, "the result is untouched");
  free(zip);
  free(text);
}

static void test_long_lines(batten_context *ctx) {
  size_t size = 3 << 20;
  char *text = malloc(size);
  memset(text, ' ', size);
  memcpy(text, "1 2 3", 5);
  text[size - 1] = '4';
  batten_cloud c = {0};
  T_STATUS(points_of(ctx, "a.xyz", text, size, 0, &c), BATTEN_E_FORMAT, ctx, "a.xyz:1: a line of more than 1048576");
  memset(text, 'x', size);
  text[0] = '#';
  memcpy(text + 900000, "\n1 2 3\n", 7);
  T_OK(points_of(ctx, "a.xyz", text, 900007, 0, &c), ctx);
  T_CHECK(c.count == 1 && c.points[2] == 3, "a line of 900,000 bytes");
  batten_cloud_free(ctx, &c);
  free(text);
}

static batten_status read_sample(batten_context *ctx, void *arg) {
  const sample *s = arg;
  batten_cloud c;
  batten_status st = points_of(ctx, s->name, s->text, strlen(s->text), 0, &c);
  if (st == BATTEN_OK) batten_cloud_free(ctx, &c);
  return st;
}

static batten_status read_zip(batten_context *ctx, void *arg) {
  unsigned char zip[256];
  size_t size = compress_text("1 2 3\n4 5 6\n", 12, zip, sizeof zip);
  batten_cloud c;
  (void)arg;
  batten_status st = points_of(ctx, "a.xyz.gz", zip, size, 0, &c);
  if (st == BATTEN_OK) batten_cloud_free(ctx, &c);
  return st;
}

static void test_files(batten_context *ctx) {
  scratch s;
  scratch_open(&s);
  const char *path = scratch_file(&s, "A.XYZ");
  file_write(path, "1 2 3\n", 6);
  batten_cloud c = {0};
  T_OK(batten_read_points(ctx, path, NULL, &c), ctx);
  T_CHECK(c.count == 1 && c.points[2] == 3, "a file on disk, extension in capitals");
  batten_cloud_free(ctx, &c);
  batten_cloud_free(ctx, &c);
  batten_cloud_free(ctx, NULL);
  batten_read_points_options o = batten_read_points_options_default();
  o.n = 4;
  T_STATUS(batten_read_points(ctx, path, &o, &c), BATTEN_E_INVALID, ctx, "opt.n: 4; 2, 3, or 0");
  o.struct_size = 0;
  T_STATUS(batten_read_points(ctx, path, &o, &c), BATTEN_E_INVALID, ctx, "struct_size: 0");
  T_STATUS(batten_read_points(ctx, NULL, NULL, &c), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_read_points(ctx, "", NULL, &c), BATTEN_E_INVALID, ctx, "path: empty");
  T_STATUS(batten_read_points(ctx, path, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_read_points(ctx, scratch_file(&s, "none.ply"), NULL, &c), BATTEN_E_IO, ctx, "check the name");
  T_STATUS(batten_read_points(ctx, "a.docx", NULL, &c), BATTEN_E_INVALID, ctx, "read from .xyz .txt .csv");
  T_STATUS(batten_read_points(ctx, "folder.d/a", NULL, &c), BATTEN_E_INVALID, ctx, "read from .xyz .txt .csv");
  T_STATUS(batten_read_points(ctx, "a.gz", NULL, &c), BATTEN_E_INVALID, ctx, "read from .xyz .txt .csv");
  file_write(scratch_file(&s, "empty.xyz"), "", 0);
  T_STATUS(batten_read_points(ctx, s.name, NULL, &c), BATTEN_E_FORMAT, ctx, "no points in the file");
  T_CHECK(c.points == NULL && batten_bytes_in_use(ctx) == 0, "nothing is left");
  scratch_close(&s);
}

static void test_shared(batten_context *ctx) {
  static const struct {
    const char *file;
    size_t count;
  } data[] = {{"phobos/phobos_thomas_xyz.txt", 16022},
              {"vipss/vertebra_500.xyz", 500},
              {"vipss/torus_gt.obj", 4096},
              {"meshes/femur.off", 3897}};
  const char *root = getenv("BATTEN_SHARED");
  for (size_t i = 0; i < sizeof data / sizeof data[0]; i++) {
    char path[1024];
    snprintf(path, sizeof path, "%s/data/%s", root ? root : "", data[i].file);
    if (!root || access(path, R_OK)) {
      t_skip(data[i].file, "not there");
      continue;
    }
    batten_cloud c = {0};
    T_OK(batten_read_points(ctx, path, NULL, &c), ctx);
    T_CHECK(c.count == data[i].count, "%s: %zu points", data[i].file, c.count);
    batten_cloud_free(ctx, &c);
  }
}

/* All rows of a table of offsets, at station, half-breadth and waterline. */
static void test_offsets(batten_context *ctx) {
  static const char text[] = "z_m,x_m,half_breadth_m\n1,5,0\n2,5,0\n3,5,4\n";
  batten_cloud c = {0};
  T_OK(points_of(ctx, "a.csv", text, strlen(text), 0, &c), ctx);
  T_CHECK(c.n == 3 && c.count == 3 && c.points[0] == 5 && c.points[1] == 0 && c.points[2] == 1 && c.points[7] == 4,
          "%zu points of a table of offsets", c.count);
  batten_cloud_free(ctx, &c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_samples(ctx);
  test_parameters(ctx);
  test_binary(ctx);
  test_dimension(ctx);
  test_gzip(ctx);
  test_long_lines(ctx);
  test_offsets(ctx);
  test_files(ctx);
  test_shared(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  for (size_t i = 0; i < SAMPLES; i++)
    t_fail_every_allocation(samples[i].name, read_sample, (void *)(uintptr_t)&samples[i]);
  for (size_t i = 0; i < PARAMETER_SAMPLES; i++) {
    sample s = {.name = parameter_samples[i].name, .text = parameter_samples[i].text};
    t_fail_every_allocation(s.name, read_sample, &s);
  }
  t_fail_every_allocation("gzip", read_zip, NULL);
  t_cancel_every_progress("gzip", read_zip, NULL);
  t_cancel_every_progress("text", read_sample, (void *)(uintptr_t)&samples[0]);
  return t_done();
}
