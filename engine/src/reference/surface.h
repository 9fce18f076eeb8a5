// SPDX-License-Identifier: Apache-2.0
// What a Surface's functions share: the stretched frame and quantities that may underflow.
#pragma once

#include "facetwise/reference.h"
#include "src/reference/scaled.h"

namespace facetwise::reference {

// A direction in the frame of standard slopes: i.M = z - x s_x - y s_y for the normal M = (-slope, 1). Any
// length.
struct Stretched {
  Real x, y, z;
};
Stretched stretched(const Surface& surface, Vector i);

struct Slope {
  Real x, y;
};
// Standard slope of a normal, and the reverse as a normal with M_z = 1.
Slope standard_slope(const Surface& surface, Vector m);
struct LongNormal {
  Real x, y;  // z is 1
};
LongNormal normal_of(const Surface& surface, Slope s);
// Determinant of the map from standard slopes to slopes: ax ay sqrt(1 - rho^2).
Real slope_determinant(const Surface& surface);

// Density of standard slopes; of normals; projected area; hit probability; what Smith densities are divided
// by.
Scaled standard_density(const Surface& surface, Slope s);
Scaled normal_density(const Surface& surface, Vector m);
Scaled area(const Surface& surface, Stretched w);
Scaled hits(const Surface& surface, Vector i);
Scaled smith_normaliser(const Surface& surface, Vector i);
Scaled vcavity_hits(const Surface& surface, Vector i);  // 1 if biased

// Phong with V-cavity, i_z < 0: H, and the density of the normals that `visible` draws.
Scaled phong_hits(const Surface& surface, Vector i);
Scaled phong_behind(const Surface& surface, Vector i, Vector m, Real im);
bool is_centred(const Surface& surface);  // no mean slope

// Densities of normals, im = i.m > 0. The reflection of `bounded` and `exact` is taken not to be occluded.
Real visible_density(const Surface& surface, Vector i, Vector m, Real im);
Real sampled_density(const Surface& surface, Sampler sampler, Vector i, Vector m, Real im);
// The same without D(m) underflowing: of `exact` for i_z > 0 (unoccluded.cc).
Real exact_density(const Surface& surface, Vector i, Vector m, Real im);
// Smith-GGX's K(i), i_z > 0.
Real unoccluded_area(const Surface& surface, Vector i);

// f cos(theta_o) of the reflection o of i at m, im = i.m; F included. i turned already.
Real reflected(const Surface& surface, Vector i, Vector o, Vector m, Real im);
Vector turned(const Surface& surface, Vector i);  // by Model::retro

}  // namespace facetwise::reference
