// SPDX-License-Identifier: Apache-2.0
// Phong with V-cavity from behind: docs/models.md, "V-cavity".
#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/reference/quadrature.h"
#include "src/reference/surface.h"

namespace facetwise::reference {
namespace {

constexpr Real kPi = std::numbers::pi_v<Real>;

// Of standard slopes at the angle psi from i's azimuth: -log of the share that is longer than r.
Real log_share(const Surface& surface, Stretched w, Real psi, Real r) {
  const Real phi = std::atan2(w.y, w.x) + psi;
  const Real a = std::pow(surface.alpha.x * std::cos(phi), 2) + std::pow(surface.alpha.y * std::sin(phi), 2);
  return std::log1p(a * r * r) / a;
}

}  // namespace

// H = (sigma(i) - sigma(i with 3 i_z)) / |i_z| is the mean over t in [k, 3 k], times 2, of the share of slopes that are
// longer than t towards i.
Scaled phong_hits(const Surface& surface, Vector i) {
  const Stretched w = stretched(surface, i);
  // Integrals over m ask for the same i again and again.
  struct Asked {
    Stretched w;
    Roughness alpha;
    Scaled hits;
  };
  thread_local Asked last{};
  if (last.w.x == w.x && last.w.y == w.y && last.w.z == w.z && last.alpha.x == surface.alpha.x &&
      last.alpha.y == surface.alpha.y)
    return last.hits;
  const Real k = -w.z / std::hypot(w.x, w.y);
  constexpr int kScan = 1024;
  Real best = kPi, least = 0;
  for (int n = 0; n < kScan; ++n) {
    const Real psi = kPi * ((n + Real{0.5}) / kScan - Real{0.5}), here = log_share(surface, w, psi, k / std::cos(psi));
    if (best == kPi || here < least) best = psi, least = here;
  }
  const auto over_azimuth = [&](Real psi) {
    const auto share = [&](Real v) { return std::exp(least - log_share(surface, w, psi, v * k / std::cos(psi))); };
    return integrate(share, 1, 3, 1e-11L, 20);
  };
  // In pieces about the peak, which may be narrow.
  Real ends[] = {-kPi / 2, best - 0.1L, best - 0.01L, best, best + 0.01L, best + 0.1L, kPi / 2}, sum = 0;
  for (Real& end : ends) end = std::clamp(end, -kPi / 2, kPi / 2);
  for (std::size_t n = 0; n + 1 < std::size(ends); ++n) sum += integrate(over_azimuth, ends[n], ends[n + 1], 1e-9L, 20);
  last = {w, surface.alpha, {sum / (2 * kPi), -least}};
  return last.hits;
}

// An azimuth psi, tan(theta) = b tan(psi) with theta's density ~ min(cos(theta) / g, 1), then a slope there that faces i:
// the share s of those that are nearer has the density min(s / c, 1) / (1 - c / 2).
Scaled phong_behind(const Surface& surface, Vector i, Vector m, Real im) {
  const Stretched w = stretched(surface, i);
  const Real k = -w.z / std::hypot(w.x, w.y), b = std::sqrt(1 + 2 * k * k);
  const Slope s = standard_slope(surface, m);
  // By im, as m's slope is rounding where it hardly faces i.
  const Real a = std::hypot(w.x, w.y), r = std::hypot(s.x, s.y);
  const Real cos = std::min<Real>((im / m.z - w.z) / (a * r), 1), sin = (s.x * w.y - s.y * w.x) / (a * r);
  const Real psi = std::atan2(-s.y, -s.x) - std::atan2(w.y, w.x);
  const Real wide2 = cos * cos + b * b * sin * sin;
  const Real end = kPi / 2 * (1 - std::min<Real>(1, 2 * k / b)), g = std::cos(end);
  const Real theta = std::abs(std::atan2(b * sin, cos));
  const Real azimuth = b / wide2 * (theta > end ? std::cos(theta) / g : 1) / 2 / (end + (1 - std::sin(end)) / g);
  Scaled density = normal_density(surface, m);
  density.mantissa *= 2 * kPi * azimuth * m.z;
  const Real nearest = k / cos, gap = im / (m.z * a * cos);
  density.exponent += log_share(surface, w, psi, nearest);
  const Real alpha2 = std::pow(surface.alpha.x * s.x / r, 2) + std::pow(surface.alpha.y * s.y / r, 2);
  const Real bend = 1 + alpha2 * nearest * nearest, c = std::min<Real>(4 * nearest * nearest / bend, 1);
  const Real nearer = -std::expm1(-std::log1p(alpha2 * gap * (2 * nearest + gap) / bend) / alpha2);
  density.mantissa *= (nearer < c ? nearer / c : 1) / (1 - c / 2);
  return density;
}

}  // namespace facetwise::reference
