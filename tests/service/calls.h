// What the tests of the protocol itself share: stubs to one server, and a request that is good.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "facetwise/v1/sampler.grpc.pb.h"
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

}  // namespace facetwise::testing
