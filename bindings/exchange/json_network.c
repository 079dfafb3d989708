/* Networks as JSON documents; read_network.c reads them.
 *
 * {"batten": "network", "version": 1, "vertices": [[x, y, z], ...], "triangles": [[i, j, k], ...],
 *  "creases": [[i, j], ...],
 *  "patches": [{"degree": 7, "face": 0, "part": 0, "control_points": [[x, y, z], ...]}, ...]} */
#include "network.h"
#include "write.h"

static void put_indices(bx_writer *w, const uint32_t *indices, size_t rows, size_t width) {
  for (size_t i = 0; i < rows; i++) {
    bx_put_text(w, i ? ",\n[" : "\n[");
    for (size_t k = 0; k < width; k++) bx_print(w, k ? ", %lu" : "%lu", (unsigned long)indices[i * width + k]);
    bx_put_u8(w, ']');
  }
}

void bx_write_json_network(bx_writer *w, const batten_network *network) {
  size_t patches = batten_network_patch_count(network);
  bx_put_text(w, "{\"batten\": \"network\", \"version\": 1,\n\"vertices\":\n");
  bx_put_json_rows(w, batten_network_vertices(network), batten_network_vertex_count(network), 3, ",\n");
  bx_put_text(w, ",\n\"triangles\": [");
  put_indices(w, batten_network_triangles(network), batten_network_face_count(network), 3);
  bx_put_text(w, "],\n\"creases\": [");
  put_indices(w, batten_network_creases(network), batten_network_crease_count(network), 2);
  bx_put_text(w, "],\n\"patches\": [");
  for (size_t p = 0; p < patches && bx_goes_on(w, p, patches); p++) {
    batten_network_patch patch = batten_network_get_patch(network, p);
    bx_print(w, "%s\n{\"degree\": %u, \"face\": %lu, \"part\": %u, \"control_points\": ", p ? "," : "", patch.degree,
             (unsigned long)patch.face, patch.part);
    bx_put_json_rows(w, patch.control_points, (size_t)(patch.degree + 1) * (patch.degree + 2) / 2, 3, ", ");
    bx_put_u8(w, '}');
  }
  bx_put_text(w, "]\n}\n");
}
