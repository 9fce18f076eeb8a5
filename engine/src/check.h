// SPDX-License-Identifier: Apache-2.0
// Checks shared by the calls: columns, active lists, overlap.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "facetwise/engine.h"
#include "src/fields.h"

namespace facetwise {

// The memory of a column, for finding overlaps.
struct MemoryUse {
  std::uintptr_t begin, end;
  std::size_t stride, width;  // stride 0: one value
  bool operator==(const MemoryUse&) const = default;
};

inline MemoryUse memory_use(const void* data, std::size_t count, std::size_t stride, std::size_t width) {
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  if (count == 0) return {0, 0, 0, width};
  return {begin, begin + (count - 1) * stride + width, count > 1 ? stride : 0, width};
}
template <class Column>
MemoryUse memory_use(const Column& column) {
  return memory_use(column.data(), column.count(), column.stride(), sizeof(*column.data()));
}

// Whether two columns' ranges meet, and whether their values do.
inline bool ranges_meet(const MemoryUse& a, const MemoryUse& b) { return (a.begin < b.end) & (b.begin < a.end); }
bool share_memory(const MemoryUse& a, const MemoryUse& b);

// Length, null, alignment, stride. Errors begin with the field's name.
template <class T>
absl::Status check_input(absl::string_view field, const Column<T>& column, std::size_t lanes);
template <class T>
absl::Status check_output(absl::string_view field, const OutputColumn<T>& column, std::size_t lanes);
absl::Status check(Operation operation, const Batch& batch, const PresentColumns& columns);
absl::Status check_active(const std::optional<std::span<const std::uint32_t>>& active, std::size_t lanes);

}  // namespace facetwise
