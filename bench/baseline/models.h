// SPDX-License-Identifier: Apache-2.0
// Definitions of baseline.h for the models besides GGX with Smith masking. Formulas and their sources: docs/models.md.
#pragma once

#include <algorithm>
#include <cmath>

#include "bench/baseline/baseline.h"

namespace facetwise::baseline {
inline namespace FACETWISE_BASELINE_BUILD {
namespace internal {

inline constexpr float kInverseRootPi = 0.564189583547756f;

// Giles 2010, "Approximating the erfinv function", single precision.
inline float erfinv(float x) {
  x = std::clamp(x, -0.99999f, 0.99999f);
  float w = -std::log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5f;
    p = 2.81022636e-08f;
    p = 3.43273939e-07f + p * w;
    p = -3.5233877e-06f + p * w;
    p = -4.39150654e-06f + p * w;
    p = 0.00021858087f + p * w;
    p = -0.00125372503f + p * w;
    p = -0.00417768164f + p * w;
    p = 0.246640727f + p * w;
    p = 1.50140941f + p * w;
  } else {
    w = std::sqrt(w) - 3;
    p = -0.000200214257f;
    p = 0.000100950558f + p * w;
    p = 0.00134934322f + p * w;
    p = -0.00367342844f + p * w;
    p = 0.00573950773f + p * w;
    p = -0.0076224613f + p * w;
    p = 0.00943887047f + p * w;
    p = 1.00167406f + p * w;
    p = 2.83297682f + p * w;
  }
  return p * x;
}

// D(m) for unit m.
inline float distribution(Distribution which, Vector m, float ax, float ay) {
  if (which == Distribution::ggx) return distribution(m, ax, ay);
  const float z2 = m.z * m.z, x = m.x / ax, y = m.y / ay;
  const float r2 = (x * x + y * y) / z2;
  const float scale = kPi * ax * ay * z2 * z2;
  if (which == Distribution::beckmann) return std::exp(-r2) / scale;
  if (which == Distribution::phong) {
    const float sin2 = m.x * m.x + m.y * m.y;  // m_z^n, n + 2 = 2 r^2 z^2 / sin^2
    return sin2 > 0 ? std::pow(m.z, 2 * r2 * z2 / sin2 - 2) / (kPi * ax * ay) : 1 / (kPi * ax * ay);
  }
  const float t = 2 + r2;
  return 8 / (scale * t * t * t);
}

// Projected area, in front and behind.
inline float area(Distribution which, Vector i, float ax, float ay) {
  if (which == Distribution::ggx) return stretch(i, ax, ay).area;
  const float x = ax * i.x, y = ay * i.y;
  const float s = std::sqrt(x * x + y * y);
  if (s == 0) return std::max(i.z, 0.0f);
  const float a = i.z / s;
  if (which == Distribution::beckmann) return (i.z * std::erfc(-a) + s * kInverseRootPi * std::exp(-a * a)) / 2;
  const float t = 1 / (2 + a * a), root = std::sqrt(t);
  return i.z * (1 + a * root * (1 + t)) / 2 + s * t * root;
}

// f cos(theta_o) / pdf of visible normals' reflections, for o_z > 0.
inline float smith_weight(Distribution which, Shadowing shadowing, float area_i, Vector i, Vector o, float ax,
                          float ay) {
  const float area_o = area(which, o, ax, ay);
  if (shadowing == Shadowing::uncorrelated) return o.z / area_o;
  return area_i / (area_i + std::abs(i.z) * (area_o / o.z - 1));
}

inline float cavity_masking(Vector i, float im, float mz) { return std::min(2 * mz * i.z / im, 1.0f); }

// Share of the standard slopes that are shorter than r, and the r^2 of a share: ggx, beckmann, student_t.
inline float share_within(Distribution which, float r2) {
  if (which == Distribution::ggx) return r2 / (1 + r2);
  if (which == Distribution::beckmann) return 1 - std::exp(-r2);
  const float t = 2 / (2 + r2);
  return 1 - t * t;
}
inline float squared_radius(Distribution which, float share) {
  if (which == Distribution::ggx) return share / (1 - share);
  if (which == Distribution::beckmann) return -std::log(1 - share);
  return 2 * (1 / std::sqrt(1 - share) - 1);
}

// A normal with density D(m) m_z, of any length.
inline Vector draw_ndf(Distribution which, float ax, float ay, float u1, float u2) {
  const Azimuth phi(u2);
  float r = 0;  // of the stretched slope
  if (which == Distribution::phong) {
    const float x = ax * phi.cos, y = ay * phi.sin, a = x * x + y * y;
    r = std::sqrt((std::pow(1 - u1, -a) - 1) / a);
  } else {
    r = std::sqrt(squared_radius(which, u1));
  }
  return {ax * r * phi.cos, ay * r * phi.sin, 1};
}

// A visible normal of Beckmann's, of any length. The slope in i's plane by inverting its distribution with Newton's
// method on the erf of it, bisecting where a step leaves the bracket; the other slope by erfinv.
inline Vector draw_beckmann(Vector i, float ax, float ay, float u1, float u2) {
  const Vector v = normalize({ax * i.x, ay * i.y, i.z});
  const float sin = std::sqrt(v.x * v.x + v.y * v.y);
  if (sin < 1e-4f * std::abs(v.z)) return draw_ndf(Distribution::beckmann, ax, ay, u1, u2);
  const float cot = v.z / sin;
  const float theta = std::acos(v.z);
  const float total = v.z * std::erfc(-cot) + sin * kInverseRootPi * std::exp(-cot * cot);
  u1 = std::max(u1, 1e-6f);
  float low = -1, high = std::erf(cot);
  const float fit = 1 + theta * (-0.876f + theta * (0.4265f - 0.0594f * theta));
  float b = high - (1 + high) * std::pow(1 - u1, fit);
  for (int step = 0; step < 10; ++step) {
    if (!(b >= low && b <= high)) b = (low + high) / 2;
    const float x = erfinv(b);
    const float value = (v.z * (1 + b) + sin * kInverseRootPi * std::exp(-x * x)) / total - u1;
    if (std::abs(value) < 1e-5f) break;
    (value > 0 ? high : low) = b;
    b -= value * total / (v.z - x * sin);
  }
  const float x = erfinv(b), y = erfinv(2 * std::max(u2, 1e-6f) - 1);
  const float cos_phi = v.x / sin, sin_phi = v.y / sin;
  return {-ax * (cos_phi * x - sin_phi * y), -ay * (sin_phi * x + cos_phi * y), 1};
}

// Student-t's visible normal, of any length: both slopes by inverting their distributions with Newton's method, bisecting
// where a step leaves the bracket. In the frame stretched by sqrt(2) alpha, x = (t - 1 / t) / 2 and t < T has the share
// below; y / sqrt(1 + x^2) has a density like (1 + y^2)^-3.
inline Vector draw_student_t(Vector i, float ax, float ay, float u1, float u2) {
  constexpr float kRoot2 = 1.41421356f;
  const Vector v = normalize({kRoot2 * ax * i.x, kRoot2 * ay * i.y, i.z});
  const float sin = std::sqrt(v.x * v.x + v.y * v.y);
  if (sin < 1e-4f) return draw_ndf(Distribution::student_t, ax, ay, u1, u2);
  const float t_max = (1 + v.z) / sin, t2 = t_max * t_max;
  float low = 0, high = 1, z = 0.5f;  // t / T
  for (int step = 0; step < 20; ++step) {
    const float b = 1 + t2 * z * z, b3 = b * b * b;
    const float value = z * z * z * ((t2 - 1) * z * (3 + t2 * z * z) + 4) * (1 + t2) / b3 - u1;
    if (std::abs(value) < 1e-5f) break;
    (value > 0 ? high : low) = z;
    z -= value * b3 * b / (12 * z * z * (1 - z) * (t2 * z + 1) * (1 + t2));
    if (!(z > low && z < high)) z = (low + high) / 2;
  }
  const float t = std::max(t_max * z, 1e-9f), x = (t - 1 / t) / 2, wide = (t + 1 / t) / 2;
  float y = 0, from = -1e4f, to = 1e4f;
  for (int step = 0; step < 30; ++step) {
    const float w = 1 / (1 + y * y);
    const float value = 0.5f + (std::atan(y) + y * w + 2 * y * w * w / 3) / kPi - u2;
    if (std::abs(value) < 1e-5f) break;
    (value > 0 ? to : from) = y;
    y -= value * 3 * kPi / (8 * w * w * w);
    if (!(y > from && y < to)) y = (std::max(from, -10.0f) + std::min(to, 10.0f)) / 2;
  }
  y *= wide;
  const float cos_phi = v.x / sin, sin_phi = v.y / sin;
  return {-kRoot2 * ax * (cos_phi * x - sin_phi * y), -kRoot2 * ay * (sin_phi * x + cos_phi * y), 1};
}

// A normal m of any length, and N in p(o) = D(m) / (4 N).
struct Unoccluded {
  Vector m;
  float n = 0;
};

// V-cavity's normals whose reflection is not occluded, for i_z > 0: docs/models.md.
struct Limits {
  float q, near, within;  // q.e; the limit on the side away from i; the share within the one towards it
};
inline Limits limits(Distribution which, Vector i, float ax, float ay, float ex, float ey) {
  const float x = ax * ex, y = ay * ey, a = x * x + y * y;
  const float q = (x * i.x + y * i.y) / i.z;
  const float sum = std::abs(q) + std::sqrt(q * q + a), far = sum / a;
  return {q, 1 / sum, share_within(which, far * far)};
}
inline float unoccluded_normaliser(const Limits& limits, Vector i, float r, float mz, float im) {
  const float n = im / (2 * mz);
  return limits.within * (r < limits.near ? std::max(n, i.z) : n);
}
inline Unoccluded draw_cavity_exact(Distribution which, Vector i, float ax, float ay, float u1, float u2, float u3) {
  const Azimuth phi(u1);
  const Limits l = limits(which, i, ax, ay, phi.cos, phi.sin);
  const float r = std::sqrt(squared_radius(which, u2 * l.within));
  const bool flipped = r < l.near && 2 * u3 < 1 - std::abs(l.q) * r;
  const float side = (l.q > 0) == flipped ? -1.0f : 1.0f;
  Unoccluded drawn;
  drawn.m = normalize({ax * r * side * phi.cos, ay * r * side * phi.sin, 1});
  drawn.n = unoccluded_normaliser(l, i, r, drawn.m.z, dot(i, drawn.m));
  return drawn;
}
inline float cavity_exact_normaliser(Distribution which, Vector i, Vector m, float im, float ax, float ay) {
  const float x = m.x / (ax * m.z), y = m.y / (ay * m.z), r = std::sqrt(x * x + y * y);
  const Limits l = limits(which, i, ax, ay, r > 0 ? x / r : 1, r > 0 ? y / r : 0);
  return unoccluded_normaliser(l, i, r, m.z, im);
}

// Beckmann's with Smith, for i_z > 0: docs/models.md. x is a visible slope along the stretched w between the ends of an
// ellipse, y one across it between the ends of its chord.
struct Chords {
  float ex, ey, t, m12, m22, kappa, xa, xb, c;  // c: C of the density
  float below(float x) const { return std::erf(x) / 2 + t * kInverseRootPi / 2 * std::exp(-x * x); }
  void chord(float x, float& from, float& to) const {
    const float middle = -m12 * x / m22, reach = std::sqrt(std::max(kappa / m22 * (x - xa) * (xb - x), 0.0f));
    from = middle - reach, to = middle + reach;
  }
};
inline Chords chords(Vector i, float ax, float ay) {
  Chords c;
  const float x = ax * i.x, y = ay * i.y, s = std::sqrt(x * x + y * y);
  c.ex = s > 0 ? x / s : 1, c.ey = s > 0 ? y / s : 0;
  c.t = s / i.z;
  c.m12 = (ay * ay - ax * ax) * c.ex * c.ey;
  c.m22 = ax * ax * c.ey * c.ey + ay * ay * c.ex * c.ex;
  c.kappa = ax * ax * ay * ay / c.m22;
  const float sum = c.t + std::sqrt(c.t * c.t + c.kappa);
  c.xb = 1 / sum, c.xa = -sum / c.kappa;
  c.c = c.below(c.xb) - c.below(c.xa);
  return c;
}
inline Unoccluded draw_beckmann_exact(Vector i, float ax, float ay, float u1, float u2) {
  const Chords c = chords(i, ax, ay);
  const float wanted = c.below(c.xa) + u1 * c.c;
  float low = std::max(c.xa, -5.0f), high = std::min(c.xb, 5.0f), x = (low + high) / 2;
  for (int step = 0; step < 20; ++step) {
    const float value = c.below(x) - wanted;
    if (std::abs(value) < 1e-6f) break;
    (value > 0 ? high : low) = x;
    x -= value / ((1 - c.t * x) * kInverseRootPi * std::exp(-x * x));
    if (!(x > low && x < high)) x = (low + high) / 2;
  }
  float from, to;
  c.chord(x, from, to);
  const float erf_from = std::erf(from), erf_to = std::erf(to);
  const float y = std::clamp(erfinv(erf_from + u2 * (erf_to - erf_from)), from, to);
  Unoccluded drawn;
  drawn.m = normalize({-ax * (c.ex * x - c.ey * y), -ay * (c.ey * x + c.ex * y), 1});
  drawn.n = i.z * c.c * (erf_to - erf_from) / 2;
  return drawn;
}
inline float beckmann_exact_normaliser(Vector i, Vector m, float ax, float ay) {
  const Chords c = chords(i, ax, ay);
  const float x = -m.x / (ax * m.z), y = -m.y / (ay * m.z);
  float from, to;
  c.chord(c.ex * x + c.ey * y, from, to);
  return i.z * c.c * (std::erf(to) - std::erf(from)) / 2;
}

// One of the two sides of a cavity, in proportion to what i sees of each.
inline Vector flip(Vector i, Vector m, float u3) {
  const Vector other = {-m.x, -m.y, m.z};
  const float here = std::max(dot(i, m), 0.0f), there = std::max(dot(i, other), 0.0f);
  return u3 * (here + there) < here ? m : other;
}

inline Vector draw(Model model, Sampler sampler, Vector i, float ax, float ay, float u1, float u2, float u3) {
  if (sampler == Sampler::visible && model.masking == Masking::smith)
    return normalize(model.distribution == Distribution::beckmann ? draw_beckmann(i, ax, ay, u1, u2)
                                                                  : draw_student_t(i, ax, ay, u1, u2));
  const Vector m = normalize(draw_ndf(model.distribution, ax, ay, u1, u2));
  return sampler == Sampler::visible ? flip(i, m, u3) : m;
}

// N in p(o) = D(m) / (4 N); p(m) = D(m) i.m / N.
inline float normaliser(Model model, Sampler sampler, Vector i, Vector m, float im, float ax, float ay) {
  if (sampler == Sampler::ndf) return im / m.z;
  if (sampler == Sampler::exact && i.z > 0)
    return model.masking == Masking::vcavity ? cavity_exact_normaliser(model.distribution, i, m, im, ax, ay)
                                             : beckmann_exact_normaliser(i, m, ax, ay);
  const float mz = m.z;
  if (model.masking == Masking::vcavity) return i.z / cavity_masking(i, im, mz);
  return area(model.distribution, i, ax, ay);
}

// f cos(theta_o) = D(m) / 4 times this, for o_z > 0.
inline float visibility(Model model, Shadowing shadowing, Vector i, Vector o, float im, float mz, float ax, float ay) {
  if (model.masking == Masking::vcavity) return std::min(cavity_masking(i, im, mz), cavity_masking(o, im, mz)) / i.z;
  const float area_i = area(model.distribution, i, ax, ay);
  return smith_weight(model.distribution, shadowing, area_i, i, o, ax, ay) / area_i;
}

constexpr bool is_ggx_smith(Model model) {
  return model.distribution == Distribution::ggx && model.masking == Masking::smith;
}

}  // namespace internal

constexpr bool has_baseline(Model model, Sampler sampler) {
  if (internal::is_ggx_smith(model)) return sampler != Sampler::visible;  // its `visible` is `cap`
  const bool cavity = model.masking == Masking::vcavity;
  if (model.distribution > (cavity ? Distribution::phong : Distribution::student_t)) return false;
  if (sampler == Sampler::exact)
    return cavity ? model.distribution != Distribution::phong : model.distribution == Distribution::beckmann;
  return sampler == Sampler::ndf || sampler == Sampler::visible;
}

inline Sample sample_normal(Model model, Sampler sampler, Vector i, float alpha_x, float alpha_y, float u1, float u2,
                            float u3) {
  using namespace internal;
  if (is_ggx_smith(model)) return sample_normal(sampler, i, alpha_x, alpha_y, u1, u2);
  Sample sample;
  sample.m = draw(model, sampler, i, alpha_x, alpha_y, u1, u2, u3);
  const float im = sample.incident_dot_normal = dot(i, sample.m);
  if (im <= 0 || (model.masking == Masking::vcavity && i.z <= 0)) return sample;
  sample.accepted = true;
  sample.pdf = distribution(model.distribution, sample.m, alpha_x, alpha_y) * im /
               normaliser(model, sampler, i, sample.m, im, alpha_x, alpha_y);
  return sample;
}

inline Sample sample_reflection(Model model, Sampler sampler, Shadowing shadowing, Vector i, float alpha_x,
                                float alpha_y, float u1, float u2, float u3) {
  using namespace internal;
  if (is_ggx_smith(model)) return sample_reflection(sampler, shadowing, i, alpha_x, alpha_y, u1, u2, u3);
  Sample sample;
  float n = 0;
  if (sampler == Sampler::exact && i.z > 0) {
    const Unoccluded drawn = model.masking == Masking::vcavity
                                 ? draw_cavity_exact(model.distribution, i, alpha_x, alpha_y, u1, u2, u3)
                                 : draw_beckmann_exact(i, alpha_x, alpha_y, u1, u2);
    sample.m = drawn.m, n = drawn.n;
  } else {
    sample.m = draw(model, sampler == Sampler::exact ? Sampler::visible : sampler, i, alpha_x, alpha_y, u1, u2, u3);
  }
  const float im = sample.incident_dot_normal = dot(i, sample.m);
  sample.o = 2 * im * sample.m - i;
  if (im <= 0 || sample.o.z <= 0 || (model.masking == Masking::vcavity && i.z <= 0)) return sample;
  sample.accepted = true;
  if (n == 0) n = normaliser(model, sampler, i, sample.m, im, alpha_x, alpha_y);
  sample.pdf = distribution(model.distribution, sample.m, alpha_x, alpha_y) / (4 * n);
  sample.weight = n * visibility(model, shadowing, i, sample.o, im, sample.m.z, alpha_x, alpha_y);
  return sample;
}

inline float pdf_reflection(Model model, Sampler sampler, Vector i, Vector o, float alpha_x, float alpha_y) {
  using namespace internal;
  if (is_ggx_smith(model)) return pdf_reflection(sampler, i, o, alpha_x, alpha_y);
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0 || (model.masking == Masking::vcavity && i.z <= 0)) return 0;
  const Vector m = normalize(h);
  return distribution(model.distribution, m, alpha_x, alpha_y) /
         (4 * normaliser(model, sampler, i, m, dot(i, m), alpha_x, alpha_y));
}

inline float evaluate_reflection(Model model, Shadowing shadowing, Vector i, Vector o, float alpha_x, float alpha_y) {
  using namespace internal;
  if (is_ggx_smith(model)) return evaluate_reflection(shadowing, i, o, alpha_x, alpha_y);
  const Vector h = i + o;
  if (o.z <= 0 || h.z <= 0 || (model.masking == Masking::vcavity && i.z <= 0)) return 0;
  const Vector m = normalize(h);
  return visibility(model, shadowing, i, o, dot(i, m), m.z, alpha_x, alpha_y) *
         distribution(model.distribution, m, alpha_x, alpha_y) / 4;
}

inline float masking(Model model, Vector i, float alpha_x, float alpha_y) {
  return i.z > 0 ? i.z / internal::area(model.distribution, i, alpha_x, alpha_y) : 0;
}

}  // namespace FACETWISE_BASELINE_BUILD
}  // namespace facetwise::baseline
