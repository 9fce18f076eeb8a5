// SPDX-License-Identifier: Apache-2.0
#include "src/material.h"

#include <algorithm>
#include <cmath>

#include "facetwise/vector.h"

namespace facetwise::scene {
namespace {

constexpr float kBumps = 90.0f;     // bumps of the normal map across the mesh
constexpr float kSteepness = 1.1f;  // largest slope of one component of the bend
constexpr float kPatches = 25.0f;   // patches of the roughness texture across the mesh

// Noise in [-1, 1]: random numbers at the points of a lattice, smoothly interpolated.
float noise(Vector p, std::uint32_t seed) {
  float corner[3], t[3];
  for (int k = 0; k < 3; ++k) {
    corner[k] = std::floor(p[k]);
    const float f = p[k] - corner[k];
    t[k] = f * f * (3.0f - 2.0f * f);
  }
  float sum = 0;
  for (unsigned c = 0; c < 8; ++c) {
    float weight = 1;
    std::uint32_t at[3];
    for (unsigned k = 0; k < 3; ++k) {
      const bool far = c >> k & 1;
      weight *= far ? t[k] : 1.0f - t[k];
      at[k] = static_cast<std::uint32_t>(static_cast<std::int32_t>(corner[k]) + far);
    }
    sum += weight * hash_uniform(at[0] + 0x9e3779b9u * seed, at[1], at[2]);
  }
  return 2.0f * sum - 1.0f;
}

}  // namespace

float hash_uniform(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::uint32_t h = a * 0x8da6b343u ^ b * 0xd8163841u ^ c * 0xcb1ab31fu;
  h = (h ^ h >> 16) * 0x7feb352du;
  h = (h ^ h >> 15) * 0x846ca68bu;
  h ^= h >> 16;
  return static_cast<float>(h >> 8) * 0x1p-24f;
}

Vector bend_normal(Vector point, Vector normal) {
  const Vector at = kBumps * point;
  const Vector bend = {noise(at, 1), noise(at, 2), noise(at, 3)};
  return normalized(normal + kSteepness * (bend - dot(bend, normal) * normal));
}

Roughness roughness(Vector point, std::uint32_t part) {
  constexpr Roughness kParts[] = {{0.05f, 0.05f}, {0.1f, 0.1f}, {0.3f, 0.3f},  {0.6f, 0.6f},
                                  {0.15f, 0.6f},  {0.8f, 0.1f}, {0.02f, 0.2f}, {0.9f, 0.9f}};
  const Roughness base = kParts[part % std::size(kParts)];
  const float worn = 1.0f + 0.6f * noise(kPatches * point, 4);
  return {std::min(worn * base.x, 1.0f), std::min(worn * base.y, 1.0f)};
}

}  // namespace facetwise::scene
