// SPDX-License-Identifier: Apache-2.0
#include "src/table/layout.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace facetwise {

absl::Status check_sizes(const TableSizes& sizes) {
  const auto within = [](const char* name, std::uint32_t value, std::uint32_t least, std::uint32_t most) {
    if (value >= least && value <= most) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", value, "; from ", least, " to ", most, " is possible"));
  };
  for (const absl::Status& status :
       {within("grid", sizes.grid, 5, 65537), within("areas", sizes.areas, 2, 65537),
        within("incidence", sizes.incidence, 2, 8193), within("slopes", sizes.slopes, 2, 8193),
        within("uniforms", sizes.uniforms, 4, 4096)})
    if (!status.ok()) return status;
  if (!std::has_single_bit(sizes.uniforms))
    return absl::InvalidArgumentError(absl::StrCat("uniforms: ", sizes.uniforms, "; a power of two is possible"));
  if (sizes.azimuths != 0) {
    if (auto status = within("azimuths", sizes.azimuths, 4, 4096); !status.ok()) return status;
    if (sizes.azimuths % 4 != 0)
      return absl::InvalidArgumentError(absl::StrCat("azimuths: ", sizes.azimuths, "; a multiple of 4 is possible"));
  }
  // Kernels count in 32 bits.
  if (sizes.total() > std::size_t{1} << 28)
    return absl::InvalidArgumentError(
        absl::StrCat("options: a table of ", sizes.total() * sizeof(float), " bytes; at most 1 GiB is possible"));
  return absl::OkStatus();
}

namespace {

// The mean slope, cell by cell of the grid. By w: slope = 2 w / (1 - w^2), m_z dm = 4 (1 - w^2) / (1 + w^2)^3 dw, whose
// product is finite at the rim.
void set_mean(SlopeTableView& view) {
  if (view.azimuths == 0) return;
  double sum_x = 0, sum_y = 0, sum = 0;
  const int n = view.grid;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) {
      const double wx = 2.0 * column / (n - 1) - 1, wy = 2.0 * row / (n - 1) - 1, squared = wx * wx + wy * wy;
      if (squared >= 1) continue;
      const double t = 1 / (1 + squared), density = double{view.density[row * n + column]} * t * t * t;
      sum += density * (1 - squared);
      sum_x += density * 2 * wx;
      sum_y += density * 2 * wy;
    }
  view.mean_x = static_cast<float>(sum_x / sum);
  view.mean_y = static_cast<float>(sum_y / sum);
}

}  // namespace

std::shared_ptr<const SlopeTable> SlopeTableMaker::make(const TableSizes& sizes, std::vector<float> values) {
  std::shared_ptr<SlopeTable> table(new SlopeTable);
  table->values_ = std::move(values);
  const float* at = table->values_.data();
  SlopeTableView& view = table->view_;
  view.density = at;
  view.area = at += sizes.density();
  view.tilt = at += sizes.area();
  view.side = at + sizes.tilt();
  view.grid = static_cast<std::int32_t>(sizes.grid);
  view.areas = static_cast<std::int32_t>(sizes.areas);
  view.incidence = static_cast<std::int32_t>(sizes.incidence);
  view.slopes = static_cast<std::int32_t>(sizes.slopes);
  view.uniforms = static_cast<std::int32_t>(sizes.uniforms);
  view.azimuths = static_cast<std::int32_t>(sizes.azimuths);
  set_mean(view);
  table->id_ = fnv1a(table->values_.data(), table->bytes(), fnv1a(&sizes, sizeof sizes));
  table->description_ = sizes.azimuths == 0 ? absl::StrCat("radial, grid ", sizes.grid)
                                            : absl::StrCat("azimuths ", sizes.azimuths, ", grid ", sizes.grid);
  absl::StrAppend(&table->description_, ", incidence ", sizes.incidence, ", slopes ", sizes.slopes, ", uniforms ",
                  sizes.uniforms, ", ", table->bytes(), " bytes, id ", absl::Hex(table->id_, absl::kZeroPad16));
  return table;
}

TableSizes SlopeTableMaker::sizes(const SlopeTable& table) {
  const SlopeTableView& view = table.view_;
  const auto u32 = [](std::int32_t value) { return static_cast<std::uint32_t>(value); };
  return {u32(view.grid),   u32(view.areas),    u32(view.incidence),
          u32(view.slopes), u32(view.uniforms), u32(view.azimuths)};
}

Azimuth azimuth_node(std::size_t row, std::size_t n) {
  const std::size_t quarter = n / 4;
  const double p = static_cast<double>(row % quarter) / static_cast<double>(quarter);
  const double length = std::hypot(1 - p, p), c = (1 - p) / length, s = p / length;
  switch (row / quarter % 4) {
    case 0: return {c, s};
    case 1: return {-s, c};
    case 2: return {-c, -s};
    default: return {s, -c};
  }
}

double diamond_angle(double cos, double sin) {
  const double p = std::abs(sin) / (std::abs(sin) + std::abs(cos));
  const double half = cos >= 0 ? p : 2 - p;
  return sin >= 0 ? half : 4 - half;
}

double normal_density(const SlopeTableView& view, double wx, double wy) {
  const auto n = static_cast<std::size_t>(view.grid);
  const auto lerp = [](double a, double b, double w) { return a + w * (b - a); };
  if (view.azimuths == 0) {
    const Place at = place(std::sqrt(wx * wx + wy * wy) * static_cast<double>(n - 1), n);
    const float* d = view.density + at.cell;
    return lerp(d[0], d[1], at.weight);
  }
  const double scale = static_cast<double>(n - 1) / 2;
  const Place x = place((wx + 1) * scale, n), y = place((wy + 1) * scale, n);
  const float* d = view.density + y.cell * n + x.cell;
  return lerp(lerp(d[0], d[1], x.weight), lerp(d[n], d[n + 1], x.weight), y.weight);
}

std::uint64_t fnv1a(const void* data, std::size_t bytes, std::uint64_t hash) {
  const auto* byte = static_cast<const unsigned char*>(data);
  for (std::size_t k = 0; k < bytes; ++k) hash = (hash ^ byte[k]) * 0x100000001b3u;
  return hash;
}

}  // namespace facetwise
