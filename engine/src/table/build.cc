// SPDX-License-Identifier: Apache-2.0
// Tables of a density of slopes.
#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "facetwise/slope_table.h"
#include "src/float_environment.h"
#include "src/tasks.h"
#include "src/table/layout.h"
#include "src/work.h"

namespace facetwise {
namespace {

using std::numbers::pi;

std::uint32_t chosen(std::size_t size, std::uint32_t otherwise) {
  if (size == 0) return otherwise;
  return static_cast<std::uint32_t>(std::min<std::size_t>(size, ~std::uint32_t{0}));
}

TableSizes sizes_of(const SlopeTable::Options& options) {
  const bool radial = options.radial;
  return {.grid = chosen(options.grid, radial ? 1025 : 513),
          .areas = radial ? 1025u : 257u,
          .incidence = chosen(options.incidence, radial ? 129 : 65),
          .slopes = chosen(options.slopes, 129),
          .uniforms = chosen(options.uniforms, radial ? 256 : 128),
          .azimuths = radial ? 0 : chosen(options.azimuths, 128)};
}

// D at the grid's nodes. Nodes at the disk's rim and outside, where slopes are infinite, have the value of
// their azimuth's finite slope half a cell inside.
absl::Status evaluate(const SlopeDensity& p22, const TableSizes& sizes, std::span<float> density) {
  const bool radial = sizes.azimuths == 0;
  const double step = (radial ? 1.0 : 2.0) / (sizes.grid - 1), rim = 1 - step / 2;
  double largest = 0;
  std::vector<double> values(density.size());
  for (std::size_t k = 0; k < density.size(); ++k) {
    double wx = radial ? static_cast<double>(k) * step : static_cast<double>(k % sizes.grid) * step - 1;
    double wy = radial ? 0 : static_cast<double>(k / sizes.grid) * step - 1;
    if (const double radius = std::hypot(wx, wy); radius > rim) wx *= rim / radius, wy *= rim / radius;
    const double to_slope = 2 / (1 - wx * wx - wy * wy), x = wx * to_slope, y = wy * to_slope;
    const double value = p22(x, y);
    if (!std::isfinite(value) || value < 0)
      return absl::InvalidArgumentError(absl::StrCat("p22: ", std::isfinite(value) ? "negative" : "not finite",
                                                     " at slope (", x, ", ", y, "): ", value));
    const double squared = 1 + x * x + y * y;
    values[k] = value * squared * squared;
    if (!std::isfinite(values[k]))
      return absl::InvalidArgumentError(
          absl::StrCat("p22: its projected area is not finite: ", value, " at slope (", x, ", ", y, ")"));
    largest = std::max(largest, values[k]);
  }
  if (largest == 0) return absl::InvalidArgumentError("p22: 0 at every slope of the grid");
  // Scaled, so that float has them whatever p22's unit is.
  for (std::size_t k = 0; k < density.size(); ++k) density[k] = static_cast<float>(values[k] / largest);
  return absl::OkStatus();
}

// Whether a density that is said to be radial is, at some slopes and within what a user's grid rounds.
absl::Status check_radial(const SlopeDensity& p22, const TableSizes& sizes, std::span<const float> density) {
  constexpr std::size_t kRadii = 32;
  for (std::size_t k = 1; k < kRadii; ++k) {
    const std::size_t node = k * (sizes.grid - 1) / kRadii;
    if (density[node] < 0.01f) continue;
    const double w = static_cast<double>(node) / (sizes.grid - 1), r = 2 * w / (1 - w * w), here = p22(r, 0);
    for (const auto& [cos, sin] : {Azimuth{-1, 0}, Azimuth{0, 1}, Azimuth{0, -1}, Azimuth{0.6, 0.8}})
      if (const double there = p22(r * cos, r * sin); !(std::abs(there - here) <= 0.05 * here))
        return absl::InvalidArgumentError(absl::StrCat("radial: p22 is ", here, " at slope (", r, ", 0) and ", there,
                                                       " at (", r * cos, ", ", r * sin, "); build without it"));
  }
  return absl::OkStatus();
}

// Gauss-Legendre, 4 points on [0, 1].
constexpr double kPoint[] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
constexpr double kWeight[] = {0.17392742256872692, 0.32607257743127308, 0.32607257743127308, 0.17392742256872692};

// The integral of D m_z over the hemisphere, that is of P22: cell by cell of the grid.
double integral(const SlopeTableView& view) {
  // m_z dm by w: dm = 4 / (1 + w^2)^2, m_z = (1 - w^2) / (1 + w^2)
  const auto measure = [](double squared) {
    const double t = 1 / (1 + squared);
    return squared < 1 ? 4 * t * t * t * (1 - squared) : 0.0;
  };
  double sum = 0;
  const int cells = view.grid - 1;
  if (view.azimuths == 0) {
    for (int cell = 0; cell < cells; ++cell)
      for (int p = 0; p < 4; ++p) {
        const double w = (cell + kPoint[p]) / cells;
        sum += kWeight[p] * normal_density(view, w, 0) * measure(w * w) * 2 * pi * w;
      }
    return sum / cells;
  }
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column)
      for (int q = 0; q < 4; ++q)
        for (int p = 0; p < 4; ++p) {
          const double wx = 2 * (column + kPoint[p]) / cells - 1, wy = 2 * (row + kPoint[q]) / cells - 1;
          sum += kWeight[p] * kWeight[q] * normal_density(view, wx, wy) * measure(wx * wx + wy * wy);
        }
  return sum * 4 / cells / cells;
}

// Where the integral of a density, linear between equidistant values on [0, 1], reaches the nodes in u.
// False, and nothing done, if it is 0.
bool invert(std::span<const double> density, std::size_t uniforms, std::span<double> nodes) {
  double total = 0;
  for (std::size_t k = 0; k + 1 < density.size(); ++k) total += (density[k] + density[k + 1]) / 2;
  // A sum of denormals is not a distribution.
  if (!(total > 1e-290)) return false;
  const double cells = static_cast<double>(density.size() - 1);
  std::size_t cell = 0;
  double before = 0;
  for (std::size_t k = 1; k < uniforms; ++k) {
    const double target = u_node(k, uniforms) * total;
    const auto mass = [&] { return (density[cell] + density[cell + 1]) / 2; };
    while (cell + 2 < density.size() && before + mass() < target) before += mass(), ++cell;
    const double rest = std::clamp(target - before, 0.0, mass()), first = density[cell];
    const double root = std::sqrt(std::max(first * first + 2 * (density[cell + 1] - first) * rest, 0.0));
    const double within = first + root > 0 ? 2 * rest / (first + root) : 0;
    nodes[k] = (static_cast<double>(cell) + std::min(within, 1.0)) / cells;
  }
  nodes[0] = 0;
  nodes[uniforms] = 1;
  return true;
}

// To float. A little of the uniform distribution keeps nodes apart, so that no density is infinite.
void store(std::span<const double> nodes, double from, double to, float* out) {
  constexpr double kUniform = 0x1p-14;
  const std::size_t last = nodes.size() - 1;
  for (std::size_t k = 0; k <= last; ++k) {
    const double linear = from + (to - from) * static_cast<double>(k) / static_cast<double>(last);
    out[k] = static_cast<float>(nodes[k] + kUniform * (linear - nodes[k]));
  }
  out[0] = static_cast<float>(from);
  out[last] = static_cast<float>(to);
}

class Builder {
  static constexpr std::size_t kTurns = SlopeTableView::kAreaTurns;

