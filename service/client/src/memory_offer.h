// SPDX-License-Identifier: Apache-2.0
// Gives a server the memory that a client shares with it, as often as the server needs it.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "facetwise/shared_memory.h"

namespace facetwise {

class MemoryOffer {
 public:
  // address: unix:PATH.
  MemoryOffer(std::shared_ptr<const SharedMemory> memory, const std::string& address);
  ~MemoryOffer();  // the server lets it go
  MemoryOffer(const MemoryOffer&) = delete;
  MemoryOffer& operator=(const MemoryOffer&) = delete;

  // Hands it over, unless the server that was given it still stands. Unavailable: no server is there that shares
  // memory; PermissionDenied: it refuses this one, and why.
  absl::Status make();
  // Whether the server that had it is no more, so that it writes nothing there. Waits a moment for that: its other connections
  // may end first.
  bool has_ended();

 private:
  const std::shared_ptr<const SharedMemory> memory_;
  const std::string path_;
  std::mutex mutex_;
  int socket_ = -1;  // stands as long as the server has the memory
};

}  // namespace facetwise
