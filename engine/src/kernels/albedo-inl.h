// SPDX-License-Identifier: Apache-2.0
// Directional albedo by its table: docs/albedo.md.

#if defined(FACETWISE_ALBEDO_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_ALBEDO_INL_H_
#undef FACETWISE_ALBEDO_INL_H_
#else
#define FACETWISE_ALBEDO_INL_H_
#endif

#include "facetwise/albedo_table.h"
#include "src/kernels/inputs-inl.h"
#include "src/kernels/output-inl.h"
#include "src/math/slope_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// A table's coordinates of a lane, in [0, 1] each.
template <class D>
struct AlbedoPlace {
  using V = Vec<D>;
  V v, a, r, t;

  template <class S, bool kFast>
  HWY_INLINE AlbedoPlace(D d, const AlbedoTableView& table, const Inputs<D, S>& in,
                         const Exceptions<D, kFast>& exceptions)
      : AlbedoPlace(d, table, exceptions.Computable(in.x, 0.0f), exceptions.Computable(in.y, 0.0f),
                    exceptions.Computable(in.z, 1.0f), exceptions.Computable(in.ax, 1.0f),
                    exceptions.Computable(in.ay, 1.0f)) {}
  // z <= 0 is taken as 0.
  HWY_INLINE AlbedoPlace(D d, const AlbedoTableView& table, V x, V y, V z, V alpha_x, V alpha_y) {
    const V one = Set(d, 1.0f), tiny = Set(d, 1e-30f);
    const V bounded_x = alpha_x / (one + alpha_x), bounded_y = alpha_y / (one + alpha_y);
    x = Abs(x) * bounded_x;
    y = Abs(y) * bounded_y;
    z = Max(z, Zero(d));
    const V horizontal2 = Fma(x, x, y * y), length = Sqrt(Fma(z, z, horizontal2));
    // v / (1 - v) = sqrt(c / (1 - c)), c = z / length.
    const V up = Sqrt(z * (length + z));
    v = up / Max(up + Sqrt(horizontal2), tiny);
    const V range = Set(d, 0.5f * table.inverse_range), sum = (bounded_x + bounded_y) * range;
    a = Min(sum, one);
    const V difference = Abs(bounded_x - bounded_y) * range;
    r = Min(difference / Max(Min(a, one - a), Set(d, 1e-6f)), one);
    // Along the axis of the larger roughness t is 0.
    t = Select(bounded_x >= bounded_y, y, x) / Max(x + y, tiny);
    t = Min(t, one);
  }
};

// Of a dielectric: as of isotropic surfaces. Of the roughness along i's azimuth and the mean square one: their mean says
// what is lost, and what lies between them, the more towards the azimuth the nearer i is to the horizon, what is reflected.
// Of what was tried these come closest (docs/albedo.md).
template <class D>
struct DielectricPlace {
  using V = Vec<D>;
  AlbedoPlace<D> of;
  V share_a;
  V u, e;
  V f;  // Fresnel's reflectance of a smooth surface

  // s: sine of the angle with n.
  HWY_INLINE DielectricPlace(D d, const AlbedoTableView& table, V s, V z, V along, V mean, V eta)
      : of(d, table, s, Zero(d), z, Set(d, 0.5f) * (along + mean), Set(d, 0.5f) * (along + mean)) {
    const V one = Set(d, 1.0f), half = Set(d, 0.5f);
    const V alpha = Fma(s * s, along - mean, mean);
    share_a = Min(alpha / (one + alpha) * Set(d, table.inverse_range), one);
    V g;
    f = DielectricReflectance(d, z, eta, g);
    u = Sqrt(Max(z, Zero(d)));
    constexpr float kInverse = (kLargestEta + 1) / (kLargestEta - 1);
    const V r = (eta - one) / (eta + one);
    const V from = Min(Sqrt(Abs(r) * Set(d, kInverse)), one);
    e = Fma(half, Select(r < Zero(d), Neg(from), from), half);
  }
};

template <class D>
class AlbedoLookup {
 public:
  using V = Vec<D>;

  struct Shares {
    V reflected, transmitted;
  };
  static HWY_INLINE Shares OfDielectric(D d, const AlbedoTableView& table, const DielectricPlace<D>& place) {
    const AlbedoSizes& n = table.sizes;
    const auto e = Cell(d, place.e, n.e);
    const auto at = [&](const float* values, V first, V second) {
      const Rebind<int32_t, D> di;
      const auto stride = static_cast<int32_t>(n.v), plane = static_cast<int32_t>(n.v * n.a);
      const auto cell = Cell(d, first, n.v), a = Cell(d, second, n.a);
      const auto from = cell.cell + a.cell * Set(di, stride) + e.cell * Set(di, plane);
      const V low = Square(d, values, from, stride, cell.weight, a.weight);
      return Between(low, Square(d, values + plane, from, stride, cell.weight, a.weight), e.weight);
    };
    const V zero = Zero(d), one = Set(d, 1.0f);
    const V both = Min(at(table.both, place.of.v, place.of.a), one);
    const V share = Min(Max(place.f + at(table.share, place.u, place.share_a), zero), one);
    const V reflected = both * share;
    return {reflected, both - reflected};
  }
  static HWY_INLINE V MeanOfDielectric(D d, const AlbedoTableView& table, V a_, V e_) {
    const Rebind<int32_t, D> di;
    const auto stride = static_cast<int32_t>(table.sizes.a);
    const auto a = Cell(d, a_, table.sizes.a), e = Cell(d, e_, table.sizes.e);
    return Square(d, table.mean, a.cell + e.cell * Set(di, stride), stride, a.weight, e.weight);
  }

