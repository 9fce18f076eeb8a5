// SPDX-License-Identifier: Apache-2.0
// The error function's relatives that do not underflow.
#pragma once

#include "src/reference/scaled.h"

namespace facetwise::reference {

// exp(t^2) erfc(t), t >= 0.
Real erfcx(Real t);
// exp(t^2) times the integral of erfc from t to infinity, t >= 0.
Real ierfcx(Real t);
// Half of erf(b) - erf(a), a <= b: the probability of [a, b] under exp(-y^2) / sqrt(pi).
Scaled gaussian_interval(Real a, Real b);

}  // namespace facetwise::reference
