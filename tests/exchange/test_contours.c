/* Contours in text: how they are parted, columns, tables of offsets, planes in space, what is refused and where, real
 * data. */
#include "files.h"

static batten_status read_bytes(batten_context *ctx, const char *name, const void *bytes, size_t size,
                                batten_contours *out) {
  bx_reader r;
  batten_status st = bx_open_memory(&r, ctx, name, bytes, size);
  if (st != BATTEN_OK) return st;
  st = bx_read_contours_from(&r, out);
  bx_close(&r);
  return st;
}

static batten_contours read_good(batten_context *ctx, const char *text) {
  batten_contours c = {0};
  T_OK(read_bytes(ctx, "a.txt", text, strlen(text), &c), ctx);
  return c;
}

/* Contours, their first rows and the end, ended by SIZE_MAX; points row by row. */
static bool has(const batten_contours *c, const size_t *starts, const double *points) {
  size_t count = 0;
  while (starts[count] != SIZE_MAX) count++;
  return c->count + 1 == count && !memcmp(c->starts, starts, count * sizeof *starts) &&
         !memcmp(c->points, points, 2 * starts[count - 1] * sizeof *points);
}

/* ---- parting ----------------------------------------------------------------------------------------- */

static void test_parting(batten_context *ctx) {
  static const double points[] = {0, 0, 1, 0.5, 2, -1, 5, 5, 6, 7};
  static const size_t two[] = {0, 3, 5, SIZE_MAX}, one[] = {0, 5, SIZE_MAX};
  static const struct {
    const char *text;
    const size_t *starts;
  } cases[] = {
      {"0 0\n1 .5\n2 -1\n\n5 5\n6 7\n", two},
      {"\n\n  \n0 0\n1 .5\n2 -1\n\n \t\n\n5 5\n6 7\n\n\n", two},
      {"# a\n0 0\n1 .5 # here\n2 -1\n\n# b\n5 5\n# no part\n6 7", two},
      {"0 0\n1 .5\n2 -1\n# not empty\n5 5\n6 7\n", one},
      {"contour 3\n0 0\n1 .5\n2 -1\ncontour 2\n5 5\n6 7\n", two},
      {"contour 3 # first\r\n0 0\r\n\r\n1 .5\r\n2 -1\r\n\r\n  contour 2\r\n5 5\r\n6 7", two},
      {"contour 5\n0 0\n1 .5\n2 -1\n\n5 5\n6 7\n", one},
      {"x,y,contour\n0,0,a\n1,.5,a\n2,-1,a\n5,5,b\n6,7,b\n", two},
      {"x,y,contour\n0,0,1\n5,5,2\n\n1,.5,1\n6,7,2\n\n2,-1,1\n", two},
      {"Contour;Y;X\na b;0;0\n\"c\";5;5\na b;.5;1\na b;-1;2\n\"c\";7;6\n", two},
      {"curve,t,x,y,curvature\n0,0,0,0,7\n0,1,1,.5,nan\n0,2,2,-1,-\n1,0,5,5,0\n1,1,6,7,-\n", two},
      {"# contour x y\n1 0 0\n1 1 .5\n1 2 -1\n2 5 5\n2 6 7\n", two},
      {"x y\ncontour 3\n0 0\n1 .5\n2 -1\ncontour 2\n5 5\n6 7\n", two},
      {"0\t0\n1\t.5\n2\t-1\n\n5\t5\n6\t7\n", two},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_contours c = read_good(ctx, cases[i].text);
    T_CHECK(c.count && has(&c, cases[i].starts, points) && !c.planes && !c.weights, "case %zu: %zu contours", i,
            c.count);
    T_CHECK((c.parameters != NULL) == (i == 10), "case %zu: parameters %s", i, c.parameters ? "taken" : "none");
    batten_contours_free(ctx, &c);
  }
  batten_contours c = read_good(ctx, "w t y x\n2 0.25 0 1\n3 0.5 7 8\n");
  T_CHECK(c.weights && c.parameters && c.weights[1] == 3 && c.parameters[0] == 0.25 && c.points[2] == 8,
          "weights and parameters by their names");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "contour,w,t,x,y\n1,1,2,3,4\n2,5,6,7,8\n1,9,10,11,12\n");
  T_CHECK(c.count == 2 && c.weights[0] == 1 && c.weights[1] == 9 && c.weights[2] == 5 && c.parameters[1] == 10 &&
              c.parameters[2] == 6,
          "and they follow their contour");
  batten_contours_free(ctx, &c);
  T_CHECK(!c.starts && !c.points && !c.count, "empty after it is freed");
}

