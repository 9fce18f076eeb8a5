// SPDX-License-Identifier: Apache-2.0
// Procedural materials: a normal map and roughness as functions of the point. Exact float operations only,
// so that they are the same everywhere.
#pragma once

#include <cstdint>

#include "facetwise/scene.h"

namespace facetwise::scene {

// A random number in [0, 1) that belongs to (a, b, c).
float hash_uniform(std::uint32_t a, std::uint32_t b, std::uint32_t c);

// The normal bent by the normal map; `point` is in units of the mesh's size.
Vector bend_normal(Vector point, Vector normal);

struct Roughness {
  float x, y;
};
Roughness roughness(Vector point, std::uint32_t part);

}  // namespace facetwise::scene
