// SPDX-License-Identifier: Apache-2.0
// The little vector algebra that tracing needs.
#pragma once

#include <array>
#include <cmath>

namespace facetwise::scene {

using Vector = std::array<float, 3>;

inline Vector operator+(Vector a, Vector b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector operator-(Vector a, Vector b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector operator*(float s, Vector a) { return {s * a[0], s * a[1], s * a[2]}; }
inline Vector operator*(Vector a, Vector b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }
inline float dot(Vector a, Vector b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector cross(Vector a, Vector b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector normalized(Vector a) { return (1.0f / std::sqrt(dot(a, a))) * a; }

// Tangent, bitangent and normal: an orthonormal local frame.
struct Frame {
  Vector tangent, bitangent, normal;

  // About a unit normal. Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
  explicit Frame(Vector n) : normal(n) {
    const float sign = std::copysign(1.0f, n[2]);
    const float a = -1.0f / (sign + n[2]);
    const float b = n[0] * n[1] * a;
    tangent = {1.0f + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
    bitangent = {b, sign + n[1] * n[1] * a, -n[1]};
  }
  // The same, its tangent as near to `along` as the normal allows.
  Frame(Vector n, Vector along) : Frame(n) {
    const Vector across = along - dot(along, n) * n;
    const float square = dot(across, across);
    if (!(square > 1e-12f)) return;
    tangent = (1.0f / std::sqrt(square)) * across;
    bitangent = cross(n, tangent);
  }

  Vector to_local(Vector v) const { return {dot(tangent, v), dot(bitangent, v), dot(normal, v)}; }
  Vector to_world(Vector v) const { return v[0] * tangent + v[1] * bitangent + v[2] * normal; }
};

}  // namespace facetwise::scene
