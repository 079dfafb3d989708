/* Which of the compiled inner loops this processor runs. Asked at each call: no state, and it costs a few loads. */
#include "fmm/lanes.h"

extern const fmm_lanes batten_fmm_lanes_baseline;
#if defined(FMM_WITH_avx2)
extern const fmm_lanes batten_fmm_lanes_avx2;
#endif
#if defined(FMM_WITH_avx512)
extern const fmm_lanes batten_fmm_lanes_avx512;
#endif

const fmm_lanes *batten_fmm_lanes_at(unsigned index) {
#if defined(FMM_WITH_avx512)
  if (__builtin_cpu_supports("avx512f") && index-- == 0) return &batten_fmm_lanes_avx512;
#endif
#if defined(FMM_WITH_avx2)
  if (__builtin_cpu_supports("avx2") && index-- == 0) return &batten_fmm_lanes_avx2;
#endif
  return index == 0 ? &batten_fmm_lanes_baseline : NULL;
}

const fmm_lanes *batten_fmm_lanes_now(void) { return batten_fmm_lanes_at(0); }