/* Tables of airfoils: a title on the first line of .dat, and nowhere else. */
static void test_title(batten_context *ctx) {
  static const char text[] = "NACA 0012, 1933\n1 0.00126\n0 0\n1 -0.00126\n";
  static const char late[] = "\nNACA 0012\n1 0\n";
  batten_contours c = {0};
  T_OK(read_bytes(ctx, "a.DAT", text, strlen(text), &c), ctx);
  T_CHECK(c.count == 1 && c.starts[1] == 3 && c.points[1] == 0.00126, "a title above an airfoil");
  batten_contours_free(ctx, &c);
  T_STATUS(read_bytes(ctx, "a.txt", text, strlen(text), &c), BATTEN_E_FORMAT, ctx,
           "a.txt:1: the header 'NACA 0012, 1933' names no columns x and y");
  T_STATUS(read_bytes(ctx, "a.dat", late, strlen(late), &c), BATTEN_E_FORMAT, ctx,
           "a.dat:2: the header 'NACA 0012' names no columns x and y");
  batten_cloud cloud = {0};
  T_OK(points_of(ctx, "a.txt", "contour 2\n1 2 3\n4 5 6\ncontour 1\n7 8 9\n", 38, 0, &cloud), ctx);
  T_CHECK(cloud.count == 3 && cloud.points[6] == 7, "as points, without the lines that part them");
  batten_cloud_free(ctx, &cloud);
}

static void check_airfoil(batten_context *ctx, const char *text, size_t count, const double *wanted,
                          const char *what) {
  batten_contours c = {0};
  T_OK(read_bytes(ctx, "l.dat", text, strlen(text), &c), ctx);
  T_CHECK(c.count == 1 && c.starts[1] == count && !memcmp(c.points, wanted, 2 * count * sizeof *wanted),
          "%s: %zu contours, %zu points", what, c.count, c.starts[c.count]);
  batten_contours_free(ctx, &c);
}

/* Lednicer's tables of airfoils: counts, upper surface, lower surface, both from the nose. */
static void test_surfaces(batten_context *ctx) {
  static const double sharp[] = {1, .1, .5, .3, 0, 0, .5, -.2, 1, -.1};
  static const double blunt[] = {1, .1, .5, .3, 0, .01, 0, -.01, .5, -.2, 1, -.1};
  static const double plain[] = {3, 2, 0, 0, .5, .3, 1, .1};
  static const char upside[] = "NACA\n3. 3.\n\n0 0\n.5 .3\n1 .1\n0 0\n.5 -.2\n1 -.1\n\n0 0\n";
  check_airfoil(ctx, "NACA 1\n  3.  3.\n\n0 0\n.5 .3\n1 .1\n\n0 0\n.5 -.2\n1 -.1\n", 5, sharp,
                "two surfaces, the nose in both");
  check_airfoil(ctx, "NACA 1\r\n3 3\r\n0 0\r\n.5 .3\r\n1 .1\r\n0 0\r\n.5 -.2\r\n1 -.1", 5, sharp,
                "without blank lines");
  check_airfoil(ctx, "NACA 1\n3 3\n\n0 .01\n.5 .3\n1 .1\n\n0 -.01\n.5 -.2\n1 -.1\n", 6, blunt,
                "a nose of two points");
  check_airfoil(ctx, "NACA 1\n3 2\n0 0\n.5 .3\n1 .1\n", 4, plain, "whole coordinates of a first point");
  batten_contours c = {0};
  T_STATUS(read_bytes(ctx, "l.dat", upside, strlen(upside), &c), BATTEN_E_FORMAT, ctx,
           "l.dat: the first line of numbers says that 3 and 3 points of two surfaces follow, but there are 7; "
           "correct or remove it");
  T_OK(read_bytes(ctx, "l.txt", upside + 5, strlen(upside) - 5, &c), ctx);
  T_CHECK(c.count == 3 && c.starts[1] == 1 && c.points[0] == 3, "only in .dat: %zu contours", c.count);
  batten_contours_free(ctx, &c);
}

