// SPDX-License-Identifier: Apache-2.0
// Arithmetic of reference::Vector.
#pragma once

#include <cmath>

#include "facetwise/reference.h"

namespace facetwise::reference {

inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector operator*(double s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(Vector a) { return std::sqrt(dot(a, a)); }
inline Vector normalize(Vector a) { return (1 / length(a)) * a; }

// (alpha_x a_x, alpha_y a_y, a_z): a direction into the stretched frame, a stretched normal out of it.
inline Vector stretch(Roughness alpha, Vector a) { return {alpha.x * a.x, alpha.y * a.y, a.z}; }

}  // namespace facetwise::reference
