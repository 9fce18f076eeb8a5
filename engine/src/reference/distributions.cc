// SPDX-License-Identifier: Apache-2.0
// Distributions of slopes and their projected areas: docs/models.md, "Distributions".
#include <limits>
#include <numbers>

#include "src/reference/error_functions.h"
#include "src/reference/polar.h"
#include "src/reference/surface.h"

namespace facetwise::reference {
namespace {

constexpr Real kPi = std::numbers::pi_v<Real>;

Real independent(const Surface& surface) {  // sqrt(1 - rho^2)
  const Real rho = surface.slope_correlation;
  return std::sqrt((1 - rho) * (1 + rho));
}

// (z + sqrt(a2 + z^2)) / 2, a quotient behind.
Real half_sum(Real a2, Real z) {
  const Real nu = std::sqrt(a2 + z * z);
  return z >= 0 ? (z + nu) / 2 : a2 / (2 * (nu - z));
}

// Along rays of standard slopes, to an absolute tolerance: the kink of max(i.M, 0) is one of their ends.
Real area_by_quadrature(const Surface& surface, Stretched w, Real tolerance) {
  const Real a = std::hypot(w.x, w.y);
  if (a == 0) return std::max<Real>(w.z, 0);
  const auto along = [&](Real cos, Real sin) {
    const Real slope = w.x * cos + w.y * sin;
    if (w.z <= 0 && slope >= 0) return Real{0};
    const Real end = slope == 0 ? kInfinity : w.z / slope;
    const Real low = w.z > 0 ? 0 : end, high = w.z > 0 && slope > 0 ? end : kInfinity;
    const auto f = [&](Real r) {
      return value(standard_density(surface, {r * cos, r * sin})) * std::max<Real>(w.z - r * slope, 0);
    };
    return integrate_ray(f, low, high, falls_over(surface, low), tolerance);
  };
  return integrate_azimuths(along, std::atan2(w.y, w.x), std::min<Real>(1, std::max<Real>(std::abs(w.z) / a, 0.1L)),
                            tolerance);
}

// To about 1e-10 of the area, which is small behind.
Real area_by_quadrature(const Surface& surface, Stretched w) {
  Real tolerance = 1e-11L * (std::hypot(w.x, w.y) + std::abs(w.z));
  Real sum = area_by_quadrature(surface, w, tolerance);
  for (int pass = 0; pass < 8 && sum > 0 && tolerance > 1e-10L * sum; ++pass) {
    tolerance = 1e-11L * sum;
    sum = area_by_quadrature(surface, w, tolerance);
  }
  return sum;
}

}  // namespace

bool is_centred(const Surface& surface) { return surface.mean_slope_x == 0 && surface.mean_slope_y == 0; }

Real slope_determinant(const Surface& surface) {
  return static_cast<Real>(surface.alpha.x) * surface.alpha.y * independent(surface);
}

Stretched stretched(const Surface& surface, Vector i) {
  const Real x = surface.alpha.x * static_cast<Real>(i.x), y = surface.alpha.y * static_cast<Real>(i.y);
  const Real mean_x = surface.mean_slope_x, mean_y = surface.mean_slope_y;
  return {x + surface.slope_correlation * y, independent(surface) * y, i.z - mean_x * i.x - mean_y * i.y};
}

Slope standard_slope(const Surface& surface, Vector m) {
  const Real x = (-m.x / static_cast<Real>(m.z) - surface.mean_slope_x) / surface.alpha.x;
  const Real y = (-m.y / static_cast<Real>(m.z) - surface.mean_slope_y) / surface.alpha.y;
  return {x, (y - surface.slope_correlation * x) / independent(surface)};
}

LongNormal normal_of(const Surface& surface, Slope s) {
  return {-(surface.mean_slope_x + surface.alpha.x * s.x),
          -(surface.mean_slope_y + surface.alpha.y * (surface.slope_correlation * s.x + independent(surface) * s.y))};
}

Scaled standard_density(const Surface& surface, Slope s) {
  const Real r2 = s.x * s.x + s.y * s.y;
  switch (surface.model.distribution) {
    case Distribution::ggx: return {1 / (kPi * (1 + r2) * (1 + r2)), 0};
    case Distribution::beckmann: return {1 / kPi, -r2};
    case Distribution::student_t: return {8 / (kPi * (2 + r2) * (2 + r2) * (2 + r2)), 0};
    case Distribution::phong: {
      // m_z^(n + 4) with m_z^-2 = 1 + p and n + 2 = 2 r^2 / p, where p = |slope|^2.
      const Real x = surface.alpha.x * s.x, y = surface.alpha.y * s.y, p = x * x + y * y;
      return {1 / kPi, p == 0 ? 0 : -std::log1p(p) * (1 + r2 / p)};
    }
    case Distribution::table: return {surface.table_density(static_cast<double>(s.x), static_cast<double>(s.y)), 0};
  }
  return {};
}

Scaled normal_density(const Surface& surface, Vector m) {
  if (m.z <= 0) return {};
  Scaled d = standard_density(surface, standard_slope(surface, m));
  const Real z2 = static_cast<Real>(m.z) * m.z;
  d.mantissa /= slope_determinant(surface) * z2 * z2;
  return d;
}

Scaled area(const Surface& surface, Stretched w) {
  const Real a2 = w.x * w.x + w.y * w.y;
  switch (surface.model.distribution) {
    case Distribution::ggx: return {half_sum(a2, w.z), 0};
    case Distribution::beckmann: {
      if (a2 == 0) return {std::max<Real>(w.z, 0), 0};
      const Real a = std::sqrt(a2), t = w.z / a;
      if (t < 0) return {a / 2 * ierfcx(-t), -t * t};
      return {(w.z * std::erfc(-t) + a * std::numbers::inv_sqrtpi_v<Real> * std::exp(-t * t)) / 2, 0};
    }
    case Distribution::student_t: {
      const Real half = half_sum(2 * a2, w.z), nu = std::sqrt(2 * a2 + w.z * w.z);
      return {nu == 0 ? 0 : half * half / nu, 0};
    }
    case Distribution::phong: return {area_by_quadrature(surface, w), 0};
    case Distribution::table:
      if (surface.table_area)
        return {surface.table_area({static_cast<double>(w.x), static_cast<double>(w.y), static_cast<double>(w.z)}), 0};
      return {area_by_quadrature(surface, w), 0};
  }
  return {};
}

double slope_density(const Surface& surface, double x, double y) {
  return static_cast<double>(value(standard_density(surface, standard_slope(surface, {-x, -y, 1}))) /
                             slope_determinant(surface));
}

double distribution(const Surface& surface, Vector m) { return static_cast<double>(value(normal_density(surface, m))); }

double projected_area(const Surface& surface, Vector i) {
  return static_cast<double>(value(area(surface, stretched(surface, i))));
}

}  // namespace facetwise::reference
