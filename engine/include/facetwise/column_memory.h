// SPDX-License-Identifier: Apache-2.0
// Memory for columns, placed so that calls run at full speed.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace facetwise {

// Some columns of as many floats each, in one piece of memory, uninitialised. Each begins at a cache line, and no two
// have the same lane at the same place of their pages, nor nearly: such columns take turns in one set of the
// first-level cache, and the processor takes the store of one for a store to another that it is about to read. Columns
// from malloc all lie at one place of their pages, and neighbours in one large array do if its length is a multiple of
// 1,024. Large ones are on large pages where the system has them (Linux, madvise). docs/benchmarks.md has what it is
// worth.
class ColumnMemory {
 public:
  ColumnMemory() = default;
  // Throws std::bad_alloc.
  ColumnMemory(std::size_t columns, std::size_t lanes);
  // The same in memory of the caller's that begins at a page: bytes() of it, for as long as it is used.
  ColumnMemory(void* memory, std::size_t columns, std::size_t lanes);

  std::size_t columns() const { return columns_; }
  std::size_t lanes() const { return lanes_; }
  // index < columns().
  float* operator[](std::size_t index) const { return data_.get() + index * stride_; }

  // Bytes that it takes, without rounding to large pages.
  static std::size_t bytes(std::size_t columns, std::size_t lanes);

 private:
  static constexpr std::size_t kLargePage = std::size_t{2} << 20;
  struct Free {
    Free() : owned(true) {}
    explicit Free(bool is_owned) : owned(is_owned) {}
    void operator()(float* p) const {
      if (owned) ::operator delete[](p, std::align_val_t{kLargePage});
    }
    bool owned;
  };
  std::size_t columns_ = 0, lanes_ = 0, stride_ = 0;
  std::unique_ptr<float[], Free> data_;
};

}  // namespace facetwise
