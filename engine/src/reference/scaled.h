// SPDX-License-Identifier: Apache-2.0
// Numbers as mantissa * exp(exponent): densities and areas of a Gaussian underflow far behind the surface,
// where their quotients do not.
#pragma once

#include <cmath>

namespace facetwise::reference {

using Real = long double;

struct Scaled {
  Real mantissa = 0, exponent = 0;
};

inline Real value(Scaled a) { return a.mantissa * std::exp(a.exponent); }
// a / b; 0 for b = 0, which nothing is visible from.
inline Real quotient(Scaled a, Scaled b) {
  return b.mantissa == 0 ? 0 : a.mantissa / b.mantissa * std::exp(a.exponent - b.exponent);
}

}  // namespace facetwise::reference
