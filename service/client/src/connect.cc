// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>

#include "absl/strings/str_cat.h"
#include "facetwise/client.h"
#include "facetwise/remote_tables.h"
#include "facetwise/v1/sampler.pb.h"
#include "src/pieces.h"
#include "src/pipeline.h"
#include "wire/status.h"

namespace facetwise {
namespace {

// Columns of one Compact call that servers take.
constexpr std::size_t kMostCompactColumns = 64;

// Gives it the shared memory. OK also where it is not there: it is asked again when it says that it has none.
absl::Status offer(const Connection& connection) {
  const absl::Status status = connection.memory->make();
  if (status.ok() || absl::IsUnavailable(status)) return absl::OkStatus();
  return {status.code(), absl::StrCat("server ", connection.channel.address, ": ", status.message())};
}

class RemoteEngine final : public Engine {
 public:
  RemoteEngine(std::vector<Connection> connections, const ConnectOptions& options, std::size_t message_bytes)
      : connections_(std::move(connections)), options_(options), limits_{options.piece_bytes, message_bytes} {}

  absl::StatusOr<Statistics> run(Operation operation, const Batch& batch) override {
    if (auto status = check(operation, batch); !status.ok()) return status;
    BatchPieces batch_pieces(operation, batch, limits_, options_.shared_memory.get(), options_.compact_answers);
    Pieces pieces = batch_pieces.pieces();
    const SlopeTable* table = batch.model.table.get();
    // A server that is not there gets what it needs when it is; one that has lost it (started again, not used for long) says so.
    if (table != nullptr || options_.shared_memory != nullptr)
      pieces.provide = [this, table](const Connection& connection) {
        if (connection.memory != nullptr)
          if (auto status = offer(connection); !status.ok()) return status;
        return table == nullptr ? absl::OkStatus() : upload(connection.channel, *table);
      };
    if (table != nullptr)
      if (auto status = upload_to_all(*table); !status.ok()) return status;
    if (auto status = send(connections_, options_, pieces, turn_.fetch_add(1, std::memory_order_relaxed)); !status.ok())
      return status;
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
      if (auto status = send(connections_, options_, pieces, turn_.fetch_add(1, std::memory_order_relaxed));
          !status.ok())
        return status;
      accepted = compact_pieces.accepted();
      begin += part.columns.size();
    } while (begin < compaction.columns.size());
    return accepted;
  }

 private:
  absl::Status upload(const Channel& channel, const SlopeTable& table) const {
    const std::size_t piece = std::min(limits_.piece_bytes, limits_.message_bytes / 2);
    return upload_table(channel, table, piece, std::chrono::system_clock::now() + options_.call_timeout);
  }
  // Once, so that not each server's first piece fails.
  absl::Status upload_to_all(const SlopeTable& table) {
    const std::lock_guard lock(uploaded_mutex_);
    if (uploaded_.contains(table.id())) return absl::OkStatus();
    for (const Connection& connection : connections_)
      if (auto status = upload(connection.channel, table);
          !status.ok() && !absl::IsUnavailable(status) && !absl::IsDeadlineExceeded(status))
        return status;
    uploaded_.insert(table.id());
    return absl::OkStatus();
  }

  const std::vector<Connection> connections_;
  const ConnectOptions options_;
  const PieceLimits limits_;
  std::atomic<std::size_t> turn_{0};
  std::mutex uploaded_mutex_;
  std::set<std::uint64_t> uploaded_;  // by SlopeTable::id()
};

// Why a server does not answer. gRPC says it only to a call that does not wait for the connection.
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
    std::shared_ptr<MemoryOffer> memory;
    if (options.shared_memory != nullptr) {
      if (!address.starts_with("unix:"))
        return absl::InvalidArgumentError(
            absl::StrCat("shared_memory: ", address, " is no Unix socket of this machine"));
      memory = std::make_shared<MemoryOffer>(options.shared_memory, address);
    }
    connections.push_back({*std::move(channel), std::move(stub), std::move(memory)});
  }
  // Each is asked once its connection stands. When one has answered, the others get kMore: they may come later.
  constexpr std::chrono::milliseconds kMore{500};
  std::size_t message_bytes = std::size_t{1} << 30;
  auto until = std::chrono::system_clock::now() + options.connect_timeout;
  std::vector<const Connection*> silent;
  for (const Connection& connection : connections) silent.push_back(&connection);
  for (bool last_look = false; !silent.empty() && !last_look;) {
    last_look = std::chrono::system_clock::now() >= until;
    for (std::size_t k = 0; k < silent.size();) {
      const Connection& connection = *silent[k];
      const Channel& channel = connection.channel;
      v1::InfoResponse info;
      grpc::Status status(grpc::StatusCode::UNAVAILABLE, "");
      if (channel.channel->GetState(true) == GRPC_CHANNEL_READY) status = ask_info(channel, until, false, info);
      if (status.error_code() == grpc::StatusCode::UNAVAILABLE ||
          status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED ||
          status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
        ++k;
        continue;
      }
      if (!status.ok()) return wire::from_grpc(status, channel.address);
      message_bytes = std::min<std::size_t>(message_bytes, info.max_message_bytes());
      if (connection.memory != nullptr && info.limits().shared_bytes() == 0)
        return absl::FailedPreconditionError(
            absl::StrCat("server ", channel.address, ": shares no memory: start it with --shared-memory-mib"));
      if (connection.memory != nullptr)
        if (auto offered = offer(connection); !offered.ok()) return offered;
      silent.erase(silent.begin() + static_cast<std::ptrdiff_t>(k));
      until = std::min(until, std::chrono::system_clock::now() + kMore);
    }
    if (!silent.empty() && !last_look) wait_a_moment(*silent[0]->channel.channel);
  }
  if (silent.size() == connections.size())
    return absl::UnavailableError(absl::StrCat("server ", silent[0]->channel.address, ": no answer within ",
                                               options.connect_timeout.count(), " ms: is it started?",
                                               reason(silent[0]->channel)));
  for (const Connection* connection : silent)
    if (options.absent)
      options.absent(
          absl::StrCat("server ", connection->channel.address, ": no answer yet", reason(connection->channel)));
  if (message_bytes < 4096)
    return absl::FailedPreconditionError(absl::StrCat("a server takes messages of ", message_bytes, " bytes only"));
  return std::make_unique<RemoteEngine>(std::move(connections), options, message_bytes);
}

}  // namespace facetwise
