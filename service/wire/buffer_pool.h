// SPDX-License-Identifier: Apache-2.0
// Memory for messages: blocks that are used again, so that a stream of large messages neither allocates nor
// clears pages.
#pragma once

#include <cstddef>

#include "grpcpp/support/slice.h"

namespace facetwise::wire {

// Uninitialised memory, aligned to 64 bytes, owned until destruction or until a slice takes it.
class Block {
 public:
  Block() = default;
  explicit Block(std::size_t bytes);
  ~Block();
  Block(Block&& other) noexcept;
  Block& operator=(Block&& other) noexcept;

  char* data() const { return data_; }
  std::size_t size() const { return size_; }
  // The same memory as a slice, which gives it back when its last reference goes.
  grpc::Slice into_slice() &&;

 private:
  char* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace facetwise::wire
