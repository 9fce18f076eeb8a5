// SPDX-License-Identifier: Apache-2.0
// What the tests of the protocol itself share: stubs to one server, and a request that is good.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/v1/sampler.grpc.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"

namespace facetwise::testing {

inline std::string floats(std::size_t count, float value) {
  const std::vector<float> values(count, value);
  return {reinterpret_cast<const char*>(values.data()), count * sizeof(float)};
}

// `reads_ahead`: takes more of an answer than 64 KiB before it is read.
inline std::shared_ptr<grpc::Channel> open_channel(const std::string& address, bool reads_ahead = true) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  if (!reads_ahead) arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// sample_reflection with the exact sampler, every column one per lane, all outputs.
inline v1::BatchRequest good_request(std::size_t lanes) {
  v1::BatchRequest request;
  request.set_operation(v1::SAMPLE_REFLECTION);
  request.set_lanes(lanes);
  request.mutable_incident()->set_x(floats(lanes, 0.6f));
  request.mutable_incident()->set_y(floats(lanes, 0.0f));
  request.mutable_incident()->set_z(floats(lanes, 0.8f));
  request.set_alpha_x(floats(lanes, 0.5f));
  request.set_alpha_y(floats(lanes, 0.25f));
  request.set_u1(floats(lanes, 0.125f));
  request.set_u2(floats(lanes, 0.75f));
  request.set_u3(floats(lanes, 0.5f));
  for (const v1::Output output : {v1::OUTGOING, v1::NORMAL, v1::INCIDENT_DOT_NORMAL, v1::PDF, v1::WEIGHT, v1::STATUS})
    request.add_outputs(output);
  return request;
}

// One lane by sample_reflection: its weight, in (0.5, 1], or why not.
inline absl::StatusOr<float> sample_one(Engine& engine) {
  float weight = 0;
  Batch batch;
  batch.lanes = 1;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.5f;
  batch.u1 = batch.u2 = batch.u3 = 0.25f;
  batch.out.weight = {&weight, 1};
  if (const auto status = engine.sample_reflection(batch).status(); !status.ok()) return status;
  return weight;
}

// Calls that have begun and send nothing.
class SilentCalls {
 public:
  explicit SilentCalls(std::shared_ptr<grpc::Channel> channel) : stub_(std::move(channel)) {}
  ~SilentCalls() {
    for (auto& call : calls_) call->context.TryCancel();
    end();
  }
  SilentCalls(const SilentCalls&) = delete;
  SilentCalls& operator=(const SilentCalls&) = delete;

  // "/package.Service/Method". Returns when it has begun.
  void begin(const std::string& method) {
    auto& call = *calls_.emplace_back(std::make_unique<Call>());
    call.stream = stub_.PrepareCall(&call.context, method, &queue_);
    call.stream->StartCall(&call);
    wait();
  }
  // Waits until the server has ended all of them.
  std::vector<grpc::Status> end() {
    std::vector<grpc::Status> statuses(calls_.size());
    for (std::size_t k = 0; k < calls_.size(); ++k) {
      calls_[k]->stream->Finish(&statuses[k], nullptr);
      wait();
    }
    calls_.clear();
    return statuses;
  }

 private:
  struct Call {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream;
  };
  void wait() {
    void* tag = nullptr;
    bool good = false;
    queue_.Next(&tag, &good);
  }

  grpc::GenericStub stub_;
  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<Call>> calls_;
};

}  // namespace facetwise::testing
