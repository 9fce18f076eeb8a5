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

// A normal with density D(m) m_z, of any length.
inline Vector draw_ndf(Distribution which, float ax, float ay, float u1, float u2) {
  const Azimuth phi(u2);
  float r = 0;  // of the stretched slope
  if (which == Distribution::ggx)
    r = std::sqrt(u1 / (1 - u1));
  else if (which == Distribution::beckmann)
    r = std::sqrt(-std::log(1 - u1));
  else
    r = std::sqrt(2 * (1 / std::sqrt(1 - u1) - 1));
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

// One of the two sides of a cavity, in proportion to what i sees of each.
inline Vector flip(Vector i, Vector m, float u3) {
  const Vector other = {-m.x, -m.y, m.z};
  const float here = std::max(dot(i, m), 0.0f), there = std::max(dot(i, other), 0.0f);
  return u3 * (here + there) < here ? m : other;
}

inline Vector draw(Model model, Sampler sampler, Vector i, float ax, float ay, float u1, float u2, float u3) {
  if (sampler == Sampler::visible && model.masking == Masking::smith)
    return normalize(draw_beckmann(i, ax, ay, u1, u2));
  const Vector m = normalize(draw_ndf(model.distribution, ax, ay, u1, u2));
  return sampler == Sampler::visible ? flip(i, m, u3) : m;
}

// N in p(o) = D(m) / (4 N); p(m) = D(m) i.m / N.
inline float normaliser(Model model, Sampler sampler, Vector i, float im, float mz, float ax, float ay) {
  if (sampler == Sampler::ndf) return im / mz;
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
  if (model.distribution > Distribution::student_t) return false;
  if (sampler == Sampler::ndf) return true;
  return sampler == Sampler::visible &&
         (model.masking == Masking::vcavity || model.distribution == Distribution::beckmann);
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
               normaliser(model, sampler, i, im, sample.m.z, alpha_x, alpha_y);
  return sample;
}

inline Sample sample_reflection(Model model, Sampler sampler, Shadowing shadowing, Vector i, float alpha_x,
                                float alpha_y, float u1, float u2, float u3) {
  using namespace internal;
  if (is_ggx_smith(model)) return sample_reflection(sampler, shadowing, i, alpha_x, alpha_y, u1, u2, u3);
  Sample sample;
  sample.m = draw(model, sampler, i, alpha_x, alpha_y, u1, u2, u3);
  const float im = sample.incident_dot_normal = dot(i, sample.m);
  sample.o = 2 * im * sample.m - i;
  if (im <= 0 || sample.o.z <= 0 || (model.masking == Masking::vcavity && i.z <= 0)) return sample;
  sample.accepted = true;
  const float n = normaliser(model, sampler, i, im, sample.m.z, alpha_x, alpha_y);
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
         (4 * normaliser(model, sampler, i, dot(i, m), m.z, alpha_x, alpha_y));
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
