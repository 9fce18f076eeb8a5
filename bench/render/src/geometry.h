// SPDX-License-Identifier: Apache-2.0
// The scene's triangles in Embree, traced in packets.
#pragma once

#include <embree3/rtcore.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "facetwise/scene.h"

namespace facetwise::render {

inline constexpr std::uint32_t kMissed = ~std::uint32_t{0};

// Columns of rays: origin and direction, from `near` on.
struct RayColumns {
  const float *ox, *oy, *oz, *dx, *dy, *dz;
};
// What each ray hits: its triangle (kMissed if none), barycentric coordinates and distance.
struct HitColumns {
  std::uint32_t* triangle;
  float *u, *v, *distance;
};

class Geometry {
 public:
  static absl::StatusOr<std::unique_ptr<Geometry>> create(const scene::Mesh& mesh);
  ~Geometry();
  Geometry(const Geometry&) = delete;
  Geometry& operator=(const Geometry&) = delete;

  // [begin, end) of the columns. Rays begin at `near` along their direction.
  void intersect(const RayColumns& rays, const HitColumns& hits, std::size_t begin, std::size_t end, float near,
                 bool coherent) const;
  // Sets `visible` where nothing is hit, for lanes where it is set.
  void occlude(const RayColumns& rays, std::uint8_t* visible, std::size_t begin, std::size_t end, float near) const;

 private:
  Geometry() = default;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace facetwise::render
