// SPDX-License-Identifier: Apache-2.0
// Columns: how batches of values are passed. The caller owns the memory; no call keeps a column.
#pragma once

#include <cstddef>
#include <ranges>
#include <span>
#include <type_traits>

namespace facetwise {

// An input column: absent, one value for all lanes, or one value per lane.
//
// A column over memory has `count` values, `stride` bytes apart: sizeof(T) when contiguous (the fast
// path), the size of the structure when it is a member of an array of structures. A column of exactly
// one value serves every lane. Memory of a float or 64-bit column is aligned to 4 bytes at least.
template <class T>
class Column {
 public:
  Column() = default;
  Column(T value) : value_(value), count_(1) {}  // NOLINT: implicit, `alpha_x = 0.3f` is the point
  Column(const T* values, std::size_t count, std::size_t stride = sizeof(T))
      : data_(values), count_(count), stride_(stride), over_memory_(true) {}
  template <std::ranges::contiguous_range Range>
  requires std::is_same_v<std::ranges::range_value_t<Range>, T> Column(const Range& values)  // NOLINT: implicit
      : Column(std::ranges::data(values), std::ranges::size(values)) {}

  bool present() const { return over_memory_ || count_ == 1; }
  bool one_value() const { return count_ == 1; }
  std::size_t count() const { return count_; }
  // Bytes between the values of neighbouring lanes: 0 when one value serves every lane.
  std::size_t lane_stride() const { return one_value() ? 0 : stride_; }
  std::size_t stride() const { return stride_; }
  // The first value's memory. For a column made from a value it lies inside this object.
  const T* data() const { return over_memory_ ? data_ : &value_; }
  const T& operator[](std::size_t lane) const {
    return *reinterpret_cast<const T*>(reinterpret_cast<const char*>(data()) + lane * lane_stride());
  }

 private:
  const T* data_ = nullptr;
  T value_{};
  std::size_t count_ = 0;
  std::size_t stride_ = sizeof(T);
  bool over_memory_ = false;
};

// An output column: absent (then it is not computed where that saves work), or one value per lane.
template <class T>
class OutputColumn {
 public:
  OutputColumn() = default;
  OutputColumn(T* values, std::size_t count, std::size_t stride = sizeof(T))
      : data_(values), count_(count), stride_(stride), present_(true) {}
  template <std::ranges::contiguous_range Range>
  requires std::is_same_v<std::ranges::range_value_t<Range>, T> OutputColumn(Range& values)  // NOLINT: implicit
      : OutputColumn(std::ranges::data(values), std::ranges::size(values)) {}
  OutputColumn(std::span<T> values) : OutputColumn(values.data(), values.size()) {}  // NOLINT: implicit

  bool present() const { return present_; }
  std::size_t count() const { return count_; }
  std::size_t stride() const { return stride_; }
  T* data() const { return data_; }
  T& operator[](std::size_t lane) const {
    return *reinterpret_cast<T*>(reinterpret_cast<char*>(data_) + lane * stride_);
  }

 private:
  T* data_ = nullptr;
  std::size_t count_ = 0;
  std::size_t stride_ = sizeof(T);
  bool present_ = false;
};

}  // namespace facetwise
