// SPDX-License-Identifier: Apache-2.0
// Where a ray meets the scene: what shading needs of it.
#pragma once

#include <cstdint>

#include "facetwise/render.h"

namespace facetwise::render {

struct Surface {
  Vector point;
  Vector facing;                    // geometric normal, unit, on the ray's side
  scene::Frame frame;               // of the shading normal, on the same side
  bool entering = true;             // the ray comes from outside
  std::array<float, 2> texcoord{};  // (0, 0) where the mesh has none

  // A ray's beginning towards `direction`, moved off the triangle.
  Vector origin(Vector direction, float step) const {
    return point + (dot(direction, facing) >= 0 ? step : -step) * facing;
  }
};

inline Surface surface_at(const scene::Mesh& mesh, const Material& material, std::uint32_t triangle, float u, float v,
                          Vector direction) {
  const auto& corners = mesh.triangles[triangle];
  const std::uint32_t a = corners[0], b = corners[1], c = corners[2];
  const float w = 1 - u - v;
  const auto at = [&](const auto& values) { return w * values[a] + u * values[b] + v * values[c]; };
  const Vector ab = mesh.positions[b] - mesh.positions[a], ac = mesh.positions[c] - mesh.positions[a];
  const Vector geometric = normalized(cross(ab, ac));
  const bool entering = dot(geometric, direction) < 0;
  const Vector facing = entering ? geometric : -1.0f * geometric;
  Vector normal = mesh.normals.empty() ? facing : at(mesh.normals);
  if (!(dot(normal, normal) > 1e-12f)) normal = facing;
  normal = normalized(normal);
  if (dot(normal, facing) < 0) normal = -1.0f * normal;
  scene::Frame frame = mesh.tangents.empty() ? scene::Frame(normal) : scene::Frame(normal, at(mesh.tangents));
  std::array<float, 2> texcoord{};
  if (!mesh.texcoords.empty())
    for (std::size_t k = 0; k < 2; ++k)
      texcoord[k] = w * mesh.texcoords[a][k] + u * mesh.texcoords[b][k] + v * mesh.texcoords[c][k];
  if (material.normal_map && !mesh.texcoords.empty()) {
    const Color texel = material.normal_map->sample(texcoord[0], texcoord[1]);
    // Green is up, as glTF has it; texture coordinates grow along the tangent.
    const Vector bent = {material.normal_scale * (2 * texel[0] - 1), material.normal_scale * (2 * texel[1] - 1),
                         2 * texel[2] - 1};
    if (dot(bent, bent) > 1e-12f) frame = scene::Frame(normalized(frame.to_world(normalized(bent))), frame.tangent);
  }
  return {at(mesh.positions), facing, frame, entering, texcoord};
}

}  // namespace facetwise::render
