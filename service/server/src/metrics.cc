// SPDX-License-Identifier: Apache-2.0
#include "src/metrics.h"

#include <exception>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "prometheus/collectable.h"

namespace facetwise {
namespace {

// From a small batch in the cache to one that waits behind many.
const prometheus::Histogram::BucketBoundaries kSeconds = {1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2,
                                                          5e-2, 0.1,  0.2,  0.5,  1,    2,    5,    10};

prometheus::Family<prometheus::Counter>& counters(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

}  // namespace

// What is looked at when it is asked for.
class Metrics::Gauges final : public prometheus::Collectable {
 public:
  Gauges(const v1::InfoResponse& info, std::function<v1::ServerLoad()> load) : info_(info), load_(std::move(load)) {}

  std::vector<prometheus::MetricFamily> Collect() const override {
    const v1::ServerLoad load = load_();
    const v1::ServerLimits& limits = info_.limits();
    std::vector<prometheus::MetricFamily> families;
    const auto add = [&](const char* name, const char* help, double value,
                         std::vector<prometheus::ClientMetric::Label> labels = {}) {
      prometheus::ClientMetric metric;
      metric.label = std::move(labels);
      metric.gauge.value = value;
      families.push_back({name, help, prometheus::MetricType::Gauge, {metric}});
    };
    const auto add_limited = [&](const std::string& name, const std::string& help, double value, double limit) {
      add(name.c_str(), help.c_str(), value);
      add((name + "_limit").c_str(), (help + ": most").c_str(), limit);
    };
    add("facetwise_info", "1; the labels say what the server is", 1,
        {{"version", info_.version()}, {"target", info_.target()}, {"cpu", info_.cpu()}});
    add("facetwise_serving", "1; 0 as soon as it drains", load.serving() ? 1 : 0);
    add("facetwise_threads", "Threads that compute", info_.threads());
    add("facetwise_uptime_seconds", "Since the start", load.uptime_seconds());
    add_limited("facetwise_calls_working", "Calls that are worked on, until their answers have left", load.calls(),
                limits.calls());
    add_limited("facetwise_calls_open", "Calls, those that wait for their client among them", load.open_calls(),
                limits.open_calls());
    add_limited("facetwise_held_bytes", "Messages received and decoded, and answers that have not left",
                static_cast<double>(load.held_bytes()), static_cast<double>(limits.held_bytes()));
    add_limited("facetwise_connections", "Connections", load.connections(), limits.connections());
    add_limited("facetwise_table_bytes", "Tables of slopes that clients have uploaded",
                static_cast<double>(load.table_bytes()), static_cast<double>(limits.table_bytes()));
    add_limited("facetwise_shared_bytes", "Memory that clients on this machine share",
                static_cast<double>(load.shared_bytes()), static_cast<double>(limits.shared_bytes()));
    return families;
  }

 private:
  const v1::InfoResponse info_;
  const std::function<v1::ServerLoad()> load_;
};

Metrics::Metrics(const v1::InfoResponse& info, std::function<v1::ServerLoad()> load)
    : registry_(std::make_shared<prometheus::Registry>()),
      calls_(counters(*registry_, "facetwise_calls_total", "Calls that have ended, by method and gRPC status")),
      lanes_of_(counters(*registry_, "facetwise_lanes_total", "Lanes computed, by what became of them")),
      bytes_(counters(*registry_, "facetwise_message_bytes_total", "Bytes of batches received and of answers sent")),
      seconds_(prometheus::BuildHistogram()
                   .Name("facetwise_answer_seconds")
                   .Help("From a whole batch received to its answer made")
                   .Register(*registry_)),
      gauges_(std::make_shared<Gauges>(info, std::move(load))) {}

Metrics::~Metrics() = default;

void Metrics::call_ended(absl::string_view method, grpc::StatusCode code) {
  calls_.Add({{"method", std::string(method)}, {"code", absl::StatusCodeToString(static_cast<absl::StatusCode>(code))}})
      .Increment();
}

void Metrics::answered(absl::string_view method, std::chrono::duration<double> time, std::size_t received,
                       std::size_t sent) {
  const std::string name(method);
  seconds_.Add({{"method", name}}, kSeconds).Observe(time.count());
  bytes_.Add({{"method", name}, {"way", "received"}}).Increment(static_cast<double>(received));
  bytes_.Add({{"method", name}, {"way", "sent"}}).Increment(static_cast<double>(sent));
}

void Metrics::computed(Operation operation, const Model& model, Sampler sampler, const Statistics& statistics) {
  lanes_.fetch_add(statistics.lanes(), std::memory_order_relaxed);
  const auto add = [&](LaneStatus status, std::uint64_t count) {
    if (count == 0) return;
    lanes_of_
        .Add({{"operation", std::string(name(operation))},
              {"distribution", std::string(name(model.distribution))},
              {"masking", std::string(name(model.masking))},
              {"sampler", std::string(name(sampler))},
              {"status", std::string(name(status))}})
        .Increment(static_cast<double>(count));
  };
  add(LaneStatus::accepted, statistics.accepted);
  add(LaneStatus::occluded, statistics.occluded);
  add(LaneStatus::smooth, statistics.smooth);
  add(LaneStatus::invalid, statistics.invalid);
}

absl::StatusOr<std::string> Metrics::listen(const std::string& address) {
  const auto colon = address.rfind(':');
  const std::string host = address.substr(0, colon) == "localhost" ? "127.0.0.1" : address.substr(0, colon);
  try {
    // Three threads of its own: one accepts, two answer.
    exposer_ = std::make_unique<prometheus::Exposer>(host + address.substr(colon));
    exposer_->RegisterCollectable(registry_);
    exposer_->RegisterCollectable(gauges_);
    return absl::StrCat(host, ":", exposer_->GetListeningPorts().at(0));
  } catch (const std::exception&) {
    return absl::UnavailableError(absl::StrCat(
        "metrics: ", address, ": cannot listen there: another has it, or it is no address of this machine"));
  }
}

}  // namespace facetwise
