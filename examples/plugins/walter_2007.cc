// SPDX-License-Identifier: Apache-2.0
// GGX drawn by its normals' distribution: Walter, Marschner, Li, Torrance 2007, Eqs. 35, 36, 38; the way of many renderers
// before visible normals.
#include "ggx.h"

const char* const kName = "ggx by D(m) m_z (Walter 2007)";

namespace {

float pdf(Vec i, Vec m, float ax, float ay) { return distribution(m, ax, ay) * m.z / (4 * dot(i, m)); }

}  // namespace

Drawn sample(Vec i, float ax, float ay, float u1, float u2, float) {
  const float tangent = std::sqrt(u1 / (1 - u1)), phi = 2 * kPi * u2;
  const Vec m = normalised({ax * tangent * std::cos(phi), ay * tangent * std::sin(phi), 1});
  Drawn d;
  if (!(i.z > 0 && dot(i, m) > 0)) return d;
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