/* As many contours as rows, from both ends. */
static void test_many(batten_context *ctx) {
  enum { CONTOURS = 3000 };
  char *text = malloc(2 * CONTOURS * 32), *at = text + sprintf(text, "contour x y\n");
  for (int i = 0; i < CONTOURS; i++) at += sprintf(at, "c%d %d 0\n", i, i);
  for (int i = CONTOURS - 1; i >= 0; i--) at += sprintf(at, "c%d %d 1\n", i, i);
  batten_contours c = read_good(ctx, text);
  bool same = c.count == CONTOURS;
  for (size_t i = 0; same && i < CONTOURS; i++)
    same = c.starts[i] == 2 * i && c.points[4 * i] == (double)i && c.points[4 * i + 1] == 0 &&
           c.points[4 * i + 2] == (double)i && c.points[4 * i + 3] == 1;
  T_CHECK(same, "%zu contours of two rows that are far apart", c.count);
  batten_contours_free(ctx, &c);
  free(text);
}

/* ---- tables of offsets ------------------------------------------------------------------------------- */

/* Two stations of two points each, (0, 1) (2, 3) in x = 5 and (0, 2) (4, 3) in x = 7, whatever the table is like. */
static void test_offsets(batten_context *ctx) {
  static const double points[] = {0, 1, 2, 3, 0, 2, 4, 3};
  static const size_t two[] = {0, 2, 4, SIZE_MAX};
  static const char *const tables[] = {
      "x_m,z_m,half_breadth_m\n5,1,0\n5,3,2\n7,2,0\n7,3,4\n",
      "x_m,z_m,half_breadth_m\n7,3,4\n7,2,0\n\n5,3,2\n5,1,0\n", /* from the bow and the deck; blank lines do not part
                                                                 */
      "x_m;z_m;\"half-breadth [m]\"\n5;1;0\n7;2;0\n\n5;3;2\n7;3;4\n", /* waterline by waterline */
      "station,waterline,y\n7,2,0\n5,3,2\n5,1,0\n7,3,4\n",
      "Waterline HalfBreadth Station\n1 0 5\n3 2 5\n2 0 7\n3 4 7\n",
      "# station z half_breadth\n5 1 0\n5 3 2\n7 2 0\n7 3 4\n",
      "station,x,waterline,z,y,half_breadth\n1,5,1,1,9,0\n1,5,2,3,9,2\n2,7,1,2,9,0\n2,7,3,3,9,4\n", /* their numbers,
                                                                                                       too */
      "x,z,half_breadth\n5,-1,0\n5,0,0\n5,1,0\n5,3,2\n7,0,0\n7,2,0\n7,3,4\n8,0,0\n8,1,0\n9,5,1\n4,2,2\n4,2,2\n",
  };
  for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
    batten_contours c = read_good(ctx, tables[i]);
    T_CHECK(c.count && has(&c, two, points) && c.planes && c.planes[0].origin[0] == 5 && c.planes[1].origin[0] == 7 &&
                c.planes[0].origin[1] == 0 && c.planes[0].axes[0][1] == 1 && c.planes[1].axes[1][2] == 1,
            "offsets %zu: %zu stations", i, c.count);
    batten_contours_free(ctx, &c);
  }
  /* a bulb under a bow: the middle between them stays, that above the deck does not */
  static const double bulb[] = {0, 1, 1, 2, 0, 3, 0, 4, 2, 5, 0, 6};
  static const size_t one[] = {0, 6, SIZE_MAX};
  batten_contours c =
      read_good(ctx, "x z half_breadth w\n5 0 0 1\n5 1 0 2\n5 2 1 3\n5 3 0 4\n5 4 0 5\n5 5 2 6\n5 6 0 7\n5 7 0 8\n");
  T_CHECK(c.count && has(&c, one, bulb) && c.weights && c.weights[0] == 2 && c.weights[5] == 7,
          "zeros between points stay, those at the ends do not; weights follow their points");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "x,z,half_breadth\n1,0,2\n1,0,0\n1,1,2\n");
  T_CHECK(c.count == 1 && c.points[0] == 2 && c.points[2] == 0, "rows of one waterline keep their order");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "x,y,half_breadth\n1,2,3\n4,5,6\n");
  T_CHECK(c.count == 1 && !c.planes && c.points[3] == 5, "without waterlines it is a plane contour");
  batten_contours_free(ctx, &c);
}

