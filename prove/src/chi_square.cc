// SPDX-License-Identifier: Apache-2.0
#include "facetwise/chi_square.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace facetwise {
namespace {

// x^a exp(-x) / Gamma(a)
double factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

}  // namespace

double upper_incomplete_gamma(double a, double x) {
  constexpr double kEpsilon = 1e-15;
  if (x <= 0) return 1;
  if (x < a + 1) {
    // Series of the lower function.
    double term = 1 / a, sum = term;
    for (double n = a + 1; term > sum * kEpsilon; ++n) sum += term *= x / n;
    return 1 - sum * factor(a, x);
  }
  // Continued fraction, by Lentz's algorithm.
  constexpr double kTiny = std::numeric_limits<double>::min() / kEpsilon;
  double b = x + 1 - a, c = 1 / kTiny, d = 1 / b, h = d;
  for (int n = 1; n < 100000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1 / d;
    h *= d * c;
    if (std::abs(d * c - 1) < kEpsilon) break;
  }
  return h * factor(a, x);
}

ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> expected, double smallest) {
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return expected[a] < expected[b]; });

  ChiSquare result;
  double pooled = 0, pooled_count = 0;
  int cells = 0;
  const auto add = [&](double e, double n) {
    result.statistic += (n - e) * (n - e) / e;
    ++cells;
  };
  for (std::size_t cell : order) {
    const auto n = static_cast<double>(counts[cell]);
    if (expected[cell] < smallest || ((pooled > 0 || pooled_count > 0) && pooled < smallest)) {
      pooled += expected[cell];
      pooled_count += n;
    } else {
      add(expected[cell], n);
    }
  }
  if (pooled > 0) {
    add(pooled, pooled_count);
  } else if (pooled_count > 0) {
    result.statistic = std::numeric_limits<double>::infinity();  // samples where none can be
  }
  result.degrees = std::max(0, cells - 1);
  if (std::isinf(result.statistic))
    result.p_value = 0;
  else if (result.degrees > 0)
    result.p_value = upper_incomplete_gamma(result.degrees / 2.0, result.statistic / 2);
  return result;
}

double sidak(double any, int tests) { return -std::expm1(std::log1p(-any) / tests); }

}  // namespace facetwise
