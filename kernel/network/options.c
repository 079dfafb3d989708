/* Options of minimum norm networks: defaults, ranges, what AUTO stands for. */
#include "options.h"

#include "base/checked.h"

batten_network_options batten_network_options_default(void) {
  return (batten_network_options){.struct_size = sizeof(batten_network_options),
                                  .fair_faces_max = 5000,
                                  .normal_passes = 30,
                                  .normal_tol_rad = 1e-6,
                                  .weight_power = 3,
                                  .field_weight = 0.32,
                                  .corner_angle_deg = 60,
                                  .fair_passes = 12,
                                  .fair_tol = 1e-3,
                                  .check_samples = 9};
}

unsigned net_fill_continuity(batten_network_fill fill) {
  switch (fill) {
    case BATTEN_FILL_SS:
    case BATTEN_FILL_SS_CLASSIC:
    case BATTEN_FILL_PETERS:
    case BATTEN_FILL_PN:
      return 1;
    default:
      return 2;
  }
}

void net_fill_degree(batten_network_fill fill, unsigned *degree, unsigned *parts) {
  bool split = fill == BATTEN_FILL_SS || fill == BATTEN_FILL_SS_CLASSIC || fill == BATTEN_FILL_DEGREE6;
  *parts = split ? 3 : 1;
  *degree = fill == BATTEN_FILL_DEGREE6  ? 6
            : split                      ? 4
            : fill == BATTEN_FILL_PETERS ? 5
            : fill == BATTEN_FILL_PN     ? 3
                                         : 7;
}

static batten_status check_words(batten_context *ctx, const batten_network_options *o) {
  const struct {
    const char *name;
    int value, largest;
  } words[] = {
      {"fill", (int)o->fill, BATTEN_FILL_PN},
      {"normals", (int)o->normals, BATTEN_NORMALS_SPHERE},
      {"direction", (int)o->direction, BATTEN_DIRECTION_D1},
      {"length", (int)o->length, BATTEN_LENGTH_L4},
      {"functional", (int)o->functional, BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI},
      {"solver", (int)o->solver, BATTEN_NETWORK_DIRECT},
  };
  for (size_t i = 0; i < sizeof words / sizeof *words; i++)
    if (words[i].value < 0 || words[i].value > words[i].largest)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %d; must be 0 .. %d", words[i].name, words[i].value,
                         words[i].largest);
  if (o->continuity > 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.continuity: %u; must be 1 (G1), 2 (G2) or 0 (as the fill wants)",
                       o->continuity);
  if (o->continuity && o->fill != BATTEN_FILL_AUTO && o->continuity != net_fill_continuity(o->fill))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.continuity: %u, but this fill is made for a G%u network; leave it 0 or take another fill",
                       o->continuity, net_fill_continuity(o->fill));
  return BATTEN_OK;
}

static batten_status check_numbers(batten_context *ctx, const batten_network_options *o) {
  const struct {
    const char *name;
    double value, lower, upper;
  } numbers[] = {
      {"normal_tol_rad", o->normal_tol_rad, 0, 1},       {"weight_power", o->weight_power, 0, 6},
      {"field_weight", o->field_weight, 0, 1e6},         {"crease_angle_deg", o->crease_angle_deg, 0, 180},
      {"corner_angle_deg", o->corner_angle_deg, 0, 180}, {"fair_tol", o->fair_tol, 0, 1},
  };
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
    if (!(numbers[i].value >= numbers[i].lower && numbers[i].value <= numbers[i].upper))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be %g .. %g", numbers[i].name, numbers[i].value,
                         numbers[i].lower, numbers[i].upper);
  if (o->check_samples == 1 || o->check_samples > 1000)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.check_samples: %u; must be 2 .. 1000, or 0 for no check",
                       o->check_samples);
  return BATTEN_OK;
}

batten_status net_options_check(batten_context *ctx, const batten_network_options *given,
                                batten_network_options *out) {
  batten_network_options o = batten_network_options_default();
  batten_status st = BATTEN_OK;
  if (given) st = batten_check_struct(ctx, "batten_network_options", given->struct_size, sizeof o);
  if (st < 0) return st;
  if (given) o = *given; /* not before its size is known */
  st = check_words(ctx, &o);
  if (st >= 0) st = check_numbers(ctx, &o);
  if (st >= 0) *out = o;
  return st;
}

batten_network_fill net_options_fill(const batten_network_options *o, size_t faces) {
  if (o->fill != BATTEN_FILL_AUTO) return o->fill;
  if (o->continuity == 1) return BATTEN_FILL_SS;
  return faces <= o->fair_faces_max ? BATTEN_FILL_FAIR : BATTEN_FILL_DEGREE7;
}
