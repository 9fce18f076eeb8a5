// SPDX-License-Identifier: Apache-2.0
// How calls become messages: a batch's lanes in pieces, each a request of its own.
#pragma once

#include <algorithm>
#include <cstddef>

#include "facetwise/engine.h"
#include "facetwise/shared_memory.h"
#include "src/pipeline.h"

namespace facetwise {

// The lanes of a call, in order: all of them, or those of its active list.
class Positions {
 public:
  Positions(std::size_t lanes, const std::optional<std::span<const std::uint32_t>>& active)
      : active_(active ? active->data() : nullptr), count_(active ? active->size() : lanes) {}

  std::size_t count() const { return count_; }
  bool all() const { return active_ == nullptr; }
  std::size_t lane(std::size_t position) const { return active_ ? active_[position] : position; }

 private:
  const std::uint32_t* active_;
  std::size_t count_;
};

// A piece: positions [begin, end).
struct Range {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

// Splits `count` positions into pieces of about the same size, none above `most` (which is 1 or more).
class Split {
 public:
  Split(std::size_t count, std::size_t most) : count_(count) {
    const std::size_t pieces = (count + most - 1) / most;
    size_ = pieces == 0 ? 1 : (count + pieces - 1) / pieces;
    // Whole vectors where that fits.
    if (size_ % 16 != 0 && size_ / 16 * 16 + 16 <= most) size_ = size_ / 16 * 16 + 16;
  }
  std::size_t pieces() const { return (count_ + size_ - 1) / size_; }
  Range range(std::size_t piece) const { return {piece * size_, std::min(count_, (piece + 1) * size_)}; }

 private:
  std::size_t count_, size_;
};

// What the pieces must respect.
struct PieceLimits {
  std::size_t piece_bytes;    // wanted
  std::size_t message_bytes;  // the servers' limit
  // The most lanes of a piece with so many bytes a lane in the request and in the response.
  std::size_t lanes(std::size_t request_bytes, std::size_t response_bytes) const {
    constexpr std::size_t kOtherBytes = 1024;  // small fields, lengths, columns of one value
    const std::size_t limit = message_bytes - std::min(message_bytes / 2, kOtherBytes);
    // Where nothing is sent a piece's work is what counts, as far as servers take so many lanes.
    constexpr std::size_t kMost = std::size_t{1} << 20;
    if (request_bytes + response_bytes == 0) return std::min(kMost, limit / 4);
    const std::size_t bytes = std::max<std::size_t>({request_bytes, response_bytes, 4});  // 4: the lane limit
    return std::max<std::size_t>(std::min(piece_bytes, limit) / bytes, 1);
  }
};

// The pieces of a checked call. They refer to the call's columns.
class BatchPieces {
 public:
  // Columns in `shared`, if there is any, are named instead of sent.
  // `compact`: directions and weights are asked for in half their bytes.
  BatchPieces(Operation operation, const Batch& batch, const PieceLimits& limits, const SharedMemory* shared,
              bool compact);
  Pieces pieces();
  const Statistics& statistics() const { return statistics_; }

 private:
  grpc::ByteBuffer encode(std::size_t piece) const;
  absl::Status decode(std::size_t piece, grpc::ByteBuffer& response);
  template <class AnyColumn>
  bool is_shared(const AnyColumn& column) const;
  std::size_t most_lanes(const PieceLimits& limits);

  Operation operation_;
  Batch batch_;
  Positions positions_;
  const SharedMemory* shared_;
  bool compact_;
  bool sends_ids_;
  unsigned outputs_ = 0, shared_outputs_ = 0;  // bit (1 << v1::Output): those that are sent, and those in shared memory
  Split split_;
  Statistics statistics_;
};

class CompactPieces {
 public:
  CompactPieces(const Compaction& compaction, const PieceLimits& limits);
  Pieces pieces();
  std::size_t accepted() const { return first_.back(); }

 private:
  grpc::ByteBuffer encode(std::size_t piece);
  absl::Status decode(std::size_t piece, grpc::ByteBuffer& response) const;

  const Compaction& compaction_;
  Positions positions_;
  Split split_;
  // Of each piece: accepted lanes before it. Known when it is sent, since the status column is here.
  std::vector<std::size_t> first_;
};

}  // namespace facetwise
