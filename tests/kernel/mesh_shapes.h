/* Meshes written by hand, for the mesh tests. */
#ifndef MESH_SHAPES_H
#define MESH_SHAPES_H

#include <stdint.h>

/* The corner tetrahedron: volume 1/6, area 3/2 + sqrt(3)/2. */
static const double tetra_vertices[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t tetra_triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

/* The cube [-1/2, 1/2]^3; vertex i has bit k of i as coordinate k. */
static const double cube_vertices[24] = {-.5, -.5, -.5, .5, -.5, -.5, -.5, .5, -.5, .5, .5, -.5,
                                         -.5, -.5, .5,  .5, -.5, .5,  -.5, .5, .5,  .5, .5, .5};
static const uint32_t cube_triangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                            2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

#endif
