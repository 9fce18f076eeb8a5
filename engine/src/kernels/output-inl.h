// SPDX-License-Identifier: Apache-2.0
// How outputs leave a kernel.

#if defined(FACETWISE_OUTPUT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef FACETWISE_OUTPUT_INL_H_
#undef FACETWISE_OUTPUT_INL_H_
#else
#define FACETWISE_OUTPUT_INL_H_
#endif

#include "src/math/lanes-inl.h"
#include "src/tile.h"

HWY_BEFORE_NAMESPACE();
namespace facetwise {
namespace HWY_NAMESPACE {

// Stores a vector of an output if it is wanted.
template <class D, class V = Vec<D>>
HWY_INLINE void Store(D d, const Tile& tile, OutputIndex output, std::size_t lane, V value) {
  if (!(tile.wanted & bit(output))) return;
  if constexpr (kStreams<D>) {
    if (tile.streamed & bit(output)) {
      Stream(value, d, tile.out[output] + lane);
      return;
    }
  }
  StoreU(value, d, tile.out[output] + lane);
}

}  // namespace HWY_NAMESPACE
}  // namespace facetwise
HWY_AFTER_NAMESPACE();

#endif
