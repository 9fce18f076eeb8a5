// SPDX-License-Identifier: Apache-2.0
#include "support/lobe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "facetwise/gauss.h"

namespace facetwise::test {
namespace {

using reference::Vector;

constexpr double kHalfPi = std::numbers::pi / 2, kTwoPi = 2 * std::numbers::pi;

// The part of the meridian phi that belongs to the lobe is one interval [low, high] of t. In x = tan t, with
// w = alpha_x i_x cos phi + alpha_y i_y sin phi and a = (alpha_x cos phi)^2 + (alpha_y sin phi)^2,
//   i.m > 0  where  i_z + w x > 0;
//   o_z > 0  where  i_z + 2 w x - i_z a x^2 > 0   (from 2 (i.m) m_z > i_z |m|^2).
// For i_z > 0 the second implies the first, for i_z <= 0 the first the second.
struct Interval {
  double low = 0, high = 0;
};

Interval meridian(const Lobe& lobe, double phi) {
  const double cos = std::cos(phi), sin = std::sin(phi), iz = lobe.i.z;
  const double ax = lobe.alpha.x * cos, ay = lobe.alpha.y * sin;
  const double w = lobe.i.x * ax + lobe.i.y * ay, a = ax * ax + ay * ay;
  if (iz <= 0) {
    if (w <= 0) return {};
    return {std::atan2(-iz, w), kHalfPi};
  }
  if (lobe.reflections) {
    const double root = std::sqrt(w * w + iz * iz * a);
    return {0, w > 0 ? std::atan2(w + root, iz * a) : std::atan2(iz, root - w)};
  }
  return {0, w >= 0 ? kHalfPi : std::atan2(iz, -w)};
}

// The integrand per dt dphi.
double value_at(const Lobe& lobe, const Integrand& integrand, double t, double phi) {
  const double sin = std::sin(t);
  const Vector big = {lobe.alpha.x * sin * std::cos(phi), lobe.alpha.y * sin * std::sin(phi), std::cos(t)};
  const double length = std::sqrt(big.x * big.x + big.y * big.y + big.z * big.z);
  const Vector m = {big.x / length, big.y / length, big.z / length};
  const double im = lobe.i.x * m.x + lobe.i.y * m.y + lobe.i.z * m.z;
  double jacobian = lobe.alpha.x * lobe.alpha.y / (length * length * length) * sin;
  if (lobe.reflections && !lobe.per_normal) jacobian *= 4 * im;
  if (jacobian <= 0) return 0;
  return jacobian * integrand(m, reflect(lobe.i, m));
}

// The integral over t in [low, high] at one phi.
double along(const Lobe& lobe, const Integrand& integrand, double low, double high, double phi) {
  static const GaussRule rule = gauss_rule(6);
  double sum = 0;
  for (std::size_t n = 0; n < rule.point.size(); ++n)
    sum += rule.weight[n] * value_at(lobe, integrand, low + (high - low) * rule.point[n], phi);
  return sum * (high - low);
}

double along_adaptive(const Lobe& lobe, const Integrand& integrand, double low, double high, double phi, double whole,
                      double tolerance, int depth) {
  const double middle = (low + high) / 2;
  const double left = along(lobe, integrand, low, middle, phi), right = along(lobe, integrand, middle, high, phi);
  if (std::abs(whole - left - right) <= tolerance || depth == 0) return left + right;
  return along_adaptive(lobe, integrand, low, middle, phi, left, tolerance, depth - 1) +
         along_adaptive(lobe, integrand, middle, high, phi, right, tolerance, depth - 1);
}

// Integrals over phi in [a, b] of all t cells, by the outer rule. tolerance_t > 0: adaptive in t, too.
void strip(const Lobe& lobe, const Grid& grid, const Integrand& integrand, double a, double b, double tolerance_t,
           std::vector<double>& sums) {
  std::fill(sums.begin(), sums.end(), 0.0);
  static const GaussRule outer = gauss_rule(8);
  for (std::size_t k = 0; k < outer.point.size(); ++k) {
    const double phi = a + (b - a) * outer.point[k];
    const Interval part = meridian(lobe, phi);
    for (std::size_t cell = 0; cell + 1 < grid.t.size(); ++cell) {
      const double low = std::max(grid.t[cell], part.low), high = std::min(grid.t[cell + 1], part.high);
      if (!(low < high)) continue;
      double sum = along(lobe, integrand, low, high, phi);
      if (tolerance_t > 0) sum = along_adaptive(lobe, integrand, low, high, phi, sum, tolerance_t, 30);
      sums[cell] += sum * outer.weight[k] * (b - a);
    }
  }
}

void refine(const Lobe& lobe, const Grid& grid, const Integrand& integrand, double a, double b,
            const std::vector<double>& whole, double tolerance, double tolerance_t, int depth, double* out) {
  const std::size_t cells = whole.size();
  std::vector<double> left(cells), right(cells);
  const double middle = (a + b) / 2;
  strip(lobe, grid, integrand, a, middle, tolerance_t, left);
  strip(lobe, grid, integrand, middle, b, tolerance_t, right);
  double error = 0;
  for (std::size_t n = 0; n < cells; ++n) error = std::max(error, std::abs(whole[n] - left[n] - right[n]));
  if (error <= tolerance || depth == 0) {
    for (std::size_t n = 0; n < cells; ++n) out[n] += left[n] + right[n];
    return;
  }
  refine(lobe, grid, integrand, a, middle, left, tolerance, tolerance_t, depth - 1, out);
  refine(lobe, grid, integrand, middle, b, right, tolerance, tolerance_t, depth - 1, out);
}

// Edges that cut a histogram over [low, high] into equal parts.
std::vector<double> quantiles(const std::vector<double>& histogram, double low, double high, int cells, double first,
                              double last) {
  double total = 0;
  for (double h : histogram) total += h;
  std::vector<double> edges = {first};
  double sum = 0;
  const double width = (high - low) / histogram.size();
  for (std::size_t n = 0; n < histogram.size(); ++n) {
    while (static_cast<int>(edges.size()) < cells && histogram[n] > 0 &&
           sum + histogram[n] >= total * edges.size() / cells) {
      const double inside = (total * edges.size() / cells - sum) / histogram[n];
      edges.push_back(low + width * (n + std::clamp(inside, 0.0, 1.0)));
    }
    sum += histogram[n];
  }
  edges.push_back(last);
  return edges;
}

}  // namespace

std::size_t Grid::cell(reference::Roughness alpha, Vector m) const {
  const double x = m.x / alpha.x, y = m.y / alpha.y;
  const double polar = std::atan2(std::sqrt(x * x + y * y), m.z);
  double azimuth = std::atan2(y, x);
  if (azimuth < 0) azimuth += kTwoPi;
  const auto find = [](const std::vector<double>& edges, double value) {
    const auto after = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
    return static_cast<std::size_t>(after - edges.begin() - 1);
  };
  return index(find(phi, azimuth), find(t, polar));
}

Grid make_grid(const Lobe& lobe, const Integrand& integrand, int t_cells, int phi_cells) {
  constexpr int kSteps = 256;
  double low = kHalfPi, high = 0;
  for (int n = 0; n < kSteps; ++n) {
    const Interval part = meridian(lobe, kTwoPi * (n + 0.5) / kSteps);
    if (!(part.low < part.high)) continue;
    low = std::min(low, part.low);
    high = std::max(high, part.high);
  }
  std::vector<double> of_t(kSteps), of_phi(kSteps);
  for (int p = 0; p < kSteps; ++p) {
    const double phi = kTwoPi * (p + 0.5) / kSteps;
    const Interval part = meridian(lobe, phi);
    for (int n = 0; n < kSteps; ++n) {
      const double t = low + (high - low) * (n + 0.5) / kSteps;
      if (t <= part.low || t >= part.high) continue;
      const double value = value_at(lobe, integrand, t, phi);
      of_t[n] += value;
      of_phi[p] += value;
    }
  }
  return {quantiles(of_t, low, high, t_cells, 0, kHalfPi), quantiles(of_phi, 0, kTwoPi, phi_cells, 0, kTwoPi)};
}

namespace {

std::vector<double> integrate_grid(const Lobe& lobe, const Grid& grid, const Integrand& integrand, double tolerance,
                                   double tolerance_t) {
  std::vector<double> cells(grid.cells());
  std::vector<double> whole(grid.t.size() - 1);
  for (std::size_t p = 0; p + 1 < grid.phi.size(); ++p) {
    const double a = grid.phi[p], b = grid.phi[p + 1];
    strip(lobe, grid, integrand, a, b, tolerance_t, whole);
    refine(lobe, grid, integrand, a, b, whole, tolerance, tolerance_t, 20, &cells[grid.index(p, 0)]);
  }
  return cells;
}

}  // namespace

std::vector<double> integrate_cells(const Lobe& lobe, const Grid& grid, const Integrand& integrand, double tolerance) {
  return integrate_grid(lobe, grid, integrand, tolerance, 0);
}

double integrate(const Lobe& lobe, const Integrand& integrand, double tolerance) {
  double sum = 0;
  const Grid grid = make_grid(lobe, integrand, 8, 8);
  for (double cell : integrate_grid(lobe, grid, integrand, tolerance, tolerance)) sum += cell;
  return sum;
}

Vector reflect(Vector i, Vector m) {
  const double twice = 2 * (i.x * m.x + i.y * m.y + i.z * m.z);
  return {twice * m.x - i.x, twice * m.y - i.y, twice * m.z - i.z};
}

}  // namespace facetwise::test
