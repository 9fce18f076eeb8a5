// SPDX-License-Identifier: Apache-2.0
// The rejection-count experiment: how many samples of each sampler are occluded, counted through the kernels
// and predicted.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "facetwise/bench.h"

namespace facetwise::bench {

// The share of a sampler's reflections that are occluded, for i at `theta` (radians) and azimuth 0.
//   cap, heitz   1 - K / sigma                                (closed form)
//   bounded      1 - K / sigma_b, sigma_b = (nu + k i_z) / 2  (closed form)
//   exact        0
//   ndf          by quadrature, see ndf_share_occluded()
double predicted_share(Sampler sampler, double alpha_x, double alpha_y, double theta);
// The same of any model: `visible` by the reference's quadrature.
double predicted_share(const Model& model, Sampler sampler, double alpha_x, double alpha_y, double theta);

// GGX's normals of density D(m) m_z have u1 = t^2 / (1 + t^2) uniform (Beckmann's 1 - exp(-t^2)) and their azimuth
// uniform, where t is the stretched slope's length. On a ray of given azimuth the accepted normals are those below (i_z
// > 0) or above (i_z < 0) one bound of t, so that one integral over the azimuth remains: the trapezium rule.
double ndf_share_occluded(double alpha_x, double alpha_y, double theta, Distribution distribution = Distribution::ggx);

// Counts `samples` samples per configuration with in-kernel random numbers: the table of the documentation, a
// sweep over theta and roughness, the counts of a post of 2015 (docs/benchmarks.md), and the table of Beckmann and
// of V-cavity. Appends to
// `results`. Stops with Cancelled when `step()` returns false.
absl::Status count_rejections(std::size_t samples, Target target, const std::function<bool()>& step,
                              std::vector<RejectionResult>& results);

}  // namespace facetwise::bench
