// SPDX-License-Identifier: Apache-2.0
#include "facetwise/column_memory.h"

#include <limits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "src/tile.h"

namespace facetwise {
namespace {

// Between a column's end and the next one's begin: three pages and 19 lines. Multiples of 19 lines are at least two
// lines apart modulo a page for 27 columns; odd multiples of a page keep apart caches that look at the next higher
// bits. Measured: only 19 lines, or a page and 5 lines, cost 5 to 15 %.
constexpr std::size_t kGap = 3 * 1024 + 19 * kLine;

std::size_t stride_of(std::size_t lanes) { return (lanes + kLine - 1) / kLine * kLine + kGap; }

}  // namespace

std::size_t ColumnMemory::bytes(std::size_t columns, std::size_t lanes) {
  const std::size_t most = std::numeric_limits<std::size_t>::max() / sizeof(float) / 2;
  if (lanes > most - kGap - kLine || (columns != 0 && stride_of(lanes) > most / columns)) throw std::bad_alloc();
  return columns * stride_of(lanes) * sizeof(float);
}

ColumnMemory::ColumnMemory(std::size_t columns, std::size_t lanes)
    : columns_(columns), lanes_(lanes), stride_(stride_of(lanes)) {
  const std::size_t needed = (bytes(columns, lanes) + kLargePage - 1) / kLargePage * kLargePage;
  data_.reset(static_cast<float*>(::operator new[](needed, std::align_val_t{kLargePage})));
#if defined(__linux__)
  // Small ones would fault whole large pages in for a few kilobytes. Where a system has no large pages the advice is ignored.
  if (needed >= 2 * kLargePage) (void)madvise(data_.get(), needed, MADV_HUGEPAGE);
#endif
}

ColumnMemory::ColumnMemory(void* memory, std::size_t columns, std::size_t lanes)
    : columns_(columns), lanes_(lanes), stride_(stride_of(lanes)), data_(static_cast<float*>(memory), Free{false}) {}

}  // namespace facetwise
