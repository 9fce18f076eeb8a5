// SPDX-License-Identifier: Apache-2.0
// GGX with Smith masking: distribution, areas, shadowing. Sources of each formula: docs/math.md.
#include <cmath>
#include <numbers>

#include "facetwise/reference.h"
#include "src/reference/cone.h"
#include "src/reference/vector.h"

namespace facetwise::reference {
namespace {

// Lambda(o) = (sqrt(1 + A / o_z^2) - 1) / 2 for o_z > 0, as a quotient that does not cancel.
double lambda(Roughness alpha, Vector o) {
  const Vector w = stretch(alpha, o);
  const double a = w.x * w.x + w.y * w.y;
  return a / (2 * o.z * (o.z + length(w)));
}

}  // namespace

double distribution(Roughness alpha, Vector m) {
  if (m.z <= 0) return 0;
  const double x = m.x / alpha.x, y = m.y / alpha.y;
  const double e = x * x + y * y + m.z * m.z;
  return 1 / (std::numbers::pi * alpha.x * alpha.y * e * e);
}

double projected_area(Roughness alpha, Vector i) {
  const Vector w = stretch(alpha, i);
  if (i.z >= 0) return (i.z + length(w)) / 2;
  return (w.x * w.x + w.y * w.y) / (2 * (length(w) - i.z));
}

double masking(Roughness alpha, Vector i) { return i.z > 0 ? i.z / projected_area(alpha, i) : 0; }

double share_unoccluded(Roughness alpha, Vector i) {
  return i.z > 0 ? unoccluded_cone(alpha, i).k / projected_area(alpha, i) : 1;
}

double shadowing_weight(Shadowing shadowing, Roughness alpha, Vector i, Vector o) {
  if (o.z <= 0) return 0;
  if (shadowing == Shadowing::uncorrelated) return masking(alpha, o);
  const double sigma = projected_area(alpha, i);
  return sigma / (sigma + std::abs(i.z) * lambda(alpha, o));
}

double evaluate_reflection(const Model& model, Roughness alpha, Vector i, Vector o) {
  // w times the density of visible normals' reflections.
  return shadowing_weight(model.shadowing, alpha, i, o) * pdf_reflection(Sampler::cap, alpha, i, o);
}

}  // namespace facetwise::reference
