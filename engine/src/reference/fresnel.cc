// SPDX-License-Identifier: Apache-2.0
// How much a microfacet reflects: docs/models.md, "Interfaces".
#include <cmath>

#include "facetwise/reference.h"
#include "src/reference/scaled.h"

namespace facetwise::reference {

double fresnel(const Surface& surface, double cos) {
  const Real c = cos;
  switch (surface.model.interface) {
    case Interface::conductor: return 1;
    case Interface::schlick: {
      const Real u = 1 - c;
      return static_cast<double>(surface.f0 + (static_cast<Real>(surface.f90) - surface.f0) * u * u * u * u * u);
    }
    case Interface::dielectric: break;
  }
  // With g = eta cos(theta_t), g^2 = eta^2 - 1 + c^2: (c - g) / (c + g) and (eta^2 c - g) / (eta^2 c + g),
  // each difference replaced by that of the squares over the sum.
  const Real eta = surface.eta, contrast = (eta - 1) * (eta + 1), g2 = contrast + c * c;
  if (contrast == 0) return 0;
  if (g2 <= 0) return 1;
  const Real g = std::sqrt(g2), across = c + g, along = eta * eta * c + g;
  const Real s = contrast / (across * across);
  const Real p = contrast * ((eta * eta + 1) * c * c - 1) / (along * along);
  return static_cast<double>((s * s + p * p) / 2);
}

}  // namespace facetwise::reference
