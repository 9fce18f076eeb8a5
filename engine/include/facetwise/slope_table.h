// SPDX-License-Identifier: Apache-2.0
// Tabulated distributions of microfacet normals: any density of slopes, its projected area, and its visible
// normals sampled by two inverse tables (Heitz & d'Eon 2014, Algorithm 4). docs/tables.md has the design.
//
// A slope is (-m_x / m_z, -m_y / m_z). All is said for roughness (1, 1); another roughness stretches slopes:
// P22(x / alpha_x, y / alpha_y) / (alpha_x alpha_y). Directions are stretched ones: theta in [0, pi], beyond
// pi/2 too, and azimuth phi.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace facetwise {

// P22(x, y) >= 0. Need not be normalised: a table divides by the integral.
using SlopeDensity = std::function<double(double x, double y)>;

// What kernels read. Rows of azimuth: azimuths + 1, the last a copy of the first; one if radial. Areas have
// kAreaTurns as many steps of azimuth: they are small, and must be exact.
struct SlopeTableView {
  static constexpr std::int32_t kAreaTurns = 4;

  const float* density;  // D(m): [grid][grid] (y, x) over the square around w = slope / (1 + sqrt(1 +
                         // slope^2)), or if radial [grid] over |w| in [0, 1]
  const float* area;     // projected area over (1 + cos theta) / 2: [row of kAreaTurns azimuths + 1][areas]
  const float* tilt;     // where m tilts to in the plane of incidence: [row][incidence][uniforms + 1]
  const float* side;     // where m leans to, given its tilt: [row][slopes][uniforms + 1]
  std::int32_t grid, areas, incidence, slopes, uniforms;
  std::int32_t azimuths;  // 0 if radial
  float mean_x, mean_y;   // the density's mean slope, which Smith masking takes as if given with the batch
};

// Immutable; any number of threads may use one.
class SlopeTable {
 public:
  // Sizes; 0 is the default, of which the first is for radial tables.
  struct Options {
    bool radial = false;        // P22 depends only on x^2 + y^2
    std::size_t grid = 0;       // nodes of the density, per axis: 1025, 513
    std::size_t incidence = 0;  // nodes in theta: 129, 65
    std::size_t slopes = 0;     // nodes in tilt: 129, 129
    std::size_t uniforms = 0;   // cells in u1 and in u2, a power of two: 256, 128
    std::size_t azimuths = 0;   // nodes in phi: none, 128
    std::size_t threads = 0;    // 0: the caller's TBB arena
    // Told the fraction done, rising to 1; one call at a time, from any thread.
    std::function<void(double)> progress{};
  };

  // Calls p22 only on this thread, at the grid's nodes; it may throw. The same machine makes the same bits
  // with any threads; another's sine may differ in the last place: to have one table, share its file.
  static absl::StatusOr<std::shared_ptr<const SlopeTable>> build(const SlopeDensity& p22, const Options& options);

  // Densities at nx times ny equidistant slopes, x fastest; linear in between, 0 outside.
  struct Range {
    double from, to;
  };
  static absl::StatusOr<std::shared_ptr<const SlopeTable>> from_grid(std::span<const double> values, std::size_t nx,
                                                                     std::size_t ny, Range x, Range y,
                                                                     const Options& options);

  // A table as bytes. parse() refuses what serialise() did not write.
  std::string serialise() const;
  static absl::StatusOr<std::shared_ptr<const SlopeTable>> parse(std::string_view bytes);
  absl::Status save(const std::string& path) const;
  static absl::StatusOr<std::shared_ptr<const SlopeTable>> load(const std::string& path);
  // A saved table, or text: the line "facetwise-slopes 1 nx ny x_min x_max y_min y_max", then from_grid()'s
  // values, apart by spaces or lines. `options` are for text.
  static absl::StatusOr<std::shared_ptr<const SlopeTable>> load_any(const std::string& path, const Options& options);

  const SlopeTableView& view() const { return view_; }
  bool radial() const { return view_.azimuths == 0; }
  std::size_t bytes() const { return values_.size() * sizeof(float); }
  std::uint64_t id() const { return id_; }  // a hash of the contents
  std::string_view description() const { return description_; }

  // In double. The density itself:
  double p22(double x, double y) const;
  // Its projected area by quadrature, not by the table of areas; and by that table.
  double projected_area(double theta, double phi) const;
  double tabulated_area(double theta, double phi) const;
  // A visible slope as the tables draw it, and the density of slopes that they draw: close to the visible
  // slopes' density and positive wherever that is. u1, u2 in [0, 1].
  struct Drawn {
    double x, y, density;
  };
  Drawn draw(double theta, double phi, double u1, double u2) const;
  double drawn_density(double theta, double phi, double x, double y) const;

  SlopeTable(const SlopeTable&) = delete;
  SlopeTable& operator=(const SlopeTable&) = delete;

 private:
  friend struct SlopeTableMaker;
  SlopeTable() = default;

  std::vector<float> values_;
  SlopeTableView view_{};
  std::uint64_t id_ = 0;
  std::string description_;
};

}  // namespace facetwise
