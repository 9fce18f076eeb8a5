// SPDX-License-Identifier: Apache-2.0
// Beckmann's visible normals whose reflection is not occluded, nearly in proportion, for i_z > 0: docs/math.md. Slopes
// are rotated into the plane of incidence. There x is a visible slope between x_a and x_b, and y a normal one between
// the ends of the ellipse's chord at x.

#if defined(FACETWISE_BECKMANN_EXACT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_BECKMANN_EXACT_INL_H_
#undef FACETWISE_BECKMANN_EXACT_INL_H_
#else
#define FACETWISE_BECKMANN_EXACT_INL_H_
#endif

#include "src/kernels/beckmann-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The ellipse of unoccluded slopes and the share of visible ones between its ends in x.
template <class D>
struct Ellipse {
  using V = Vec<D>;
  V horizontal;
  Azimuth<D> azimuth;
  Beckmann::Kept<D> visible;
  V xa, xb;
  V m12, m22, kappa;
  V fa, fb;  // shares of the visible slopes below xa and xb
  V area;    // i_z (C_b - C_a)

  template <class I>
  HWY_INLINE Ellipse(D d, const I& i) : horizontal(Sqrt(i.a)), azimuth(d, i.wx, i.wy, horizontal) {
    const V one = Set(d, 1.0f);
    const V ex = azimuth.ex, ey = azimuth.ey;
    const V ax2 = i.ax * i.ax, ay2 = i.ay * i.ay;
    // Lanes behind compute with i = n.
    const V z = Select(i.front, Max(i.wz, Set(d, kTiny)), one);
    const V slope = Min(horizontal / z, Set(d, 1e12f));  // T
    m12 = (ay2 - ax2) * ex * ey;
    m22 = Fma(ax2, ey * ey, ay2 * (ex * ex));
    kappa = ax2 * ay2 / m22;
    const V sum = slope + Sqrt(Fma(slope, slope, kappa));
    xb = one / sum;
    xa = Neg(sum) / kappa;
    V erfcx, tail;
    const V k = Min(one / Max(slope, Set(d, 1e-7f)), Set(d, 1e7f));
    ErfcxAndTail(d, k, erfcx, tail);
    visible = Beckmann::Kept<D>(d, k, erfcx, tail);
    fa = visible.ShareBelow(d, xa);
    fb = visible.ShareBelow(d, xb);
    area = z * (fb - fa) * (visible.total / k);
  }
  // The chord at x.
  HWY_INLINE void Chord(D d, V x, V& from, V& to) const {
    const V inverse = Set(d, 1.0f) / m22;
    const V middle = Neg(m12 * x * inverse);
    const V reach = Sqrt(Max(kappa * inverse * ((x - xa) * (xb - x)), Zero(d)));
    from = middle - reach;
    to = middle + reach;
  }
};

// The normal slopes between two values, turned round so that they lean to the left: both ends may be far in the
// tail, where all is kept times e^(shift), shift = to^2.
template <class D>
struct NormalInterval {
  using V = Vec<D>;
  V from, to, flip;  // flip: the sign bit where turned round
  V shift;
  V below_to, share;  // e^(shift) times the share below `to`, and between

  HWY_NOINLINE NormalInterval(D d, V a, V b) {
    const V zero = Zero(d), half = Set(d, 0.5f), one = Set(d, 1.0f);
    const auto turned = a + b > zero;
    flip = IfThenElseZero(turned, SignBit(d));
    from = Select(turned, Neg(b), a);
    to = Select(turned, Neg(a), b);
    const auto tail = to < zero;
    shift = IfThenElseZero(tail, to * to);
    V e_from, e_to, unused;
    ErfcxAndTail(d, Abs(from), e_from, unused);
    ErfcxAndTail(d, Abs(to), e_to, unused);
    // from <= to and from + to <= 0, so that from <= 0. from^2 - to^2 = (from - to)(from + to)
    const V fall = Exp(d, Neg(Select(tail, (from - to) * (from + to), Min(from * from, Set(d, 1e3f)))));
    const V below_from = half * fall * e_from;
    below_to = Select(tail, half * e_to, one - half * Gauss(d, to) * e_to);
    share = Max(below_to - below_from, zero);
  }
  HWY_NOINLINE V Draw(D d, V u) const {
    const V one = Set(d, 1.0f);
    // The share below y, of all and of that below `to`.
    const V p = NegFma(one - u, share, below_to);
    V drawn = NormalSlope(d, p, one - p);
    const auto tail = to < Set(d, -3.0f);
    if (!AllFalse(d, tail)) drawn = Select(tail, Neg(DrawTail(d, p)), drawn);
    return Xor(Min(Max(drawn, from), to), flip);
  }

