// SPDX-License-Identifier: Apache-2.0
// Adaptive Gauss-Kronrod quadrature.
#pragma once

#include <cmath>

#include "src/reference/scaled.h"

namespace facetwise::reference {

// Integral of f over [a, b], by 15 and 7 points (Kronrod 1965); halves the interval until the two differ by
// less than `tolerance` or by rounding.
template <class F>
Real integrate(const F& f, Real a, Real b, Real tolerance, int depth = 40) {
  static constexpr Real kNode[] = {0.991455371120812639206854697526329L, 0.949107912342758524526189684047851L,
                                   0.864864423359769072789712788640926L, 0.741531185599394439863864773280788L,
                                   0.586087235467691130294144838253L,    0.405845151377397166906606412076961L,
                                   0.207784955007898467600689403773245L, 0};
  static constexpr Real kWeight15[] = {0.022935322010529224963732008058970L, 0.063092092629978553290700663189204L,
                                       0.104790010322250183839876322541518L, 0.140653259715525918745189590510238L,
                                       0.169004726639267902826583426598550L, 0.190350578064785409913256402421014L,
                                       0.204432940075298892414161999234649L, 0.209482141084727828012999174891714L};
  static constexpr Real kWeight7[] = {0.129484966168869693270611432679082L, 0.279705391489276667901467771423780L,
                                      0.381830050505118944950369775488975L, 0.417959183673469387755102040816327L};
  if (!(a < b)) return 0;
  const Real middle = (a + b) / 2, half = (b - a) / 2;
  const Real centre = f(middle);
  Real fine = kWeight15[7] * centre, coarse = kWeight7[3] * centre;
  for (int n = 0; n < 7; ++n) {
    const Real sum = f(middle - half * kNode[n]) + f(middle + half * kNode[n]);
    fine += kWeight15[n] * sum;
    if (n % 2 == 1) coarse += kWeight7[n / 2] * sum;
  }
  const Real error = std::abs(fine - coarse) * half;
  if (depth == 0 || error <= tolerance || error <= 1e-14L * std::abs(fine) * half) return fine * half;
  return integrate(f, a, middle, tolerance / 2, depth - 1) + integrate(f, middle, b, tolerance / 2, depth - 1);
}

}  // namespace facetwise::reference
