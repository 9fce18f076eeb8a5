// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "facetwise/render.h"

namespace facetwise::render {
namespace {

SlopeMap::Moments mix(const SlopeMap::Moments& a, const SlopeMap::Moments& b, float t) {
  const auto between = [t](float p, float q) { return p + t * (q - p); };
  return {between(a.x, b.x), between(a.y, b.y), between(a.xx, b.xx), between(a.yy, b.yy), between(a.xy, b.xy)};
}

}  // namespace

SlopeMap::SlopeMap(int side, const std::vector<float>& heights, float spacing) : side_(side) {
  const auto height = [&](int x, int y) {
    return heights[static_cast<std::size_t>(((y + side) % side) * side + (x + side) % side)];
  };
  auto& finest = levels_.emplace_back();
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const float sx = (height(x + 1, y) - height(x - 1, y)) / (2 * spacing);
      const float sy = (height(x, y + 1) - height(x, y - 1)) / (2 * spacing);
      finest.push_back({sx, sy, sx * sx, sy * sy, sx * sy});
    }
  for (int n = side / 2; n >= 1; n /= 2) {
    const auto& below = levels_.back();
    std::vector<Moments> level;
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const auto at = [&](int dx, int dy) {
          return below[static_cast<std::size_t>((2 * y + dy) * 2 * n + 2 * x + dx)];
        };
        level.push_back(mix(mix(at(0, 0), at(1, 0), 0.5f), mix(at(0, 1), at(1, 1), 0.5f), 0.5f));
      }
    levels_.push_back(std::move(level));
  }
}

SlopeMap::Moments SlopeMap::at_level(float x, float y, std::size_t level) const {
  const int n = side_ >> level;
  // Slopes of the finest level lie at the texels' corners (where the heights are), those of squares at their middles.
  const float scale = 1 / static_cast<float>(1 << level), offset = level == 0 ? 0 : 0.5f - 0.5f * scale;
  x = x * scale - offset, y = y * scale - offset;
  const float fx = std::floor(x), fy = std::floor(y);
  const auto at = [&](float px, float py) {
    const auto wrap = [n](float p) { return ((static_cast<int>(p) % n) + n) % n; };
    return levels_[level][static_cast<std::size_t>(wrap(py) * n + wrap(px))];
  };
  return mix(mix(at(fx, fy), at(fx + 1, fy), x - fx), mix(at(fx, fy + 1), at(fx + 1, fy + 1), x - fx), y - fy);
}

SlopeMap::Moments SlopeMap::at(float x, float y, float level) const {
  level = std::clamp(level, 0.0f, static_cast<float>(levels_.size() - 1));
  const auto below = static_cast<std::size_t>(level);
  if (below + 1 == levels_.size()) return at_level(x, y, below);
  return mix(at_level(x, y, below), at_level(x, y, below + 1), level - static_cast<float>(below));
}

}  // namespace facetwise::render
