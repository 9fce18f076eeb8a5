// SPDX-License-Identifier: Apache-2.0
// Real input: the incident directions and roughness of rays that hit a mesh, traced with Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/vector.h"

namespace facetwise::scene {

// Triangles with vertex normals, in world space: a file's instances are resolved.
struct Mesh {
  std::vector<Vector> positions, normals;               // per vertex
  std::vector<std::array<std::uint32_t, 3>> triangles;  // vertices
  std::vector<std::uint32_t> parts;                     // per triangle: which of the file's meshes it is of
  std::vector<Vector> tangents;                         // per vertex, of any length, 0 where unknown; may be empty
  std::vector<std::array<float, 2>> texcoords;          // per vertex, v grows downwards; may be empty
};

// Reads any format that assimp knows; tangents, if wanted, from the texture coordinates. Errors begin with the path.
absl::StatusOr<Mesh> load_mesh(const std::string& path, bool tangents = false);

// 2CylinderEngine.glb of Debian's assimp-testmodels, or NotFound where it is not installed.
absl::StatusOr<std::string> default_mesh();

// Lanes in the local frame of the shading normal.
struct Lanes {
  std::vector<float> incident_x, incident_y, incident_z, alpha_x, alpha_y;
  std::uint64_t backfacing = 0;  // lanes with i_z <= 0

  std::size_t size() const { return incident_x.size(); }
};

// A fixed perspective camera that the mesh fills, and what its rays hit. Each pass over the image shoots one
// ray through a random point of each pixel; a pixel's points are fixed by its place and the pass, so the
// lanes are the same in every run on the same machine.
//
// The shading normal is the interpolated vertex normal, on the side of the viewer, bent by a procedural
// normal map; bent far enough it faces away from the viewer: i_z <= 0. Roughness belongs to the part of the
// mesh and varies over it by a procedural texture.
class Camera {
 public:
  static absl::StatusOr<std::unique_ptr<Camera>> create(Mesh mesh);
  ~Camera();

  // The next `lanes` hits, over as many passes as it takes.
  Lanes trace(std::size_t lanes);

  std::size_t triangles() const;
  std::uint64_t rays() const;  // shot so far
  std::uint64_t hits() const;  // and how many of them hit

 private:
  struct State;
  explicit Camera(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace facetwise::scene
