// SPDX-License-Identifier: Apache-2.0
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

inline constexpr uint32_t kMultiplier0 = 0xD2511F53u, kMultiplier1 = 0xCD9E8D57u;
inline constexpr uint32_t kWeyl0 = 0x9E3779B9u, kWeyl1 = 0xBB67AE85u;

// One counter; the words of its block in c.
inline void PhiloxBlock(uint32_t k0, uint32_t k1, uint32_t (&c)[4]) {
  for (int round = 0; round < 10; ++round, k0 += kWeyl0, k1 += kWeyl1) {
    const uint64_t product0 = uint64_t{c[0]} * kMultiplier0, product1 = uint64_t{c[2]} * kMultiplier1;
    const uint32_t c0 = static_cast<uint32_t>(product1 >> 32) ^ c[1] ^ k0;
    const uint32_t c2 = static_cast<uint32_t>(product0 >> 32) ^ c[3] ^ k1;
    c[0] = c0;
    c[1] = static_cast<uint32_t>(product1);
    c[2] = c2;
    c[3] = static_cast<uint32_t>(product0);
  }
}

// Counters in 64-bit lanes, of which the lower halves count: a product is then the halves of two words, and
// what the upper halves hold does not matter.
template <class D64>
struct PhiloxWide {
  using U = Vec<D64>;
  U c0, c1, c2, c3;

  HWY_INLINE void Rounds(D64 d64, uint64_t seed) {
    const hn::Repartition<uint32_t, D64> d32;
    const auto multiply = [&](U a, uint32_t factor) HWY_ATTR {
      return hn::MulEven(hn::BitCast(d32, a), hn::BitCast(d32, hn::Set(d64, factor)));
    };
    uint32_t k0 = static_cast<uint32_t>(seed), k1 = static_cast<uint32_t>(seed >> 32);
    for (int round = 0; round < 10; ++round, k0 += kWeyl0, k1 += kWeyl1) {
      const U product0 = multiply(c0, kMultiplier0), product1 = multiply(c2, kMultiplier1);
      c0 = hn::Xor3(hn::ShiftRight<32>(product1), c1, hn::Set(d64, k0));
      c2 = hn::Xor3(hn::ShiftRight<32>(product0), c3, hn::Set(d64, k1));
      c1 = product1;
      c3 = product0;
    }
  }
};

// Words of even and odd lanes, as floats in [0, 1) of their upper 24 bits.
template <class DF, class U64>
HWY_INLINE void StoreUniform(DF d, U64 even, U64 odd, float* to) {
  const hn::Rebind<int32_t, DF> di;
  const auto words = hn::OddEven(hn::BitCast(di, hn::ShiftLeft<32>(odd)), hn::BitCast(di, even));
  const hn::Rebind<uint32_t, DF> du;
  const auto bits = hn::BitCast(di, hn::ShiftRight<8>(hn::BitCast(du, words)));
  hn::StoreU(hn::ConvertTo(d, bits) * hn::Set(d, 0x1p-24f), d, to);
}

// `DF`: one of Highway's tags.
template <class DF>
void Philox(const PhiloxTile& tile) {
  if constexpr (hn::MaxLanes(DF()) == 1) {
    for (std::size_t lane = 0; lane < tile.lanes; ++lane) {
      const uint64_t first = tile.first_id + lane;
      uint32_t c[4] = {static_cast<uint32_t>(first), static_cast<uint32_t>(first >> 32), tile.dimension, 0};
      if (tile.id != nullptr) {
        c[0] = static_cast<uint32_t>(tile.id[lane]);
        c[1] = static_cast<uint32_t>(tile.id[lane] >> 32);
      }
      PhiloxBlock(static_cast<uint32_t>(tile.seed), static_cast<uint32_t>(tile.seed >> 32), c);
      for (int k = 0; k < 3; ++k)
        if (tile.u[k] != nullptr) tile.u[k][lane] = static_cast<float>(c[k] >> 8) * 0x1p-24f;
    }
  } else {
#if HWY_TARGET != HWY_SCALAR
    const DF d;
    const hn::RepartitionToWide<hn::Rebind<uint32_t, DF>> d64;
    const std::size_t half = hn::Lanes(d64);
    // Iota of even and odd lanes.
    const auto pairs = hn::Iota(d64, 0) + hn::Iota(d64, 0);
    for (std::size_t lane = 0; lane < tile.lanes; lane += hn::Lanes(d)) {
      auto even_id = pairs + hn::Set(d64, tile.first_id + lane);
      auto odd_id = even_id + hn::Set(d64, uint64_t{1});
      if (tile.id != nullptr) {
        const auto a = hn::LoadU(d64, tile.id + lane), b = hn::LoadU(d64, tile.id + lane + half);
        even_id = hn::ConcatEven(d64, b, a);
        odd_id = hn::ConcatOdd(d64, b, a);
      }
      const auto c2 = hn::Set(d64, uint64_t{tile.dimension});
      const auto c3 = hn::Zero(d64);
      PhiloxWide<decltype(d64)> even{even_id, hn::ShiftRight<32>(even_id), c2, c3};
      PhiloxWide<decltype(d64)> odd{odd_id, hn::ShiftRight<32>(odd_id), c2, c3};
      even.Rounds(d64, tile.seed);
      odd.Rounds(d64, tile.seed);
      if (tile.u[0] != nullptr) StoreUniform(d, even.c0, odd.c0, tile.u[0] + lane);
      if (tile.u[1] != nullptr) StoreUniform(d, even.c1, odd.c1, tile.u[1] + lane);
      if (tile.u[2] != nullptr) StoreUniform(d, even.c2, odd.c2, tile.u[2] + lane);
    }
#endif
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