static void test_gunnerus(batten_context *ctx) {
  char path[400];
  const char *shared = getenv("BATTEN_SHARED");
  snprintf(path, sizeof path, "%s/data/hulls/gunnerus_offsets.csv", shared ? shared : "none");
  if (access(path, R_OK)) {
    printf("# skipped: no %s\n", path);
    return;
  }
  batten_contours c = {0};
  T_OK(batten_read_contours(ctx, path, &c), ctx);
  bool ascending = c.count > 0;
  double widest = 0;
  for (size_t i = 0; i < c.count; i++) {
    if (i > 0) ascending = ascending && c.planes[i].origin[0] > c.planes[i - 1].origin[0];
    for (size_t k = c.starts[i]; k < c.starts[i + 1]; k++) {
      widest = fmax(widest, c.points[2 * k]);
      if (k > c.starts[i]) ascending = ascending && c.points[2 * k + 1] > c.points[2 * k - 1];
    }
  }
  printf("# %zu stations, %zu points\n", c.count, c.starts[c.count]);
  T_CHECK(c.count == 63 && c.planes[0].origin[0] == 0 && c.planes[62].origin[0] == 35.96 && ascending &&
              c.points[0] == 0 && c.points[1] == 1.5 && fabs(widest - 4.8051) < 1e-12,
          "a hull of %zu stations, half as wide as %g", c.count, widest);
  batten_contours_free(ctx, &c);
}

/* ---- planes ------------------------------------------------------------------------------------------ */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* How far the plane's points are from those in space, and its axes from a right angle. */
static double plane_error(const batten_contours *c, size_t which, const double (*space)[3]) {
  const batten_plane *p = &c->planes[which];
  double worst = fabs(dot(p->axes[0], p->axes[1]));
  for (int k = 0; k < 2; k++) worst = fmax(worst, fabs(dot(p->axes[k], p->axes[k]) - 1));
  for (size_t i = c->starts[which]; i < c->starts[which + 1]; i++)
    for (int k = 0; k < 3; k++)
      worst = fmax(worst, fabs(p->origin[k] + c->points[2 * i] * p->axes[0][k] +
                               c->points[2 * i + 1] * p->axes[1][k] - space[i - c->starts[which]][k]));
  return worst;
}

static void test_constant(batten_context *ctx) {
  batten_contours c = read_good(ctx, "1 2 -98.44\n3 4 -98.44\n0 7 -98.44\n\n1 2 5\n5 6 5\n");
  T_CHECK(c.planes && c.planes[0].origin[2] == -98.44 && c.planes[1].origin[2] == 5 && c.planes[0].axes[0][0] == 1 &&
              c.planes[0].axes[1][1] == 1 && c.points[2] == 3 && c.points[3] == 4,
          "z constant: x y");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "1 3 4\n2 3 5\n7 3 5\n");
  T_CHECK(c.planes && c.planes[0].origin[1] == 3 && c.planes[0].axes[0][0] == 1 && c.planes[0].axes[1][2] == 1 &&
              c.points[1] == 4 && c.points[2] == 2,
          "y constant: x z");
  batten_contours_free(ctx, &c);
  /* the second contour alone would have z constant */
  c = read_good(ctx, "-2 3 4\n-2 4 5\n-2 3 5\n\n9 0 1\n9 1 1\n9 2 1\n");
  T_CHECK(c.planes && c.planes[0].origin[0] == -2 && c.planes[1].origin[0] == 9 && c.planes[1].axes[0][1] == 1 &&
              c.planes[1].axes[1][2] == 1 && c.points[6] == 0 && c.points[7] == 1,
          "x constant: y z, also where a section is straight");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "1 3 4\n2 3 5\n7 3 5\n\n1 2 3\n4 5 3\n0 0 3\n");
  T_CHECK(c.planes && c.planes[0].origin[1] == 3 && c.planes[1].origin[2] == 3, "each its own where none is shared");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "x,y,z\n5,6,7\n\n5,6,8\n5,6,8\n");
  T_CHECK(
      c.planes && c.planes[0].origin[2] == 7 && c.points[0] == 5 && c.points[1] == 6 && c.planes[1].origin[2] == 8,
      "single points");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "0 0 1\n1 0 1.0000005\n1 1 1\n");
  T_CHECK(c.planes && fabs(c.planes[0].origin[2] - 1.00000025) < 1e-15 && c.planes[0].axes[0][0] == 1,
          "constant to what a file rounds: the middle");
  batten_contours_free(ctx, &c);
}

