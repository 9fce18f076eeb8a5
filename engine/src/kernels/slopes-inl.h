// Samplers by slopes, for distributions that are no stretched sphere: m_hat = (-x, -y, 1) for a standard slope (x, y).

#if defined(FACETWISE_SLOPES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SLOPES_INL_H_
#undef FACETWISE_SLOPES_INL_H_
#else
#define FACETWISE_SLOPES_INL_H_
#endif

#include "src/kernels/samplers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// What a distribution has that is given by Profile(d, i, x, y, shift) = pi P22(x, y) exp(shift) of standard slopes.
template <class Policy>
struct SlopeDistribution {
  // pi ax ay D(m) exp(shift) for m of any length up to 2: Profile |m|^4 / m_z^4. At the horizon m_z is taken as 2^-30.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Density(D d, const I& i, V mx, V my, V mz, V m2, V shift) {
    Centre(i, mx, my, mz);
    const V inverse = Set(d, 1.0f) / Max(mz, Set(d, 0x1p-30f));
    const V q = m2 * (inverse * inverse);
    return Policy::Profile(d, i, Neg(mx * inverse) / i.ax, Neg(my * inverse) / i.ay, shift) * q * q;
  }
};

// Slopes of length r in the direction of a whole turn's fraction u.
template <class D, class V = Vec<D>>
HWY_INLINE void PolarSlope(D d, V r, V u, V& x, V& y) {
  V sin, cos;
  SinCosTurn(d, u, sin, cos);
  x = r * cos;
  y = r * sin;
}

// M and M.M from a slope.
template <class D, class I, class V = Vec<D>>
HWY_INLINE void FromSlope(D d, const I& i, V x, V y, Drawn<D>& drawn) {
  drawn.sx = x;
  drawn.sy = y;
  Unstretch(i, Neg(x), Neg(y), Set(d, 1.0f), drawn);
}

struct SlopeNormals {
  static constexpr bool kUnit = true;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = I::Distribution::Profile(d, i, drawn.sx, drawn.sy, i.shift) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
};

// Normals with density D(m) m_z, by DrawSlope(d, i, u1, u2, x, y).
struct SlopeNdf : SlopeNormals {
  static constexpr bool kUsesU3 = false;
  static constexpr bool kVisible = false;
  static constexpr bool kNIsSigma = false;
  static constexpr bool kShifted = false;
  static constexpr bool kExact = false;
  static constexpr bool kNormals = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = I::Distribution::Profile(d, i, drawn.sx, drawn.sy, Zero(d)) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D, const I&, V, V, V mz, V im) {
    return (im + im) / mz;
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    V x, y;
    I::Distribution::DrawSlope(d, i, u1, u2, x, y);
    FromSlope(d, i, x, y, drawn);
    drawn.im = NegFma(i.wx, x, NegFma(i.wy, y, i.wz));
    drawn.two_n = drawn.im + drawn.im;
  }
};

// Where w points in the plane: its direction (1, 0) if it is vertical, cosine c and sine s of its angle with n.
template <class D>
struct Azimuth {
  using V = Vec<D>;
  V ex, ey, c, s;
  template <class I>
  HWY_INLINE Azimuth(D d, const I& i) {
    const V one = Set(d, 1.0f);
    const V horizontal = Sqrt(i.a);
    const auto vertical = horizontal < Set(d, 1e-15f);
    const V scale = one / Select(vertical, one, horizontal);
    ex = Select(vertical, one, i.wx * scale);
    ey = Select(vertical, Zero(d), i.wy * scale);
    const V inverse_nu = one / i.nu;
    c = i.wz * inverse_nu;
    s = horizontal * inverse_nu;
  }
};

// Visible normals by the distribution's DrawVisible(d, i, c, s, u1, u2, x, y, gap), with x along the azimuth and
// gap = c - s x.
struct SlopeVisible : SlopeNormals, VisibleNormals {
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const Azimuth<D> azimuth(d, i);
    V x, y, gap;
    I::Distribution::DrawVisible(d, i, azimuth.c, azimuth.s, u1, u2, x, y, gap);
    FromSlope(d, i, Fms(x, azimuth.ex, y * azimuth.ey), Fma(x, azimuth.ey, y * azimuth.ex), drawn);
    drawn.im = Max(i.nu * gap, Set(d, kSmallestIm));
    drawn.two_n = i.tn;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
