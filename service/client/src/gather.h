// SPDX-License-Identifier: Apache-2.0
// Columns in the caller's memory from and to columns without gaps.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "src/pieces.h"
#include "wire/message_reader.h"

namespace facetwise {

// Values of a column that a piece sends: one if one serves every lane.
template <class T>
std::size_t values_sent(const Column<T>& column, const Range& range) {
  return column.one_value() ? 1 : range.size();
}

template <class T>
void gather(const Column<T>& column, const Positions& positions, const Range& range, char* to) {
  const char* from = reinterpret_cast<const char*>(column.data());
  if (column.one_value()) {
    std::memcpy(to, from, sizeof(T));
  } else if (positions.all() && column.stride() == sizeof(T)) {
    std::memcpy(to, from + range.begin * sizeof(T), range.size() * sizeof(T));
  } else {
    for (std::size_t k = range.begin; k < range.end; ++k, to += sizeof(T))
      std::memcpy(to, from + positions.lane(k) * column.stride(), sizeof(T));
  }
}

// Reads a column of the message to where it belongs.
template <class T>
bool scatter(wire::MessageReader& reader, const OutputColumn<T>& column, const Positions& positions,
             const Range& range) {
  if (positions.all() && column.stride() == sizeof(T))
    return reader.read(column.data() + range.begin, range.size() * sizeof(T));
  constexpr std::size_t kStaged = 1024;
  T staged[kStaged];
  for (std::size_t k = range.begin; k < range.end;) {
    const std::size_t count = std::min(kStaged, range.end - k);
    if (!reader.read(staged, count * sizeof(T))) return false;
    for (std::size_t j = 0; j < count; ++j, ++k) column[positions.lane(k)] = staged[j];
  }
  return true;
}

}  // namespace facetwise
