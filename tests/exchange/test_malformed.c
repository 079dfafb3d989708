/* Files that are wrong: each with the text that it must be refused with, and nothing left behind. */
#include "files.h"

static const struct {
  const char *name, *text, *error;
  char as; /* 'p' points, 'm' mesh */
} cases[] = {
    {"a.xyz", "", "a.xyz: no points in the file", 'p'},
    {"a.xyz", "# only\n\n", "a.xyz: no points in the file", 'p'},
    {"a.xyz", "1 2 3\n4 5\n", "a.xyz:2: 2 columns, but the lines before have 3", 'p'},
    {"a.xyz", "1 2 3\n4 5 6 7\n", "a.xyz:2: 4 columns, but the lines before have 3", 'p'},
    {"a.xyz", "1\n2\n", "a.xyz:1: 1 column without names", 'p'},
    {"a.xyz", "1 2 3 4 5\n", "a.xyz:1: 5 columns without names; 2, 3, 4 (x y nx ny) or 6", 'p'},
    {"a.xyz", "1 2 3\n4 abc 6\n", "a.xyz:2: column 2: 'abc' is not a number", 'p'},
    {"a.xyz", "1 2 3\n4 5 6x\n", "a.xyz:2: column 3: '6x' is not a number", 'p'},
    {"a.xyz", "1 2 3\n\n\n4 nan 6\n", "a.xyz:4: column 2: 'nan' is not finite; remove the line", 'p'},
    {"a.xyz", "1 2 -inf\n", "a.xyz:1: column 3: '-inf' is not finite", 'p'},
    {"a.xyz", "1 2 1e400\n", "a.xyz:1: column 3: '1e400' is too large for a double", 'p'},
    {"a.csv", "1,5;2,5;3,0\n", "a.csv:1: column 1: '1,5' has a comma; write a point as the decimal sign", 'p'},
    {"a.txt", "1,5 2,5 3,5\n", "a.txt:1: column 2: '5 2' holds a blank; separate by commas or by blanks", 'p'},
    {"a.csv", "1,2,3\n4,,6\n", "a.csv:2: column 2 is missing", 'p'},
    {"a.csv", "a,b,c\n1,2,3\n", "a.csv:1: the header 'a,b,c' names no columns x and y; rename them", 'p'},
    {"a.csv", "x,y,z\n1,2\n", "a.csv:2: 2 columns, but the header names 3", 'p'},
    {"a.csv", "x,y,z\nx,y,z\n1,2,3\n", "a.csv:2: column 1: 'x' is not a number", 'p'},
    {"a.xyz", "1 2 \x01\x02\x1b[31m\n", "a.xyz:1: column 3: '???[31m' is not a number", 'p'},
    {"a.xyz", "1 2 aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\n",
     "'aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa...' is not a number", 'p'},
    {"a.ply", "", "a.ply:1: a PLY file begins with the line 'ply'", 'p'},
    {"a.ply", "plyx\n", "a.ply:1: a PLY file begins with the line 'ply'", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\n", "a.ply:3: the file ends here; end_header is missing", 'p'},
    {"a.ply", "ply\nend_header\n", "a.ply:2: the line 'format ... 1.0' is missing", 'p'},
    {"a.ply", "ply\nformat binary 1.0\n", "a.ply:2: format 'binary' is not ascii, binary_little_endian", 'p'},
    {"a.ply", "ply\nformat ascii 2.0\n", "a.ply:2: version '2.0' of PLY; 1.0 is read", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex -1\n", "a.ply:3: -1 elements", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex x\n", "a.ply:3: the number of elements: 'x' is not a whole",
     'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", "is too large for an index", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nproperty float x\n", "a.ply:3: a property before the first element", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", "a.ply:4: 'half' is not a type of PLY",
     'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n",
     "a.ply:4: the length of a list as a floating-point number", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float x\n",
     "a.ply:5: a second property 'x' of element 'vertex'", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nelement vertex 1\n", "a.ply:4: a second element 'vertex'",
     'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", "a.ply:4: no element 'vertex'", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
     "a.ply:5: the vertices have no properties x and y", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nnonsense\n", "a.ply:3: 'nonsense' is not a word of a PLY header", 'p'},
#define PLY_VERTICES(n) \
  "ply\nformat ascii 1.0\nelement vertex " n "\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACES "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
    {"a.ply", PLY_VERTICES("2147483648") "end_header\n1 2 3\n",
     "a.ply:9: the file ends here; the header declares 2147483648 of element 'vertex'", 'p'},
    {"a.ply", PLY_VERTICES("1") "end_header\n1 2\n", "a.ply:8: z is missing", 'p'},
    {"a.ply", PLY_VERTICES("1") "end_header\n1 inf 3\n", "a.ply:8: y: 'inf' is not finite", 'p'},
    {"a.ply", PLY_VERTICES("1") "end_header\n1 2 3\n", "a.ply: no faces in the file; read it as points", 'm'},
    {"a.ply", PLY_VERTICES("3") PLY_FACES "3 0 1 3\n",
     "a.ply:13: vertex_indices: no such vertex; they are counted from 0 (3)", 'm'},
    {"a.ply", PLY_VERTICES("3") PLY_FACES "3 0 1 -1\n", "a.ply:13: vertex_indices: no such vertex", 'm'},
    {"a.ply", PLY_VERTICES("3") PLY_FACES "2 0 1\n", "a.ply:13: vertex_indices: a face of fewer than 3 corners (2)",
     'm'},
    {"a.ply", PLY_VERTICES("3") PLY_FACES "4000000000 0 1 2\n", "a.ply:13: vertex_indices is missing", 'm'},
    {"a.ply", PLY_VERTICES("3") PLY_FACES "-1 0 1 2\n", "the length of a list is out of range (-1)", 'm'},
    {"a.ply",
     "ply\nformat binary_little_endian 1.0\nelement vertex 2147483647\nproperty double x\nproperty double y\n"
     "property double z\nend_header\n12345678123456781234567812",
     "a.ply: byte 153: the file ends here; x is missing", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement\n", "a.ply:3: a name is missing", 'p'},
    {"a.ply",
     "ply\nformat ascii 1.0\nelement vertex 1\nproperty float "
     "a234567890123456789012345678901234567890123456789012345678901234\n",
     "a.ply:4: the name 'a2345678901234567890123456789012...' has more than 63 characters", 'p'},
    {"a.ply", "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar float vertex_indices\n",
     "a.ply:4: corners of faces as floating-point numbers", 'm'},
    {"a.obj", "v 1 2\n", "a.obj:1: z is missing", 'p'},
    {"a.obj", "v 1 2 3 0.5\n", "a.obj:1: w: a weight other than 1; rational vertices are not read", 'p'},
    {"a.obj", "v 1 nan 3\n", "a.obj:1: y: 'nan' is not finite", 'p'},
    {"a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\nv 5 5 5\n\nf 1 2 9\nv 6 6 6\n",
     "a.obj:6: vertex number 9, but the file has 4", 'm'},
    {"a.obj", "v 0 0 0\nf 1 0 1\n", "a.obj:2: vertex number 0; they are counted from 1", 'm'},
    {"a.obj", "v 0 0 0\nf 1 1 -2\n", "a.obj:2: vertex number -2, but only 1 came before", 'm'},
    {"a.obj", "v 0 0 0\nf 1 1\n", "a.obj:2: a face of 2 corners; it needs 3 or more", 'm'},
    {"a.obj", "v 0 0 0\nf 1 1 x/2\n", "a.obj:2: corner 'x/2' is not v, v/vt, v//vn or v/vt/vn", 'm'},
    {"a.obj", "v 0 0 0\nf 1/1/1/1 1 1\n", "a.obj:2: corner '1/1/1/1' is not v", 'm'},
    {"a.obj", "v 0 0 0\nf 1//2 1//2 1//2\nvn 0 0 1\n", "a.obj:2: normal number 2, but the file has 1", 'm'},
    {"a.obj", "v 0 0 0\nf 99999999999 1 1\n", "a.obj:2: vertex number 99999999999 is too large", 'm'},
    {"a.obj", "v 0 0 0\n", "a.obj: no faces in the file; read it as points", 'm'},
    {"a.off", "", "a.off:1: the file ends here; the word OFF is missing", 'p'},
    {"a.off", "4OFF\n", "a.off:1: '4OFF' is not OFF, NOFF, COFF", 'p'},
    {"a.off", "OFF BINARY\n", "a.off:1: OFF BINARY is not read; save the file as text", 'p'},
    {"a.off", "OFF\n", "a.off:2: the file ends here; the line of counts is missing", 'p'},
    {"a.off", "OFF\n3\n", "a.off:2: the number of faces is missing", 'p'},
    {"a.off", "OFF\n-3 1 0\n", "a.off:2: -3 vertices and 1 faces", 'p'},
    {"a.off", "OFF\n2147483648 1 0\n1 2 3\n", "a.off:4: the file ends here; a vertex is missing", 'p'},
    {"a.off", "OFF\n1 1 0\n1 2\n", "a.off:3: z is missing", 'p'},
    {"a.off", "NOFF\n1 1 0\n1 2 3 0 0\n", "a.off:3: z of the normal is missing", 'p'},
    {"a.off", "OFF\n1 1 0\n1 2 3\n3 0 0 1\n", "a.off:4: corner 2: vertex 1, but the 1 vertices are counted from 0",
     'm'},
    {"a.off", "OFF\n1 1 0\n1 2 3\n3 0 0\n", "a.off:4: a corner is missing", 'm'},
    {"a.off", "OFF\n1 1 0\n1 2 3\n2 0 0\n", "a.off:4: a face of 2 corners; it needs 3 or more", 'm'},
    {"a.off", "OFF\n1 1 0\n1 2 3\n2147483648 0 0\n", "a.off:4: a corner is missing", 'm'},
    {"a.off", "OFF\n1 1 0\n1 2 3\n3.5 0 0 0\n", "a.off:4: the number of corners: '3.5' is not a whole number", 'm'},
    {"a.stl", "", "a.stl: byte 0: the file ends here; the STL header of 84 bytes is missing", 'm'},
    {"a.stl", "soli", "a.stl: byte 4: the file ends here; the STL header of 84 bytes is missing", 'm'},
    {"a.stl", "0123456789012345678901234567890123456789012345678901234567890123456789012345678 \xff\xff\xff\x7f tail",
     "a.stl: byte 89: the file ends here; a triangle of those that the header declares is missing", 'm'},
    {"a.stl", "solid\nvertex 1 2 3\n", "a.stl:2: a vertex outside of outer loop", 'm'},
    {"a.stl", "solid\nouter loop\nouter loop\n", "a.stl:3: a loop in a loop; endloop is missing", 'm'},
    {"a.stl", "solid\nouter loop\nvertex 1 2\n", "a.stl:3: z is missing", 'm'},
    {"a.stl", "solid\nouter loop\nvertex 1 2 3\nendloop\n", "a.stl:4: a triangle of 1 corners", 'm'},
    {"a.stl", "solid\nouter loop\nvertex 1 2 3\nvertex 2 2 3\nvertex 2 3 3\nvertex 3 3 3\n",
     "a.stl:6: a fourth corner of a triangle", 'm'},
    {"a.stl", "solid\nouter loop\nvertex 1 2 3\n", "the file ends in a triangle", 'm'},
    {"a.stl", "solid\nhello\n", "a.stl:2: 'hello' is not a word of STL", 'm'},
    {"a.stl", "solid\nendsolid\n", "a.stl: no faces in the file; read it as points", 'm'},
    {"a.xyz.gz", "\x1f\x8b", "a.xyz.gz: byte 0: the gzip data end too early; the file is cut off", 'p'},
    {"a.xyz.gz", "\x1f\x8bgarbage garbage", "a.xyz.gz: byte 0: the gzip data are damaged", 'p'},
};
enum { CASES = sizeof cases / sizeof cases[0] };

int main(void) {
  t_memory memory = {0};
  batten_context *ctx = t_context(&memory, NULL, 1);
  for (size_t i = 0; i < CASES; i++) {
    batten_cloud cloud = {0};
    batten_mesh *mesh = NULL;
    size_t size = strlen(cases[i].text);
    batten_status st = cases[i].as == 'p' ? points_of(ctx, cases[i].name, cases[i].text, size, 0, &cloud)
                                          : mesh_of(ctx, cases[i].name, cases[i].text, size, &mesh);
    bool ok = st == BATTEN_E_FORMAT && strstr(batten_error(ctx), cases[i].error);
    T_CHECK(ok && memory.live == 1 && !cloud.points && !mesh, "%s", st ? batten_error(ctx) : cases[i].error);
    if (!ok) printf("# expected: %s\n", cases[i].error);
  }
  unsigned char nul[] = "1 2 3\n4 \0 6\n";
  batten_cloud cloud = {0};
  T_STATUS(points_of(ctx, "a.xyz", nul, sizeof nul - 1, 0, &cloud), BATTEN_E_FORMAT, ctx,
           "a.xyz:2: a byte of value 0 in column 3; is this a text file");
  char wide[600];
  for (size_t i = 0; i < sizeof wide; i++) wide[i] = i % 2 ? ' ' : '1';
  T_STATUS(points_of(ctx, "a.xyz", wide, sizeof wide, 0, &cloud), BATTEN_E_FORMAT, ctx,
           "a.xyz:1: 300 columns; at most 256 are read");
  batten_mesh *mesh = NULL;
  T_STATUS(batten_read_mesh(ctx, "a.vtp", &mesh), BATTEN_E_INVALID, ctx, "meshes are read from .ply .obj .off .stl");
  size_t peak = batten_bytes_peak(ctx);
  T_CHECK(peak < 1 << 20, "whatever headers declare: at most %zu bytes were held", peak);
  batten_context_free(ctx);
  T_CHECK(memory.live == 0, "all is released");
  printf("# %d malformed files\n", CASES + 3);
  return t_done();
}
