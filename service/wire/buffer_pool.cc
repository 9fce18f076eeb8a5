// SPDX-License-Identifier: Apache-2.0
#include "wire/buffer_pool.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace facetwise::wire {
namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kSmallest = 4096;
constexpr std::size_t kMostKept = std::size_t{128} << 20;  // bytes that wait in the pool, at most

// Free blocks by size, powers of two. A block's class stands in the alignment gap before it.
class Pool {
 public:
  char* take(std::size_t bytes) {
    const std::size_t size = std::bit_ceil(std::max(bytes, kSmallest));
    const auto which = static_cast<std::size_t>(std::countr_zero(size));
    {
      const std::lock_guard lock(mutex_);
      if (auto& blocks = free_[which]; !blocks.empty()) {
        char* block = blocks.back();
        blocks.pop_back();
        kept_ -= size;
        return block;
      }
    }
    void* memory = std::aligned_alloc(kAlignment, size + kAlignment);
    if (memory == nullptr) throw std::bad_alloc();
    char* block = static_cast<char*>(memory) + kAlignment;
    class_of(block) = which;
    return block;
  }

  void give_back(char* block) {
    const std::size_t which = class_of(block);
    const std::size_t size = std::size_t{1} << which;
    {
      const std::lock_guard lock(mutex_);
      if (kept_ + size <= kMostKept) {
        free_[which].push_back(block);
        kept_ += size;
        return;
      }
    }
    std::free(block - kAlignment);
  }

 private:
  static std::size_t& class_of(char* block) { return *reinterpret_cast<std::size_t*>(block - kAlignment); }

  std::mutex mutex_;
  std::array<std::vector<char*>, 64> free_;
  std::size_t kept_ = 0;
};

// Never destroyed: gRPC may let go of the last slices at exit.
Pool& pool() {
  static Pool& instance = *new Pool;
  return instance;
}

}  // namespace

Block::Block(std::size_t bytes) : data_(pool().take(bytes)), size_(bytes) {}

Block::~Block() {
  if (data_) pool().give_back(data_);
}

Block::Block(Block&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

Block& Block::operator=(Block&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  return *this;
}

grpc::Slice Block::into_slice() && {
  char* data = std::exchange(data_, nullptr);
  return grpc::Slice(
      data, std::exchange(size_, 0), [](void* block) { pool().give_back(static_cast<char*>(block)); }, data);
}

}  // namespace facetwise::wire
