// SPDX-License-Identifier: Apache-2.0
// How different two pictures look: a simple kin of FLIP (Andersson et al. 2020). Both are blurred as an eye at arm's length
// blurs them, and the distance of their colours in CIELAB (HyAB: |L| apart plus the distance in a, b) is averaged and scaled
// so that 1 is about black against white.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "facetwise/render.h"

namespace facetwise::render {

inline std::array<double, 3> to_lab(const Color& rgb) {
  const double r = rgb[0], g = rgb[1], b = rgb[2];
  const double xyz[] = {(0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505, 0.2126 * r + 0.7152 * g + 0.0722 * b,
                        (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0891};
  double f[3];
  for (int k = 0; k < 3; ++k) f[k] = xyz[k] > 216.0 / 24389 ? std::cbrt(xyz[k]) : (24389.0 / 27 * xyz[k] + 16) / 116;
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

// `a` and `b` as linear colours of width x height pixels, clamped to [0, 1].
inline double looks_different(const std::vector<Color>& a, const std::vector<Color>& b, int width, int height) {
  const auto blurred = [&](const std::vector<Color>& picture) {
    constexpr int kRadius = 2;
    std::vector<Color> result(picture.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        double weights = 0, sum[3] = {};
        for (int dy = -kRadius; dy <= kRadius; ++dy)
          for (int dx = -kRadius; dx <= kRadius; ++dx) {
            const int px = std::clamp(x + dx, 0, width - 1), py = std::clamp(y + dy, 0, height - 1);
            const double weight = std::exp(-0.5 * (dx * dx + dy * dy));
            weights += weight;
            for (std::size_t c = 0; c < 3; ++c)
              sum[c] += weight * std::clamp(picture[static_cast<std::size_t>(py * width + px)][c], 0.0f, 1.0f);
          }
        for (std::size_t c = 0; c < 3; ++c)
          result[static_cast<std::size_t>(y * width + x)][c] = static_cast<float>(sum[c] / weights);
      }
    return result;
  };
  const auto p = blurred(a), q = blurred(b);
  double sum = 0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const auto x = to_lab(p[k]), y = to_lab(q[k]);
    sum += (std::abs(x[0] - y[0]) + std::hypot(x[1] - y[1], x[2] - y[2])) / 100;
  }
  return sum / static_cast<double>(p.size());
}

}  // namespace facetwise::render
