// SPDX-License-Identifier: Apache-2.0
// Tabulated distributions: docs/tables.md. Samples have the density of what the interpolated tables draw, so N follows
// from that: for a density p of standard normals m_hat (unit), p(m) is p (|m| / |m_hat|)^3 / (ax ay) and 2 N = 2 i.m
// D_hat / (p |m_hat|).
//
// Smith masking needs normals whose mean slope is that which the batch gives. A table's own is added to it, so that
// slopes here are centred, and taken off where the tables are looked up.

#if defined(FACETWISE_TABULATED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_TABULATED_INL_H_
#undef FACETWISE_TABULATED_INL_H_
#else
#define FACETWISE_TABULATED_INL_H_
#endif

#include "src/kernels/sampler-inl.h"
#include "src/math/slope_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

struct Tabulated : DistributionTraits {
  static constexpr bool kOwnMean = true;
  // Below it D counts as this much, so that densities have quotients.
  static constexpr float kSmallestDensity = 1e-30f;

  // A standard normal as the table has it, from a centred one, and back.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void ToTable(D d, const I& i, V& x, V& y, V z) {
    if constexpr (I::Surface::kAffine) {
      x = NegFma(Set(d, i.table->mean_x), z, x);
      y = NegFma(Set(d, i.table->mean_y), z, y);
    }
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void FromTable(D d, const I& i, V& x, V& y, V z) {
    if constexpr (I::Surface::kAffine) {
      x = Fma(Set(d, i.table->mean_x), z, x);
      y = Fma(Set(d, i.table->mean_y), z, y);
    }
  }
  // 2 sigma of a stretched direction w, given for centred normals.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoArea(D d, const I& i, V wx, V wy, V wz) {
    V c, s, ex, ey, nu;
    Seen(d, i, wx, wy, wz, c, s, ex, ey, nu);
    return Max((nu + nu) * ProjectedArea(d, *i.table, c, s, ex, ey), Set(d, 1e-20f));
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Seen(D d, const I& i, V wx, V wy, V wz, V& c, V& s, V& ex, V& ey, V& nu) {
    const V one = Set(d, 1.0f);
    if constexpr (I::Surface::kAffine) wz = Fma(wx, Set(d, i.table->mean_x), Fma(wy, Set(d, i.table->mean_y), wz));
    const V a = Fma(wx, wx, wy * wy);
    const V horizontal = Sqrt(a);
    const Azimuth<D> azimuth(d, wx, wy, horizontal);
    ex = azimuth.ex;
    ey = azimuth.ey;
    nu = Sqrt(Fma(wz, wz, a));
    const V inverse = one / Max(nu, Set(d, 1e-30f));
    c = wz * inverse;
    s = horizontal * inverse;
  }

  template <class D, class I>
  static HWY_INLINE void Area(D d, I& i) {
    i.two_sigma = TwoArea(d, i, i.wx, i.wy, i.wz);
  }
  template <class D, class I>
  static HWY_INLINE void BiasedArea(D d, I& i) {
    i.two_normaliser = TwoArea(d, i, i.wx, i.wy, Abs(i.wz));
  }
  // V-cavity behind: 2 H = 2 (sigma(k) - sigma(3 k)) / k with k = |i_z| / sqrt(A). Below kNearest, where that cancels, H
  // is linear in k to its third power.
  template <class D, class I, class V = Vec<D>>
  static HWY_NOINLINE void TwoHit(D d, const I& i, V& two_hit, V&) {
    const V one = Set(d, 1.0f), zero = Zero(d), two = Set(d, 2.0f), near = Set(d, 0x1p-6f);
    const V at = Abs(i.z) / Sqrt(Max(i.a, Set(d, kSmallestA))), k = Max(at, near);
    const V hit = (TwoArea(d, i, one, zero, Neg(k)) - TwoArea(d, i, one, zero, Set(d, -3.0f) * k)) / k;
    const V part = Min(at / near, one);
    two_hit = Max(Fma(part, hit - two, two), Set(d, 1e-25f));
  }
  // sigma(-o) is sigma(o) - z' of centred normals.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Areas(D d, const I& i, V wx, V wy, V z, V, V& front, V& back, V& scale) {
    front = Max(TwoArea(d, i, wx, wy, z), z + z);
    back = front - (z + z);
    scale = Set(d, 1.0f);
  }

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V Density(D d, const I& i, V mx, V my, V mz, V m2, V) {
    V density, length2;
    Lookup(d, i, mx, my, mz, density, length2);
    const V q = m2 / length2;
    return Set(d, kPi) * density * q * q;
  }

  // D_hat and |m_hat|^2 of an m of any length, and m_hat of unit length.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Lookup(D d, const I& i, V& mx, V& my, V& mz, V& density, V& length2) {
    Centre(i, mx, my, mz);
    mx = mx / i.ax;
    my = my / i.ay;
    ToTable(d, i, mx, my, mz);
    length2 = Dot(mx, my, mz, mx, my, mz);
    const V inverse = Set(d, 1.0f) / Sqrt(length2);
    mx = mx * inverse;
    my = my * inverse;
    mz = mz * inverse;
    density = Max(NormalDensity(d, *i.table, mx, my, mz), Set(d, kSmallestDensity));
  }
};