 private:
  // -y where all is in the tail.
  HWY_NOINLINE V DrawTail(D d, V p) const {
    const V one = Set(d, 1.0f);
    const V l = Neg(Log(d, Min(Max(p / below_to, Set(d, 0x1p-40f)), one)));
    const V b = Abs(to);
    V e_to, e, unused;
    ErfcxAndTail(d, b, e_to, unused);
    // Y^2 - b^2 - log(erfcx(Y) / erfcx(b)) = l, by Newton's method.
    V y = Sqrt(Fma(b, b, l));
    for (int step = 0; step < 2; ++step) {
      ErfcxAndTail(d, y, e, unused);
      const V h = Fma(y - b, y + b, Neg(l)) - Log(d, e / e_to);
      y = Max(y - h * (e * Set(d, 0.5f / kInverseRootPi)), b);
    }
    return y;
  }
};

struct BeckmannExact : SamplerTraits {
  static constexpr bool kLongChain = true;
  static constexpr bool kReadsArea = false;
  static constexpr bool kUnit = true;
  static constexpr bool kOwnShift = true;
  static constexpr bool kExact = true;
  static constexpr bool kNormals = false;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    const V shift = i.all_front ? drawn.shift : Select(i.front, drawn.shift, i.shift);
    numerator = Beckmann::Profile(d, i, drawn.sx, drawn.sy, shift) * drawn.mm * drawn.mm;
    denominator = Set(d, 1.0f);
  }
  // Times e^(shift).
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V mx, V my, V mz, V, V& shift) {
    const Ellipse<D> ellipse(d, i);
    const V inverse = Set(d, -1.0f) / Max(mz, Set(d, kHorizon));
    const V sx = mx * inverse / i.ax, sy = my * inverse / i.ay;
    const V x = Fma(sx, ellipse.azimuth.ex, sy * ellipse.azimuth.ey);
    V from, to;
    ellipse.Chord(d, x, from, to);
    const NormalInterval<D> interval(d, from, to);
    shift = i.all_front ? interval.shift : Select(i.front, interval.shift, i.shift);
    // Rounding may make a half vector of directions that are each other's opposite which no such slope has: no density.
    const auto outside = Or(x < ellipse.xa, x > ellipse.xb);
    const V two_n = Select(outside, Set(d, kLargestDensity), (ellipse.area + ellipse.area) * interval.share);
    return i.all_front ? two_n : Select(i.front, two_n, i.two_normaliser);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    const Ellipse<D> ellipse(d, i);
    V x, t, from, to;
    const V u = Fma(u1, ellipse.fb - ellipse.fa, ellipse.fa);
    Beckmann::FrontSlope(d, ellipse.visible, Min(u, Set(d, kLargestBelowOne)), x, t);
    x = Min(Max(x, ellipse.xa), ellipse.xb);
    ellipse.Chord(d, x, from, to);
    const NormalInterval<D> interval(d, from, to);
    const V y = interval.Draw(d, u2);
    V sx, sy;
    ellipse.azimuth.Turn(x, y, sx, sy);
    FromSlope(d, i, sx, sy, drawn);
    drawn.im = Max(NegFma(ellipse.horizontal, x, i.wz), Set(d, kSmallestIm));
    drawn.two_n = Max((ellipse.area + ellipse.area) * interval.share, Set(d, 1e-37f));
    drawn.shift = interval.shift;
    if (!i.all_front) {
      Drawn<D> behind;
      SlopeVisible::Draw(d, i, u1, u2, u3, behind);
      drawn.KeepWhere(i.front, behind);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
