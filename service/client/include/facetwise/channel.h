// SPDX-License-Identifier: Apache-2.0
// A connection to one server, for the calls that the engine does not make: Info, Benchmark and those of tables.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "facetwise/client.h"
#include "grpcpp/grpcpp.h"

namespace facetwise {

namespace v1 {
class InfoResponse;
}

struct Channel {
  std::string address;
  std::shared_ptr<grpc::Channel> channel;
  std::string authorization;  // "Bearer TOKEN", or empty

  // Call it on the context of each call.
  void authorise(grpc::ClientContext& context) const {
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
  }
};

// Begins to connect; does not wait. InvalidArgument and NotFound as connect().
absl::StatusOr<Channel> open_channel(const std::string& address, const ConnectOptions& options);

// What the server says of itself, until the time given. With `waits` a server that is not there yet is waited for; without,
// the status says why there is no connection.
grpc::Status ask_info(const Channel& channel, std::chrono::system_clock::time_point until, bool waits,
                      v1::InfoResponse& info);

}  // namespace facetwise
