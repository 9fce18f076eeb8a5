// SPDX-License-Identifier: Apache-2.0
// ColumnMemory: columns begin at cache lines, apart in their pages, and hold their lanes.
#include "facetwise/column_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace facetwise::test {
namespace {

TEST(ColumnMemory, ColumnsAreApart) {
  for (const std::size_t lanes : {1u, 100u, 1024u, 65536u, 1u << 20}) {
    constexpr std::size_t kColumns = 20;
    const ColumnMemory memory(kColumns, lanes);
    ASSERT_EQ(memory.columns(), kColumns);
    ASSERT_EQ(memory.lanes(), lanes);
    for (std::size_t k = 0; k < kColumns; ++k) {
      const auto address = reinterpret_cast<std::uintptr_t>(memory[k]);
      EXPECT_EQ(address % 64, 0u);
      for (std::size_t j = 0; j < k; ++j) {
        const auto other = reinterpret_cast<std::uintptr_t>(memory[j]);
        EXPECT_GE(address - other, lanes * sizeof(float));
        if (lanes % 1024 != 0) continue;
        const auto distance = (address - other) % 4096;
        EXPECT_GE(std::min(distance, 4096 - distance), 128u) << j << " and " << k;
      }
    }
    for (std::size_t k = 0; k < kColumns; ++k) std::fill_n(memory[k], lanes, static_cast<float>(k));
    for (std::size_t k = 0; k < kColumns; ++k) {
      EXPECT_EQ(memory[k][0], static_cast<float>(k));
      EXPECT_EQ(memory[k][lanes - 1], static_cast<float>(k));
    }
  }
}

TEST(ColumnMemory, NoneAndTooMuch) {
  EXPECT_EQ(ColumnMemory().columns(), 0u);
  EXPECT_EQ(ColumnMemory(0, 100).columns(), 0u);
  EXPECT_THROW(ColumnMemory(4, std::numeric_limits<std::size_t>::max()), std::bad_alloc);
  EXPECT_THROW(ColumnMemory(std::numeric_limits<std::size_t>::max() / 8, 8), std::bad_alloc);
}

}  // namespace
}  // namespace facetwise::test
