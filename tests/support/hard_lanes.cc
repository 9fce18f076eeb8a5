// SPDX-License-Identifier: Apache-2.0
#include "support/hard_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace facetwise::test {
namespace {

// A sequence of numbers for one seed. Each expression below draws one at most: the order of two would be the
// compiler's choice.
class Sequence {
 public:
  Sequence(std::uint64_t seed, std::uint64_t stream) : seed_(hash(seed, stream)) {}
  std::uint32_t bits() { return static_cast<std::uint32_t>(hash(seed_, index_++) >> 32); }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((std::uint64_t{bits()} * n) >> 32); }
  float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }
  bool one_in(std::uint32_t n) { return below(n) == 0; }

 private:
  std::uint64_t seed_, index_ = 0;
};

// The columns that every model has: input::kPlain.
enum { kIx, kIy, kIz, kAlphaX, kAlphaY, kOx, kOy, kOz, kU1, kU2, kU3, kFields };

constexpr float kBelowOne = 1.0f - 0x1p-24f;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

float power_of_two(int exponent) { return std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23); }

// What is alike in a block of lanes.
struct Block {
  bool front, isotropic, gentle;  // alpha <= 1
  bool exceptions;
  explicit Block(Sequence next)
      : front(next.one_in(3)), isotropic(next.one_in(4)), gentle(next.one_in(2)), exceptions(next.one_in(2)) {}
};

struct Direction3 {
  float x, y, z;
};

// A unit vector with the given z, up to rounding.
Direction3 with_z(Sequence& next, float z) {
  const float radius = std::sqrt((1 - z) * (1 + z));
  const float t = next.uniform();
  const float c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
  const std::uint32_t quadrant = next.below(4);
  const float x = quadrant & 1 ? s : c, y = quadrant & 1 ? c : s;
  const std::uint32_t axis = next.below(16);  // sometimes on an axis
  return {radius * (axis == 0      ? 0.0f
                    : axis == 1    ? 1.0f
                    : quadrant & 2 ? -x
                                   : x),
          radius * (axis == 0   ? 1.0f
                    : axis == 1 ? 0.0f
                                : y),
          z};
}

Direction3 direction(Sequence& next, bool front) {
  float z = next.uniform();
  switch (next.below(8)) {
    case 0: z = (1 + z) / 2 * power_of_two(-static_cast<int>(next.below(60))); break;  // grazing
    case 1: z = 1 - z * z * power_of_two(-static_cast<int>(next.below(20))); break;    // steep
    case 2: z = next.one_in(4) ? 0x1p-140f : next.one_in(2) ? 1.0f : 0.0f; break;
    default: break;
  }
  if (front) z = std::max(z, 0x1p-149f);
  if (!front && next.one_in(2)) z = -z;
  Direction3 v = with_z(next, z);
  if (next.one_in(8)) {  // |v|^2 within 1 +- 9e-4
    const float scale = 1 + 4.4e-4f * (2 * next.uniform() - 1);
    v = {v.x * scale, v.y * scale, v.z * scale};
  }
  return v;
}

float alpha(Sequence& next, bool gentle) {
  if (next.one_in(16)) return gentle || next.one_in(2) ? kSmallestAlpha : kLargestAlpha;
  if (next.one_in(16)) return 1.0f;
  if (next.one_in(2)) return 0.05f + 0.95f * next.uniform();
  const int exponent = -14 + static_cast<int>(next.below(18));
  const float value = power_of_two(exponent) * (1 + next.uniform());
  return std::clamp(value, kSmallestAlpha, gentle ? 1.0f : kLargestAlpha);
}

float any_u(Sequence& next) {
  if (!next.one_in(10)) return next.uniform();
  switch (next.below(8)) {
    case 0: return 0.0f;
    case 1: return -0.0f;
    case 2: return kBelowOne;
    case 3: return 0.25f * static_cast<float>(next.below(4));
    case 4: return 0x1p-149f;
    case 5: return 0x1p-24f;
    case 6: return power_of_two(-static_cast<int>(next.below(126)) - 1);
    default: return 1 - 0x1p-23f;
  }
}

