/* batten: smooth solids and surfaces of guaranteed shape from points, contours and meshes. */
#ifndef BATTEN_H
#define BATTEN_H

#include <batten/base.h>
#include <batten/blas.h>
#include <batten/carrier.h>
#include <batten/contour.h>
#include <batten/convex.h>
#include <batten/curve.h>
#include <batten/field.h>
#include <batten/fmm.h>
#include <batten/frep.h>
#include <batten/loft.h>
#include <batten/lsq.h>
#include <batten/matrix.h>
#include <batten/mesh.h>
#include <batten/network.h>
#include <batten/qp.h>
#include <batten/saddle.h>
#include <batten/solid.h>
#include <batten/spline.h>
#include <batten/stack.h>
#include <batten/surface.h>

#endif
