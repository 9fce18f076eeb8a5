// SPDX-License-Identifier: Apache-2.0
// Tabulated distributions (facetwise/slope_table.h) in lanes: docs/tables.md. src/table/layout.h says what a
// tilt and a side are.
//
// Every function takes the stretched unit incident direction as cos(theta), sin(theta) >= 0, cos(phi),
// sin(phi), and is for HWY's tags and pairs of them alike. Any input, NaN too, reads inside the tables.

#if defined(FACETWISE_SLOPE_TABLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_SLOPE_TABLE_INL_H_
#undef FACETWISE_SLOPE_TABLE_INL_H_
#else
#define FACETWISE_SLOPE_TABLE_INL_H_
#endif

#include "facetwise/slope_table.h"
#include "src/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

template <class D, class V>
HWY_INLINE Vec<Twice<D>> GatherIndex(Twice<D> d, const float* from, Pair<V> index) {
  return {GatherIndex(d.d, from, index.a), GatherIndex(d.d, from, index.b)};
}
template <class D>
using TableIndex = Vec<Rebind<std::int32_t, D>>;

template <class V>
HWY_INLINE V Between(V a, V b, V weight) {
  return Fma(weight, b - a, a);
}

// Where a position lies between nodes 0 ... n - 1.
template <class D, class V = Vec<D>>
struct TablePlace {
  TableIndex<D> cell;
  V weight;
  HWY_INLINE TablePlace() {}
  HWY_INLINE TablePlace(D d, V position, std::int32_t n) {
    const Rebind<std::int32_t, D> di{};
    const V zero = Zero(d);
    const V inside = Select(position > zero, position, zero);
    cell = ConvertTo(di, Min(inside, Set(d, static_cast<float>(n - 2))));
    weight = Min(inside - ConvertTo(d, cell), Set(d, 1.0f));
  }
};

// 1 + tan(half the angle of (cos, sin)), for cos >= 0 and their length; near 0 nothing cancels.
template <class D, class V = Vec<D>>
HWY_INLINE V OnePlusHalfTangent(D d, V length, V cos, V sin) {
  const V one = Set(d, 1.0f);
  const auto up = sin >= Zero(d);
  const V sum = length + cos;
  const V bend = Select(up, sin, cos * (one + cos / (length + Abs(sin)))) / sum;
  return Select(up, one + bend, bend);
}

// An incident direction and where it lies in the tables.
template <class D, class V = Vec<D>>
struct TableIncident {
  V cos_phi, sin_phi;
  V reach;  // 1 + the largest visible tan(chi / 2)
  V angle;  // phi as a diamond angle, [0, 4)
  TablePlace<D> azimuth;
  HWY_INLINE TableIncident(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos, V sin)
      : cos_phi(cos), sin_phi(sin) {
    const V zero = Zero(d);
    reach = OnePlusHalfTangent(d, Set(d, 1.0f), Max(sin_theta, zero), cos_theta);
    reach = Max(reach, Set(d, 0x1p-20f));
    if (view.azimuths == 0) return;
    const V a = Abs(cos), b = Abs(sin);
    const V p = b / (a + b);
    const V half = Select(cos >= zero, p, Set(d, 2.0f) - p);
    angle = Select(sin >= zero, half, Set(d, 4.0f) - half);
    azimuth = Turned(d, view.azimuths);
  }
  HWY_INLINE TablePlace<D> Turned(D d, std::int32_t azimuths) const {
    return TablePlace<D>(d, angle * Set(d, 0.25f * static_cast<float>(azimuths)), azimuths + 1);
  }
  HWY_INLINE TablePlace<D> At(D d, std::int32_t nodes) const {
    return TablePlace<D>(d, (Set(d, 1.0f) - reach * Set(d, 0.5f)) * Set(d, static_cast<float>(nodes - 1)), nodes);
  }
};

