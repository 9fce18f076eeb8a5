// SPDX-License-Identifier: Apache-2.0
// Definitions of baseline.h: GGX with Smith masking. Formulas and their sources: docs/math.md.
#pragma once

#include <algorithm>
#include <cmath>

#include "bench/baseline/baseline.h"

namespace facetwise::baseline {
inline namespace FACETWISE_BASELINE_BUILD {
namespace internal {

inline constexpr float kPi = 3.14159265358979f;

#ifdef FACETWISE_BASELINE_VECTORISED
inline constexpr bool kVectorised = true;
// gcc joins std::sin and std::cos of one angle to a call that has no vector function. These have one, and are kept
// apart by -fno-builtin.
extern "C" float sinf(float) noexcept __attribute__((const, simd("notinbranch")));
extern "C" float cosf(float) noexcept __attribute__((const, simd("notinbranch")));
inline float sine(float x) { return sinf(x); }
inline float cosine(float x) { return cosf(x); }
#else
inline constexpr bool kVectorised = false;
inline float sine(float x) { return std::sin(x); }
inline float cosine(float x) { return std::cos(x); }
#endif

inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(float s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector normalize(Vector a) { return (1 / std::sqrt(dot(a, a))) * a; }

// The incident direction in the stretched frame: w = (alpha_x i_x, alpha_y i_y, i_z).
struct Stretched {
  Vector w;
  float a;     // w_x^2 + w_y^2
  float nu;    // |w|
  float area;  // projected area sigma(i)
};

inline Stretched stretch(Vector i, float ax, float ay) {
  Stretched s;
  s.w = {ax * i.x, ay * i.y, i.z};
  s.a = s.w.x * s.w.x + s.w.y * s.w.y;
  s.nu = std::sqrt(s.a + i.z * i.z);
  s.area = i.z >= 0 ? (i.z + s.nu) / 2 : s.a / (2 * (s.nu - i.z));
  return s;
}

// GGX, for unit m.
inline float distribution(Vector m, float ax, float ay) {
  const float x = m.x / ax, y = m.y / ay;
  const float e = x * x + y * y + m.z * m.z;
  return 1 / (kPi * ax * ay * e * e);
}

// k of Eto & Tokuyoshi 2023, Eq. 5 and 6, for i_z > 0.
inline float bound(Vector i, float ax, float ay) {
  const float a = ax == ay ? ax : std::min(std::min(ax, ay), 1.0f);
  float s = 1 + std::sqrt(i.x * i.x + i.y * i.y);
  if (a > 1) s = i.z * i.z / s;  // 1 - sin(theta)
  const float s2 = s * s;
  return (1 - a) * (1 + a) * s2 / (s2 + a * a * i.z * i.z);
}

// The cone of unoccluded normals for i_z > 0: docs/math.md, "The exact reflection sampler".
struct Cone {
  float lambda, p, q, vx, vy, n2;
  float k;
};

inline Cone cone(Vector i, const Stretched& s, float ax, float ay) {
  const float px = i.z * ax * ax, py = i.z * ay * ay;
  const float mean = ax == ay ? px : s.a > 0 ? (s.w.x * s.w.x * px + s.w.y * s.w.y * py) / s.a : 0;
  const float root = std::sqrt((i.z + mean) * (i.z + mean) + 4 * s.a);
  float lambda = i.z >= mean ? (i.z - mean + root) / 2 : 2 * (i.z * mean + s.a) / (root + mean - i.z);
  // Vector code takes the same steps for all.
  if (kVectorised || ax != ay) {
    const int steps = kVectorised || std::max(ax, ay) > 1 ? 4 : 2;
    for (int step = 0; step < steps; ++step) {
      const float inverse_p = 1 / (lambda + px), inverse_q = 1 / (lambda + py);
      const float x = s.w.x * s.w.x * inverse_p, y = s.w.y * s.w.y * inverse_q;
      lambda -= (lambda - i.z - x - y) / (1 + x * inverse_p + y * inverse_q);
    }
  }
  Cone c;
  c.lambda = lambda;
  c.p = lambda + px;
  c.q = lambda + py;
  c.vx = s.w.x / c.p;
  c.vy = s.w.y / c.q;
  c.n2 = c.vx * c.vx + c.vy * c.vy + 1;
  c.k = lambda * lambda / (c.n2 * std::sqrt(c.p * c.q));
  return c;
}

// N in p(o) = D(m) / (4 N).
inline float normaliser(Sampler sampler, Vector i, const Stretched& s, float im, float mz, float ax, float ay) {
  if (sampler == Sampler::ndf) return im / mz;
  if (sampler == Sampler::bounded && i.z > 0) return (bound(i, ax, ay) * i.z + s.nu) / 2;
  if (sampler == Sampler::exact && i.z > 0) return cone(i, s, ax, ay).k;
  return s.area;
}

// f cos(theta_o) / pdf of visible normals' reflections, for o_z > 0.
inline float shadowing_weight(Shadowing shadowing, Vector i, const Stretched& s, Vector o, float ax, float ay) {
  const float x = ax * o.x, y = ay * o.y;
  const float a = x * x + y * y;
  const float t = o.z + std::sqrt(a + o.z * o.z);
  if (shadowing == Shadowing::uncorrelated) return 2 * o.z / t;
  const float lambda = a / (2 * o.z * t);
  return s.area / (s.area + std::abs(i.z) * lambda);
}

// The angle 2 pi u2, which every sampler takes.
struct Azimuth {
  explicit Azimuth(float u2) : cos(cosine(2 * kPi * u2)), sin(sine(2 * kPi * u2)) {}
  float cos, sin;
};

inline Vector draw_ndf(float u1, Azimuth phi) {
  const float r = std::sqrt(u1);
  return {r * phi.cos, r * phi.sin, std::sqrt(1 - u1)};
}

inline Vector draw_heitz(const Stretched& s, float u1, Azimuth phi) {
  const Vector v = (1 / s.nu) * s.w;
  const float length2 = v.x * v.x + v.y * v.y;
  const float inverse_length = length2 > 0 ? 1 / std::sqrt(length2) : 0;
  const Vector t1 = length2 > 0 ? Vector{-v.y * inverse_length, v.x * inverse_length, 0} : Vector{0, 1, 0};
  const Vector t2 = {-v.z * t1.y, v.z * t1.x, v.x * t1.y - v.y * t1.x};  // v x t1
  const float r = std::sqrt(u1);
  const float p1 = r * phi.cos;
  const float blend = s.area / s.nu;  // (1 + v_z) / 2
  const float p2 = (1 - blend) * std::sqrt(std::max(0.0f, 1 - p1 * p1)) + blend * r * phi.sin;
  const float p3 = std::sqrt(std::max(0.0f, 1 - p1 * p1 - p2 * p2));
  Vector m = p1 * t1 + p2 * t2 + p3 * v;
  m.z = std::max(m.z, 1e-7f);
  return m;
}

// The half vector of i_hat and a point of the cap o_hat_z in (-k c, 1].
inline Vector draw_cap(const Stretched& s, float k, float u1, Azimuth phi) {
  const Vector v = (1 / s.nu) * s.w;
  const float z = 1 - u1 * (1 + k * v.z);
  const float r = std::sqrt(std::max(0.0f, (1 - z) * (1 + z)));
  return {v.x + r * phi.cos, v.y + r * phi.sin, std::max(v.z + z, 1e-7f)};
}

inline Vector draw_exact(Vector i, const Stretched& s, const Cone& c, float ax, float ay, float u1, Azimuth phi,
                         float u3) {
  const float cos = phi.cos, sin = phi.sin;
  const float r = std::sqrt(c.lambda * u1);
  const float root_p = std::sqrt(c.p), root_q = ax == ay ? root_p : std::sqrt(c.q);
  const float x = r * cos / root_p, y = r * sin / root_q;
  const float d = x * c.vx + y * c.vy;
  const float t = -d / c.n2;
  // 1 - x^2 - y^2 without cancellation at the rim, where u1 is nearly 1.
  const float cp = cos * cos / c.p, sq = sin * sin / c.q;
  const float inside = (1 - u1) * c.lambda * (cp + sq) + i.z * (ax * ax * cp + ay * ay * sq);
  const float zeta = std::sqrt((inside + d * d / c.n2) / c.n2);
  const float threshold = c.lambda * (zeta + t) + x * s.w.x + y * s.w.y;
  const float sign = u3 * 2 * c.lambda * zeta < threshold ? 1 : -1;
  const float z = std::max(zeta + sign * t, 1e-7f);
  return {sign * x + z * c.vx, sign * y + z * c.vy, z};
}

// A sampled microfacet normal and the N of its density (ndf's depends on i.m and comes later).
struct Drawn {
  Vector m;
  float n;
};

inline Drawn draw(Sampler sampler, Vector i, const Stretched& s, float ax, float ay, float u1, float u2, float u3) {
  const Azimuth phi(u2);
  Vector h;
  float n = s.area;
  if (sampler == Sampler::ndf) {
    h = draw_ndf(u1, phi);
  } else if (sampler == Sampler::heitz) {
    h = draw_heitz(s, u1, phi);
  } else if (sampler == Sampler::exact && i.z > 0) {
    const Cone c = cone(i, s, ax, ay);
    h = draw_exact(i, s, c, ax, ay, u1, phi, u3);
    n = c.k;
  } else {
    float k = 1;
    if (sampler == Sampler::bounded && i.z > 0) {
      k = bound(i, ax, ay);
      n = (k * i.z + s.nu) / 2;
    }
    h = draw_cap(s, k, u1, phi);
  }
  return {normalize({ax * h.x, ay * h.y, h.z}), n};
}

}  // namespace internal

inline Sample sample_normal(Sampler sampler, Vector i, float alpha_x, float alpha_y, float u1, float u2) {
  using namespace internal;
  const Stretched s = stretch(i, alpha_x, alpha_y);
  Sample sample;
  sample.m = draw(sampler, i, s, alpha_x, alpha_y, u1, u2, 0).m;
  const float im = sample.incident_dot_normal = dot(i, sample.m);
  if (im <= 0) return sample;
  sample.accepted = true;
  const float d = distribution(sample.m, alpha_x, alpha_y);
  sample.pdf = sampler == Sampler::ndf ? d * sample.m.z : d * im / s.area;
  return sample;
}

inline Sample sample_reflection(Sampler sampler, Shadowing shadowing, Vector i, float alpha_x, float alpha_y, float u1,
                                float u2, float u3) {
  using namespace internal;
  const Stretched s = stretch(i, alpha_x, alpha_y);
  const Drawn drawn = draw(sampler, i, s, alpha_x, alpha_y, u1, u2, u3);
  Sample sample;
  sample.m = drawn.m;
  const float im = sample.incident_dot_normal = dot(i, sample.m);
  sample.o = 2 * im * sample.m - i;
  if (im <= 0 || sample.o.z <= 0) return sample;
  sample.accepted = true;
  const float n = sampler == Sampler::ndf ? im / sample.m.z : drawn.n;
  sample.pdf = distribution(sample.m, alpha_x, alpha_y) / (4 * n);
  sample.weight = shadowing_weight(shadowing, i, s, sample.o, alpha_x, alpha_y) * (n / s.area);
  return sample;
}

inline float pdf_reflection(Sampler sampler, Vector i, Vector o, float alpha_x, float alpha_y) {
  using namespace internal;
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  const float ih = dot(h, h) / 2;
  const Stretched s = stretch(i, alpha_x, alpha_y);
  return distribution(normalize(h), alpha_x, alpha_y) / (4 * normaliser(sampler, i, s, ih, h.z, alpha_x, alpha_y));
}

inline float evaluate_reflection(Shadowing shadowing, Vector i, Vector o, float alpha_x, float alpha_y) {
  using namespace internal;
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0) return 0;
  const Stretched s = stretch(i, alpha_x, alpha_y);
  return shadowing_weight(shadowing, i, s, o, alpha_x, alpha_y) * distribution(normalize(h), alpha_x, alpha_y) /
         (4 * s.area);
}

inline float masking(Vector i, float alpha_x, float alpha_y) {
  return i.z > 0 ? i.z / internal::stretch(i, alpha_x, alpha_y).area : 0;
}

}  // namespace FACETWISE_BASELINE_BUILD
}  // namespace facetwise::baseline
