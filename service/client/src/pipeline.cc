#include "src/pipeline.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "wire/status.h"

namespace facetwise {
namespace {

struct Call {
  std::optional<grpc::ClientContext> context;
  std::unique_ptr<grpc::ClientAsyncResponseReader<grpc::ByteBuffer>> reader;
  grpc::ByteBuffer response;
  grpc::Status status;
  std::size_t piece = 0;
  std::size_t connection = 0;
  bool in_flight = false;
};

class Sender {
 public:
  Sender(const std::vector<Connection>& connections, const ConnectOptions& options, const Pieces& pieces)
      : connections_(connections),
        options_(options),
        pieces_(pieces),
        calls_(std::min<std::size_t>(std::max(options.window, 1), pieces.count)),
        load_(connections.size()) {}

  absl::Status run() {
    if (auto status = wait_for_connections(); !status.ok()) return status;
    for (Call& call : calls_) start(call);
    absl::Status error;
    while (in_flight_ > 0) {
      void* tag = nullptr;
      bool good = false;
      queue_.Next(&tag, &good);
      Call& call = *static_cast<Call*>(tag);
      absl::Status status = finish(call);
      if (error.ok() && !status.ok()) {
        error = std::move(status);
        for (Call& other : calls_)
          if (other.in_flight) other.context->TryCancel();
      }
      if (error.ok() && next_ < pieces_.count) start(call);
    }
    queue_.Shutdown();
    void* tag = nullptr;
    bool good = false;
    while (queue_.Next(&tag, &good)) {
    }
    return error;
  }

 private:
  // Calls on a connection that was lost would fail before it is made again.
  absl::Status wait_for_connections() const {
    const auto until = std::chrono::system_clock::now() + options_.connect_timeout;
    for (const auto& [connection, stub] : connections_) {
      if (connection.channel->GetState(true) == GRPC_CHANNEL_READY || connection.channel->WaitForConnected(until))
        continue;
      return absl::UnavailableError(absl::StrCat("server ", connection.address, ": no connection within ",
                                                 options_.connect_timeout.count(), " ms: has it ended?"));
    }
    return absl::OkStatus();
  }

  // The connection with the fewest calls in flight, in turn among those.
  std::size_t pick_connection() {
    std::size_t best = turn_;
    for (std::size_t k = 0; k < load_.size(); ++k)
      if (const std::size_t other = (turn_ + k) % load_.size(); load_[other] < load_[best]) best = other;
    turn_ = (best + 1) % load_.size();
    return best;
  }

  void start(Call& call) {
    call.piece = next_++;
    call.connection = pick_connection();
    ++load_[call.connection];
    call.context.emplace();
    call.context->set_deadline(std::chrono::system_clock::now() + options_.call_timeout);
    connections_[call.connection].channel.authorise(*call.context);
    call.response.Clear();
    call.in_flight = true;
    ++in_flight_;
    call.reader = connections_[call.connection].stub->PrepareUnaryCall(&*call.context, pieces_.method,
                                                                       pieces_.encode(call.piece), &queue_);
    call.reader->StartCall();
    call.reader->Finish(&call.response, &call.status, &call);
  }

  absl::Status finish(Call& call) {
    call.in_flight = false;
    --in_flight_;
    --load_[call.connection];
    const std::string& address = connections_[call.connection].channel.address;
    if (!call.status.ok()) return wire::from_grpc(call.status, address);
    const absl::Status status = pieces_.decode(call.piece, call.response);
    if (status.ok()) return status;
    return absl::Status(status.code(), absl::StrCat("server ", address, ": ", status.message()));
  }

  const std::vector<Connection>& connections_;
  const ConnectOptions& options_;
  const Pieces& pieces_;
  grpc::CompletionQueue queue_;
  std::vector<Call> calls_;
  std::vector<int> load_;  // calls in flight on each connection
  std::size_t turn_ = 0;
  std::size_t next_ = 0;
  std::size_t in_flight_ = 0;
};

}  // namespace

absl::Status send(const std::vector<Connection>& connections, const ConnectOptions& options, const Pieces& pieces) {
  return Sender(connections, options, pieces).run();
}

}  // namespace facetwise
