/* The longest time that a call leaves its host without a progress call, which is what a cancel waits at most. */
#ifndef BATTEN_BENCHMARKS_SILENCE_H
#define BATTEN_BENCHMARKS_SILENCE_H

#include <batten/batten.h>
#include <stdio.h>
#include <string.h>

typedef struct silence {
  double last, longest;
  char phase[24], longest_in[24]; /* of the last call, and of that before the longest time */
} silence;

/* The progress callback. */
static inline int silence_heard(void *user, const char *phase, double part) {
  silence *s = user;
  double now = batten_now();
  (void)part;
  if (now - s->last > s->longest) {
    s->longest = now - s->last;
    memcpy(s->longest_in, s->phase, sizeof s->phase);
  }
  s->last = now;
  snprintf(s->phase, sizeof s->phase, "%s", phase);
  return 0;
}

static inline void silence_begin(silence *s) {
  s->last = batten_now();
  snprintf(s->phase, sizeof s->phase, "start");
}

static inline void silence_end(silence *s) { silence_heard(s, "end", 1); }

#endif
