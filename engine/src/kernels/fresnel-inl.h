// SPDX-License-Identifier: Apache-2.0
// What share of the light a microfacet reflects.

#if defined(FACETWISE_FRESNEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_FRESNEL_INL_H_
#undef FACETWISE_FRESNEL_INL_H_
#else
#define FACETWISE_FRESNEL_INL_H_
#endif

#include "src/math/lanes-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Schlick 1994, Eq. 15, c = i.m in [0, 1].
template <class D, class V = Vec<D>>
HWY_INLINE V SchlickReflectance(D d, V c, V f0, V f90) {
  const V x = Max(Set(d, 1.0f) - c, Zero(d));
  const V x2 = x * x;
  return Fma(f90 - f0, x2 * x2 * x, f0);
}

// Fresnel's equations without polarisation for c = i.m, eta = eta_o / eta_i; `g` = eta times the refracted cosine, 0
// where all is reflected. By c - g = (1 - eta^2) / (c + g) both amplitudes are products with (eta - 1)(eta + 1):
// nothing cancels for eta near 1.
template <class D, class V = Vec<D>>
HWY_INLINE V DielectricReflectance(D d, V c, V eta, V& g) {
  const V zero = Zero(d), one = Set(d, 1.0f);
  c = Max(c, Set(d, 0x1p-40f));
  const V contrast = (eta - one) * (eta + one);
  const V g2 = Fma(c, c, contrast);
  g = Sqrt(Max(g2, zero));
  const V sum = c + g;
  const V s = contrast / (sum * sum);
  const V p = s * sum * (Fms(c, sum, one) / Fma(eta * eta, c, g));
  const V f = Set(d, 0.5f) * Fma(s, s, p * p);
  return Select(g2 > zero, Min(f, one), one);
}

// The interface's columns. They are loaded before anything is stored, as outputs may take their place.
template <class D>
struct InterfaceInputs {
  using V = Vec<D>;
  V f0, f90, eta;
  HWY_INLINE InterfaceInputs(D d, const Tile& tile, std::size_t lane) : f0(Zero(d)), f90(f0), eta(f0) {
    if (tile.interface == Interface::schlick) {
      f0 = LoadU(d, tile.in[kF0] + lane);
      f90 = LoadU(d, tile.in[kF90] + lane);
    } else if (tile.interface == Interface::dielectric) {
      eta = LoadU(d, tile.in[kEta] + lane);
    }
  }
  // By the model's interface, which is not a conductor.
  HWY_INLINE V Reflectance(D d, const Tile& tile, V c) const {
    if (tile.interface == Interface::schlick) return SchlickReflectance(d, c, f0, f90);
    V g;
    return DielectricReflectance(d, c, eta, g);
  }
};

// Whether the interface's own columns are valid. NaN is not.
template <class D>
HWY_INLINE Mask<D> ValidInterface(D d, const Tile& tile, std::size_t lane) {
  const auto one = Set(d, 1.0f);
  if (tile.interface == Interface::schlick) {
    const auto f0 = LoadU(d, tile.in[kF0] + lane), f90 = LoadU(d, tile.in[kF90] + lane);
    return And(And(f0 >= Zero(d), f0 <= one), And(f90 >= Zero(d), f90 <= one));
  }
  const auto eta = LoadU(d, tile.in[kEta] + lane);
  return And(eta >= Set(d, kSmallestEta), eta <= Set(d, kLargestEta));
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