 public:
  Builder(const TableSizes& sizes, std::span<float> values)
      : sizes_(sizes),
        radial_(sizes.azimuths == 0),
        density_(values.data()),
        area_(density_ + sizes.density()),
        tilt_(area_ + sizes.area()),
        side_(tilt_ + sizes.tilt()),
        tilts_(radial_ ? 4096 : 768),
        sides_(radial_ ? 1024 : 384),
        steps_(2048),
        marginal_(turns() * (tilts_ + 1)),
        cos_psi_(2 * sides_ + 1),
        sin_psi_(2 * sides_ + 1) {
    for (std::size_t j = 0; j < cos_psi_.size(); ++j) {
      const double psi = pi * (static_cast<double>(j) / static_cast<double>(2 * sides_) - 0.5);
      cos_psi_[j] = std::cos(psi);
      sin_psi_[j] = std::sin(psi);
    }
    view_.density = density_;
    view_.grid = static_cast<std::int32_t>(sizes.grid);
    view_.azimuths = static_cast<std::int32_t>(sizes.azimuths);
  }

  absl::Status run(const SlopeDensity& p22, const std::function<void(double)>& progress) {
    if (auto status = evaluate(p22, sizes_, {density_, sizes_.density()}); !status.ok()) return status;
    if (radial_)
      if (auto status = check_radial(p22, sizes_, {density_, sizes_.density()}); !status.ok()) return status;
    const double whole = integral(view_);
    if (!std::isfinite(whole)) return absl::InvalidArgumentError("p22: integral is not finite");
    if (!(whole > 0)) return absl::InvalidArgumentError("p22: integral is 0");
    for (std::size_t k = 0; k < sizes_.density(); ++k) density_[k] = static_cast<float>(density_[k] / whole);

    // Costs: of one evaluation of the density, and of one of the marginal.
    const double look = static_cast<double>(sides_), fold = static_cast<double>(steps_) / 2;
    const std::size_t tilts = tilts_ + 1;
    Work work(progress, static_cast<double>(turns()) * (look * static_cast<double>(tilts) + fold / 4 * sizes_.areas) +
                            static_cast<double>(rows()) * (2 * look * sizes_.slopes + fold * sizes_.incidence));
    work.each(turns() * tilts, look, [&](std::size_t k) { make_marginal(k / tilts, k % tilts); });
    work.each(turns() * sizes_.areas, fold / 4, [&](std::size_t k) { make_area(k / sizes_.areas, k % sizes_.areas); });
    work.each(rows() * sizes_.incidence, fold,
              [&](std::size_t k) { make_tilt(k / sizes_.incidence, k % sizes_.incidence); });
    work.each(rows() * sizes_.slopes, 2 * look,
              [&](std::size_t k) { make_side(k / sizes_.slopes, k % sizes_.slopes); });
    if (!radial_) close();
    return absl::OkStatus();
  }