// A row of nodes in u, linear between neighbouring rows and azimuths.
template <class D, class V = Vec<D>>
struct TableRow {
  const float* table;
  std::int32_t next, turn;  // to the neighbouring row, and to that of the next azimuth, 0 if there is none
  TableIndex<D> offset, nearest;
  V outer, azimuth;
  HWY_INLINE TableRow(D d, const SlopeTableView& view, const float* from, std::int32_t rows, const TablePlace<D>& place,
                      const TableIncident<D>& incident)
      : table(from), next(view.uniforms + 1), turn(view.azimuths == 0 ? 0 : rows * next), outer(place.weight) {
    const Rebind<std::int32_t, D> di{};
    const V half = Set(d, 0.5f), one = Set(d, 1.0f);
    offset = place.cell * Set(di, next);
    nearest = offset + ConvertTo(di, IfThenElseZero(outer > half, one)) * Set(di, next);
    azimuth = Zero(d);
    if (turn == 0) return;
    azimuth = incident.azimuth.weight;
    offset = offset + incident.azimuth.cell * Set(di, turn);
    nearest = nearest + (incident.azimuth.cell + ConvertTo(di, IfThenElseZero(azimuth > half, one))) * Set(di, turn);
  }
  HWY_INLINE V At(D d, TableIndex<D> node) const {
    const TableIndex<D> at = offset + node;
    const V here = Between(GatherIndex(d, table, at), GatherIndex(d, table + next, at), outer);
    if (turn == 0) return here;
    const float* turned = table + turn;
    return Between(here, Between(GatherIndex(d, turned, at), GatherIndex(d, turned + next, at), outer), azimuth);
  }
  // In the nearest row.
  HWY_INLINE V Nearest(D d, TableIndex<D> node) const { return GatherIndex(d, table, nearest + node); }
  // Neighbouring nodes are apart, but may round to one value.
  HWY_INLINE V Width(D d, V low, V high) const { return Max(high - low, Set(d, 0x1p-24f)); }
};

// The value that u draws from a row, and its density there. `rest`: 1 - u. Cells are counted from the nearer end: cell j
// ends at 2 ((j + 1) / n)^2.
template <class D, class V = Vec<D>>
HWY_INLINE V DrawFrom(D d, const TableRow<D>& row, std::int32_t uniforms, V u, V rest, V& density) {
  const Rebind<std::int32_t, D> di{};
  const float n = static_cast<float>(uniforms);
  const V one = Set(d, 1.0f), zero = Zero(d);
  const auto lower = u < Set(d, 0.5f);
  const V end = Select(lower, u, rest);
  const V squares = Select(end > zero, end, zero) * Set(d, 0.5f * n * n);
  const TableIndex<D> j = ConvertTo(di, Min(Sqrt(squares), Set(d, 0.5f * n - 1.0f)));
  const V from = ConvertTo(d, j);
  const V odd = Fma(from, Set(d, 2.0f), one);
  V within = Min(Max(NegFma(from, from, squares) / odd, zero), one);
  within = Select(lower, within, one - within);
  const V node = Select(lower, from, Set(d, n - 1.0f) - from);
  const TableIndex<D> k = ConvertTo(di, node);
  const V low = row.At(d, k);
  const V high = row.At(d, k + Set(di, 1));
  density = odd * Set(d, 2.0f / (n * n)) / row.Width(d, low, high);
  return Between(low, high, within);
}

// The cell of a row in which a value lies.
template <class D>
struct TableCell {
  using V = Vec<D>;
  V low, width;
  V from, odd;    // it begins at from^2 steps from the nearer end, and has as many as `odd`
  Mask<D> upper;  // the nearer end is the upper
  HWY_INLINE TableCell(D d, const TableRow<D>& row, std::int32_t uniforms, V value) {
    const Rebind<std::int32_t, D> di{};
    const float n = static_cast<float>(uniforms);
    const V zero = Zero(d), one = Set(d, 1.0f), last = Set(d, n - 1.0f);
    V node = zero;
    for (float step = 0.5f * n; step >= 1.0f; step *= 0.5f) {
      const V further = node + Set(d, step);
      node = Select(row.Nearest(d, ConvertTo(di, further)) <= value, further, node);
    }
    // The interpolated row's cell is that of the nearest row, or one near it.
    low = zero;
    V high = one;
    for (std::int32_t steps = 0; steps < uniforms; ++steps) {
      const TableIndex<D> k = ConvertTo(di, node);
      low = row.At(d, k);
      high = row.At(d, k + Set(di, 1));
      const auto down = And(low > value, node > zero), up = And(high <= value, node < last);
      if (AllFalse(d, Or(down, up))) break;
      node = node + IfThenElseZero(up, one) - IfThenElseZero(down, one);
    }
    from = Min(node, last - node);
    upper = last - node < node;
    odd = Fma(from, Set(d, 2.0f), one);
    width = row.Width(d, low, high);
  }
};

