/* Which of the compiled inner loops this processor runs. Asked at each call: no state, and it costs a few loads. */
#include "spline/sum.h"

extern const spline_code batten_spline_code_baseline;
#if defined(SPLINE_WITH_avx2)
extern const spline_code batten_spline_code_avx2;
#endif
#if defined(SPLINE_WITH_avx512)
extern const spline_code batten_spline_code_avx512;
#endif

const spline_code *batten_spline_code_at(unsigned index) {
#if defined(SPLINE_WITH_avx512)
  if (__builtin_cpu_supports("avx512f") && index-- == 0) return &batten_spline_code_avx512;
#endif
#if defined(SPLINE_WITH_avx2)
  if (__builtin_cpu_supports("avx2") && index-- == 0) return &batten_spline_code_avx2;
#endif
  return index == 0 ? &batten_spline_code_baseline : NULL;
}

const spline_code *batten_spline_code(void) { return batten_spline_code_at(0); }
