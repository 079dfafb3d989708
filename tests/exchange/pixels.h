/* What tests of pictures share: pictures read back, and a ball to be drawn. */
#ifndef PIXELS_H
#define PIXELS_H

#include <batten/mesh.h>
#include <math.h>
#include <png.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct pixels {
  unsigned width, height;
  unsigned char *rgb;
} pixels;

static inline pixels read_png(const char *path) {
  png_image image = {.version = PNG_IMAGE_VERSION};
  pixels p = {0};
  if (!png_image_begin_read_from_file(&image, path)) return p;
  image.format = PNG_FORMAT_RGB;
  p.rgb = malloc(PNG_IMAGE_SIZE(image));
  if (!p.rgb || !png_image_finish_read(&image, NULL, p.rgb, 0, NULL)) return p;
  p.width = image.width;
  p.height = image.height;
  return p;
}

static inline bool same_bytes(const char *a, const char *b) {
  FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
  bool same = f && g;
  for (int c = 0; same && c != EOF;) same = (c = fgetc(f)) == fgetc(g);
  if (f) fclose(f);
  if (g) fclose(g);
  return same;
}

/* Ball of radius 2 about (3, 4, 5), by latitude and longitude. */
static inline batten_mesh *make_ball(batten_context *ctx, uint32_t M) {
  enum { LARGEST = 24 };
  static double v[2 + (LARGEST - 1) * 2 * LARGEST][3];
  static uint32_t t[4 * LARGEST * (LARGEST - 1)][3];
  const uint32_t N = 2 * M;
  size_t V = 0, F = 0;
  const double pi = 3.14159265358979323846;
  for (uint32_t i = 1; i < M; i++)
    for (uint32_t j = 0; j < N; j++, V++) {
      double a = pi * i / M, b = 2 * pi * j / N;
      v[V][0] = 3 + 2 * sin(a) * cos(b), v[V][1] = 4 + 2 * sin(a) * sin(b), v[V][2] = 5 + 2 * cos(a);
    }
  v[V][0] = v[V + 1][0] = 3, v[V][1] = v[V + 1][1] = 4, v[V][2] = 7, v[V + 1][2] = 3;
  for (uint32_t j = 0; j < N; j++) {
    uint32_t k = (j + 1) % N, last = (M - 2) * N;
    t[F][0] = (uint32_t)V, t[F][1] = j, t[F++][2] = k;
    t[F][0] = (uint32_t)V + 1, t[F][1] = last + k, t[F++][2] = last + j;
    for (uint32_t i = 0; i + 2 < M; i++) {
      uint32_t a = i * N + j, b = i * N + k;
      t[F][0] = a, t[F][1] = a + N, t[F++][2] = b;
      t[F][0] = b, t[F][1] = a + N, t[F++][2] = b + N;
    }
  }
  batten_mesh *mesh = NULL;
  return batten_mesh_create(ctx, V + 2, &v[0][0], F, &t[0][0], &mesh) == BATTEN_OK ? mesh : NULL;
}
#endif
