// SPDX-License-Identifier: Apache-2.0
#include "facetwise/gauss.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace facetwise {

// By Newton's method on the Legendre polynomial.
GaussRule gauss_rule(int n) {
  GaussRule rule;
  for (int k = 0; k < n; ++k) {
    double x = std::cos(std::numbers::pi * (k + 0.75) / (n + 0.5)), slope = 0;
    for (int step = 0; step < 100; ++step) {
      double last = 1, p = x;
      for (int j = 2; j <= n; ++j) last = std::exchange(p, ((2 * j - 1) * x * p - (j - 1) * last) / j);
      slope = n * (x * p - last) / (x * x - 1);
      const double change = p / slope;
      x -= change;
      if (std::abs(change) < 1e-16) break;
    }
    rule.point.push_back((1 + x) / 2);
    rule.weight.push_back(1 / ((1 - x * x) * slope * slope));
  }
  return rule;
}

}  // namespace facetwise
