// SPDX-License-Identifier: Apache-2.0
// The bearer tokens that calls must carry.
#pragma once

#include <sys/stat.h>

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "grpcpp/server_context.h"
#include "src/log.h"

namespace facetwise {

// Of a file that is read again within a second of a change. A file that has become unreadable changes nothing.
class Tokens {
 public:
  // Without a path every call is allowed.
  Tokens(std::string path, Log& log) : path_(std::move(path)), log_(log) {}
  // Error: the file, and why.
  absl::Status read();

  // OK or UNAUTHENTICATED.
  absl::Status check(const grpc::CallbackServerContext& context);

 private:
  void read_if_changed();

  const std::string path_;
  Log& log_;
  std::mutex mutex_;
  std::vector<std::string> tokens_;
  struct stat seen_ {};
  std::chrono::steady_clock::time_point looked_;
};

}  // namespace facetwise
