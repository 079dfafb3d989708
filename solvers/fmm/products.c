/* The set of inner loops as a whole, for one instruction set (see lanes.h). */
#include "fmm/lanes.h"

#define NAME_TEXT_(a) #a
#define NAME_TEXT(a) NAME_TEXT_(a)
const fmm_lanes FMM_OF_SET(batten_fmm_lanes) = {NAME_TEXT(FMM_ISA), FMM_OF_SET(batten_fmm_near)};
