// SPDX-License-Identifier: Apache-2.0
// Densities and values of reflections, every model: docs/models.md.
#include <algorithm>
#include <cmath>
#include <limits>

#include "src/reference/surface.h"
#include "src/reference/vector.h"

namespace facetwise::reference {

// D (i.m)+ over sigma, or D min(2 m_z |i_z|, i.m)+ over H |i_z| with |i_z| divided out.
Real visible_density(const Surface& surface, Vector i, Vector m, Real im) {
  const Scaled d = normal_density(surface, m);
  if (surface.model.masking == Masking::smith) return quotient(d, smith_normaliser(surface, i)) * im;
  const Real iz = std::abs(static_cast<Real>(i.z));
  const Real seen = iz == 0 ? 2 * m.z : std::min<Real>(2 * m.z, im / iz);
  return quotient(d, vcavity_hits(surface, i)) * seen;
}

namespace {

Real bounded_density(const Surface& surface, Vector i, Vector m, Real im) {
  if (surface.model.distribution != Distribution::ggx || surface.model.masking != Masking::smith ||
      !is_centred(surface) || surface.slope_correlation != 0)
    return std::numeric_limits<Real>::quiet_NaN();
  const Stretched w = stretched(surface, i);
  const Real nu = std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z);
  return value(normal_density(surface, m)) * im * 2 / (bounded_k(surface.alpha, i) * w.z + nu);
}

// How much of o is not shadowed, Smith: the share of f cos(theta_o) in what visible normals reflect.
Real smith_shadowing(const Surface& surface, Vector i, Vector o) {
  const Real z = stretched(surface, o).z;
  if (z <= 0) return 0;
  const Real g1 = z / value(area(surface, stretched(surface, o)));
  if (surface.model.shadowing == Shadowing::uncorrelated) return g1;
  // sigma / (sigma + |z'| Lambda) with Lambda = (sigma(o) - z'(o)) / z'(o). The facets that face away make up
  // the difference: sigma(o) - z'(o) = sigma(-o), which does not cancel.
  const Real lambda = value(area(surface, stretched(surface, -1 * o))) / z;
  const Real sigma = value(smith_normaliser(surface, i));
  const Real masked = std::abs(stretched(surface, i).z) * lambda;
  return masked == 0 ? 1 : sigma / (sigma + masked);
}

// min(G(i, m), G(o, m)) / G(i, m).
Real vcavity_shadowing(Vector i, Vector o, Vector m, Real im) {
  const Real masked = std::min<Real>(2 * m.z * std::abs(static_cast<Real>(i.z)), im);
  const Real shadowed = std::min<Real>(2 * m.z * static_cast<Real>(o.z), im);
  return shadowed >= masked ? 1 : shadowed / masked;
}

}  // namespace

Vector turned(const Surface& surface, Vector i) { return surface.model.retro ? Vector{-i.x, -i.y, i.z} : i; }

Real sampled_density(const Surface& surface, Sampler sampler, Vector i, Vector m, Real im) {
  if (sampler == Sampler::ndf) return value(normal_density(surface, m)) * m.z;
  if (i.z > 0 && sampler == Sampler::bounded) return bounded_density(surface, i, m, im);
  if (i.z > 0 && sampler == Sampler::exact) return exact_density(surface, i, m, im);
  if (i.z < 0 && surface.model.masking == Masking::vcavity && surface.model.distribution == Distribution::phong) {
    const Real drawn = value(phong_behind(surface, i, m, im));
    return surface.model.normalisation == Normalisation::biased ? drawn * value(phong_hits(surface, i)) : drawn;
  }
  return visible_density(surface, i, m, im);
}

Real reflected(const Surface& surface, Vector i, Vector o, Vector m, Real im) {
  if (o.z <= 0) return 0;
  const Real weight =
      surface.model.masking == Masking::smith ? smith_shadowing(surface, i, o) : vcavity_shadowing(i, o, m, im);
  if (weight == 0) return 0;
  return fresnel(surface, static_cast<double>(im)) * weight * visible_density(surface, i, m, im) / (4 * im);
}

double pdf_normal(const Surface& surface, Sampler sampler, Vector i, Vector m) {
  const double im = dot(i, m);
  if (im <= 0 || m.z <= 0) return 0;
  const bool reflections = i.z > 0 && (sampler == Sampler::bounded || sampler == Sampler::exact);
  if (reflections && 2 * im * m.z <= i.z) return 0;
  return static_cast<double>(sampled_density(surface, sampler, i, m, im));
}

double pdf_reflection(const Surface& surface, Sampler sampler, Vector i, Vector o) {
  i = turned(surface, i);
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  // i.m is |h| / 2: the scalar product would be nothing but rounding where o is nearly -i.
  const Real im = length(h) / 2;
  return static_cast<double>(sampled_density(surface, sampler, i, normalize(h), im) / (4 * im));
}

double evaluate_reflection(const Surface& surface, Vector i, Vector o) {
  i = turned(surface, i);
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  return static_cast<double>(reflected(surface, i, o, normalize(h), length(h) / 2));
}

}  // namespace facetwise::reference
