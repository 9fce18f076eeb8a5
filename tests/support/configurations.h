// SPDX-License-Identifier: Apache-2.0
// The configurations that samplers are tested on, fixed once.
#pragma once

#include <string>
#include <vector>

#include "facetwise/reference.h"

namespace facetwise::test {

// Degrees; theta from the shading normal, so that above 90 the shading normal faces away.
struct Configuration {
  double theta, azimuth, alpha_x, alpha_y;
};

// Rounded to float, as the kernels see them.
reference::Vector incident(const Configuration& configuration);
reference::Roughness roughness(const Configuration& configuration);

// Unique, made only of letters, digits and _: "theta_60_azimuth_0_alpha_0p3_1".
std::string name(const Configuration& configuration);

// At least 60: front, back to theta = 170, 89.9 and 90.5, normal incidence, alpha from 1e-3 to 4 on both
// axes, anisotropy to 20:1, rotated. In the quick build a spread of eight of them.
const std::vector<Configuration>& configurations();

}  // namespace facetwise::test
