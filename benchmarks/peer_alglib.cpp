// ALGLIB's dense interior point: peer-alglib PROBLEM RESULT (formats: qp_solvers.py, Program).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include <libalglib/optimization.h>

int main(int argc, char **argv) {
  if (argc < 3) return 2;
  std::FILE *in = std::fopen(argv[1], "rb");
  double size[4];
  if (!in || std::fread(size, sizeof *size, 4, in) != 4) return 1;
  const size_t n = size_t(size[0]), equal = size_t(size[1]), m = size_t(size[2]), repeats = size_t(size[3]);
  std::vector<double> all(n * n + n + m * n + m);
  if (std::fread(all.data(), sizeof(double), all.size(), in) != all.size()) return 1;
  std::fclose(in);
  const double *p = all.data(), *q = p + n * n, *g = q + n, *h = g + m * n;
  alglib::real_2d_array quadratic, rows;
  alglib::real_1d_array linear, low, high, scale, x;
  quadratic.setlength(long(n), long(n));
  rows.setlength(long(m), long(n));
  linear.setcontent(long(n), q);
  low.setcontent(long(m), h);
  high.setlength(long(m));
  scale.setlength(long(n));
  for (size_t i = 0; i < n; i++) {
    scale[long(i)] = 1;
    for (size_t j = 0; j < n; j++) quadratic(long(i), long(j)) = p[i + j * n];
  }
  for (size_t i = 0; i < m; i++) {
    high[long(i)] = i < equal ? h[i] : alglib::fp_posinf;
    for (size_t j = 0; j < n; j++) rows(long(i), long(j)) = g[i + j * m];
  }
  std::vector<double> times;
  alglib::minqpreport report;
  double good = 0;
  for (size_t k = 0; k < repeats; k++) {
    const auto start = std::chrono::steady_clock::now();
    try {
      alglib::minqpstate state;
      alglib::minqpcreate(long(n), state);
      alglib::minqpsetquadraticterm(state, quadratic);
      alglib::minqpsetlinearterm(state, linear);
      alglib::minqpsetscale(state, scale);
      alglib::minqpsetlc2dense(state, rows, low, high, long(m));
      alglib::minqpsetalgodenseipm(state, 1e-12); // 1e-9 leaves gaps of 1e-7
      alglib::minqpoptimize(state);
      alglib::minqpresults(state, x, report);
      good = report.terminationtype > 0;
    } catch (const alglib::ap_error &) {
      good = 0;
    }
    times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(times.begin(), times.end());
  std::FILE *out = std::fopen(argv[2], "wb");
  if (!out) return 1;
  const double head[2] = {times[times.size() / 2], good};
  std::fwrite(head, sizeof *head, 2, out);
  for (size_t i = 0; i < n; i++) {
    const double value = good > 0 ? x[long(i)] : NAN;
    std::fwrite(&value, sizeof value, 1, out);
  }
  for (size_t i = 0; i < m; i++) {
    const double value = good > 0 ? -report.laglc[long(i)] : NAN;
    std::fwrite(&value, sizeof value, 1, out);
  }
  return std::fclose(out) != 0;
}
