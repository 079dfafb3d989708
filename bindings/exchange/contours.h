/* Contours on their way from the lines of a file to planes. */
#ifndef BATTEN_EXCHANGE_CONTOURS_H
#define BATTEN_EXCHANGE_CONTOURS_H

#include "stream.h"

#include <batten/exchange.h>

/* bx_read_contours_from, which also tells whether the file is a table of offsets; stems as in bx_arrange_offsets. */
batten_status bx_parse_contours(bx_reader *r, bool stems, batten_contours *out, bool *offsets);

/* Takes points in space [starts[count]][3] to the planes in which each contour lies: out [starts[count]][2], planes
 * [count]. Where a coordinate is constant, the others are taken over as they are. FORMAT: the points of a contour lie
 * in no plane, to 1e-6 of its size. */
batten_status bx_find_planes(bx_reader *r, size_t count, const size_t *starts, const double *points, double *out,
                             batten_plane *planes);

/* Sections of a hull from a table of offsets: rows [count][width] begin with station x, half-breadth y, waterline z,
 * in any order. order [count] becomes the rows that stay, section by section, and starts [count + 1] where these
 * begin; *sections. See batten_read_contours for what is left out. stems: a first or last station all on the middle
 * plane stays, by its lowest and its highest row. FORMAT: no section stays. */
batten_status bx_arrange_offsets(bx_reader *r, bool stems, size_t count, const double *rows, size_t width,
                                 size_t *order, size_t *starts, size_t *sections);

/* The plane x = station, y and z as its axes. */
batten_plane bx_station_plane(double station);

#endif