static void test_oblique(batten_context *ctx) {
  uint64_t seed = 6;
  double worst = 0, turned = 0;
  for (int trial = 0; trial < 200; trial++) {
    enum { POINTS = 20 };
    double a[3], b[3], at[3], space[POINTS][3];
    char text[POINTS * 90], *end = text;
    for (int k = 0; k < 3; k++) {
      a[k] = t_uniform(&seed) - 0.5;
      b[k] = t_uniform(&seed) - 0.5;
      at[k] = 10 * t_uniform(&seed);
    }
    double size = ldexp(1, trial % 41 * 4 - 80); /* the numbers' own size does not matter */
    for (int i = 0; i < POINTS; i++) {
      double s = cos(0.3 * i), t = sin(0.3 * i) * (1 + 0.1 * i);
      for (int k = 0; k < 3; k++) space[i][k] = size * (at[k] + s * a[k] + t * b[k]);
      end += sprintf(end, "%.17g %.17g %.17g\n", space[i][0], space[i][1], space[i][2]);
    }
    batten_contours c = {0};
    if (read_bytes(ctx, "a.txt", text, strlen(text), &c) != BATTEN_OK) {
      worst = INFINITY;
      continue;
    }
    batten_plane plane = c.planes[0];
    for (int k = 0; k < 3; k++) plane.origin[k] /= size;
    for (size_t i = 0; i < 2 * POINTS; i++) c.points[i] /= size;
    for (int i = 0; i < POINTS; i++)
      for (int k = 0; k < 3; k++) space[i][k] /= size;
    c.planes[0] = plane;
    worst = fmax(worst, plane_error(&c, 0, (const double(*)[3])space));
    for (int k = 0; k < 2; k++) turned = fmax(turned, fabs(dot(plane.origin, plane.axes[k])));
    batten_contours_free(ctx, &c);
  }
  T_RATIO(worst, 1e-12, "200 oblique planes: points in space come back");
  T_RATIO(turned, 1e-12, "the origin is the place next to that of space");
  /* almost z = 0: axes almost x and y */
  batten_contours c = read_good(ctx, "0 0 0\n1 0 1e-3\n1 1 1e-3\n0 1 0\n");
  T_CHECK(c.planes && fabs(c.planes[0].axes[0][0] - 1) < 1e-5 && fabs(c.planes[0].axes[1][1] - 1) < 1e-5,
          "axes next to those of space");
  batten_contours_free(ctx, &c);
  c = read_good(ctx, "0 0 0\n1 2 3\n-2 -4 -6\n0.5 1 1.5\n");
  const double line[4][3] = {{0, 0, 0}, {1, 2, 3}, {-2, -4, -6}, {0.5, 1, 1.5}};
  T_RATIO(c.planes ? plane_error(&c, 0, line) : INFINITY, 1e-14, "a straight line has a plane");
  batten_contours_free(ctx, &c);
}

/* ---- refused ----------------------------------------------------------------------------------------- */