// What the tables' samplers share: `Drawer::DrawingDensity(d, i, mx, my, mz)` is the density of standard normals.
template <class Drawer>
struct TableNormals : SamplerTraits {
  static constexpr bool kUnit = true;
  static constexpr bool kUnboundedWeight = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Density(D d, const I& i, const Drawn<D>& drawn, V, V& numerator, V& denominator) {
    numerator = Tabulated::Density(d, i, drawn.mx, drawn.my, drawn.mz, drawn.mm, Zero(d));
    denominator = Set(d, 1.0f);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V TwoN(D d, const I& i, V mx, V my, V mz, V im) {
    V density, length2;
    Tabulated::Lookup(d, i, mx, my, mz, density, length2);
    return TwoNOf(d, im, density, length2, Drawer::DrawingDensity(d, i, mx, my, mz));
  }
  template <class D, class V = Vec<D>>
  static HWY_INLINE V TwoNOf(D d, V im, V density, V length2, V drawing) {
    const V two_n = (im + im) * density / (drawing * Sqrt(length2));
    return Select(drawing > Zero(d), Min(two_n, Set(d, kLargestDensity)), Set(d, kLargestDensity));
  }
  // M from a unit m_hat of the table.
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Finish(D d, const I& i, V mx, V my, V mz, V drawing, Drawn<D>& drawn) {
    const V density = Max(NormalDensity(d, *i.table, mx, my, mz), Set(d, Tabulated::kSmallestDensity));
    Tabulated::FromTable(d, i, mx, my, mz);
    Unstretch(i, mx, my, mz, drawn);
    drawn.im = Dot(i.wx, i.wy, i.wz, mx, my, mz);
    if constexpr (Drawer::kVisible) drawn.im = Max(drawn.im, Set(d, kSmallestIm));
    drawn.two_n = TwoNOf(d, drawn.im, density, Set(d, 1.0f), drawing);
  }
};

struct TableNdf : TableNormals<TableNdf> {
  static constexpr bool kReadsArea = false;
  static constexpr bool kVisible = false;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V DrawingDensity(D d, const I& i, V mx, V my, V mz) {
    const V one = Set(d, 1.0f), zero = Zero(d);
    return VisibleNormalDensity(d, *i.table, one, zero, one, zero, mx, my, mz);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const V one = Set(d, 1.0f), zero = Zero(d);
    V mx, my, mz, drawing;
    DrawVisibleNormal(d, *i.table, one, zero, one, zero, u1, one - u1, u2, mx, my, mz, drawing);
    Finish(d, i, mx, my, mz, drawing, drawn);
  }
};

struct TableVisible : TableNormals<TableVisible> {
  static constexpr bool kReadsArea = false;
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V DrawingDensity(D d, const I& i, V mx, V my, V mz) {
    V c, s, ex, ey, nu;
    Tabulated::Seen(d, i, i.wx, i.wy, i.wz, c, s, ex, ey, nu);
    return VisibleNormalDensity(d, *i.table, c, s, ex, ey, mx, my, mz);
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V&, Drawn<D>& drawn) {
    const V one = Set(d, 1.0f);
    V c, s, ex, ey, nu, mx, my, mz, drawing;
    Tabulated::Seen(d, i, i.wx, i.wy, i.wz, c, s, ex, ey, nu);
    DrawVisibleNormal(d, *i.table, c, s, ex, ey, u1, one - u1, u2, mx, my, mz, drawing);
    Finish(d, i, mx, my, mz, drawing, drawn);
  }
};

// V-cavity, of a radial table. In front a normal as TableNdf draws it or its mirror image, by how much they face i.
// Behind as Tokuyoshi 2021, section 2.3: with a share 2 F / H a normal whose slope along w's azimuth is below -3 k, else
// a visible one beyond. F is the share of the former among all that TableNdf draws.
struct TableCavity : TableNormals<TableCavity> {
  static constexpr bool kUsesU3 = true;

  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE V DrawingDensity(D d, const I& i, V mx, V my, V mz) {
    const V zero = Zero(d);
    const V across = Fma(i.wx, mx, i.wy * my), up = i.wz * mz;
    const V facing = Max(up + across, zero), other = Max(up - across, zero);
    const V both = TableNdf::DrawingDensity(d, i, mx, my, mz) + TableNdf::DrawingDensity(d, i, Neg(mx), Neg(my), mz);
    const V in_front = both * facing / Max(facing + other, Set(d, kSmallestIm));
    if (i.all_front) return in_front;
    const Behind<D> at(d, i);
    const auto first = across > Set(d, -3.0f) * up;
    V c, s;
    at.See(d, first, c, s);
    const V share = Select(first, at.probability / Max(at.below, Set(d, kTiny)),
                           (Set(d, 1.0f) - at.probability) / Max(at.rest, Set(d, kTiny)));
    const V behind = share * VisibleNormalDensity(d, *i.table, c, s, at.ex, at.ey, mx, my, mz);
    return Select(i.front, in_front, behind * (i.two_sigma / i.two_normaliser));
  }
  template <class D, class I, class V = Vec<D>>
  static HWY_INLINE void Draw(D d, const I& i, V u1, V u2, V& u3, Drawn<D>& drawn) {
    const V one = Set(d, 1.0f), zero = Zero(d), below_one = Set(d, kLargestBelowOne);
    V c = one, s = zero, ex = one, ey = zero, rest1 = one - u1, behind_u3 = u3;
    if (!i.all_front) {
      const Behind<D> at(d, i);
      const auto first = u3 < at.probability;
      behind_u3 = Select(first, u3, u3 - at.probability) /
                  Max(Select(first, at.probability, one - at.probability), Set(d, kTiny));
      V behind_c, behind_s;
      at.See(d, first, behind_c, behind_s);
      const V low = u1 * at.below, high = rest1 * at.rest;
      c = Select(i.front, c, behind_c);
      s = Select(i.front, s, behind_s);
      ex = Select(i.front, ex, at.ex);
      ey = Select(i.front, ey, at.ey);
      u1 = Select(i.front, u1, Select(first, low, one - high));
      rest1 = Select(i.front, rest1, Select(first, one - low, high));
    }
    V mx, my, mz, unused;
    DrawVisibleNormal(d, *i.table, c, s, ex, ey, u1, rest1, u2, mx, my, mz, unused);
    const V across = Fma(i.wx, mx, i.wy * my), up = i.wz * mz;
    const V a1 = Max(up + across, zero), a2 = Max(up - across, zero);
    const V at = u3 * (a1 + a2);
    const auto mirrored = And(And(at >= a1, a2 > zero), i.front);
    const V sign = IfThenElseZero(mirrored, SignBit(d));
    mx = Xor(mx, sign);
    my = Xor(my, sign);
    u3 = Select(mirrored, at - a1, at) / Max(Select(mirrored, a2, a1), Set(d, kSmallestIm));
    u3 = Min(Max(Select(i.front, u3, behind_u3), zero), below_one);
    Finish(d, i, mx, my, mz, DrawingDensity(d, i, mx, my, mz), drawn);
  }

 private:
  template <class D>
  struct Behind {
    using V = Vec<D>;
    V c, s, ex, ey;
    V below, rest;  // F; the share of the visible normals beyond -3 k
    V probability;
    template <class I>
    HWY_INLINE Behind(D d, const I& i) {
      const V one = Set(d, 1.0f), zero = Zero(d);
      V nu, unused;
      Tabulated::Seen(d, i, i.wx, i.wy, i.wz, c, s, ex, ey, nu);
      const V c3 = Set(d, 3.0f) * Abs(c);
      const V rise = OnePlusHalfTangent(d, Sqrt(Fma(s, s, c3 * c3)), s, Neg(c3));
      ShareBelowTilt(d, *i.table, one, zero, ex, ey, rise, below, unused);
      ShareBelowTilt(d, *i.table, c, s, ex, ey, rise, unused, rest);
      probability = Min(Set(d, 4.0f) * below / i.two_sigma, one);
    }
    // From where a part's normals are drawn.
    HWY_INLINE void See(D d, Mask<D> first, V& cos, V& sin) const {
      cos = Select(first, Set(d, 1.0f), c);
      sin = Select(first, Zero(d), s);
    }
  };
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