 private:
  // Azimuths of samples, and of areas and marginals.
  std::size_t rows() const { return radial_ ? 1 : sizes_.azimuths; }
  std::size_t turns() const { return radial_ ? 1 : kTurns * sizes_.azimuths; }

  // D of the normal of tilt tan(chi / 2) = s and side sin(psi).
  double look(const Azimuth& azimuth, double s, double cos_psi, double sin_psi) const {
    const double t = 1 / (1 + s * s), cos_chi = (1 - s) * (1 + s) * t, sin_chi = 2 * s * t;
    const double scale = 1 / (1 + cos_chi * cos_psi);
    const double wx = sin_chi * cos_psi * scale, wy = sin_psi * scale;
    return normal_density(view_, azimuth.cos * wx - azimuth.sin * wy, azimuth.sin * wx + azimuth.cos * wy);
  }
  Azimuth azimuth(std::size_t turn) const { return radial_ ? Azimuth{1, 0} : azimuth_node(turn, turns()); }

  // The integral over h of D c.
  void make_marginal(std::size_t turn, std::size_t k) {
    const Azimuth frame = azimuth(turn);
    const double s = 2 * static_cast<double>(k) / static_cast<double>(tilts_) - 1;
    double sum = 0;
    // Midpoints.
    for (std::size_t j = 1; j < cos_psi_.size(); j += 2)
      sum += look(frame, s, cos_psi_[j], sin_psi_[j]) * cos_psi_[j] * cos_psi_[j];
    marginal_[turn * (tilts_ + 1) + k] = sum * pi / static_cast<double>(sides_);
  }

  // The visible normals' density in f, s = -1 + f reach, where reach is 1 more than the largest s. At theta =
  // pi reach is 0 and the limit is meant.
  static constexpr double kSmallestReach = 1e-6;
  void visible(std::size_t turn, double reach, std::span<double> out) const {
    const double* marginal = marginal_.data() + turn * (tilts_ + 1);
    const double largest = reach - 1;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const double f = static_cast<double>(k) / static_cast<double>(out.size() - 1);
      const double s = f * reach - 1;
      const Place at = place(f * reach / 2 * static_cast<double>(tilts_), tilts_ + 1);
      const double m = marginal[at.cell] + at.weight * (marginal[at.cell + 1] - marginal[at.cell]);
      // cos(chi + theta), by the tangent p / q of half of pi/2 - theta - chi
      const double p = reach * (1 - f), q = 1 + largest * s;
      out[k] = p > 0 ? m * 2 * p * q / (p * p + q * q) * 2 / (1 + s * s) : 0;
    }
  }

  void make_area(std::size_t turn, std::size_t k) {
    const double reach =
        std::max(2 - 2 * static_cast<double>(k) / static_cast<double>(sizes_.areas - 1), kSmallestReach);
    constexpr std::size_t kSteps = 512;
    double density[kSteps + 1];
    visible(turn, reach, density);
    // Simpson's rule.
    double sum = density[0] + density[kSteps];
    for (std::size_t j = 1; j < kSteps; ++j) sum += density[j] * (j % 2 == 1 ? 4 : 2);
    const double area = sum / 3 / static_cast<double>(kSteps) * reach;
    // 1 + cos(theta) = reach^2 / (1 + largest^2)
    const double largest = reach - 1;
    area_[turn * sizes_.areas + k] = static_cast<float>(area * 2 * (1 + largest * largest) / (reach * reach));
  }

