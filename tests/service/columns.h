// SPDX-License-Identifier: Apache-2.0
// Columns in memory of their own, contiguous or strided, that can be compared to the last byte.
#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

#include "facetwise/column.h"

namespace facetwise::testing {

inline constexpr float kUntouched = -7777.0f;

enum class Shape { contiguous, strided };

// A column's memory: values one after the other, or `stride` floats apart.
template <class T>
class Memory {
 public:
  Memory(std::size_t count, Shape shape, T value)
      : count_(count), step_(shape == Shape::strided ? 3 : 1), values_(count * step_ + 1, value) {}
  Column<T> in() const { return {values_.data(), count_, step_ * sizeof(T)}; }
  OutputColumn<T> out() { return {values_.data(), count_, step_ * sizeof(T)}; }
  T& operator[](std::size_t k) { return values_[k * step_]; }
  bool operator==(const Memory& other) const {
    return values_.size() == other.values_.size() &&
           std::memcmp(values_.data(), other.values_.data(), values_.size() * sizeof(T)) == 0;
  }

 private:
  std::size_t count_, step_;
  std::vector<T> values_;
};

}  // namespace facetwise::testing
