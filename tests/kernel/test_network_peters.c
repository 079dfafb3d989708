/* The fill by one quintic a facet. */
#include "network/fill_peters.h"
#include "network_check.h"

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  static const struct { const char *name; scene_mesh (*make)(void); } scenes[] = {
    {"octahedron", scene_mesh_octahedron}, {"tetra",scene_mesh_tetrahedron},{"42", NULL}, {"graph", scene_mesh_graph_7}, {"torus", scene_mesh_torus_10_6},
    {"irregular", scene_mesh_sphere_irregular}, {"noisy",scene_mesh_sphere_noisy},{"blob", scene_mesh_blob_162}, {"cube", scene_mesh_cube_26}, {"genus3", scene_mesh_genus3},{"shifted",NULL},{"plane",NULL}};
  for (int p=0;p<=3;p+=3)
  for (size_t i = 0; i < 12; i++) {
    batten_network_options o = check_options(p);
    check_net n;
    scene_mesh m = i==2?scene_mesh_icosphere(2):i==10?scene_mesh_octahedron_shifted(.5,.3):i==11?scene_mesh_plane(5):scenes[i].make();
    T_OK(check_net_make(ctx, m, &o, true, &n), ctx);
    check_patches q = check_patches_make(&n.t, 5, 1);
    double *tw = malloc(24*n.t.faces), res;
    net_peters_twists(ctx,&n.t,n.normals,n.local,tw,&res); free(tw);
    T_OK(net_fill_peters(ctx, &n.t, n.normals, n.local, (double(*)[21][3])q.net), ctx);
    check_figures c = check_measure(&q, n.normals);
    printf("# %s p %d: jump %.3g rms %.3g gap %.3g corner %.3g %.3g K %.3f %.3f residual %.3g\n", scenes[i].name, p, c.jump_max, c.jump_rms, c.gap_max, c.corner_gap, c.corner_normal_deg, c.K_min, c.K_max, res);
    free(q.net);
    q = check_patches_make(&n.t, 4, 3);
    for (size_t f = 0; f < n.t.faces; f++) {
    double edges[3][4][3], normal[3][3];
    check_cubics(&n, f, edges, normal);
    net_fill_ss(false, (const double(*)[4][3])edges, (const double(*)[3])normal,
                           (double(*)[15][3])check_patch(&q, 3 * f));
  }
     c = check_measure(&q, n.normals);
    printf("# %s SS %d: jump %.3g rms %.3g K %.3f %.3f\n", scenes[i].name, p, c.jump_max, c.jump_rms, c.K_min, c.K_max);
    free(q.net);
    check_net_free(ctx, &n);
  }
  return t_done();
}
