// SPDX-License-Identifier: Apache-2.0
// Load on servers: how long calls take that come at their own times, whether or not those before them are answered.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/client.h"

namespace facetwise::app {

struct LoadOptions {
  std::vector<std::string> servers;
  ConnectOptions connection;
  std::size_t lanes = 1024;  // of a call
  double rate = 100;         // calls a second
  double seconds = 10;
  // Calls at once at most, each on a connection of its own. One that finds all of them busy waits for one, and its time runs.
  int connections = 8;
  // Callers beside these, each with calls of so many lanes one after another.
  int beside = 0;
  std::size_t beside_lanes = std::size_t{1} << 22;
};

struct LoadResult {
  std::vector<double> microseconds;  // of the calls that were answered, rising
  std::size_t failed = 0;
  std::string error;  // the first
  double seconds = 0;
  double beside_lanes_per_second = 0;

  // p in [0, 1], by the nearest rank; 0 if none was answered.
  double percentile(double p) const;
};

// A call's time is from when it was due: one that starts late because the server is slow counts the wait (no coordinated
// omission). `progress` is told the share of the time that is over; `stop` ends it early.
absl::StatusOr<LoadResult> run_load(const LoadOptions& options, const std::function<void(double)>& progress,
                                    const std::atomic<bool>& stop);

}  // namespace facetwise::app
