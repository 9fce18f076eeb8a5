// Checks shared by the calls: columns, active lists, overlap.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "facetwise/engine.h"

namespace facetwise {

// The memory of a column, for finding overlaps.
struct MemoryUse {
  std::uintptr_t begin = 0;
  std::size_t count = 0, stride = 0, width = 0;
  bool operator==(const MemoryUse&) const = default;
};
bool share_memory(const MemoryUse& a, const MemoryUse& b);

template <class Column>
MemoryUse memory_use(const Column& column) {
  return {reinterpret_cast<std::uintptr_t>(column.data()), column.count(), column.stride(), sizeof(*column.data())};
}

// Length, null, alignment, stride. Errors begin with the field's name.
template <class T>
absl::Status check_input(absl::string_view field, const Column<T>& column, std::size_t lanes);
template <class T>
absl::Status check_output(absl::string_view field, const OutputColumn<T>& column, std::size_t lanes);
absl::Status check_active(const std::optional<std::span<const std::uint32_t>>& active, std::size_t lanes);

}  // namespace facetwise
