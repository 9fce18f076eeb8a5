// SPDX-License-Identifier: Apache-2.0
// Cells of the visible slopes of an incident direction: equal steps in the share f of the visible tilts'
// tan(chi / 2) and in the side h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "facetwise/chi_square.h"

namespace facetwise::test {

class Cells {
 public:
  Cells(double theta, double phi, int n = 16);

  int count() const { return n_ * n_; }
  // -1: not visible.
  int of(double x, double y) const;
  // Integrals of a density of slopes over the cells, by midpoints, `fine` times `fine` of them in each.
  std::vector<double> integrals(const std::function<double(double x, double y)>& density, int fine) const;
  // Those of p22 max(i.m, 0) / m_z, and of its integral over a density: sum of p^2 / q.
  std::vector<double> visible(const std::function<double(double x, double y)>& p22, int fine) const;

 private:
  double theta_, cos_, sin_, reach_;
  int n_;
};

}  // namespace facetwise::test
