/* Which of the compiled inner loops this processor runs. Asked at each call: no state, and it costs a few loads. */
#include "judge_sums.h"
#include "lanes.h"

#define DECLARE(set)                    \
  extern const qp_lanes qp_lanes_##set; \
  extern const qp_judge_sums qp_judge_sums_##set;
DECLARE(baseline)
#if defined(QP_WITH_avx2)
DECLARE(avx2)
#endif
#if defined(QP_WITH_avx512)
DECLARE(avx512)
#endif

typedef struct set {
  const qp_lanes *lanes;
  const qp_judge_sums *sums;
} set;

/* The sets that run here, widest first. */
static set set_at(unsigned index) {
#if defined(QP_WITH_avx512)
  if (__builtin_cpu_supports("avx512f") && index-- == 0) return (set){&qp_lanes_avx512, &qp_judge_sums_avx512};
#endif
#if defined(QP_WITH_avx2)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && index-- == 0)
    return (set){&qp_lanes_avx2, &qp_judge_sums_avx2};
#endif
  return index == 0 ? (set){&qp_lanes_baseline, &qp_judge_sums_baseline} : (set){0};
}

const qp_lanes *qp_lanes_at(unsigned index) { return set_at(index).lanes; }
const qp_lanes *qp_lanes_now(void) { return qp_lanes_at(0); }
const qp_judge_sums *qp_judge_sums_at(unsigned index) { return set_at(index).sums; }
const qp_judge_sums *qp_judge_sums_now(void) { return qp_judge_sums_at(0); }
