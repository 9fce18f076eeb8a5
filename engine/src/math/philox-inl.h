// Philox4x32-10: Salmon, Moraes, Dror, Shaw 2011, "Parallel random numbers: as easy as 1, 2, 3".

#if defined(FACETWISE_PHILOX_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_PHILOX_INL_H_
#undef FACETWISE_PHILOX_INL_H_
#else
#define FACETWISE_PHILOX_INL_H_
#endif

#include "src/math/lanes-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// The 64-bit product of every lane with a constant, in halves.
template <class D, class V = Vec<D>>
HWY_INLINE void MultiplyWide(D d, V a, uint32_t b, V& low, V& high) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    const uint64_t product = uint64_t{hn::GetLane(a)} * b;
    low = hn::Set(d, static_cast<uint32_t>(product));
    high = hn::Set(d, static_cast<uint32_t>(product >> 32));
  } else {
#if HWY_TARGET != HWY_SCALAR
    const hn::RepartitionToWide<D> wide;
    const V factor = hn::Set(d, b);
    const auto even = hn::MulEven(a, factor);
    const auto odd = hn::MulEven(hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(wide, a))), factor);
    low = hn::OddEven(hn::BitCast(d, hn::ShiftLeft<32>(odd)), hn::BitCast(d, even));
    high = hn::OddEven(hn::BitCast(d, odd), hn::BitCast(d, hn::ShiftRight<32>(even)));
#endif
  }
}

// The upper 24 bits as a float in [0, 1).
template <class DF, class DU, class V = Vec<DU>>
HWY_INLINE Vec<DF> UniformFromBits(DF d, DU, V bits) {
  const hn::Rebind<int32_t, DF> di;
  return hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<8>(bits))) * hn::Set(d, 0x1p-24f);
}

template <class DF>
void Philox(const PhiloxTile& tile) {
  const DF d;
  const hn::Rebind<uint32_t, DF> du;
  using U = Vec<decltype(du)>;
  for (std::size_t lane = 0; lane < tile.lanes; lane += hn::Lanes(d)) {
    U c0, c1;
    if (tile.id_low != nullptr) {
      c0 = hn::LoadU(du, tile.id_low + lane);
      c1 = hn::LoadU(du, tile.id_high + lane);
    } else {
      const uint64_t first = tile.first_id + lane;
      const U low = hn::Set(du, static_cast<uint32_t>(first));
      c0 = hn::Iota(du, static_cast<uint32_t>(first));
      c1 = hn::Set(du, static_cast<uint32_t>(first >> 32));
      c1 = hn::IfThenElse(c0 < low, c1 + hn::Set(du, 1u), c1);  // the carry
    }
    U c2 = hn::Set(du, tile.dimension);
    U c3 = hn::Zero(du);
    uint32_t k0 = static_cast<uint32_t>(tile.seed);
    uint32_t k1 = static_cast<uint32_t>(tile.seed >> 32);
    for (int round = 0; round < 10; ++round) {
      U low0, high0, low1, high1;
      MultiplyWide(du, c0, 0xD2511F53u, low0, high0);
      MultiplyWide(du, c2, 0xCD9E8D57u, low1, high1);
      c0 = hn::Xor(hn::Xor(high1, c1), hn::Set(du, k0));
      c2 = hn::Xor(hn::Xor(high0, c3), hn::Set(du, k1));
      c1 = low1;
      c3 = low0;
      k0 += 0x9E3779B9u;
      k1 += 0xBB67AE85u;
    }
    if (tile.u[0] != nullptr) hn::StoreU(UniformFromBits(d, du, c0), d, tile.u[0] + lane);
    if (tile.u[1] != nullptr) hn::StoreU(UniformFromBits(d, du, c1), d, tile.u[1] + lane);
    if (tile.u[2] != nullptr) hn::StoreU(UniformFromBits(d, du, c2), d, tile.u[2] + lane);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
