#include "absl/strings/str_cat.h"
#include "facetwise/client.h"
#include "facetwise/v1/sampler.grpc.pb.h"
#include "src/pieces.h"
#include "src/pipeline.h"
#include "wire/keep_grpc.h"
#include "wire/status.h"

namespace facetwise {
namespace {

// Columns of one Compact call that servers take.
constexpr std::size_t kMostCompactColumns = 64;

class RemoteEngine final : public Engine {
 public:
  RemoteEngine(std::vector<Connection> connections, const ConnectOptions& options, std::size_t message_bytes)
      : connections_(std::move(connections)), options_(options), limits_{options.piece_bytes, message_bytes} {}

  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    if (auto status = check(operation, batch); !status.ok()) return status;
    BatchPieces batch_pieces(operation, batch, limits_);
    const Pieces pieces = batch_pieces.pieces();
    if (auto status = send(connections_, options_, pieces); !status.ok()) return status;
    return batch_pieces.statistics();
  }

  absl::StatusOr<std::size_t> compact(const Compaction& compaction) override {
    if (auto status = check(compaction); !status.ok()) return status;
    // More columns than a call takes go in several, each with the same lanes.
    std::size_t accepted = 0, begin = 0;
    do {
      Compaction part = compaction;
      part.columns =
          compaction.columns.subspan(begin, std::min(kMostCompactColumns, compaction.columns.size() - begin));
      if (begin > 0) part.index = {};
      CompactPieces compact_pieces(part, limits_);
      const Pieces pieces = compact_pieces.pieces();
      if (auto status = send(connections_, options_, pieces); !status.ok()) return status;
      accepted = compact_pieces.accepted();
      begin += part.columns.size();
    } while (begin < compaction.columns.size());
    return accepted;
  }

 private:
  const std::vector<Connection> connections_;
  const ConnectOptions options_;
  const PieceLimits limits_;
};

bool is_unix(const std::string& address) { return address.starts_with("unix:"); }

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost:") || address.starts_with("[::1]:");
}

grpc::ChannelArguments channel_arguments(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // Without keepalive a server that was stopped or cut off costs each call its whole deadline.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  // A server that starts again is found within a second.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // Engines do not share connections, whatever process-wide state they would come from.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Estimating the bandwidth helps over distance and over Unix sockets; on loopback TCP its pings only cost.
  if (is_loopback(address)) arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  return arguments;
}

absl::Status check_address(const std::string& address) {
  const auto colon = address.rfind(':');
  if (is_unix(address) ? address.size() > 5 : colon != std::string::npos && colon > 0 && colon + 1 < address.size())
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("address: \"", address, "\" is neither unix:PATH nor HOST:PORT"));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Engine>> connect(std::span<const std::string> addresses, const ConnectOptions& options) {
  if (addresses.empty()) return absl::InvalidArgumentError("address: none given");
  if (options.piece_bytes == 0) return absl::InvalidArgumentError("piece_bytes: 0");
  if (options.window < 1) return absl::InvalidArgumentError("window: below 1");
  for (const std::string& address : addresses)
    if (auto status = check_address(address); !status.ok()) return status;

  wire::keep_grpc();
  std::vector<Connection> connections;
  for (const std::string& address : addresses) {
    auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), channel_arguments(address));
    channel->GetState(true);  // begins to connect: all at once
    connections.push_back({address, channel, std::make_unique<grpc::GenericStub>(channel)});
  }
  std::size_t message_bytes = std::size_t{1} << 30;
  const auto until = std::chrono::system_clock::now() + options.connect_timeout;
  for (const Connection& connection : connections) {
    grpc::ClientContext context;
    context.set_deadline(until);
    context.set_wait_for_ready(true);
    v1::InfoResponse info;
    const grpc::Status status = v1::Sampler::NewStub(connection.channel)->Info(&context, {}, &info);
    if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED)
      return absl::UnavailableError(absl::StrCat("server ", connection.address, ": no answer within ",
                                                 options.connect_timeout.count(), " ms: is it started?"));
    if (!status.ok()) return wire::from_grpc(status, connection.address);
    message_bytes = std::min<std::size_t>(message_bytes, info.max_message_bytes());
  }
  if (message_bytes < 4096)
    return absl::FailedPreconditionError(absl::StrCat("a server takes messages of ", message_bytes, " bytes only"));
  return std::make_unique<RemoteEngine>(std::move(connections), options, message_bytes);
}

}  // namespace facetwise