// Makes an ordinary lane smooth or invalid.
void spoil(Sequence& next, float (&lane)[kFields]) {
  static constexpr float kBad[] = {kNan, -kNan, kInfinity, -kInfinity, 3e38f, -1.0f, -0x1p-149f, 11.0f, 1.001f};
  static constexpr float kBadAlpha[] = {0.0f, -0.0f, -0.5f, 10.00001f, 0x1p-149f, 9.9999e-5f, 1e-30f};
  static constexpr float kBadU[] = {1.0f, -0x1p-149f, -0x1p-24f, 1.5f, 1e30f};
  float& field = lane[next.below(kFields)];
  switch (next.below(6)) {
    case 0: field = kBad[next.below(std::size(kBad))]; break;
    case 1: field = std::bit_cast<float>(next.bits()); break;
    case 2: lane[kAlphaX + next.below(2)] = kBadAlpha[next.below(std::size(kBadAlpha))]; break;
    case 3: lane[kAlphaX + next.below(2)] = kSmallestAlpha * next.uniform(); break;
    case 4: lane[kU1 + next.below(3)] = kBadU[next.below(std::size(kBadU))]; break;
    default: {  // length just, or well, outside
      float scale = next.one_in(2) ? 1.0006f : 0.9994f;
      if (next.one_in(4)) scale /= 2;
      const int first = next.one_in(2) ? kIx : kOx;
      for (int k = first; k < first + 3; ++k) lane[k] *= scale;
    }
  }
}

void ordinary_lane(Sequence& next, const Block& block, float (&lane)[kFields]) {
  const Direction3 i = direction(next, block.front);
  Direction3 o = direction(next, false);
  if (next.one_in(16)) o = next.one_in(2) ? Direction3{-i.x, -i.y, i.z} : Direction3{-i.x, -i.y, -i.z};
  const float ax = alpha(next, block.gentle);
  const float ay = block.isotropic || next.one_in(4) ? ax : alpha(next, block.gentle);
  const float values[kFields] = {i.x, i.y, i.z, ax, ay, o.x, o.y, o.z, any_u(next), any_u(next), any_u(next)};
  std::copy(std::begin(values), std::end(values), lane);
}

// The columns of only some models.
void other_columns(Sequence& next, Kind kind, bool exceptions, Lanes& lanes, std::size_t lane) {
  static constexpr float kBad[] = {kNan, kInfinity, -kInfinity, 3e38f, -1.0f, 1.0f, 100.01f, -100.01f, 0.00999f};
  const auto put = [&](input::Index index, float value) {
    if (kind == Kind::mixed && exceptions && next.one_in(32)) value = kBad[next.below(std::size(kBad))];
    if (kind == Kind::any_bits && next.one_in(8)) value = std::bit_cast<float>(next.bits());
    lanes.in[index][lane] = value;
  };
  for (const auto index : {input::mean_slope_x, input::mean_slope_y}) {
    const float scale = next.one_in(8) ? kLargestMeanSlope : next.one_in(4) ? 0.0f : 1.0f;
    put(index, scale * (2 * next.uniform() - 1));
  }
  const float edge = next.one_in(16) ? kBelowOne : next.one_in(4) ? 0.0f : 0.99f;
  put(input::slope_correlation, edge * (2 * next.uniform() - 1));
  const float media[] = {1.0f, kSmallestEta, kLargestEta, 1.5f, 0.75f, 1 + 0x1p-20f};
  const bool chosen = next.one_in(3);
  const std::uint32_t medium = next.below(std::size(media));
  const float eta = 0.4f + 2 * next.uniform();
  put(input::eta, chosen ? media[medium] : eta);
  for (const auto index : {input::f0, input::f90}) {
    const bool end = next.one_in(8);
    const float f = next.uniform();
    put(index, end ? static_cast<float>(next.below(2)) : f);
  }
}

}  // namespace

Lanes hard_lanes(Kind kind, std::size_t count, std::uint64_t seed) {
  Lanes lanes;
  lanes.count = count;
  lanes.in.assign(input::count, std::vector<float>(count));
  for (std::size_t lane = 0; lane < count; ++lane) {
    const Block block(Sequence(2 * seed, lane / 64));
    Sequence next(2 * seed + 1, lane);
    float values[kFields];
    ordinary_lane(next, block, values);
    if (kind == Kind::mixed && block.exceptions && next.one_in(8)) spoil(next, values);
    if (kind == Kind::any_bits) {
      const std::uint32_t style = next.below(8);
      const std::uint32_t chosen = style < 5 ? 1u << next.below(kFields) : style == 5 ? next.bits() : ~0u;
      for (int k = 0; k < kFields; ++k)
        if (chosen >> k & 1) values[k] = std::bit_cast<float>(next.bits());
      if (style == 7) ordinary_lane(next, block, values);
    }
    for (int k = 0; k < kFields; ++k) lanes.in[input::kPlain[k]][lane] = values[k];
    Sequence others(hash(2 * seed + 1, lane), 1);
    other_columns(others, kind, block.exceptions, lanes, lane);
  }
  return lanes;
}

}  // namespace facetwise::test
