// SPDX-License-Identifier: Apache-2.0
// What a server counts, for Prometheus to fetch.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "facetwise/batch.h"
#include "facetwise/v1/sampler.pb.h"
#include "grpcpp/support/status.h"
#include "prometheus/counter.h"
#include "prometheus/exposer.h"
#include "prometheus/family.h"
#include "prometheus/histogram.h"
#include "prometheus/registry.h"

namespace facetwise {

class Metrics {
 public:
  // `info` says what the server is and may hold; `load` what it holds now.
  Metrics(const v1::InfoResponse& info, std::function<v1::ServerLoad()> load);
  ~Metrics();

  // A call has ended.
  void call_ended(absl::string_view method, grpc::StatusCode code);
  // A message has its answer: after how long, and how large both are.
  void answered(absl::string_view method, std::chrono::duration<double> time, std::size_t received, std::size_t sent);
  // Lanes have been computed.
  void computed(Operation operation, const Model& model, Sampler sampler, const Statistics& statistics);
  std::uint64_t lanes() const { return lanes_.load(std::memory_order_relaxed); }

  // Gives what is counted at http://ADDRESS/metrics from now on, ADDRESS being IP:PORT. The address, with the port that was
  // taken for 0. Unavailable where it cannot listen there.
  absl::StatusOr<std::string> listen(const std::string& address);

 private:
  using Counters = prometheus::Family<prometheus::Counter>;
  class Gauges;

  const std::shared_ptr<prometheus::Registry> registry_;
  Counters &calls_, &lanes_of_, &bytes_;
  prometheus::Family<prometheus::Histogram>& seconds_;
  std::atomic<std::uint64_t> lanes_{0};
  const std::shared_ptr<Gauges> gauges_;
  std::unique_ptr<prometheus::Exposer> exposer_;  // goes first
};

}  // namespace facetwise
