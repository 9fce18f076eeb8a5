// SPDX-License-Identifier: Apache-2.0
#include "src/reference/error_functions.h"

#include <algorithm>
#include <numbers>

#include "src/reference/quadrature.h"

namespace facetwise::reference {
namespace {

constexpr Real kInverseRootPi = std::numbers::inv_sqrtpi_v<Real>;

struct Ratios {
  Real zeroth, first;
};

// Repeated integrals I_n of erfc, I_-1 = 2 exp(-t^2) / sqrt(pi), obey I_(n-1) = 2 t I_n + 2 (n + 1) I_(n+1),
// so that r_n = I_n / I_(n-1) = 1 / (2 t + 2 (n + 1) r_(n+1)): a continued fraction of positive terms.
Ratios ratios(Real t) {
  Real r = 0, next = 0;
  for (int n = 600; n >= 0; --n) {
    next = r;
    r = 1 / (2 * t + 2 * (n + 1) * r);
  }
  return {r, next};
}

}  // namespace

Real erfcx(Real t) {
  if (t < 1) return std::exp(t * t) * std::erfc(t);
  return 2 * kInverseRootPi * ratios(t).zeroth;
}

Real ierfcx(Real t) {
  if (t < 1) return kInverseRootPi - t * erfcx(t);
  const auto [zeroth, first] = ratios(t);
  return 2 * kInverseRootPi * zeroth * first;
}

Scaled gaussian_interval(Real a, Real b) {
  if (a < 0 && b > 0) return {(std::erf(b) - std::erf(a)) / 2, 0};
  if (b <= 0) {  // the mirrored interval
    std::swap(a, b);
    a = -a;
    b = -b;
  }
  const auto beyond = [&](Real y) { return (y - a) * (y + a); };  // y^2 - a^2
  if ((b - a) * std::max<Real>(1, a) < 1)                         // the difference would cancel
    return {integrate([&](Real y) { return std::exp(-beyond(y)); }, a, b, Real{0}) * kInverseRootPi, -a * a};
  return {(erfcx(a) - std::exp(-beyond(b)) * erfcx(b)) / 2, -a * a};
}

}  // namespace facetwise::reference
