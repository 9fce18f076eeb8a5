// The little vector algebra that tracing needs.
#pragma once

#include <cmath>

#include "facetwise/scene.h"

namespace facetwise::scene {

inline Vector operator+(Vector a, Vector b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector operator-(Vector a, Vector b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector operator*(float s, Vector a) { return {s * a[0], s * a[1], s * a[2]}; }
inline float dot(Vector a, Vector b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector cross(Vector a, Vector b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector normalized(Vector a) { return (1.0f / std::sqrt(dot(a, a))) * a; }

}  // namespace facetwise::scene
