// SPDX-License-Identifier: Apache-2.0
// Whether the kernels' samples follow a density: the chi-square test over cells of the stretched frame.
#pragma once

#include <cstdint>
#include <vector>

#include "facetwise/chi_square.h"
#include "support/draw.h"
#include "support/lobe.h"

namespace facetwise::test {

// A claim about a sampler: its density, over the lobe of a roughness.
struct Hypothesis {
  Lobe lobe;
  Integrand density;
};

// What the reference says of a draw, and two near misses: its density times 1 + epsilon cos(2 phi), phi the
// azimuth of m about n; and the density of a roughness 1 + epsilon times as large.
Hypothesis truth(const Draw& draw);
Hypothesis modulated(const Draw& draw, double epsilon);
Hypothesis rougher(const Draw& draw, double epsilon);

struct Verdict {
  std::vector<ChiSquare> tests;  // one per hypothesis
  Statistics statistics;
  // How far accepted samples lie outside of the region of positive density, at most. That region has
  // o_z > 0 and i_z + o_z > 0; of normals, i.m > 0 and m_z > 0.
  double outside = 0;
  // Accepted samples with |o - reflect(i, m)| > 2^-20.
  std::uint64_t unreflected = 0;
  double share_expected = 0;  // accepted, by the first hypothesis
};

// Draws once and tests every hypothesis. Expected counts are integrals of the density over each cell;
// occluded samples are one more cell.
Verdict test_hypotheses(const Draw& draw, const std::vector<Hypothesis>& hypotheses);

}  // namespace facetwise::test
