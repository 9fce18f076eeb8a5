// SPDX-License-Identifier: Apache-2.0
// GGX drawn by its normals' distribution: Walter, Marschner, Li, Torrance 2007, Eqs. 35, 36, 38; the way of many renderers
// before visible normals.
#include "ggx.h"

const char* const kName = "ggx by D(m) m_z (Walter 2007)";

float pdf(Vec i, Vec m, float ax, float ay) { return distribution(m, ax, ay) * m.z / (4 * dot(i, m)); }

Vec normal(Vec, float ax, float ay, float u1, float u2) {
  const float tangent = std::sqrt(u1 / (1 - u1)), phi = 2 * kPi * u2;
  return normalised({ax * tangent * std::cos(phi), ay * tangent * std::sin(phi), 1});
}
