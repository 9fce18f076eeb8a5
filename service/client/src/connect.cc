#include "absl/strings/str_cat.h"
#include "facetwise/client.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/pieces.h"
#include "src/pipeline.h"
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

// Why a server does not answer that was not waited for: gRPC tells only then.
std::string reason(const Channel& channel) {
  v1::InfoResponse info;
  const auto until = std::chrono::system_clock::now() + std::chrono::milliseconds(500);
  const grpc::Status status = ask_info(channel, until, false, info);
  return status.error_code() == grpc::StatusCode::UNAVAILABLE ? absl::StrCat(" (", status.error_message(), ")") : "";
}

}  // namespace

absl::StatusOr<std::unique_ptr<Engine>> connect(std::span<const std::string> addresses, const ConnectOptions& options) {
  if (addresses.empty()) return absl::InvalidArgumentError("address: none given");
  if (options.piece_bytes == 0) return absl::InvalidArgumentError("piece_bytes: 0");
  if (options.window < 1) return absl::InvalidArgumentError("window: below 1");
  std::vector<Connection> connections;
  for (const std::string& address : addresses) {  // all at once
    auto channel = open_channel(address, options);
    if (!channel.ok()) return channel.status();
    auto stub = std::make_unique<grpc::GenericStub>(channel->channel);
    connections.push_back({*std::move(channel), std::move(stub)});
  }
  std::size_t message_bytes = std::size_t{1} << 30;
  const auto until = std::chrono::system_clock::now() + options.connect_timeout;
  for (const auto& [channel, stub] : connections) {
    v1::InfoResponse info;
    const grpc::Status status = ask_info(channel, until, true, info);
    if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED)
      return absl::UnavailableError(absl::StrCat("server ", channel.address, ": no answer within ",
                                                 options.connect_timeout.count(), " ms: is it started?",
                                                 reason(channel)));
    if (!status.ok()) return wire::from_grpc(status, channel.address);
    message_bytes = std::min<std::size_t>(message_bytes, info.max_message_bytes());
  }
  if (message_bytes < 4096)
    return absl::FailedPreconditionError(absl::StrCat("a server takes messages of ", message_bytes, " bytes only"));
  return std::make_unique<RemoteEngine>(std::move(connections), options, message_bytes);
}

}  // namespace facetwise
