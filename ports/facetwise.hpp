// SPDX-License-Identifier: Apache-2.0
// facetwise.hpp: GGX reflection sampling that wastes no sample, to paste into a renderer. C++17, no dependencies.
//
//   exact    reflections by the visible normals whose reflection is not occluded, in exact proportion: every sample leaves
//            the surface, whatever the angle and the roughness. pdf = D(m) / (4 K), K the projected area of those normals.
//            Source: the facetwise project, docs/math.md, "The exact reflection sampler".
//   bounded  reflections by a smaller spherical cap: Eto & Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX Reflections".
//   cap      visible normals by a spherical cap: Dupuy & Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps".
//
// Conventions: unit vectors in the local frame (z is the shading normal) that point away from the surface; i is the known
// direction, o the sampled one, m the microfacet normal. Roughness alpha_x, alpha_y in [1e-4, 10] (perceptual roughness
// squared). u1, u2, u3 uniform in [0, 1). i_z <= 0, a shading normal that faces away, is answered by visible normals, as
// `cap` does (Tokuyoshi 2021, "Unbiased VNDF Sampling for Backfacing Shading Normals").
//
// All is scalar float arithmetic without branches that cost much. The library of the same project does the same for millions
// of lanes a call; tests hold this file to it (tests/ports).
#pragma once

#include <algorithm>
#include <cmath>