// The density of DrawFrom() at a value.
template <class D, class V = Vec<D>>
HWY_INLINE V DensityFrom(D d, const TableRow<D>& row, std::int32_t uniforms, V value) {
  const float n = static_cast<float>(uniforms);
  const TableCell<D> cell(d, row, uniforms, value);
  return cell.odd * Set(d, 2.0f / (n * n)) / cell.width;
}
// The u with which DrawFrom() draws a value, and 1 - u.
template <class D, class V = Vec<D>>
HWY_INLINE void ShareBelow(D d, const TableRow<D>& row, std::int32_t uniforms, V value, V& share, V& rest) {
  const float n = static_cast<float>(uniforms);
  const V zero = Zero(d), one = Set(d, 1.0f);
  const TableCell<D> cell(d, row, uniforms, value);
  V within = Min(Max((value - cell.low) / cell.width, zero), one);
  within = Select(cell.upper, one - within, within);
  const V end = Fma(within, cell.odd, cell.from * cell.from) * Set(d, 2.0f / (n * n));
  share = Select(cell.upper, one - end, end);
  rest = Select(cell.upper, end, one - end);
}

template <class D, class V = Vec<D>>
HWY_INLINE TableRow<D> TiltRow(D d, const SlopeTableView& view, const TableIncident<D>& incident) {
  return TableRow<D>(d, view, view.tilt, view.incidence, incident.At(d, view.incidence), incident);
}
// `rise`: 1 + tan(chi / 2)
template <class D, class V = Vec<D>>
HWY_INLINE TableRow<D> SideRow(D d, const SlopeTableView& view, const TableIncident<D>& incident, V rise) {
  const TablePlace<D> place(d, rise * Set(d, 0.5f * static_cast<float>(view.slopes - 1)), view.slopes);
  return TableRow<D>(d, view, view.side, view.slopes, place, incident);
}

// A visible normal m, m_z > 0, and the density per solid angle with which the tables draw it. `rest1`: 1 - u1.
template <class D, class V = Vec<D>>
HWY_NOINLINE void DrawVisibleNormal(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi,
                                    V u1, V rest1, V u2, V& mx, V& my, V& mz, V& density) {
  const V one = Set(d, 1.0f), two = Set(d, 2.0f), least = Set(d, 0x1p-22f);
  const TableIncident<D> incident(d, view, cos_theta, sin_theta, cos_phi, sin_phi);
  V tilt, side;
  const V rise = Max(DrawFrom(d, TiltRow(d, view, incident), view.uniforms, u1, rest1, tilt) * incident.reach, least);
  const V s = rise - one;
  const V square = Fma(s, s, one);
  const V cos_chi = Max(rise * (two - rise) / square, least);
  const V sin_chi = two * s / square;
  const V most = Set(d, 1.0f - 0x1p-22f);
  V h = DrawFrom(d, SideRow(d, view, incident, rise), view.uniforms, u2, one - u2, side);
  h = Max(Min(h, most), Neg(most));
  const V c = Sqrt((one - h) * (one + h));
  const V along = sin_chi * c;
  mx = Fms(sin_phi, h, cos_phi * along);
  my = Neg(Fma(sin_phi, along, cos_phi * h));
  mz = cos_chi * c;
  density = tilt * square * Set(d, 0.5f) / incident.reach * side;
}

// The density of DrawVisibleNormal() at a unit m: 0 where m_z <= 0 or m faces away from i.
template <class D, class V = Vec<D>>
HWY_NOINLINE V VisibleNormalDensity(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi,
                                    V mx, V my, V mz) {
  const V one = Set(d, 1.0f), zero = Zero(d);
  const TableIncident<D> incident(d, view, cos_theta, sin_theta, cos_phi, sin_phi);
  const V along = Neg(Fma(cos_phi, mx, sin_phi * my));
  const V h = Fms(sin_phi, mx, cos_phi * my);
  const V length = Sqrt(Fma(along, along, mz * mz));
  const V rise = OnePlusHalfTangent(d, length, mz, along);
  const V s = rise - one;
  const V f = rise / incident.reach;
  const V tilt = DensityFrom(d, TiltRow(d, view, incident), view.uniforms, f);
  const V side = DensityFrom(d, SideRow(d, view, incident, rise), view.uniforms, h);
  const V density = tilt * Fma(s, s, one) * Set(d, 0.5f) / incident.reach * side;
  return IfThenElseZero(And(mz > zero, f <= one), density);
}