static void test_refused(batten_context *ctx) {
  static const struct {
    const char *text, *error;
  } cases[] = {
      {"", "a.txt: no points in the file"},
      {"\n# nothing\n", "a.txt: no points in the file"},
      {"x y z\n", "a.txt: no points in the file"},
      {"1\n",
       "a.txt:1: 1 column without names; 2 (x y) or 3 (x y z) are known, for others put a line of names above: "
       "x y z t w contour"},
      {"1 2 3 4\n", "a.txt:1: 4 columns without names"},
      {"1 2\n3\n", "a.txt:2: 1 column, but the lines before have 2"},
      {"1 2\n\n1 2 3\n", "a.txt:3: 3 columns, but the lines before have 2"},
      {"1 2\n3 x\n", "a.txt:2: column 2: 'x' is not a number"},
      {"1 2\n3 nan\n", "a.txt:2: column 2: 'nan' is not finite"},
      {"1 2\n3 1e999\n", "a.txt:2: column 2: '1e999' is too large"},
      {"1,5 2,5\n", "a.txt:1: column 2: '5 2' holds a blank"},
      {"x,y,t\n1,2,\n", "a.txt:2: 2 columns, but the header names 3"},
      {"x,y,t,w\n1,2,,3\n", "a.txt:2: column 3 is missing"},
      {"contour,x,y\n,1,2\n", "a.txt:2: column 1 is missing"},
      {"a,b\n1,2\n", "a.txt:1: the header 'a,b' names no columns x and y"},
      {"z,half_breadth\n1,2\n",
       "a.txt:1: the header 'z,half_breadth' names half-breadths, but not both of station (or x) and waterline (or "
       "z); "
       "add them"},
      {"station,waterline\n1,2\n", "a.txt:1: the header 'station,waterline' names no columns x and y"},
      {"x,z,half_breadth\ncontour 1\n1,2,3\n",
       "a.txt:2: a line 'contour' in a table of offsets, which its stations "},
      {"x,z,half_breadth\n1,2,3\n1,2,3\n2,0,0\n2,1,0\n", "a.txt: offsets: no station has two different points"},
      {"contour 3\n1 2\n3 4\n", "'contour 3' in line 1 says how many points follow, but there are 2"},
      {"contour 3\n1 2\n3 4\ncontour 1\n5 6\n", "a.txt:4: 'contour 3' in line 1 says how many points follow"},
      {"contour 1\n1 2\n3 4\n", "a.txt:3: more points than 'contour 1' in line 1 says"},
      {"contour 0\n", "a.txt:1: contour 0: must be 1 or more points"},
      {"contour -2\n", "a.txt:1: contour -2: must be 1 or more"},
      {"contour 2.5\n", "a.txt:1: the number of points: '2.5' is not a whole number"},
      {"contour 99999999999999999999\n", "a.txt:1: the number of points: '99999999999999999999' is too large"},
      {"contour\n", "a.txt:1: the number of points is missing"},
      {"contour 1 2\n1 2\n", "a.txt:1: something follows 'contour 1'"},
      {"contour 900000000000000000\n1 2\n", "says how many points follow, but there are 1"},
      {"1 2\ncontour 1\n1 2\n", "a.txt:2: points before the first line 'contour N'"},
      {"x y contour\n1 2 3\ncontour 1\n1 2 3\n", "a.txt:3: points before the first line"},
      {"x y contour\ncontour 1\n1 2 3\n", "a.txt:3: a column 'contour' and lines 'contour N' at once"},
      {"0 0 0\n1 0 1\n0 1 1\n0 0 1\n\n1 2 3\n",
       "a.txt: contours[0]: its points lie up to 0.289 from their best plane, at most 1e-06 is taken; part"},
      {"-1e308 0 0\n1e308 0 0\n", "a.txt: contours[0]: its coordinates are beyond a double; scale it"},
      {"1.7e308 1.7e308 1.7e308\n1.7e308 1.6e308 1.6e308\n1.6e308 1.7e308 1.6e308\n",
       "a.txt: contours[0]: its coordinates are beyond a double"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    batten_contours c = {.count = 77};
    batten_status st = read_bytes(ctx, "a.txt", cases[i].text, strlen(cases[i].text), &c);
    T_CHECK(st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error) && c.count == 77, "%zu: %s", i,
            batten_error(ctx));
  }
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_contours c = {0};
  T_STATUS(batten_read_contours(ctx, NULL, &c), BATTEN_E_INVALID, ctx, "path: NULL");
  T_STATUS(batten_read_contours(ctx, "", &c), BATTEN_E_INVALID, ctx, "path: empty");
  T_STATUS(batten_read_contours(ctx, "a.txt", NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_read_contours(ctx, "a.ply", &c), BATTEN_E_INVALID, ctx,
           "a.ply: contours are read from .txt .xyz .csv .tsv .asc .dat, each also with .gz; rename the file");
  T_STATUS(batten_read_contours(ctx, "none.txt", &c), BATTEN_E_IO, ctx, "none.txt: cannot open");
  batten_contours_free(ctx, NULL);
}

/* ---- failures, real data ------------------------------------------------------------------------------ */

static batten_status read_again(batten_context *ctx, void *arg) {
  batten_contours c = {0};
  batten_status st = batten_read_contours(ctx, arg, &c);
  batten_contours_free(ctx, &c);
  return st;
}

static void test_failures(scratch *s) {
  static const char offsets[] = "x,z,half_breadth,w\n5,1,0,1\n5,3,2,1\n7,2,0,1\n7,3,4,1\n";
  static const char column[] = "contour,x,y,z,t,w\na,1,2,3,4,5\nb,2,3,3,5,6\na,4,5,6,7,8\n";
  char path[400];
  snprintf(path, sizeof path, "%s", scratch_file(s, "column.csv"));
  file_write(path, column, strlen(column));
  t_fail_every_allocation("a column", read_again, path);
  snprintf(path, sizeof path, "%s", scratch_file(s, "offsets.csv"));
  file_write(path, offsets, strlen(offsets));
  t_fail_every_allocation("offsets", read_again, path);
  snprintf(path, sizeof path, "%s", scratch_file(s, "heads.txt"));
  FILE *f = fopen(path, "w");
  for (int c = 0; c < 70; c++) fprintf(f, "contour 2\n%d 2 3\n4 %d 3\n", c, c);
  fclose(f);
  t_fail_every_allocation("heads", read_again, path);
  t_cancel_every_progress("heads", read_again, path);
}

static void test_heart(batten_context *ctx) {
  char path[400];
  const char *shared = getenv("BATTEN_SHARED");
  snprintf(path, sizeof path, "%s/data/contours/rt_Heart.txt", shared ? shared : "none");
  if (access(path, R_OK)) {
    printf("# skipped: no %s\n", path);
    return;
  }
  batten_contours c = {0};
  double volume = 0;
  T_OK(batten_read_contours(ctx, path, &c), ctx);
  for (size_t i = 0; i < c.count; i++) {
    double twice = 0, step = fabs(c.planes[i].origin[2] - c.planes[i ? i - 1 : 1].origin[2]);
    for (size_t k = c.starts[i]; k < c.starts[i + 1]; k++) {
      const double *a = c.points + 2 * k, *b = c.points + 2 * (k + 1 < c.starts[i + 1] ? k + 1 : c.starts[i]);
      twice += a[0] * b[1] - a[1] * b[0];
    }
    volume += fabs(twice) / 2 * step;
  }
  T_CHECK(c.count == 33 && c.starts[33] == 4732 && c.points[0] == 9.13 && c.points[1] == -295.96 &&
              c.planes[0].origin[2] == -98.44,
          "a stack of %zu slices with %zu points", c.count, c.count ? c.starts[c.count] : 0);
  T_CHECK(fabs(volume / 1000 - 439.7) < 0.05, "with the volume of its description: %.2f cm3", volume / 1000);
  batten_contours_free(ctx, &c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scratch s;
  scratch_open(&s);
  test_parting(ctx);
  test_title(ctx);
  test_surfaces(ctx);
  test_many(ctx);
  test_offsets(ctx);
  test_constant(ctx);
  test_oblique(ctx);
  test_refused(ctx);
  test_failures(&s);
  test_heart(ctx);
  test_gunnerus(ctx);
  scratch_close(&s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is released");
  batten_context_free(ctx);
  return t_done();
}