  static HWY_INLINE V Albedo(D d, const AlbedoTableView& table, const AlbedoPlace<D>& place) {
    const Rebind<int32_t, D> di;
    const AlbedoSizes& n = table.sizes;
    const auto stride = static_cast<int32_t>(n.v);
    const auto v = Cell(d, place.v, n.v), a = Cell(d, place.a, n.a);
    const V albedo = Square(d, table.isotropic, v.cell + a.cell * Set(di, stride), stride, v.weight, a.weight);
    if (AllTrue(d, place.r <= Zero(d))) return Min(albedo, Set(d, 1.0f));  // their ratio is 1

    const auto next_a = static_cast<int32_t>(n.ratio_v), next_r = static_cast<int32_t>(n.ratio_v * n.ratio_a),
               next_t = next_r * static_cast<int32_t>(n.ratio_r);
    const auto rv = Cell(d, place.v, n.ratio_v), ra = Cell(d, place.a, n.ratio_a), r = Cell(d, place.r, n.ratio_r),
               t = Cell(d, place.t, n.ratio_t);
    const auto at = rv.cell + ra.cell * Set(di, next_a) + r.cell * Set(di, next_r) + t.cell * Set(di, next_t);
    const auto square = [&](int32_t from) { return Square(d, table.ratio + from, at, next_a, rv.weight, ra.weight); };
    const V low = Between(square(0), square(next_r), r.weight);
    const V high = Between(square(next_t), square(next_t + next_r), r.weight);
    return Min(albedo * Between(low, high, t.weight), Set(d, 1.0f));
  }

  static HWY_INLINE V Mean(D d, const AlbedoTableView& table, const AlbedoPlace<D>& place) {
    const Rebind<int32_t, D> di;
    const auto stride = static_cast<int32_t>(table.sizes.a);
    const auto a = Cell(d, place.a, table.sizes.a), r = Cell(d, place.r, table.sizes.ratio_r);
    return Square(d, table.mean, a.cell + r.cell * Set(di, stride), stride, a.weight, r.weight);
  }

 private:
  // Between which nodes a coordinate lies.
  static HWY_INLINE TablePlace<D> Cell(D d, V coordinate, std::uint32_t nodes) {
    return {d, coordinate * Set(d, static_cast<float>(nodes - 1)), static_cast<std::int32_t>(nodes)};
  }
  static HWY_INLINE V Square(D d, const float* from, TableIndex<D> at, int32_t stride, V x, V y) {
    const float* const next = from + stride;
    return Between(Between(GatherIndex(d, from, at), GatherIndex(d, from + 1, at), x),
                   Between(GatherIndex(d, next, at), GatherIndex(d, next + 1, at), x), y);
  }
};

// smoother: as if both axes had the smaller roughness.
template <class D, class S, bool kFast, class V = Vec<D>>
HWY_INLINE DielectricPlace<D> PlaceOf(D d, const AlbedoTableView& table, const Inputs<D, S>& in,
                                      const Exceptions<D, kFast>& exceptions, V eta, bool smoother) {
  const V x = exceptions.Computable(in.x, 0.0f), y = exceptions.Computable(in.y, 0.0f);
  const V alpha_x = exceptions.Computable(in.ax, 1.0f), alpha_y = exceptions.Computable(in.ay, 1.0f);
  const V s = Sqrt(Fma(x, x, y * y));
  V along = Min(alpha_x, alpha_y), mean = along;
  if (!smoother) {
    const V wx = x * alpha_x, wy = y * alpha_y;
    const auto upright = s < Set(d, 1e-15f);
    mean = Sqrt(Set(d, 0.5f) * Fma(alpha_x, alpha_x, alpha_y * alpha_y));
    along = Select(upright, mean, Sqrt(Fma(wx, wx, wy * wy)) / Select(upright, Set(d, 1.0f), s));
  }
  return {d, table, s, exceptions.Computable(in.z, 1.0f), along, mean, exceptions.Computable(eta, 1.5f)};
}

