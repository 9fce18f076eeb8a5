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

template <class D>
class AlbedoLookup {
 public:
  using V = Vec<D>;

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

// The operation albedo.
template <class D, class S>
struct AlbedoOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;

  HWY_INLINE AlbedoOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics& statistics) const {
    const V one = Set(d, 1.0f);
    LaneClasses<D> classes;
    if constexpr (!kFast) classes = in.Classified(d, tile, lane);
    const Exceptions<D, kFast> exceptions(d, classes);
    const AlbedoPlace<D> place(d, *tile.albedo, in, exceptions);
    if (tile.wanted & bit(kOutAlbedo))
      Store(d, tile, kOutAlbedo, lane, exceptions.Output(AlbedoLookup<D>::Albedo(d, *tile.albedo, place), one));
    if (tile.wanted & bit(kOutMeanAlbedo))
      Store(d, tile, kOutMeanAlbedo, lane, exceptions.Output(AlbedoLookup<D>::Mean(d, *tile.albedo, place), one));
    exceptions.Finish(tile, lane, NoLanes(d), statistics);
  }
};

// What compensation multiplies a lane's weight or value by, into Tile::factor: 1 + F0 (1 - E) / E (Turquin 2019).
// 1 behind the surface.
template <class D, class S>
struct CompensationOf {
  using V = Vec<D>;
  IncidentInputs<D, S> in;

  HWY_INLINE CompensationOf(D d, const Tile& tile, std::size_t lane) : in(d, tile, lane) {}
  HWY_INLINE bool AllOrdinary(D d, const Tile& tile, std::size_t lane) const { return in.AllOrdinary(d, tile, lane); }

  template <bool kFast>
  HWY_INLINE void Run(D d, const Tile& tile, std::size_t lane, Statistics&) const {
    const V one = Set(d, 1.0f);
    LaneClasses<D> classes;
    if constexpr (!kFast) classes = in.Classified(d, tile, lane);
    const Exceptions<D, kFast> exceptions(d, classes);
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
