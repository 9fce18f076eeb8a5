// SPDX-License-Identifier: Apache-2.0
// Gauss-Legendre quadrature.
#pragma once

#include <vector>

namespace facetwise {

// Points and weights on [0, 1] of the rule of n points, n > 0, to double's last digits.
struct GaussRule {
  std::vector<double> point, weight;
};
GaussRule gauss_rule(int n);

}  // namespace facetwise
