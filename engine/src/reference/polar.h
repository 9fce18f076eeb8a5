// SPDX-License-Identifier: Apache-2.0
// Integrals over standard slopes, along rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "src/reference/quadrature.h"
#include "src/reference/surface.h"

namespace facetwise::reference {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// Integral of f(r) r dr over [low, high], high possibly infinite, where f falls from `low` over about
// `scale`.
template <class F>
Real integrate_ray(const F& f, Real low, Real high, Real scale, Real tolerance) {
  const auto mapped = [&](Real v) {
    const Real rest = 1 - v, r = low + scale * v / rest;
    return f(r) * r * scale / (rest * rest);
  };
  const Real end = high == kInfinity ? 1 : (high - low) / (high - low + scale);
  return integrate(mapped, 0, end, tolerance);
}

// Integral over azimuths of f(cos, sin), which may have peaks of the width `scale` about `phi` and kinks a
// quarter of a turn from it.
template <class F>
Real integrate_azimuths(const F& f, Real phi, Real scale, Real tolerance) {
  Real sum = 0;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Real start = phi + (quarter >= 2 ? std::numbers::pi_v<Real> : 0), sign = quarter % 2 ? -1 : 1;
    const auto mapped = [&](Real v) {
      const Real rest = 1 - v, t = scale * v / rest;  // tan of the angle from `start`
      const Real angle = start + sign * std::atan(t);
      return f(std::cos(angle), std::sin(angle)) * scale / (rest * rest * (1 + t * t));
    };
    sum += integrate(mapped, 0, 1, tolerance / 4);
  }
  return sum;
}

// How fast the density falls beyond the standard slope r.
inline Real falls_over(const Surface& surface, Real r) {
  return surface.model.distribution == Distribution::beckmann ? 1 / (1 + 2 * r) : 1 + r;
}

}  // namespace facetwise::reference
