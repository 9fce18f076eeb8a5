// SPDX-License-Identifier: Apache-2.0
// Integrals over the lobe of one incident direction, by quadrature in the stretched frame.
//
// A microfacet normal m is seen as m_hat ~ (m_x / alpha_x, m_y / alpha_y, m_z), of unit length, by its polar
// angle t in [0, pi/2] and azimuth phi: there the lobe of any roughness is spread out. Integrands are given
// per solid angle of o or m and know nothing of this; the Jacobians are those of the linear map (alpha_x
// alpha_y / |M|^3) and of the reflection (4 i.m). No sampler's mapping is used.
#pragma once

#include <functional>
#include <vector>

#include "facetwise/reference.h"

namespace facetwise::test {

struct Lobe {
  reference::Roughness alpha;
  reference::Vector i;
  // Over outgoing directions with o_z > 0, else over normals. In both, those of microfacets with m_z > 0, i.m
  // > 0.
  bool reflections = true;
  // Over normals m whose reflection is not occluded: `reflections`, but integrands are per solid angle of m.
  bool per_normal = false;
};

// Value per solid angle of o (reflections), of m otherwise.
using Integrand = std::function<double(const reference::Vector& m, const reference::Vector& o)>;

// Cells of m_hat: edges of t and of phi. Together they cover the hemisphere.
struct Grid {
  std::vector<double> t, phi;
  std::size_t cells() const { return (t.size() - 1) * (phi.size() - 1); }
  // The cell of a normal, and a cell's index.
  std::size_t cell(reference::Roughness alpha, reference::Vector m) const;
  std::size_t index(std::size_t phi_cell, std::size_t t_cell) const { return phi_cell * (t.size() - 1) + t_cell; }
};

// A grid whose rows, and whose columns, hold equal parts of the integral, roughly.
Grid make_grid(const Lobe& lobe, const Integrand& integrand, int t_cells, int phi_cells);

// The integral over each cell; the error of each is about `tolerance`. For densities of samplers, which are
// smooth along t inside the lobe.
std::vector<double> integrate_cells(const Lobe& lobe, const Grid& grid, const Integrand& integrand, double tolerance);

// The integral over the whole lobe of anything.
double integrate(const Lobe& lobe, const Integrand& integrand, double tolerance = 1e-10);

// o for a normal m of unit length.
reference::Vector reflect(reference::Vector i, reference::Vector m);

}  // namespace facetwise::test