  void make_tilt(std::size_t row, std::size_t k) {
    const double reach =
        std::max(2 - 2 * static_cast<double>(k) / static_cast<double>(sizes_.incidence - 1), kSmallestReach);
    std::vector<double> density(steps_ + 1), nodes(sizes_.uniforms + 1);
    visible(kTurns * row, reach, density);
    if (!invert(density, sizes_.uniforms, nodes)) {
      // Nothing is visible: anything will do.
      for (std::size_t j = 0; j <= steps_; ++j) density[j] = static_cast<double>(steps_ - j);
      invert(density, sizes_.uniforms, nodes);
    }
    store(nodes, 0, 1, tilt_ + (row * sizes_.incidence + k) * (sizes_.uniforms + 1));
  }

  void make_side(std::size_t row, std::size_t k) {
    const Azimuth frame = azimuth(kTurns * row);
    const double s = 2 * static_cast<double>(k) / static_cast<double>(sizes_.slopes - 1) - 1;
    const std::size_t n = 2 * sides_;
    std::vector<double> density(n + 1), nodes(sizes_.uniforms + 1);
    const auto fill = [&](const auto& value) {
      for (std::size_t j = 1; j < n; ++j) density[j] = value(cos_psi_[j], sin_psi_[j]) * cos_psi_[j] * cos_psi_[j];
      return invert(density, sizes_.uniforms, nodes);
    };
    if (!fill([&](double c, double h) { return look(frame, s, c, h); })) fill([](double, double) { return 1.0; });
    for (double& node : nodes) node = std::sin(pi * (node - 0.5));
    store(nodes, -1, 1, side_ + (row * sizes_.slopes + k) * (sizes_.uniforms + 1));
  }

  // The last row is the first.
  void close() {
    const auto copy = [&](float* table, std::size_t all, std::size_t rows) {
      const std::size_t row = all / rows;
      std::copy(table, table + row, table + all - row);
    };
    copy(area_, sizes_.area(), sizes_.area_rows());
    copy(tilt_, sizes_.tilt(), sizes_.rows());
    copy(side_, sizes_.side(), sizes_.rows());
  }

  TableSizes sizes_;
  bool radial_;
  float *density_, *area_, *tilt_, *side_;
  std::size_t tilts_, sides_, steps_;  // of quadratures
  std::vector<double> marginal_;
  std::vector<double> cos_psi_, sin_psi_;  // at twice the quadrature's steps: every other is a midpoint
  SlopeTableView view_{};
};

}  // namespace

absl::StatusOr<std::shared_ptr<const SlopeTable>> SlopeTable::build(const SlopeDensity& p22, const Options& options) {
  if (!p22) return absl::InvalidArgumentError("p22: empty");
  const TableSizes sizes = sizes_of(options);
  if (auto status = check_sizes(sizes); !status.ok()) return status;
  std::vector<float> values(sizes.total());
  Builder builder(sizes, values);
  absl::Status status;
  const auto run = [&] {
    const FloatEnvironment environment;
    status = builder.run(p22, options.progress);
  };
  if (options.threads == 0)
    run();
  else
    with_threads(options.threads, run);
  if (!status.ok()) return status;
  if (options.progress) options.progress(1);
  return SlopeTableMaker::make(sizes, std::move(values));
}

absl::StatusOr<std::shared_ptr<const SlopeTable>> SlopeTable::from_grid(std::span<const double> values, std::size_t nx,
                                                                        std::size_t ny, Range x, Range y,
                                                                        const Options& options) {
  const auto wrong = [](auto... parts) { return absl::InvalidArgumentError(absl::StrCat(parts...)); };
  if (nx < 2 || ny < 2) return wrong("values: ", nx, " times ", ny, " slopes; at least 2 times 2 are needed");
  if (values.size() % nx != 0 || values.size() / nx != ny)
    return wrong("values: ", values.size(), " values for ", nx, " times ", ny, " slopes");
  for (const auto& [name, range] : {std::pair{"x", x}, std::pair{"y", y}})
    if (!std::isfinite(range.from) || !std::isfinite(range.to) || !(range.from < range.to))
      return wrong(name, ": from ", range.from, " to ", range.to, "; a finite range that rises is needed");
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k]) || values[k] < 0)
      return wrong("values[", k, "]: ", values[k], "; densities are finite and not negative");
  const auto along = [](double slope, Range range, std::size_t n) {
    return place((slope - range.from) / (range.to - range.from) * static_cast<double>(n - 1), n);
  };
  return build(
      [&](double at_x, double at_y) {
        if (!(at_x >= x.from && at_x <= x.to && at_y >= y.from && at_y <= y.to)) return 0.0;
        const Place px = along(at_x, x, nx), py = along(at_y, y, ny);
        const double* v = values.data() + py.cell * nx + px.cell;
        const double low = v[0] + px.weight * (v[1] - v[0]), high = v[nx] + px.weight * (v[nx + 1] - v[nx]);
        return low + py.weight * (high - low);
      },
      options);
}

}  // namespace facetwise