// The share of DrawVisibleNormal()'s normals whose tilt is below that of `rise`, and the rest.
template <class D, class V = Vec<D>>
HWY_NOINLINE void ShareBelowTilt(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi,
                                 V rise, V& share, V& rest) {
  const TableIncident<D> incident(d, view, cos_theta, sin_theta, cos_phi, sin_phi);
  ShareBelow(d, TiltRow(d, view, incident), view.uniforms, Min(rise / incident.reach, Set(d, 1.0f)), share, rest);
}

// The same by slopes: x, y = -m_xy / m_z, densities per area of slopes.
template <class D, class V = Vec<D>>
HWY_INLINE void DrawVisibleSlope(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi, V u1,
                                 V u2, V& x, V& y, V& density) {
  V mx, my, mz;
  DrawVisibleNormal(d, view, cos_theta, sin_theta, cos_phi, sin_phi, u1, Set(d, 1.0f) - u1, u2, mx, my, mz, density);
  x = Neg(mx / mz);
  y = Neg(my / mz);
  density = density * mz * mz * mz;
}
template <class D, class V = Vec<D>>
HWY_INLINE V VisibleSlopeDensity(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi, V x,
                                 V y) {
  const V one = Set(d, 1.0f);
  const V mz = one / Sqrt(Fma(x, x, Fma(y, y, one)));
  const V density = VisibleNormalDensity(d, view, cos_theta, sin_theta, cos_phi, sin_phi, Neg(x * mz), Neg(y * mz), mz);
  return density * mz * mz * mz;
}

// D(m) of a unit m with m_z > 0.
template <class D, class V = Vec<D>>
HWY_INLINE V NormalDensity(D d, const SlopeTableView& view, V mx, V my, V mz) {
  const Rebind<std::int32_t, D> di{};
  const V one = Set(d, 1.0f), scale = one / (one + mz);
  const float last = static_cast<float>(view.grid - 1);
  if (view.azimuths == 0) {
    const TablePlace<D> at(d, Sqrt(Fma(mx, mx, my * my)) * scale * Set(d, last), view.grid);
    return Between(GatherIndex(d, view.density, at.cell), GatherIndex(d, view.density + 1, at.cell), at.weight);
  }
  const V half = Set(d, 0.5f * last);
  const TablePlace<D> x(d, NegFma(mx, scale, one) * half, view.grid), y(d, NegFma(my, scale, one) * half, view.grid);
  const TableIndex<D> at = y.cell * Set(di, view.grid) + x.cell;
  const float *low = view.density, *high = view.density + view.grid;
  return Between(Between(GatherIndex(d, low, at), GatherIndex(d, low + 1, at), x.weight),
                 Between(GatherIndex(d, high, at), GatherIndex(d, high + 1, at), x.weight), y.weight);
}

// The density of all slopes.
template <class D, class V = Vec<D>>
HWY_INLINE V P22(D d, const SlopeTableView& view, V x, V y) {
  const V one = Set(d, 1.0f);
  const V mz = one / Sqrt(Fma(x, x, Fma(y, y, one)));
  const V square = mz * mz;
  return NormalDensity(d, view, Neg(x * mz), Neg(y * mz), mz) * square * square;
}

// The projected area of a unit i, positive wherever anything is visible.
template <class D, class V = Vec<D>>
HWY_NOINLINE V ProjectedArea(D d, const SlopeTableView& view, V cos_theta, V sin_theta, V cos_phi, V sin_phi) {
  const V one = Set(d, 1.0f), zero = Zero(d);
  const TableIncident<D> incident(d, view, cos_theta, sin_theta, cos_phi, sin_phi);
  const TablePlace<D> at = incident.At(d, view.areas);
  const auto between = [&](const float* row, TableIndex<D> cell) HWY_ATTR {
    return Between(GatherIndex(d, row, cell), GatherIndex(d, row + 1, cell), at.weight);
  };
  V ratio;
  if (view.azimuths == 0) {
    ratio = between(view.area, at.cell);
  } else {
    const Rebind<std::int32_t, D> di{};
    const TablePlace<D> turn = incident.Turned(d, SlopeTableView::kAreaTurns * view.azimuths);
    const TableIndex<D> cell = turn.cell * Set(di, view.areas) + at.cell;
    ratio = Between(between(view.area, cell), between(view.area + view.areas, cell), turn.weight);
  }
  // (1 + cos) / 2, where that cancels by the sine.
  const V half = Set(d, 0.5f);
  const V back = sin_theta * sin_theta / (one + Abs(cos_theta));
  return Select(cos_theta >= zero, one + cos_theta, back) * half * ratio;
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
