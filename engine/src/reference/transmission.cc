// SPDX-License-Identifier: Apache-2.0
// Transmission, and the choice between it and reflection: docs/models.md, "Transmission".
#include <algorithm>
#include <cmath>

#include "src/reference/surface.h"
#include "src/reference/vector.h"

namespace facetwise::reference {
namespace {

// The microfacet that refracts i to o.
struct Refraction {
  Vector m;
  Real im = 0, om = 0;  // i.m > 0 and o.m < 0, or nothing refracts so
  Real jacobian = 0;    // dm / do
  bool exists() const { return jacobian > 0; }
};

Refraction refraction(const Surface& surface, Vector i, Vector o) {
  if (o.z >= 0) return {};
  // i + eta o; with eta near 1 and o near -i both terms are small, and right.
  Vector h = (i + o) + (surface.eta - 1) * o;
  const double size = length(h);
  if (size == 0 || h.z == 0) return {};
  Refraction r;
  r.m = (h.z < 0 ? -1 / size : 1 / size) * h;
  r.im = dot(i, r.m);
  r.om = dot(o, r.m);
  if (r.im <= 0 || r.om >= 0) return {};
  // (i.m + eta o.m)^2 is |h|^2, as h is along m.
  r.jacobian = static_cast<Real>(surface.eta) * surface.eta * -r.om / (static_cast<Real>(size) * size);
  return r;
}

// How much of o, below the surface, is not shadowed. Smith: masking of -o, since the facets' area seen from o
// is that of the facets which face -o.
Real shadowing(const Surface& surface, Vector i, Vector o, const Refraction& r) {
  if (surface.model.masking == Masking::smith) return masking(surface, -1 * o);
  const Real masked = std::min<Real>(1, 2 * r.m.z * std::abs(static_cast<Real>(i.z)) / r.im);
  const Real shadowed = std::min<Real>(1, 2 * r.m.z * static_cast<Real>(o.z) / r.om);
  return shadowed >= masked ? 1 : shadowed / masked;
}

Sampler of_normals(Sampler sampler) { return sampler == Sampler::ndf ? sampler : Sampler::visible; }

double share(const Surface& surface, Real im, bool reflects, bool transmits, bool reflection) {
  const double f = fresnel(surface, static_cast<double>(im));
  const double reflected = reflects ? f : 0, transmitted = transmits ? 1 - f : 0, sum = reflected + transmitted;
  if (sum == 0) return 0;
  return (reflection ? reflected : transmitted) / sum;
}

bool reflects(Vector i, Vector m, Real im) { return 2 * im * m.z > i.z; }

bool transmits(const Surface& surface, Vector i, Vector m, Real im) {
  if (surface.model.interface != Interface::dielectric) return false;
  const Real contrast = (static_cast<Real>(surface.eta) - 1) * (static_cast<Real>(surface.eta) + 1);
  const Real g2 = contrast + im * im;
  if (g2 < 0) return false;
  // eta o_z = (i.m - g) m_z - i_z, i.m - g by its conjugate.
  return -contrast / (im + std::sqrt(g2)) * m.z - i.z < 0;
}

}  // namespace

double pdf_transmission(const Surface& surface, Sampler sampler, Vector i, Vector o) {
  const Refraction r = refraction(surface, i, o);
  if (!r.exists()) return 0;
  return static_cast<double>(sampled_density(surface, of_normals(sampler), i, r.m, r.im) * r.jacobian);
}

double evaluate_transmission(const Surface& surface, Vector i, Vector o) {
  const Refraction r = refraction(surface, i, o);
  if (!r.exists() || surface.model.interface != Interface::dielectric) return 0;
  const Real scale =
      surface.model.transport == Transport::radiance ? 1 / (static_cast<Real>(surface.eta) * surface.eta) : 1;
  const Real visible = visible_density(surface, i, r.m, r.im) * r.jacobian;
  return static_cast<double>((1 - fresnel(surface, static_cast<double>(r.im))) * visible * scale *
                             shadowing(surface, i, o, r));
}

double branch_probability(const Surface& surface, Vector i, Vector m, bool reflection) {
  const Real im = dot(i, m);
  if (im <= 0) return 0;
  return share(surface, im, reflects(i, m, im), transmits(surface, i, m, im), reflection);
}

// The branch that o itself is on is valid, whatever its rounding says.
double pdf_scattering(const Surface& surface, Sampler sampler, Vector i, Vector o) {
  if (o.z < 0) {
    const Refraction r = refraction(surface, i, o);
    if (!r.exists() || surface.model.interface != Interface::dielectric) return 0;
    return pdf_transmission(surface, sampler, i, o) * share(surface, r.im, reflects(i, r.m, r.im), true, false);
  }
  const Vector from = turned(surface, i), h = from + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  const Real im = length(h) / 2;
  return pdf_reflection(surface, of_normals(sampler), i, o) *
         share(surface, im, true, transmits(surface, from, normalize(h), im), true);
}

double evaluate_scattering(const Surface& surface, Vector i, Vector o) {
  return o.z < 0 ? evaluate_transmission(surface, i, o) : evaluate_reflection(surface, i, o);
}

}  // namespace facetwise::reference
