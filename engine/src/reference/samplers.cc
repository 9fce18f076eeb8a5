// SPDX-License-Identifier: Apache-2.0
// The samplers: their densities and their mappings from uniform numbers (model.h).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "facetwise/reference.h"
#include "src/reference/cone.h"
#include "src/reference/vector.h"

namespace facetwise::reference {
namespace {

// Eto & Tokuyoshi 2023, Eq. 5 and 6, for i_z > 0. 1 - sin(theta), which Eq. 5 takes where alpha > 1, is
// i_z^2 / (1 + sin(theta)).
double bound(Roughness alpha, Vector i) {
  const double a = alpha.x == alpha.y ? alpha.x : std::min({alpha.x, alpha.y, 1.0});
  double s = 1 + std::hypot(i.x, i.y);
  if (a > 1) s = i.z * i.z / s;
  return (1 - a) * (1 + a) * s * s / (s * s + a * a * i.z * i.z);
}

// N in p(o) = D(m) / (4 N): what the sampler normalises densities by. im is i.m.
double normaliser(Sampler sampler, Roughness alpha, Vector i, Vector m, double im) {
  if (sampler == Sampler::ndf) return im / m.z;
  if (i.z > 0 && sampler == Sampler::exact) return unoccluded_cone(alpha, i).k;
  if (i.z > 0 && sampler == Sampler::bounded) return (bound(alpha, i) * i.z + length(stretch(alpha, i))) / 2;
  return projected_area(alpha, i);
}

Vector sample_ndf(double u1, double u2) {
  const double phi = 2 * std::numbers::pi * u2, r = std::sqrt(u1);
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(1 - u1)};
}

// Heitz 2018 on the stretched i_hat: a point of the unit disk, whose half towards n is compressed by s,
// raised to the hemisphere about i_hat. The written forms lose digits behind the surface (s -> 0), so
//   R - t2 = s (R - r sin phi),  t_w^2 = R^2 - t2^2 = (R - t2) (R + t2),
// and m_hat_z = t2 sin(i_hat) + t_w c is taken by its conjugate where c < 0.
Vector sample_heitz(Roughness alpha, Vector i, double u1, double u2) {
  const Vector w = stretch(alpha, i);
  const double horizontal = std::hypot(w.x, w.y), nu = length(w);
  // Straight up or down: as if i were tilted towards +x.
  const double ex = horizontal > 0 ? w.x / horizontal : 1, ey = horizontal > 0 ? w.y / horizontal : 0;
  const double c = w.z / nu, sine = horizontal / nu;
  const double s = projected_area(alpha, i) / nu;  // (1 + c) / 2

  const double phi = 2 * std::numbers::pi * u2, r = std::sqrt(u1);
  const double t1 = r * std::cos(phi), radial = r * std::sin(phi);
  const double disk = std::hypot(radial, std::sqrt(1 - u1));                     // R = sqrt(1 - t1^2)
  const double minus = radial > 0 ? (1 - u1) / (disk + radial) : disk - radial;  // R - r sin phi
  const double plus = radial > 0 ? disk + radial : (1 - u1) / (disk - radial);   // R + r sin phi
  const double t2 = disk - s * minus;
  const double tw = std::sqrt(s * minus * (2 * disk - s * minus));

  double z = t2 * sine + tw * c;
  if (c < 0) z = s * plus * (2 * disk - s * (2 * disk + minus)) / (t2 * sine - tw * c);
  const double along = tw * sine - t2 * c;
  return {along * ex - t1 * ey, along * ey + t1 * ex, z};
}

// A point o_hat of the spherical cap o_hat_z in (-k c, 1] and the half vector i_hat + o_hat (any length).
Vector sample_cap(Roughness alpha, Vector i, double k, double u1, double u2) {
  const Vector w = stretch(alpha, i);
  const double nu = length(w);
  const double cap = k == 1 ? 2 * projected_area(alpha, i) / nu : 1 + k * i.z / nu;  // 1 + k c
  const double phi = 2 * std::numbers::pi * u2;
  const double height = u1 * cap;  // 1 - o_hat_z
  const double r = std::sqrt(height * (2 - height));
  // i_hat_z + o_hat_z = c + 1 - u1 (1 + k c)
  const double z = cap * (1 - u1) + (1 - k) * i.z / nu;
  return {w.x / nu + r * std::cos(phi), w.y / nu + r * std::sin(phi), z};
}

Vector sample_stretched(Sampler sampler, Roughness alpha, Vector i, double u1, double u2, double u3) {
  switch (sampler) {
    case Sampler::ndf: return sample_ndf(u1, u2);
    case Sampler::heitz: return sample_heitz(alpha, i, u1, u2);
    case Sampler::bounded:
      if (i.z > 0) return sample_cap(alpha, i, bound(alpha, i), u1, u2);
      break;
    case Sampler::exact:
      if (i.z > 0) return sample_cone(unoccluded_cone(alpha, i), alpha, i, u1, u2, u3);
      break;
    case Sampler::visible:
    case Sampler::cap: break;
  }
  return sample_cap(alpha, i, 1, u1, u2);
}

}  // namespace

double bounded_k(Roughness alpha, Vector i) { return i.z > 0 ? bound(alpha, i) : 1; }

double pdf_normal(Sampler sampler, Roughness alpha, Vector i, Vector m) {
  const double im = dot(i, m);
  if (im <= 0 || m.z <= 0) return 0;
  return distribution(alpha, m) * im / normaliser(sampler, alpha, i, m, im);
}

double pdf_reflection(Sampler sampler, Roughness alpha, Vector i, Vector o) {
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  const Vector m = normalize(h);
  // i.m is |h| / 2 for unit vectors; dot(i, m) would be nothing but rounding where o is nearly -i.
  return distribution(alpha, m) / (4 * normaliser(sampler, alpha, i, m, length(h) / 2));
}

Sample sample_normal(Sampler sampler, Roughness alpha, Vector i, double u1, double u2, double u3) {
  Sample sample;
  sample.m = normalize(stretch(alpha, sample_stretched(sampler, alpha, i, u1, u2, u3)));
  sample.incident_dot_normal = dot(i, sample.m);
  sample.pdf = pdf_normal(sampler, alpha, i, sample.m);
  sample.status = sample.incident_dot_normal > 0 ? LaneStatus::accepted : LaneStatus::occluded;
  return sample;
}

Sample sample_reflection(const Model& model, Sampler sampler, Roughness alpha, Vector i, double u1, double u2,
                         double u3) {
  Sample sample;
  sample.m = normalize(stretch(alpha, sample_stretched(sampler, alpha, i, u1, u2, u3)));
  sample.incident_dot_normal = dot(i, sample.m);
  sample.o = 2 * sample.incident_dot_normal * sample.m - i;
  if (sample.o.z <= 0 || sample.incident_dot_normal <= 0) {
    sample.status = LaneStatus::occluded;
    return sample;
  }
  // From m itself: the half vector of o would lose digits. f cos(theta_o) = w D / (4 sigma), so that D
  // cancels in the weight.
  const double n = normaliser(sampler, alpha, i, sample.m, sample.incident_dot_normal);
  sample.pdf = distribution(alpha, sample.m) / (4 * n);
  sample.weight = shadowing_weight(model.shadowing, alpha, i, sample.o) * n / projected_area(alpha, i);
  return sample;
}

}  // namespace facetwise::reference
