// SPDX-License-Identifier: Apache-2.0
// GGX drawn by its visible normals: Heitz 2018, "Sampling the GGX Distribution of Visible Normals", as path tracers have it.
#include "ggx.h"

#ifdef WITHOUT_G1
// A mistake that is easily made: the density of visible normals without the share of them that is seen.
const char* const kName = "ggx by visible normals, its pdf without G1";
float pdf(Vec i, Vec m, float ax, float ay) { return distribution(m, ax, ay) / (4 * i.z); }
#else
const char* const kName = "ggx by visible normals (Heitz 2018)";
float pdf(Vec i, Vec m, float ax, float ay) { return g1(i, ax, ay) * distribution(m, ax, ay) / (4 * i.z); }
#endif

Vec normal(Vec i, float ax, float ay, float u1, float u2) {
  const Vec h = normalised({ax * i.x, ay * i.y, i.z});
  const float across2 = h.x * h.x + h.y * h.y, inverse = across2 > 0 ? 1 / std::sqrt(across2) : 0;
  const Vec t1 = across2 > 0 ? Vec{-h.y * inverse, h.x * inverse, 0} : Vec{1, 0, 0};
  const Vec t2 = {h.y * t1.z - h.z * t1.y, h.z * t1.x - h.x * t1.z, h.x * t1.y - h.y * t1.x};
  const float r = std::sqrt(u1), phi = 2 * kPi * u2, a = r * std::cos(phi), s = (1 + h.z) / 2;
  const float b = (1 - s) * std::sqrt(std::max(1 - a * a, 0.0f)) + s * r * std::sin(phi);
  const float c = std::sqrt(std::max(1 - a * a - b * b, 0.0f));
  return normalised({ax * (a * t1.x + b * t2.x + c * h.x), ay * (a * t1.y + b * t2.y + c * h.y),
                     std::max(a * t1.z + b * t2.z + c * h.z, 1e-7f)});
}