namespace facetwise::port {

struct Vec3 {
  float x, y, z;
};
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct Sample {
  Vec3 o;        // sampled direction
  float pdf;     // of o, 1/sr; 0 where o is occluded
  float weight;  // f cos(theta_o) / pdf with F = 1, Smith's height-correlated masking; 0 where o is occluded
};

namespace detail {

constexpr float kPi = 3.14159265f;
constexpr float kTiny = 8.7e-19f;     // stands for 0 in quotients
constexpr float kHorizon = 9.3e-10f;  // a cosine of 0 where it is squared

// i stretched by the roughness: w, A = w_x^2 + w_y^2, nu = |w|, and twice the projected area, 2 sigma = w_z + nu.
struct Stretched {
  float x, y, z, a, nu, two_sigma;
};
inline Stretched stretch(Vec3 i, float ax, float ay) {
  Stretched w{ax * i.x, ay * i.y, i.z, 0, 0, 0};
  w.a = w.x * w.x + w.y * w.y;
  w.nu = std::sqrt(w.a + w.z * w.z);
  // Behind the surface w_z + nu cancels.
  w.two_sigma = w.z > 0 ? w.nu + w.z : std::max(w.a, 8.9e-16f) / (w.nu - w.z);
  return w;
}

// pi ax ay D(m), m of any length.
inline float ndf(Vec3 m, float ax, float ay) {
  const float axy = ax * ay, x = m.x * ay, y = m.y * ax, z = m.z * axy;
  const float q = dot(m, m) * axy * axy / (x * x + y * y + z * z);
  return q * q;
}

// The weight of visible normals: G2 / G1(i), nothing cancels.
inline float shadowing(const Stretched& w, Vec3 o, float ax, float ay) {
  const float x = ax * o.x, y = ay * o.y, z = std::max(o.z, kTiny), a = x * x + y * y;
  const float front = z + std::sqrt(z * z + a);
  const float lit = w.two_sigma * z * front;
  return lit / (lit + std::abs(w.z) * a);
}

// M = L m_hat -> o and what goes with it. two_n: 2 N of pdf = D / (4 N).
inline Sample reflect(Vec3 i, const Stretched& w, Vec3 h, float ax, float ay, float two_n, bool exact) {
  const Vec3 m{ax * h.x, ay * h.y, h.z};
  const float im = std::max(w.x * h.x + w.y * h.y + w.z * h.z, 5e-26f), mm = dot(m, m), hh = dot(h, h);
  const float rho = 2 * im / mm;
  Sample s{{rho * m.x - i.x, rho * m.y - i.y, rho * m.z - i.z}, 0, 0};
  if (exact) s.o.z = std::max(s.o.z, kHorizon);  // rounding could put it below
  if (!(s.o.z > 0)) return s;
  const float q = mm / hh;  // pi ax ay D = (M.M)^2 / |m_hat|^4
  s.pdf = std::min(q * q / (2 * kPi * ax * ay * two_n), 3e38f);
  s.weight = shadowing(w, s.o, ax, ay) * (two_n / w.two_sigma);
  return s;
}

// m_hat by a cap of the stretched frame that ends at `above` over -nu: t = nu + z - above.
inline Vec3 half_vector(const Stretched& w, float t, float above, float u1, float u2) {
  const float phi = 2 * kPi * u2, height = t * u1, radius = std::sqrt(height * (2 * w.nu - height));
  return {radius * std::cos(phi) + w.x, radius * std::sin(phi) + w.y, std::max(t * (1 - u1) + above, kTiny)};
}

// Of `bounded`, i_z > 0: t and above.
inline void bound(Vec3 i, const Stretched& w, float ax, float ay, float& t, float& above) {
  const float a = ax == ay ? ax : std::min({ax, ay, 1.0f});
  const float s = 1 + std::sqrt(i.x * i.x + i.y * i.y), s2 = s * s, z2 = i.z * i.z;
  const float p = a > 1 ? z2 : s2, q = a > 1 ? s2 : z2, scale = i.z / (a * a * q + p);
  t = w.nu + (1 - a) * (1 + a) * p * scale;  // nu + k i_z
  above = a * a * (s2 + z2) * scale;         // (1 - k) i_z
}

// The elliptic cone of the normals m_hat whose reflection is not occluded, i_z > 0:
// o_z > 0 is a quadratic form in m_hat with one positive eigenvalue lambda, the root of
//   lambda - i_z = w_x^2 / (lambda + i_z ax^2) + w_y^2 / (lambda + i_z ay^2),
// whose eigenvector is the axis (v_x, v_y, 1).
struct Cone {
  float lambda, px, py, p, q, vx, vy, n2, two_k;
};
inline Cone cone(Vec3 i, const Stretched& w, float ax, float ay) {
  Cone c{};
  c.px = i.z * ax * ax;
  c.py = i.z * ay * ay;
  // The root for isotropic roughness; else a lower bound, near it.
  const float x2 = w.x * w.x, y2 = w.y * w.y;
  const float mean = ax == ay ? c.px : (x2 * c.px + y2 * c.py) / std::max(w.a, 8.9e-16f);
  const float difference = i.z - mean, root = std::sqrt((i.z + mean) * (i.z + mean) + 4 * w.a);
  float l = difference >= 0 ? 0.5f * (difference + root) : 2 * (i.z * mean + w.a) / (root - difference);
  // One Halley step is enough for alpha up to 1, three for alpha up to 10.
  const float rough = std::max(ax, ay);
  for (int step = ax == ay ? 3 : rough > 4 ? 0 : rough > 1 ? 1 : 2; step < 3; ++step) {
    const float rp = 1 / (l + c.px), rq = 1 / (l + c.py);
    const float x = x2 * rp, y = y2 * rq, x1 = x * rp, y1 = y * rq;
    const float f = l - i.z - (x + y), f1 = x1 + y1 + 1, f2 = x1 * rp + y1 * rq;
    l -= f * f1 / (f1 * f1 + f * f2);
  }
  c.lambda = l;
  c.p = l + c.px;
  c.q = l + c.py;
  c.vx = w.x / c.p;
  c.vy = w.y / c.q;
  c.n2 = c.vx * c.vx + c.vy * c.vy + 1;
  c.two_k = 2 * l * l / (c.n2 * std::sqrt(c.p * c.q));
  return c;
}

inline float pdf(Vec3 i, Vec3 o, float ax, float ay, float two_n) {
  const Vec3 h{i.x + o.x, i.y + o.y, i.z + o.z};
  if (!(o.z > 0) || !(h.z > 0) || dot(h, h) < 9.1e-13f) return 0;
  return std::min(ndf(h, ax, ay) / (2 * kPi * ax * ay * two_n), 3e38f);
}

}  // namespace detail

// Visible normals by a spherical cap. Some reflections are occluded: then pdf and weight are 0.
inline Sample sample_cap(Vec3 i, float alpha_x, float alpha_y, float u1, float u2) {
  const auto w = detail::stretch(i, alpha_x, alpha_y);
  const Vec3 h = detail::half_vector(w, w.two_sigma, 0, u1, u2);
  return detail::reflect(i, w, h, alpha_x, alpha_y, w.two_sigma, false);
}
inline float pdf_cap(Vec3 i, Vec3 o, float alpha_x, float alpha_y) {
  return detail::pdf(i, o, alpha_x, alpha_y, detail::stretch(i, alpha_x, alpha_y).two_sigma);
}

// A smaller cap, which leaves out many of those that are occluded, not all.
inline Sample sample_bounded(Vec3 i, float alpha_x, float alpha_y, float u1, float u2) {
  if (!(i.z > 0)) return sample_cap(i, alpha_x, alpha_y, u1, u2);
  const auto w = detail::stretch(i, alpha_x, alpha_y);
  float t, above;
  detail::bound(i, w, alpha_x, alpha_y, t, above);
  const Vec3 h = detail::half_vector(w, t, above, u1, u2);
  return detail::reflect(i, w, h, alpha_x, alpha_y, t, false);
}
inline float pdf_bounded(Vec3 i, Vec3 o, float alpha_x, float alpha_y) {
  if (!(i.z > 0)) return pdf_cap(i, o, alpha_x, alpha_y);
  float t, above;
  detail::bound(i, detail::stretch(i, alpha_x, alpha_y), alpha_x, alpha_y, t, above);
  return detail::pdf(i, o, alpha_x, alpha_y, t);
}

// Only normals whose reflection is not occluded.
inline Sample sample_exact(Vec3 i, float alpha_x, float alpha_y, float u1, float u2, float u3) {
  if (!(i.z > 0)) return sample_cap(i, alpha_x, alpha_y, u1, u2);
  const auto w = detail::stretch(i, alpha_x, alpha_y);
  const auto c = detail::cone(i, w, alpha_x, alpha_y);
  const float phi = 2 * detail::kPi * u2, cos = std::cos(phi), sin = std::sin(phi);
  // A point (xi, eta) of the cone's ellipse, uniformly.
  const float lu = c.lambda * u1;
  float xi = std::sqrt(lu / c.p) * cos, eta = std::sqrt(lu / c.q) * sin;
  // The point of the sphere above it along the axis is at y + zeta, its mirror image at zeta - y.
  const float along = xi * c.vx + eta * c.vy;
  float y = -along / c.n2;
  const float left = c.lambda * (1 - u1);
  const float inside = cos * cos / c.p * (left + c.px) + sin * sin / c.q * (left + c.py);  // 1 - xi^2 - eta^2
  const float zeta = std::sqrt(y * y + inside / c.n2);
  // One of the two, in proportion to w.m_hat.
  const float g = c.lambda * zeta, facing = c.lambda * y + xi * w.x + eta * w.y + g;
  if (u3 * 2 * g >= facing) xi = -xi, eta = -eta, y = -y;
  const float z = std::max(zeta + y, detail::kHorizon);
  return detail::reflect(i, w, {z * c.vx + xi, z * c.vy + eta, z}, alpha_x, alpha_y, c.two_k, true);
}
inline float pdf_exact(Vec3 i, Vec3 o, float alpha_x, float alpha_y) {
  if (!(i.z > 0)) return pdf_cap(i, o, alpha_x, alpha_y);
  return detail::pdf(i, o, alpha_x, alpha_y,
                     detail::cone(i, detail::stretch(i, alpha_x, alpha_y), alpha_x, alpha_y).two_k);
}

// f cos(theta_o) with F = 1: the BRDF times the cosine.
inline float evaluate(Vec3 i, Vec3 o, float alpha_x, float alpha_y) {
  return pdf_cap(i, o, alpha_x, alpha_y) * detail::shadowing(detail::stretch(i, alpha_x, alpha_y), o, alpha_x, alpha_y);
}

// K / sigma: the share of the visible normals whose reflection is not occluded, and so what `cap` keeps.
inline float share_unoccluded(Vec3 i, float alpha_x, float alpha_y) {
  if (!(i.z > 0)) return 1;
  const auto w = detail::stretch(i, alpha_x, alpha_y);
  return std::min(detail::cone(i, w, alpha_x, alpha_y).two_k / w.two_sigma, 1.0f);
}

}  // namespace facetwise::port
