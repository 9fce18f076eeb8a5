// SPDX-License-Identifier: Apache-2.0
// Keeps several calls in flight over the connections, from the calling thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "facetwise/channel.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "src/memory_offer.h"

namespace facetwise {

struct Connection {
  Channel channel;
  std::unique_ptr<grpc::GenericStub> stub;
  std::shared_ptr<MemoryOffer> memory{};  // where memory is shared
};

// A batch's way through: pieces are numbered; each becomes a request, and its response is taken apart.
struct Pieces {
  std::string method;
  std::size_t count = 0;
  std::function<grpc::ByteBuffer(std::size_t piece)> encode;
  std::function<absl::Status(std::size_t piece, grpc::ByteBuffer& response)> decode;
  // Gives a server what it says that it has not found; the piece is sent again. May be empty.
  std::function<absl::Status(const Connection& connection)> provide = {};
};

// Some milliseconds, in which connections get further: gRPC makes them only while somebody waits for one.
void wait_a_moment(grpc::Channel& channel);

// Sends the pieces, at most options.window at a time, to the servers that are there, and takes the responses as they come. A
// piece whose server is lost, busy or silent is sent again, to another or later, as long as some server answers, or did
// within options.connect_timeout. Any other error ends it: calls in flight are cancelled and waited for. `turn` says which server
// is the first to be asked where several are as free: the next one each time, so that small batches go round.
absl::Status send(const std::vector<Connection>& connections, const ConnectOptions& options, const Pieces& pieces,
                  std::size_t turn);

}  // namespace facetwise
