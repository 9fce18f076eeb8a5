// SPDX-License-Identifier: Apache-2.0
// Benchmarks of a server's own machine: between the bench library and the protocol's messages.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "facetwise/bench.h"
#include "facetwise/client.h"
#include "facetwise/server.h"

namespace facetwise::app {

// What a server runs for a Benchmark call. Cheap to call: nothing runs until the call comes.
BenchmarkRunner benchmark_runner(Target target, int threads);

// Asks a server to benchmark its machine. `progress` is called after each result. Errors begin with
// "server ADDRESS:".
absl::StatusOr<BenchReport> benchmark_server(const std::string& address, const ConnectOptions& options,
                                             const std::string& filter, double min_seconds,
                                             const BenchCallback& progress);

}  // namespace facetwise::app
