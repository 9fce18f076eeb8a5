// SPDX-License-Identifier: Apache-2.0
#include "src/light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace facetwise::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kLargestBelowOne = 0x1.fffffep-1f;

float luminance(const float* rgb) { return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]; }

// The interval of a cumulative table that u in [0, 1) falls into; u becomes the place in it.
int find(const float* cumulative, int count, float& u) {
  const float* above = std::upper_bound(cumulative, cumulative + count, u);
  const int index = std::clamp(static_cast<int>(above - cumulative) - 1, 0, count - 1);
  const float low = cumulative[index], width = cumulative[index + 1] - low;
  u = width > 0 ? std::clamp((u - low) / width, 0.0f, kLargestBelowOne) : 0.5f;
  return index;
}

// Turns a sum that grows into a distribution.
void normalise(double total, const std::vector<double>& sums, float* cumulative) {
  for (std::size_t k = 0; k < sums.size(); ++k)
    cumulative[k] =
        static_cast<float>(total > 0 ? sums[k] / total : static_cast<double>(k) / static_cast<double>(sums.size() - 1));
}

}  // namespace

Light::Light(const Environment& environment) : environment_(environment) {
  if (!environment_.probe) return;
  const Image& probe = *environment_.probe;
  width_ = probe.width;
  height_ = probe.height;
  const auto w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
  cos_edge_.resize(h + 1);
  for (std::size_t y = 0; y <= h; ++y)
    cos_edge_[y] = static_cast<float>(std::cos(std::numbers::pi * static_cast<double>(y) / static_cast<double>(h)));
  rows_.resize(h + 1);
  columns_.resize(h * (w + 1));
  density_.resize(h * w);
  std::vector<double> row_sums(h + 1), sums(w + 1);
  for (std::size_t y = 0; y < h; ++y) {
    for (std::size_t x = 0; x < w; ++x)
      sums[x + 1] = sums[x] + luminance(probe.at(static_cast<int>(x), static_cast<int>(y)));
    normalise(sums[w], sums, &columns_[y * (w + 1)]);
    row_sums[y + 1] = row_sums[y] + sums[w] * (static_cast<double>(cos_edge_[y]) - cos_edge_[y + 1]);
  }
  normalise(row_sums[h], row_sums, rows_.data());
  // From the same rounded tables that are drawn from.
  for (std::size_t y = 0; y < h; ++y)
    for (std::size_t x = 0; x < w; ++x) {
      const float* row = &columns_[y * (w + 1)];
      const double solid_angle =
          2 * std::numbers::pi / static_cast<double>(w) * (static_cast<double>(cos_edge_[y]) - cos_edge_[y + 1]);
      density_[y * w + x] = static_cast<float>((static_cast<double>(rows_[y + 1]) - rows_[y]) *
                                               (static_cast<double>(row[x + 1]) - row[x]) / solid_angle);
    }
}

Light::Place Light::place(Vector direction) const {
  const float turns = 0.5f + std::atan2(direction[0], -direction[2]) / (2 * kPi) + environment_.turn;
  const float theta = std::acos(std::clamp(direction[1], -1.0f, 1.0f)) / kPi;
  return {std::min(turns - std::floor(turns), kLargestBelowOne), std::min(theta, kLargestBelowOne)};
}

Color Light::radiance(Vector direction) const {
  if (width_ == 0) return environment_.constant;
  return radiance(place(direction));
}

// As Image::sample, except at the poles: the probe does not go on beyond them.
Color Light::radiance(Place at) const {
  const float half = 0.5f / static_cast<float>(height_);
  return environment_.probe->sample(at.x, std::clamp(at.y, half, 1 - half));
}

float Light::pdf(Vector direction) const {
  if (width_ == 0) return 1 / (4 * kPi);
  const Place at = place(direction);
  const auto x = static_cast<std::size_t>(at.x * static_cast<float>(width_));
  const auto y = static_cast<std::size_t>(at.y * static_cast<float>(height_));
  return density_[y * static_cast<std::size_t>(width_) + x];
}

Light::Drawn Light::draw(float u1, float u2) const {
  if (width_ == 0) {
    const float z = 1 - 2 * u1, r = std::sqrt(std::max(0.0f, 1 - z * z)), phi = 2 * kPi * u2;
    return {{r * std::sin(phi), z, r * std::cos(phi)}, environment_.constant, 1 / (4 * kPi)};
  }
  const auto y = static_cast<std::size_t>(find(rows_.data(), height_, u1));
  const auto width = static_cast<std::size_t>(width_);
  const int x = find(&columns_[y * (width + 1)], width_, u2);
  const float top = cos_edge_[y], bottom = cos_edge_[y + 1];
  const float z = top + u1 * (bottom - top), r = std::sqrt(std::max(0.0f, 1 - z * z));
  const float turns = (static_cast<float>(x) + u2) / static_cast<float>(width_) - environment_.turn - 0.5f;
  const float phi = 2 * kPi * turns;
  const Vector direction = {r * std::sin(phi), z, -r * std::cos(phi)};
  return {direction, radiance(direction), density_[y * width + static_cast<std::size_t>(x)]};
}

}  // namespace facetwise::render
