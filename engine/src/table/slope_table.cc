// SPDX-License-Identifier: Apache-2.0
// A table in double.
#include "facetwise/slope_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/table/layout.h"

namespace facetwise {
namespace {

using std::numbers::pi;

// A row of nodes in u, linear between neighbouring rows and azimuths.
class Row {
 public:
  Row(const float* table, std::size_t rows, std::size_t uniforms, Place outer, Place azimuth, bool radial)
      : first_(table + (azimuth.cell * rows + outer.cell) * (uniforms + 1)),
        next_(uniforms + 1),
        turn_(radial ? 0 : rows * (uniforms + 1)),
        outer_(outer.weight),
        azimuth_(azimuth.weight) {}

  double operator[](std::size_t k) const {
    const auto at = [&](const float* p) { return double{p[k]} + outer_ * (double{p[k + next_]} - double{p[k]}); };
    const double here = at(first_);
    return turn_ == 0 ? here : here + azimuth_ * (at(first_ + turn_) - here);
  }

 private:
  const float* first_;
  std::size_t next_, turn_;
  double outer_, azimuth_;
};

// A value drawn from a row, and its density there.
struct Point {
  double value, density;
};
Point draw(const Row& row, std::size_t uniforms, double u) {
  const double v = u < 0.5 ? std::sqrt(u / 2) : 1 - std::sqrt((1 - u) / 2);
  const auto k = std::min(static_cast<std::size_t>(v * static_cast<double>(uniforms)), uniforms - 1);
  const double from = u_node(k, uniforms), share = u_node(k + 1, uniforms) - from;
  const double low = row[k], width = row[k + 1] - low;
  return {low + std::clamp((u - from) / share, 0.0, 1.0) * width, share / width};
}
double density(const Row& row, std::size_t uniforms, double value) {
  std::size_t k = 0;
  for (std::size_t step = uniforms / 2; step > 0; step /= 2)
    if (row[k + step] <= value) k += step;
  return (u_node(k + 1, uniforms) - u_node(k, uniforms)) / (row[k + 1] - row[k]);
}

// 1 + tan(half the angle of (cos, sin)), for cos >= 0, without cancellation where that is near 0.
double one_plus_half_tangent(double cos, double sin) {
  const double length = std::hypot(cos, sin);
  if (sin >= 0) return 1 + sin / (length + cos);
  return cos * (1 + cos / (length - sin)) / (length + cos);
}

struct Frame {
  double cos, sin, reach;
  Place incidence, azimuth;
};
Frame frame(double theta, double phi, std::int32_t nodes, std::int32_t azimuths) {
  Frame f{std::cos(phi), std::sin(phi), 0, {0, 0}, {0, 0}};
  f.reach = std::max(one_plus_half_tangent(std::max(std::sin(theta), 0.0), std::cos(theta)), 0x1p-20);
  f.incidence = place((1 - f.reach / 2) * (nodes - 1), static_cast<std::size_t>(nodes));
  if (azimuths != 0)
    f.azimuth = place(diamond_angle(f.cos, f.sin) / 4 * azimuths, static_cast<std::size_t>(azimuths) + 1);
  return f;
}

Row tilt_row(const SlopeTableView& view, const Frame& f) {
  return {view.tilt,
          static_cast<std::size_t>(view.incidence),
          static_cast<std::size_t>(view.uniforms),
          f.incidence,
          f.azimuth,
          view.azimuths == 0};
}
Row side_row(const SlopeTableView& view, const Frame& f, double rise) {
  const auto n = static_cast<std::size_t>(view.slopes);
  return {
      view.side,         n, static_cast<std::size_t>(view.uniforms), place(rise / 2 * (view.slopes - 1), n), f.azimuth,
      view.azimuths == 0};
}

}  // namespace

double SlopeTable::p22(double x, double y) const {
  const double squared = 1 + x * x + y * y, scale = 1 / (1 + std::sqrt(squared));
  return normal_density(view_, x * scale, y * scale) / (squared * squared);
}

double SlopeTable::projected_area(double theta, double phi) const {
  // Midpoints in chi and psi, over the visible tilts only.
  constexpr int kTilts = 1000, kSides = 1000;
  const double from = -pi / 2, width = pi - theta, c = std::cos(phi), s = std::sin(phi);
  double cos_psi[kSides], sin_psi[kSides];
  for (int j = 0; j < kSides; ++j) {
    const double psi = pi * ((j + 0.5) / kSides - 0.5);
    cos_psi[j] = std::cos(psi), sin_psi[j] = std::sin(psi);
  }
  double sum = 0;
  for (int k = 0; k < kTilts; ++k) {
    const double chi = from + width * (k + 0.5) / kTilts, lit = std::cos(chi + theta);
    const double cos_chi = std::cos(chi), sin_chi = std::sin(chi);
    for (int j = 0; j < kSides; ++j) {
      const double scale = 1 / (1 + cos_chi * cos_psi[j]);
      const double wx = sin_chi * cos_psi[j] * scale, wy = sin_psi[j] * scale;
      sum += normal_density(view_, c * wx - s * wy, s * wx + c * wy) * cos_psi[j] * cos_psi[j] * lit;
    }
  }
  return sum * width / kTilts * pi / kSides;
}

double SlopeTable::tabulated_area(double theta, double phi) const {
  const Frame f = frame(theta, phi, view_.areas, SlopeTableView::kAreaTurns * view_.azimuths);
  const auto row = [&](std::size_t azimuth) {
    const float* p = view_.area + azimuth * static_cast<std::size_t>(view_.areas) + f.incidence.cell;
    return p[0] + f.incidence.weight * (double{p[1]} - p[0]);
  };
  double ratio = row(f.azimuth.cell);
  if (!radial()) ratio += f.azimuth.weight * (row(f.azimuth.cell + 1) - ratio);
  const double half = std::cos(theta / 2);
  return ratio * half * half;
}

SlopeTable::Drawn SlopeTable::draw(double theta, double phi, double u1, double u2) const {
  const auto uniforms = static_cast<std::size_t>(view_.uniforms);
  const Frame f = frame(theta, phi, view_.incidence, view_.azimuths);
  const Point tilt = facetwise::draw(tilt_row(view_, f), uniforms, u1);
  const double rise = std::max(tilt.value * f.reach, 0x1p-22), s = rise - 1;
  const Point side = facetwise::draw(side_row(view_, f, rise), uniforms, u2);
  const double h = std::clamp(side.value, -(1 - 0x1p-22), 1 - 0x1p-22), c = std::sqrt((1 - h) * (1 + h));
  const double t = 1 / (1 + s * s), m_z = std::max(rise * (2 - rise) * t, 0x1p-22) * c;
  const double x = 2 * s * t * c / m_z, y = h / m_z;
  const double density = tilt.density / f.reach / (2 * t) * side.density;
  return {f.cos * x - f.sin * y, f.sin * x + f.cos * y, density * m_z * m_z * m_z};
}

double SlopeTable::drawn_density(double theta, double phi, double x, double y) const {
  const auto uniforms = static_cast<std::size_t>(view_.uniforms);
  const Frame f = frame(theta, phi, view_.incidence, view_.azimuths);
  const double m_z = 1 / std::sqrt(1 + x * x + y * y);
  const double along = f.cos * x + f.sin * y, h = (f.cos * y - f.sin * x) * m_z;
  const double rise = one_plus_half_tangent(1, along), s = rise - 1;
  if (rise > f.reach) return 0;
  const double tilt = density(tilt_row(view_, f), uniforms, rise / f.reach) / f.reach;
  const double side = density(side_row(view_, f, rise), uniforms, h);
  return tilt * (1 + s * s) / 2 * side * m_z * m_z * m_z;
}

}  // namespace facetwise
