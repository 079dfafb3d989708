/* Colours, and ticks with their texts. See picture.h.
 *
 * The colour map is a path of constant speed in Ottosson's Oklab (2020), a space in which equal steps look equally
 * far apart: lightness rises linearly while the hue turns from blue over green to yellow. Seen in grey it is a ramp,
 * and the common kinds of colour blindness keep it in order. */
#include "picture.h"

#include <math.h>
#include <stdio.h>

static double srgb_to_linear(double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); }

picture_color picture_srgb(unsigned hex) {
  return (picture_color){(float)srgb_to_linear((hex >> 16 & 255) / 255.0),
                         (float)srgb_to_linear((hex >> 8 & 255) / 255.0), (float)srgb_to_linear((hex & 255) / 255.0)};
}

static picture_color oklab(double lightness, double a, double b) {
  double l = lightness + 0.3963377774 * a + 0.2158037573 * b;
  double m = lightness - 0.1055613458 * a - 0.0638541728 * b;
  double s = lightness - 0.0894841775 * a - 1.2914855480 * b;
  l = l * l * l, m = m * m * m, s = s * s * s;
  double r = 4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s;
  double g = -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s;
  double blue = -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s;
  return (picture_color){(float)fmin(1, fmax(0, r)), (float)fmin(1, fmax(0, g)), (float)fmin(1, fmax(0, blue))};
}

/* Hues of full colour from red (0) to blue (1), a little softened: pure ones glare and hide the shading. */
static picture_color rainbow(double t) {
  double sector = 4 * t, c[3];
  c[0] = fmin(1, fmax(0, 2 - sector));
  c[1] = fmin(1, fmin(sector, 4 - sector) + 0.22 * t); /* pure blue is too dark to shade */
  c[2] = fmin(1, fmax(0, sector - 2));
  for (int k = 0; k < 3; k++) c[k] = srgb_to_linear(0.10 + 0.84 * c[k]);
  return (picture_color){(float)c[0], (float)c[1], (float)c[2]};
}

double picture_stripe(double value, double width) {
  double place = value - 0.25, inside = 0.25 - fabs(place - round(place)); /* distance into the white */
  double part = width > 0 ? fmin(1, fmax(0, 0.5 + inside / width)) : inside >= 0;
  double fade = fmin(1, fmax(0, (width - 0.4) / 0.6)); /* too narrow to be seen one by one */
  return part + fade * (0.5 - part);
}

/* Two hues of like lightness, warm below the middle, cool above, that pale to almost white there. */
static picture_color parted(double t) {
  double part = fmin(1, fabs(2 * t - 1)), lightness = 0.95 - 0.33 * part;
  return t < 0.5 ? oklab(lightness, 0.165 * part, 0.085 * part) : oklab(lightness, -0.045 * part, -0.115 * part);
}

picture_color picture_colormap(batten_picture_map map, double t) {
  if (isnan(t)) return (picture_color){0.4f, 0.4f, 0.4f};
  t = fmin(1, fmax(0, t));
  if (map == BATTEN_MAP_RAINBOW) return rainbow(t);
  if (map == BATTEN_MAP_PARTED) return parted(t);
  if (map == BATTEN_MAP_STRIPES) {
    float level = (float)(0.012 + 0.84 * t);
    return (picture_color){level, level, level};
  }
  const double degree = 0.017453292519943295;
  /* 0.1: the strongest colour that sRGB holds all along the path. */
  double hue = (300 - 205 * t) * degree, chroma = 0.1;
  return oklab(0.32 + 0.60 * t, chroma * cos(hue), chroma * sin(hue));
}

/* ---- ticks --------------------------------------------------------------------------------------- */

picture_ticks picture_ticks_choose(double lower, double upper, unsigned wanted) {
  picture_ticks none = {.mantissa = 1};
  double span = upper - lower;
  if (!(span > 0) || !isfinite(span)) return none;
  double raw = span / wanted;
  int exponent = (int)floor(log10(raw));
  double lead = raw / pow(10, exponent);
  int mantissa = lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10;
  if (mantissa == 10) mantissa = 1, exponent++;
  double step = mantissa * pow(10, exponent);
  double first = ceil(lower / step - 1e-9), last = floor(upper / step + 1e-9);
  /* Far from the origin for its size: the ticks' texts would not differ. */
  if (!isfinite(step) || step == 0 || fabs(first) > 1e12 || fabs(last) > 1e12) return none;
  return (picture_ticks){(long long)first, mantissa, exponent, last >= first ? (size_t)(last - first) + 1 : 0};
}

double picture_tick_value(const picture_ticks *t, size_t i) {
  double whole = (double)(t->first + (long long)i) * t->mantissa;
  return t->exponent < 0 ? whole / pow(10, -t->exponent) : whole * pow(10, t->exponent);
}

void picture_tick_text(const picture_ticks *t, size_t i, char text[PICTURE_TICK_SIZE]) {
  long long whole = (t->first + (long long)i) * t->mantissa;
  unsigned long long size = whole < 0 ? 0ull - (unsigned long long)whole : (unsigned long long)whole;
  const char *sign = whole < 0 ? "-" : "";
  if (whole == 0)
    snprintf(text, PICTURE_TICK_SIZE, "0");
  else if (t->exponent > 5 || t->exponent < -4) {
    int exponent = t->exponent, digits = 0; /* behind the point */
    unsigned long long unit = 1;
    for (; size % 10 == 0; size /= 10) exponent++;
    for (; digits < 19 && size / unit >= 10; unit *= 10) digits++;
    exponent += digits;
    if (unit == 1)
      snprintf(text, PICTURE_TICK_SIZE, "%s%llue%d", sign, size, exponent);
    else
      snprintf(text, PICTURE_TICK_SIZE, "%s%llu.%0*llue%d", sign, size / unit, digits, size % unit, exponent);
  } else if (t->exponent >= 0) {
    for (int k = 0; k < t->exponent; k++) size *= 10;
    snprintf(text, PICTURE_TICK_SIZE, "%s%llu", sign, size);
  } else {
    unsigned long long unit = 1;
    for (int k = 0; k > t->exponent; k--) unit *= 10;
    snprintf(text, PICTURE_TICK_SIZE, "%s%llu.%0*llu", sign, size / unit, -t->exponent, size % unit);
  }
}
