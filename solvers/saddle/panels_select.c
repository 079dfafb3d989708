/* Which of the compiled inner loops this processor runs. Asked at each call: no state, and it costs a few loads. */
#include "panels.h"

extern const saddle_code batten_saddle_code_baseline;
#if defined(SADDLE_WITH_avx2)
extern const saddle_code batten_saddle_code_avx2;
#endif
#if defined(SADDLE_WITH_avx512)
extern const saddle_code batten_saddle_code_avx512;
#endif

const saddle_code *batten_saddle_code_at(unsigned index) {
#if defined(SADDLE_WITH_avx512)
  if (__builtin_cpu_supports("avx512f") && index-- == 0) return &batten_saddle_code_avx512;
#endif
#if defined(SADDLE_WITH_avx2)
  if (__builtin_cpu_supports("avx2") && index-- == 0) return &batten_saddle_code_avx2;
#endif
  return index == 0 ? &batten_saddle_code_baseline : NULL;
}

const saddle_code *batten_saddle_code(void) { return batten_saddle_code_at(0); }