// A dielectric's lanes with eta = 1 are like smooth ones.
template <class D>
HWY_INLINE Mask<D> UnbentDielectric(D d, const Tile& tile, std::size_t lane) {
  if (tile.interface != Interface::dielectric) return NoLanes(d);
  return LoadU(d, tile.in[kEta] + lane) == Set(d, 1.0f);
}

// The operation albedo.
template <class D, class S>
struct AlbedoOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;

  HWY_INLINE AlbedoOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return in.AllOrdinary(d, tile, lane) && AllFalse(d, UnbentDielectric(d, tile, lane));
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    if (tile.interface == Interface::dielectric) return RunDielectric<kFast>(d, tile, lane, statistics);
    const V one = Set(d, 1.0f);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in);
    const AlbedoPlace<D> place(d, *tile.albedo, in, exceptions);
    if (tile.wanted & bit(kOutAlbedo))
      Store(d, tile, kOutAlbedo, lane, exceptions.Output(AlbedoLookup<D>::Albedo(d, *tile.albedo, place), one));
    if (tile.wanted & bit(kOutMeanAlbedo))
      Store(d, tile, kOutMeanAlbedo, lane, exceptions.Output(AlbedoLookup<D>::Mean(d, *tile.albedo, place), one));
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }

 private:
  template <bool kFast>
  HWY_INLINE void RunDielectric(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V zero = Zero(d), one = Set(d, 1.0f);
    const AlbedoTableView& table = *tile.albedo;
    const V loaded_eta = LoadU(d, tile.in[kEta] + lane);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in, [&](LaneClasses<D>& classes) {
      classes.smooth = And(classes.valid, Or(classes.smooth, UnbentDielectric(d, tile, lane)));
    });
    const DielectricPlace<D> place = PlaceOf(d, table, in, exceptions, loaded_eta, false);
    // A smooth lane's: Fresnel's reflectance, and its mean where a is 0.
    V g;
    const V f = DielectricReflectance(d, in.z, loaded_eta, g);
    const auto straight = loaded_eta == one;
    const auto store = [&](OutputIndex output, V value, V smooth) {
      if (tile.wanted & bit(output)) Store(d, tile, output, lane, exceptions.Output(value, smooth));
    };
    if (tile.wanted & bit(kOutMeanAlbedo)) {
      const V smooth = AlbedoLookup<D>::MeanOfDielectric(d, table, zero, EtaPlace(d, table, loaded_eta).e);
      store(kOutMeanAlbedo, AlbedoLookup<D>::MeanOfDielectric(d, table, place.of.a, place.e),
            Select(straight, zero, smooth));
    }
    if (tile.wanted & (bit(kOutAlbedo) | bit(kOutTransmitted))) {
      const auto shares = AlbedoLookup<D>::OfDielectric(d, table, place);
      store(kOutAlbedo, shares.reflected, f);
      store(kOutTransmitted, shares.transmitted, one - f);
    }
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }
  static HWY_INLINE DielectricPlace<D> EtaPlace(D d, const AlbedoTableView& table, V eta) {
    const V one = Set(d, 1.0f);
    return {d, table, Zero(d), one, one, one, eta};
  }
};

// What compensation multiplies a lane's weight or value by, into Tile::factor: 1 + F0 (1 - E) / E (Turquin 2019), 1 / E of
// a dielectric's reflected and transmitted E together, which absorbs nothing: where it is anisotropic, that of its smaller
// roughness, so that nothing becomes too bright. 1 behind the surface.
template <class D, class S>
struct CompensationOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;

  HWY_INLINE CompensationOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const {
    return in.AllOrdinary(d, tile, lane) && AllFalse(d, UnbentDielectric(d, tile, lane));
  }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics&) const {
    const V one = Set(d, 1.0f);
    const auto exceptions = ExceptionsOf<kFast>(d, tile, lane, in, [&](LaneClasses<D>& classes) {
      classes.smooth = And(classes.valid, Or(classes.smooth, UnbentDielectric(d, tile, lane)));
    });
    if (tile.interface == Interface::dielectric) {
      const AlbedoTableView& table = *tile.albedo;
      const DielectricPlace<D> place = PlaceOf(d, table, in, exceptions, LoadU(d, tile.in[kEta] + lane), true);
      const auto shares = AlbedoLookup<D>::OfDielectric(d, table, place);
      const V both = shares.reflected + shares.transmitted;
      StoreU(exceptions.Output(Select(in.z > Zero(d), one / both, one), one), d, tile.factor + lane);
      return;
    }
    const V albedo = AlbedoLookup<D>::Albedo(d, *tile.albedo, {d, *tile.albedo, in, exceptions});
    V lost = (one - albedo) / albedo;
    if (tile.interface == Interface::schlick) lost = lost * InterfaceInputs<D>(d, tile, lane).f0;
    lost = IfThenElseZero(in.z > Zero(d), lost);
    StoreU(exceptions.Output(one + lost, one), d, tile.factor + lane);
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
