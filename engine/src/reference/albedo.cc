// SPDX-License-Identifier: Apache-2.0
// Integrals over unoccluded normals, by quadrature along rays of standard slopes.
#include <algorithm>
#include <cmath>

#include "src/reference/polar.h"
#include "src/reference/surface.h"
#include "src/reference/vector.h"

namespace facetwise::reference {
namespace {

// Integral of f(m, i.m, o) dm over the normals that i sees and whose reflection o is not occluded.
template <class F>
Real over_unoccluded(const Surface& surface, Vector i, Real tolerance, const F& f) {
  const Stretched w = stretched(surface, i);
  // Rays start inside the region, which is convex: at 0, around which the density is, or where that is
  // occluded at the half vector of i and n. Behind, the region is a half plane, and rays start at 0 wherever
  // it is.
  Slope start{0, 0};
  const LongNormal centre = normal_of(surface, start);
  if (i.z > 0 && 2 * w.z <= static_cast<Real>(i.z) * (1 + centre.x * centre.x + centre.y * centre.y))
    start = standard_slope(surface, normalize(i + Vector{0, 0, 1}));
  const LongNormal m0 = normal_of(surface, start);
  const Real im0 = w.z - w.x * start.x - w.y * start.y;
  const Real iz = i.z, c0 = 2 * im0 - iz * (1 + m0.x * m0.x + m0.y * m0.y);
  const Real horizontal = std::hypot(w.x, w.y), determinant = slope_determinant(surface);

  const auto along = [&](Real cos, Real sin) {
    const LongNormal unit = normal_of(surface, {cos, sin});
    const Real bx = unit.x - centre.x, by = unit.y - centre.y, slope = w.x * cos + w.y * sin;
    Real low = 0, high = kInfinity;
    if (i.z > 0) {  // c0 - 2 b r - a r^2 > 0 is o_z |M|^2 > 0
      const Real a = iz * (bx * bx + by * by), b = slope + iz * (bx * m0.x + by * m0.y);
      const Real root = std::sqrt(b * b + a * std::max<Real>(c0, 0));
      high = b > 0 ? c0 / (b + root) : (root - b) / a;
    } else if (w.z > 0) {
      if (slope > 0) high = w.z / slope;
    } else {
      if (slope >= 0) return Real{0};
      low = w.z / slope;
    }
    const auto at = [&](Real r) {
      const Real mx = m0.x + r * bx, my = m0.y + r * by, length2 = 1 + mx * mx + my * my;
      const Real z = 1 / std::sqrt(length2), im = (im0 - r * slope) * z;
      if (!(im > 0)) return Real{0};
      const Vector m{static_cast<double>(mx * z), static_cast<double>(my * z), static_cast<double>(z)};
      const Vector o{static_cast<double>(2 * im * mx * z - i.x), static_cast<double>(2 * im * my * z - i.y),
                     static_cast<double>(2 * im * z - iz)};
      return f(m, im, o) * z * z * z * determinant;
    };
    // The density's peak along the ray.
    const Real nearest = std::clamp(-start.x * cos - start.y * sin, low, high);
    const Real before = integrate(
        [&](Real t) {
          const Real r = nearest - t;
          return at(r) * r;
        },
        0, nearest - low, tolerance);
    return before + integrate_ray(at, nearest, high, falls_over(surface, low), tolerance);
  };
  if (start.x != 0 || start.y != 0) return integrate_azimuths(along, std::atan2(-start.y, -start.x), 1, tolerance * 4);
  const Real peak = w.z < 0 ? 1 / (1 - w.z / std::max<Real>(horizontal, 1e-30L)) : 1;
  return integrate_azimuths(along, std::atan2(w.y, w.x), peak, tolerance * 4);
}

}  // namespace

double share_unoccluded(const Surface& surface, Vector i) {
  if (i.z <= 0) return 1;
  if (surface.model.masking == Masking::smith && surface.model.distribution == Distribution::ggx)
    return static_cast<double>(unoccluded_area(surface, i) / value(area(surface, stretched(surface, i))));
  return static_cast<double>(over_unoccluded(surface, i, 1e-9L, [&](Vector m, Real im, Vector) {
    return sampled_density(surface, Sampler::visible, i, m, im);
  }));
}

double albedo(const Surface& surface, Vector i) {
  i = turned(surface, i);
  return static_cast<double>(over_unoccluded(
      surface, i, 1e-9L, [&](Vector m, Real im, Vector o) { return reflected(surface, i, o, m, im) * 4 * im; }));
}

}  // namespace facetwise::reference
