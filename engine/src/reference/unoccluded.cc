// SPDX-License-Identifier: Apache-2.0
// `exact`: normals whose reflection is not occluded, i_z > 0. docs/models.md, "Unoccluded reflections".
#include <algorithm>
#include <cmath>
#include <limits>

#include "src/reference/error_functions.h"
#include "src/reference/surface.h"

namespace facetwise::reference {
namespace {

// The surface, i and m turned about z to the axes in which the slopes are not correlated.
struct Principal {
  Real ax, ay, mean_x, mean_y;
  Real ix, iy, iz;
  Real mx = 0, my = 0, mz = 1;
};

Principal principal(const Surface& surface, Vector i, Vector m) {
  Principal p{
      surface.alpha.x, surface.alpha.y, surface.mean_slope_x, surface.mean_slope_y, i.x, i.y, i.z, m.x, m.y, m.z};
  if (surface.slope_correlation == 0) return p;
  const Real ax = p.ax, ay = p.ay, covariance = surface.slope_correlation * ax * ay;
  const Real difference = (ax - ay) * (ax + ay) / 2;
  const Real angle = std::atan2(covariance, difference) / 2, cos = std::cos(angle), sin = std::sin(angle);
  const auto turn = [&](Real& x, Real& y) {
    const Real before = x;
    x = cos * before + sin * y;
    y = cos * y - sin * before;
  };
  turn(p.mean_x, p.mean_y);
  turn(p.ix, p.iy);
  turn(p.mx, p.my);
  p.ax = std::sqrt((ax * ax + ay * ay) / 2 + std::hypot(difference, covariance));
  p.ay = slope_determinant(surface) / p.ax;
  return p;
}

// Azimuth by azimuth of standard slopes, a radius below the far limit, flipped where both signs are
// unoccluded.
Real vcavity_density(const Surface& surface, Vector i, Vector m, Real im) {
  const Slope s = standard_slope(surface, m);
  const Real r = std::hypot(s.x, s.y);
  const Real ex = r > 0 ? s.x / r : 1, ey = r > 0 ? s.y / r : 0;
  const Real iz = i.z, a = std::pow(surface.alpha.x * ex, 2) + std::pow(surface.alpha.y * ey, 2);
  const Real q = (surface.alpha.x * i.x * ex + surface.alpha.y * i.y * ey) / iz;  // i.M = i_z (1 - q r)
  const Real far = (std::abs(q) + std::sqrt(q * q + a)) / a, near = 1 / (a * far);
  Real within = 0;  // P(radius < far)
  switch (surface.model.distribution) {
    case Distribution::ggx: within = far * far / (1 + far * far); break;
    case Distribution::beckmann: within = -std::expm1(-far * far); break;
    case Distribution::student_t: {
      const Real f2 = far * far;
      within = f2 / (2 + f2) * ((4 + f2) / (2 + f2));
      break;
    }
    default: return std::numeric_limits<Real>::quiet_NaN();
  }
  // im / (i_z m_z) is 1 - q r.
  const Real w = r > near ? 2 : std::clamp<Real>(im / (iz * m.z), 0, 2);
  return value(normal_density(surface, m)) * m.z * w / within;
}

// First the slope x in the plane of incidence, of all whose reflection some y leaves unoccluded; then that y.
Real beckmann_density(const Surface& surface, Vector i, Vector m, Real im) {
  const Principal p = principal(surface, i, m);
  const Real wx = p.ax * p.ix, wy = p.ay * p.iy, horizontal = std::hypot(wx, wy);
  const Real cos = horizontal > 0 ? wx / horizontal : 1, sin = horizontal > 0 ? wy / horizontal : 0;
  const Real t = horizontal / p.iz;
  const Real ax2 = p.ax * p.ax, ay2 = p.ay * p.ay;
  const Real m12 = (ay2 - ax2) * cos * sin, m22 = ax2 * sin * sin + ay2 * cos * cos;
  const Real kappa = ax2 * ay2 / m22, root = std::sqrt(t * t + kappa);
  const Real high = 1 / (t + root), low = -(t + root) / kappa;

  const Real sx = -p.mx / (p.mz * p.ax), sy = -p.my / (p.mz * p.ay);
  const Real x = cos * sx + sin * sy;
  if (x <= low || x >= high) return 0;
  // Integral of (1 - t x) exp(-x^2) / sqrt(pi).
  const Scaled share = gaussian_interval(low, high);
  const Real tail =
      t * std::numbers::inv_sqrtpi_v<Real> / 2 * std::exp(-high * high) * -std::expm1((high - low) * (high + low));
  const Real weight = value(share) + tail;
  const Real spread = std::sqrt(m22 * kappa * (x - low) * (high - x));
  const Scaled y = gaussian_interval((-m12 * x - spread) / m22, (-m12 * x + spread) / m22);
  return quotient(normal_density(surface, m), y) * im / (p.iz * weight);
}

}  // namespace

Real unoccluded_area(const Surface& surface, Vector i) {
  const Principal p = principal(surface, i, {0, 0, 1});
  const Real wx = p.ax * p.ix, wy = p.ay * p.iy, wz = p.iz - p.mean_x * p.ix - p.mean_y * p.iy;
  const Real qx = p.ax * (p.ix + p.iz * p.mean_x), qy = p.ay * (p.iy + p.iz * p.mean_y);
  const Real h = 2 * wz - p.iz * (1 + p.mean_x * p.mean_x + p.mean_y * p.mean_y);
  const Real cx = p.iz * p.ax * p.ax, cy = p.iz * p.ay * p.ay, q2 = qx * qx + qy * qy;
  // The positive root of l - h = q_x^2 / (l + c_x) + q_y^2 / (l + c_y). The right side grows when c_x, c_y
  // are left out, which bounds the root from above.
  const Real bound = std::sqrt(h * h + 4 * q2);
  Real low = std::max<Real>(h, 0), high = h > 0 ? (h + bound) / 2 : 2 * q2 / (bound - h), lambda = high;
  for (int step = 0; step < 300; ++step) {
    const Real x = qx * qx / (lambda + cx), y = qy * qy / (lambda + cy), f = lambda - h - x - y;
    (f > 0 ? high : low) = lambda;
    Real next = lambda - f / (1 + x / (lambda + cx) + y / (lambda + cy));
    if (!(next > low && next < high)) next = low + (high - low) / 2;
    const bool done = std::abs(next - lambda) <= 2e-19L * lambda || next == low || next == high;
    lambda = next;
    if (done) break;
  }
  const Real pp = lambda + cx, qq = lambda + cy, vx = qx / pp, vy = qy / qq;
  return lambda * (wx * vx + wy * vy + wz) / ((vx * vx + vy * vy + 1) * std::sqrt(pp * qq));
}

Real exact_density(const Surface& surface, Vector i, Vector m, Real im) {
  if (surface.model.masking == Masking::vcavity) return vcavity_density(surface, i, m, im);
  if (surface.model.distribution == Distribution::ggx)
    return value(normal_density(surface, m)) * im / unoccluded_area(surface, i);
  if (surface.model.distribution == Distribution::beckmann && is_centred(surface))
    return beckmann_density(surface, i, m, im);
  return std::numeric_limits<Real>::quiet_NaN();
}

}  // namespace facetwise::reference
