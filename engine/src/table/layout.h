// SPDX-License-Identifier: Apache-2.0
// How a table's values lie in memory, and what its axes mean.
//
// A normal has a tilt chi in the plane of incidence and a side h across it:
//   m = (-sin(chi) c, -h, cos(chi) c), c = sqrt(1 - h^2), in the frame turned by phi;
// an area of the sphere is d(chi) dh, and i.m = c cos(chi + theta). Kernels have s = tan(chi / 2) in [-1, 1],
// whose largest visible value is tan(pi/4 - theta/2) = cos(theta) / (1 + sin(theta)).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/slope_table.h"

namespace facetwise {

struct TableSizes {
  std::uint32_t grid, areas, incidence, slopes, uniforms, azimuths;

  std::size_t rows() const { return std::size_t{azimuths} + 1; }
  std::size_t density() const { return azimuths == 0 ? grid : std::size_t{grid} * grid; }
  std::size_t area_rows() const { return SlopeTableView::kAreaTurns * std::size_t{azimuths} + 1; }
  std::size_t area() const { return area_rows() * areas; }
  std::size_t tilt() const { return rows() * incidence * (std::size_t{uniforms} + 1); }
  std::size_t side() const { return rows() * slopes * (std::size_t{uniforms} + 1); }
  std::size_t total() const { return density() + area() + tilt() + side(); }
};

// Error: a size that no table has. The message names it.
absl::Status check_sizes(const TableSizes& sizes);

struct SlopeTableMaker {
  // `values`: density, area, tilt, side.
  static std::shared_ptr<const SlopeTable> make(const TableSizes& sizes, std::vector<float> values);
  static TableSizes sizes(const SlopeTable& table);
  static const std::vector<float>& values(const SlopeTable& table) { return table.values_; }
};

// Nodes in u are dense at both ends: node k of n is 2 (k / n)^2 up to the middle, and its mirror image after.
inline double u_node(std::size_t k, std::size_t n) {
  const double v = static_cast<double>(k) / static_cast<double>(n);
  return v <= 0.5 ? 2 * v * v : 1 - 2 * (1 - v) * (1 - v);
}

// The frame's azimuth at node `row` of n: nodes are equidistant in the diamond angle, which is sin / (|sin| +
// |cos|) in the first quarter and needs no arc tangent.
struct Azimuth {
  double cos, sin;
};
Azimuth azimuth_node(std::size_t row, std::size_t n);
double diamond_angle(double cos, double sin);  // [0, 4)

// The interpolant of D at w, in double.
double normal_density(const SlopeTableView& view, double wx, double wy);

// Where something lies between nodes 0 ... n - 1.
struct Place {
  std::size_t cell;
  double weight;
};
inline Place place(double position, std::size_t n) {
  if (!(position > 0)) return {0, 0};
  const double last = static_cast<double>(n - 2);
  const auto cell = static_cast<std::size_t>(position < last ? position : last);
  const double weight = position - static_cast<double>(cell);
  return {cell, weight < 1 ? weight : 1};
}

std::uint64_t fnv1a(const void* data, std::size_t bytes, std::uint64_t hash = 0xcbf29ce484222325u);

}  // namespace facetwise
