// SPDX-License-Identifier: Apache-2.0
#include "support/lanes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "facetwise/reference.h"

namespace facetwise::test {
namespace {

using reference::Vector;

class Maker {
 public:
  explicit Maker(std::uint64_t seed) : engine_(seed) {}

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(engine_); }
  // As the kernels' generator makes them: 24 bits.
  double u() { return static_cast<double>(engine_() >> 40) * 0x1p-24; }
  double logarithmic(double low, double high) { return low * std::pow(high / low, uniform()); }
  template <std::size_t N>
  double one_of(const double (&values)[N]) {
    return values[engine_() % N];
  }
  bool chance(int in) { return engine_() % in == 0; }

  Vector direction(double z) {
    const double phi = 2 * std::numbers::pi * uniform(), r = std::sqrt((1 - z) * (1 + z));
    return {r * std::cos(phi), r * std::sin(phi), z};
  }

 private:
  std::mt19937_64 engine_;
};

double end_of_unit_interval(Maker& make) {
  const double ends[] = {0,   0x1p-24, 0x1p-23, 1e-30,       1e-12,       0.125,      0.25,
                         0.5, 0.75,    0.875,   1 - 0x1p-24, 1 - 0x1p-23, 1 - 0x1p-20};
  return make.one_of(ends);
}

Vector outgoing(Maker& make, const Lane& lane, std::size_t n) {
  const Vector i = {lane[kIx], lane[kIy], lane[kIz]};
  switch (n / 8 % 4) {
    case 0: return make.direction(make.uniform());
    case 1: {
      const auto sample = reference::sample_reflection({}, Sampler::cap, {lane[kAlphaX], lane[kAlphaY]}, i, lane[kU1],
                                                       lane[kU2], lane[kU3]);
      return sample.o;
    }
    case 2: return i.z > 0 ? Vector{-i.x, -i.y, i.z} : Vector{i.x, i.y, -i.z};
    default: return make.direction(make.logarithmic(1e-8, 1));
  }
}

}  // namespace

Lane LaneColumns::lane(std::size_t n) const {
  Lane lane;
  for (int k = 0; k < kInputs; ++k) lane[k] = column[k][n];
  return lane;
}

LaneColumns make_lanes(std::size_t count, std::uint64_t seed) {
  Maker make(seed);
  LaneColumns columns;
  for (auto& column : columns.column) column.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    Lane lane;
    Vector i = make.direction(2 * make.uniform() - 1);
    lane[kAlphaX] = make.logarithmic(1.001e-4, 9.99);
    lane[kAlphaY] = make.chance(2) ? lane[kAlphaX] : make.logarithmic(1.001e-4, 9.99);
    for (int k : {kU1, kU2, kU3}) lane[k] = make.u();
    switch (n % 8) {
      case 4: i = make.direction((make.chance(2) ? 1 : -1) * make.logarithmic(1e-8, 1)); break;
      case 5:
        for (int k : {kU1, kU2, kU3})
          if (!make.chance(3)) lane[k] = end_of_unit_interval(make);
        break;
      case 6:
        for (int k : {kAlphaX, kAlphaY}) {
          const double alphas[] = {1.0001e-4, 1, 1 - 0x1p-24, 1 + 0x1p-23, 10, lane[kAlphaX]};
          lane[k] = make.one_of(alphas);
        }
        break;
      case 7: {
        const double tilt = make.chance(4) ? 0 : make.logarithmic(1e-10, 1);
        i = make.direction(1);
        const double phi = 2 * std::numbers::pi * make.uniform();
        i = {std::sin(tilt) * std::cos(phi), std::sin(tilt) * std::sin(phi), std::cos(tilt)};
        // Straight down no normal is visible: nearly.
        if (tilt > 1e-3 && make.chance(2)) i.z = -i.z;
        break;
      }
      default: break;
    }
    lane[kIx] = static_cast<float>(i.x);
    lane[kIy] = static_cast<float>(i.y);
    lane[kIz] = static_cast<float>(i.z);
    for (int k : {kAlphaX, kAlphaY, kU1, kU2, kU3}) lane[k] = static_cast<float>(lane[k]);
    const Vector o = outgoing(make, lane, n);
    lane[kOx] = o.x;
    lane[kOy] = o.y;
    lane[kOz] = o.z;
    for (int k = 0; k < kInputs; ++k) columns.column[k][n] = static_cast<float>(lane[k]);
  }
  return columns;
}

}  // namespace facetwise::test
