// SPDX-License-Identifier: Apache-2.0
#include "src/reference/cone.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/reference/vector.h"

namespace facetwise::reference {
namespace {

// The positive root of f(l) = l - i_z - w_x^2 / (l + i_z alpha_x^2) - w_y^2 / (l + i_z alpha_y^2).
double positive_eigenvalue(Roughness alpha, Vector i) {
  const Vector w = stretch(alpha, i);
  const double a = w.x * w.x + w.y * w.y;
  // f <= 0 at the lower end. At the upper end, the root for alpha = 0 in the denominators, f >= 0.
  double low = i.z, high = (i.z + std::sqrt(i.z * i.z + 4 * a)) / 2;
  double l = high;
  // f increases and is concave, so that Newton's method runs into the root from below. The bracket takes over
  // where rounding, or the first step, leads out of it.
  for (int step = 0; step < 200; ++step) {
    const double p = l + i.z * alpha.x * alpha.x, q = l + i.z * alpha.y * alpha.y;
    const double x = w.x * w.x / p, y = w.y * w.y / q;
    const double f = (l - i.z) - x - y;
    (f > 0 ? high : low) = l;
    double next = l - f / (1 + x / p + y / q);
    if (!(next > low && next < high)) next = low + (high - low) / 2;
    if (std::abs(next - l) <= 4e-16 * l || next == low || next == high) return next;
    l = next;
  }
  return l;
}

}  // namespace

Cone unoccluded_cone(Roughness alpha, Vector i) {
  const Vector w = stretch(alpha, i);
  Cone cone;
  cone.lambda = positive_eigenvalue(alpha, i);
  cone.p = cone.lambda + i.z * alpha.x * alpha.x;
  cone.q = cone.lambda + i.z * alpha.y * alpha.y;
  cone.v = {w.x / cone.p, w.y / cone.q, 1};
  cone.n2 = dot(cone.v, cone.v);
  cone.k = cone.lambda * cone.lambda / (cone.n2 * std::sqrt(cone.p * cone.q));
  return cone;
}

Vector sample_cone(const Cone& cone, Roughness alpha, Vector i, double u1, double u2, double u3) {
  const Vector w = stretch(alpha, i);
  const double phi = 2 * std::numbers::pi * u2;
  const double cos = std::cos(phi), sin = std::sin(phi);
  const double r = std::sqrt(cone.lambda * u1);
  const double xi = r * cos / std::sqrt(cone.p), eta = r * sin / std::sqrt(cone.q);
  const double d = xi * cone.v.x + eta * cone.v.y;
  const double y = -d / cone.n2;
  // 1 - xi^2 - eta^2 with 1 - lambda / P = i_z alpha_x^2 / P, so that nothing cancels at the rim.
  const double cp = cos * cos / cone.p, sq = sin * sin / cone.q;
  const double inside = (1 - u1) * cone.lambda * (cp + sq) + i.z * (alpha.x * alpha.x * cp + alpha.y * alpha.y * sq);
  const double zeta = std::sqrt((inside + d * d / cone.n2) / cone.n2);
  const double g = cone.lambda;
  const double s = u3 * 2 * g * zeta < g * zeta + xi * w.x + eta * w.y + g * y ? 1 : -1;
  const double z = zeta + s * y;
  return {s * xi + z * cone.v.x, s * eta + z * cone.v.y, z};
}

}  // namespace facetwise::reference
