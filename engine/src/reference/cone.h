// SPDX-License-Identifier: Apache-2.0
// The elliptic cone of normals whose reflection is not occluded: docs/math.md, "The exact reflection
// sampler", where the symbols are introduced.
#pragma once

#include "facetwise/reference.h"

namespace facetwise::reference {

// For i_z > 0.
struct Cone {
  double lambda;  // the form's positive eigenvalue; also w.v
  double p, q;    // lambda + i_z alpha_x^2, lambda + i_z alpha_y^2
  Vector v;       // the axis, v_z = 1
  double n2;      // v.v
  double k;       // K: density of a reflection is D(m) / (4 K)
};

Cone unoccluded_cone(Roughness alpha, Vector i);

// The point m_hat of the unit sphere inside the cone that u1, u2, u3 give.
Vector sample_cone(const Cone& cone, Roughness alpha, Vector i, double u1, double u2, double u3);

}  // namespace facetwise::reference
