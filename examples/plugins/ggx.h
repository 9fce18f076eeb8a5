// SPDX-License-Identifier: Apache-2.0
// GGX with Smith masking as renderers write it, one lane at a time: all but how a normal is drawn.
#pragma once

#include <algorithm>
#include <cmath>

#include "scalar.h"

constexpr float kPi = 3.14159265f;

inline Vec normalised(Vec v) {
  const float inverse = 1 / std::sqrt(dot(v, v));
  return {v.x * inverse, v.y * inverse, v.z * inverse};
}
inline Vec reflected(Vec i, Vec m) {
  const float twice = 2 * dot(i, m);
  return {twice * m.x - i.x, twice * m.y - i.y, twice * m.z - i.z};
}

inline float distribution(Vec m, float ax, float ay) {
  const float x = m.x / ax, y = m.y / ay, sum = x * x + y * y + m.z * m.z;
  return 1 / (kPi * ax * ay * sum * sum);
}
inline float lambda(Vec v, float ax, float ay) {
  const float x = ax * v.x, y = ay * v.y, z2 = std::max(v.z * v.z, 1e-14f);
  return (std::sqrt(1 + (x * x + y * y) / z2) - 1) / 2;
}
inline float g1(Vec v, float ax, float ay) { return 1 / (1 + lambda(v, ax, ay)); }

// f cos(theta_o), height-correlated.
inline float value(Vec i, Vec o, float ax, float ay) {
  if (!(i.z > 0 && o.z > 0)) return 0;
  const Vec m = normalised({i.x + o.x, i.y + o.y, i.z + o.z});
  const float g2 = 1 / (1 + lambda(i, ax, ay) + lambda(o, ax, ay));
  return distribution(m, ax, ay) * g2 / (4 * i.z);
}

// To be defined: a microfacet normal for i, i_z > 0, and the density of the reflections by such normals.
Vec normal(Vec i, float ax, float ay, float u1, float u2);
float pdf(Vec i, Vec m, float ax, float ay);

Drawn sample(Vec i, float ax, float ay, float u1, float u2, float) {
  Drawn d;
  if (!(i.z > 0)) return d;
  const Vec m = normal(i, ax, ay, u1, u2);
  if (!(dot(i, m) > 0)) return d;
  d.o = reflected(i, m);
  if (!(d.o.z > 0)) return {};
  d.pdf = pdf(i, m, ax, ay);
  d.weight = value(i, d.o, ax, ay) / d.pdf;
  return d;
}

Asked evaluate(Vec i, Vec o, float ax, float ay) {
  if (!(i.z > 0 && o.z > 0)) return {};
  return {pdf(i, normalised({i.x + o.x, i.y + o.y, i.z + o.z}), ax, ay), value(i, o, ax, ay)};
}
