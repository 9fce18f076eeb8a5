// SPDX-License-Identifier: Apache-2.0
// The environment as a light that can be sampled.
#pragma once

#include <vector>

#include "facetwise/render.h"

namespace facetwise::render {

// Directions are drawn in proportion to the luminance of the probe's pixels, each pixel's evenly over its solid angle; a
// constant environment's evenly over the sphere. Radiance is interpolated between pixels, so it may be there where the
// density is 0: only scattering finds such light, which multiple importance sampling allows for.
class Light {
 public:
  explicit Light(const Environment& environment);

  struct Drawn {
    Vector direction;
    Color radiance;
    float pdf;  // 1/sr
  };
  Drawn draw(float u1, float u2) const;
  Color radiance(Vector direction) const;
  float pdf(Vector direction) const;

 private:
  // Place in the probe, both in [0, 1); y from +y down.
  struct Place {
    float x, y;
  };
  Place place(Vector direction) const;
  Color radiance(Place at) const;

  Environment environment_;
  int width_ = 0, height_ = 0;
  std::vector<float> rows_;      // cumulative, height + 1
  std::vector<float> columns_;   // cumulative in each row, width + 1
  std::vector<float> density_;   // 1/sr of each pixel
  std::vector<float> cos_edge_;  // cosine of the polar angle at the rows' edges, height + 1
};

}  // namespace facetwise::render
