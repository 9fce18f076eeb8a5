// SPDX-License-Identifier: Apache-2.0
// Memory that a program shares with facetwise servers on its own machine: columns that lie in it are read and written there by
// the servers, and are not sent.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "facetwise/column_memory.h"

namespace facetwise {

//   auto memory = SharedMemory::make(ColumnMemory::bytes(12, lanes));
//   auto engine = connect(servers, {.shared_memory = *memory});        // unix:PATH, started with --shared-memory-mib
//   ColumnMemory columns((*memory)->data(), 12, lanes);                // then use it as any other
//
// A file of memory (memfd) of fixed size, which goes with the last that has it. The servers see what is in it, and change it, only
// while a call of this program uses it; so columns of a call must be left alone until it has ended, and after a call that failed
// with Cancelled, DeadlineExceeded or Unavailable a server may still be writing the outputs.
class SharedMemory {
 public:
  // ResourceExhausted where the system has not so much. bytes: 1 or more.
  static absl::StatusOr<std::shared_ptr<SharedMemory>> make(std::size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  // Begins at a page.
  void* data() const { return data_; }
  std::size_t bytes() const { return bytes_; }
  // Whether all of [begin, begin + bytes) lies in it.
  bool holds(const void* begin, std::size_t bytes) const;

  // What servers know it by, and its file, which stays this object's.
  std::uint64_t id() const { return id_; }
  int file() const { return file_; }

 private:
  SharedMemory(int file, void* data, std::size_t bytes, std::uint64_t id)
      : file_(file), data_(data), bytes_(bytes), id_(id) {}

  const int file_;
  void* const data_;
  const std::size_t bytes_;
  const std::uint64_t id_;
};

}  // namespace facetwise
