// SPDX-License-Identifier: Apache-2.0
// What it costs to ask a server: beside one that does nothing, and beside computing here.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/client.h"

namespace facetwise::app {

// The servers to compare, at the same kinds of address.
struct TransportPair {
  std::string name;  // "Unix socket", "TCP", "TLS"
  std::string echo, facetwise;
  ConnectOptions connection;
};

struct TransportOptions {
  std::vector<TransportPair> pairs;
  std::string shared;    // of a server that shares memory; empty: not measured
  double seconds = 0.4;  // of each measurement; the median of five counts
};

// Answers to raw messages of so many lanes, four at a time, in millions of lanes a second: by the echo server, with answers of
// the same size, and by facetwise.
struct TransportRate {
  std::string transport;
  bool stream;
  std::size_t lanes;
  double echo, facetwise;
  double ratio;  // the median of those of neighbouring measurements
};
// One message of 64 lanes after another, microseconds.
struct TransportDelay {
  std::string transport;
  double echo_p50, echo_p99, facetwise_p50, facetwise_p99;
};
// A batch through the library, nanoseconds a sample.
struct TransportCost {
  std::string way;
  std::size_t lanes;
  double nanoseconds;
};
struct TransportResult {
  std::vector<TransportRate> rates;
  std::vector<TransportDelay> delays;
  std::vector<TransportCost> costs;
};

absl::StatusOr<TransportResult> measure_transport(const TransportOptions& options,
                                                  const std::function<void(double)>& progress);

}  // namespace facetwise::app
