// SPDX-License-Identifier: Apache-2.0
#include "table/cells.h"

#include <cmath>
#include <numbers>

namespace facetwise::test {

Cells::Cells(double theta, double phi, int n)
    : theta_(theta),
      cos_(std::cos(phi)),
      sin_(std::sin(phi)),
      reach_(1 + std::tan((std::numbers::pi / 2 - theta) / 2)),
      n_(n) {}

int Cells::of(double x, double y) const {
  const double along = cos_ * x + sin_ * y, across = cos_ * y - sin_ * x;
  const double f = (1 + std::tan(std::atan(along) / 2)) / reach_;
  const double h = across / std::sqrt(1 + x * x + y * y);
  // Rounding may put the farthest tilt a little outside.
  if (!(f >= 0 && f <= 1 + 1e-9 && h >= -1 && h <= 1)) return -1;
  const auto step = [&](double share) { return std::min(static_cast<int>(share * n_), n_ - 1); };
  return step(f) * n_ + step((h + 1) / 2);
}

std::vector<double> Cells::integrals(const std::function<double(double x, double y)>& density, int fine) const {
  std::vector<double> sums(static_cast<std::size_t>(count()));
  const int all = n_ * fine;
  for (int row = 0; row < all; ++row) {
    const double s = (row + 0.5) / all * reach_ - 1, cos_chi = (1 - s * s) / (1 + s * s), sin_chi = 2 * s / (1 + s * s);
    for (int column = 0; column < all; ++column) {
      const double h = (column + 0.5) / all * 2 - 1, c = std::sqrt(1 - h * h), m_z = cos_chi * c;
      const double along = sin_chi * c / m_z, across = h / m_z;
      // dx dy = d(chi) dh / m_z^3
      sums[static_cast<std::size_t>(row / fine * n_ + column / fine)] +=
          density(cos_ * along - sin_ * across, sin_ * along + cos_ * across) / (m_z * m_z * m_z) * 2 / (1 + s * s);
    }
  }
  for (double& sum : sums) sum *= reach_ / all * 2 / all;
  return sums;
}

std::vector<double> Cells::visible(const std::function<double(double x, double y)>& p22, int fine) const {
  const double c = std::cos(theta_), s = std::sin(theta_);
  return integrals(
      [&](double x, double y) {
        const double seen = c - s * (cos_ * x + sin_ * y);
        return seen > 0 ? seen * p22(x, y) : 0;
      },
      fine);
}

}  // namespace facetwise::test
