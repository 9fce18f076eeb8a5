// SPDX-License-Identifier: Apache-2.0
// Masking, and what densities of visible normals are divided by: docs/models.md, "Maskings".
#include <algorithm>
#include <cmath>

#include "src/reference/error_functions.h"
#include "src/reference/quadrature.h"
#include "src/reference/surface.h"
#include "src/reference/vector.h"

namespace facetwise::reference {

double masking(const Surface& surface, Vector i) {
  const Stretched w = stretched(surface, i);
  return w.z > 0 ? static_cast<double>(w.z / value(area(surface, w))) : 0;
}

double vcavity_masking(Vector i, Vector m) {
  const double im = dot(i, m);
  return im > 0 ? std::min(2 * m.z * std::abs(i.z) / im, 1.0) : 0;
}

// H |i_z| = sigma(i) - sigma(i with 3 i_z) for i_z < 0, in forms that do not cancel.
Scaled hits(const Surface& surface, Vector i) {
  if (i.z >= 0) return {1, 0};
  const Stretched w = stretched(surface, i);
  const Real a2 = w.x * w.x + w.y * w.y, z = -static_cast<Real>(i.z);
  if (a2 == 0) return {};
  switch (surface.model.distribution) {
    case Distribution::ggx: {
      const Real near = std::sqrt(a2 + z * z), far = std::sqrt(a2 + 9 * z * z);
      return {(a2 / (far + 3 * z) + a2 / (near + z)) / (near + far), 0};
    }
    case Distribution::beckmann: {
      // The mean of erfc over [t, 3 t].
      const Real t = z / std::sqrt(a2);
      if (t > 0.5L) return {(ierfcx(t) - std::exp(-8 * t * t) * ierfcx(3 * t)) / (2 * t), -t * t};
      return {integrate([&](Real v) { return std::erfc(t * v); }, 1, 3, 0) / 2, 0};
    }
    case Distribution::student_t:
      // In the same way the mean of twice the share of slopes that face i, (1 + tau)^2 (2 - tau) / 2.
      return {integrate(
                  [&](Real v) {
                    const Real nu = std::sqrt(2 * a2 + z * z * v * v), front = 2 * a2 / ((nu + z * v) * nu);
                    return front * front * (3 - front) / 4;
                  },
                  1, 3, 0),
              0};
    case Distribution::phong: return phong_hits(surface, i);
    default: return {(value(area(surface, w)) - value(area(surface, {w.x, w.y, 3 * w.z}))) / z, 0};
  }
}

Scaled vcavity_hits(const Surface& surface, Vector i) {
  return surface.model.normalisation == Normalisation::biased ? Scaled{1, 0} : hits(surface, i);
}

Scaled smith_normaliser(const Surface& surface, Vector i) {
  Stretched w = stretched(surface, i);
  if (surface.model.normalisation == Normalisation::biased) w.z = std::abs(w.z);
  return area(surface, w);
}

double hit_probability(const Surface& surface, Vector i) { return static_cast<double>(value(hits(surface, i))); }

double normaliser(const Surface& surface, Vector i) {
  if (surface.model.masking == Masking::smith) return static_cast<double>(value(smith_normaliser(surface, i)));
  return static_cast<double>(value(vcavity_hits(surface, i)) * std::abs(i.z));
}

}  // namespace facetwise::reference
