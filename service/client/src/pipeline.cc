// SPDX-License-Identifier: Apache-2.0
#include "src/pipeline.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <thread>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "wire/status.h"

namespace facetwise {
namespace {

// How often, per server, a table is given again in one call: a server that keeps losing it has too little room.
constexpr std::size_t kProvisions = 8;

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Call {
  std::optional<grpc::ClientContext> context;
  std::unique_ptr<grpc::ClientAsyncResponseReader<grpc::ByteBuffer>> reader;
  // Kept for another attempt: outputs may lie where the inputs were.
  grpc::ByteBuffer request;
  grpc::ByteBuffer response;
  grpc::Status status;
  std::size_t piece = 0;
  std::size_t connection = 0;
  bool in_flight = false;
};

// How the server's log names a call that failed. Empty: the server has not said how it ended, but the way to it.
std::string request_id(const grpc::ClientContext& context) {
  const auto& trailer = context.GetServerTrailingMetadata();
  const auto id = trailer.find("x-request-id");
  return id == trailer.end() ? "" : std::string(id->second.data(), id->second.size());
}

// How long to wait before this server is asked again. Nothing: it would give the same answer.
std::optional<milliseconds> rest_after(const grpc::Status& status, bool said_by_server) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNKNOWN:  // a proxy's server was lost in the middle of an answer
    case grpc::StatusCode::INTERNAL: return said_by_server ? std::nullopt : std::optional(milliseconds(100));
    case grpc::StatusCode::UNAVAILABLE:        // not there, or shutting down
    case grpc::StatusCode::DEADLINE_EXCEEDED:  // there, but does not answer
    case grpc::StatusCode::CANCELLED:          // it wanted the place: the call's own cancelling ends the batch
      return wire::retry_delay(status).value_or(milliseconds(100));
    case grpc::StatusCode::RESOURCE_EXHAUSTED:  // without a delay: a message above gRPC's limit
      return wire::retry_delay(status);
    default: return std::nullopt;
  }
}

class Sender {
 public:
  Sender(const std::vector<Connection>& connections, const ConnectOptions& options, const Pieces& pieces,
         std::size_t turn)
      : connections_(connections),
        options_(options),
        pieces_(pieces),
        traceparent_(options.traceparent ? options.traceparent() : ""),
        calls_(std::min<std::size_t>(std::max(options.window, 1), pieces.count)),
        servers_(connections.size()),
        turn_(turn % connections.size()) {}

  absl::Status run() {
    absl::Status error;
    while (error.ok() && (in_flight_ > 0 || next_ < pieces_.count || !again_.empty())) {
      const bool waits = start_calls();
      if (in_flight_ == 0) {  // for a server
        if (error = given_up(); !error.ok()) break;
        wait_a_moment(*connections_[turn_].channel.channel);
        continue;
      }
      // Where pieces wait for a server, it is looked for often: not only when the next answer comes.
      const auto until = std::chrono::system_clock::now() + (waits ? milliseconds(20) : std::chrono::hours(24));
      void* tag = nullptr;
      bool good = false;
      if (queue_.AsyncNext(&tag, &good, until) == grpc::CompletionQueue::GOT_EVENT)
        error = finish(*static_cast<Call*>(tag));
    }
    for (Call& call : calls_)
      if (call.in_flight) call.context->TryCancel();
    queue_.Shutdown();
    void* tag = nullptr;
    bool good = false;
    while (queue_.Next(&tag, &good)) {
    }
    return error;
  }

 private:
  struct Server {
    int load = 0;  // calls in flight
    Clock::time_point rests_until{};
  };

  // Gives every free call a piece, as far as there are servers. True: there are not enough.
  bool start_calls() {
    for (Call& call : calls_) {
      if (call.in_flight || (again_.empty() && next_ == pieces_.count)) continue;
      const auto server = pick_server();
      if (!server) return true;
      start(call, *server);
    }
    return false;
  }

  // The server with the fewest calls in flight, taking turns between equals. Nothing: none can be used now.
  std::optional<std::size_t> pick_server() {
    std::optional<std::size_t> best;
    const auto now = Clock::now();
    for (std::size_t k = 0; k < servers_.size(); ++k) {
      const std::size_t other = (turn_ + k) % servers_.size();
      if (servers_[other].rests_until > now) continue;
      if (connections_[other].channel.channel->GetState(true) != GRPC_CHANNEL_READY) continue;
      if (!best || servers_[other].load < servers_[*best].load) best = other;
    }
    if (best) turn_ = (*best + 1) % servers_.size();
    return best;
  }

  // An error when no server was there, or all refused, for as long as one is waited for.
  absl::Status given_up() {
    const auto now = Clock::now();
    if (!failing_since_) failing_since_ = now;
    if (now - *failing_since_ < options_.connect_timeout) return absl::OkStatus();
    if (!last_error_.ok()) return last_error_;
    return absl::UnavailableError(absl::StrCat("server ", connections_[0].channel.address, ": no connection within ",
                                               options_.connect_timeout.count(), " ms: has it ended?"));
  }

  void start(Call& call, std::size_t server) {
    if (again_.empty()) {
      call.piece = next_++;
      call.request = pieces_.encode(call.piece);
    } else {
      std::tie(call.piece, call.request) = again_.front();
      again_.pop_front();
    }
    call.connection = server;
    ++servers_[server].load;
    const auto& [channel, stub, memory] = connections_[server];
    call.context.emplace();
    call.context->set_deadline(std::chrono::system_clock::now() + options_.call_timeout);
    channel.authorise(*call.context);
    if (!traceparent_.empty()) call.context->AddMetadata("traceparent", traceparent_);
    call.response.Clear();
    call.in_flight = true;
    ++in_flight_;
    call.reader = stub->PrepareUnaryCall(&*call.context, pieces_.method, call.request, &queue_);
    call.reader->StartCall();
    call.reader->Finish(&call.response, &call.status, &call);
  }

  // OK: the piece is done, or will be sent again. Since an answer depends on its request alone, it does not matter whether
  // the server has computed it before.
  absl::Status finish(Call& call) {
    call.in_flight = false;
    --in_flight_;
    Server& server = servers_[call.connection];
    --server.load;
    const std::string& address = connections_[call.connection].channel.address;
    if (call.status.ok()) {
      failing_since_.reset();
      const absl::Status status = pieces_.decode(call.piece, call.response);
      return status.ok() ? status
                         : absl::Status(status.code(), absl::StrCat("server ", address, ": ", status.message()));
    }
    last_error_ = wire::from_grpc(call.status, address);
    const std::string id = request_id(*call.context);
    if (!id.empty())
      last_error_ = absl::Status(last_error_.code(), absl::StrCat(last_error_.message(), " (request ", id, ")"));
    // A server that has only become silent may go on later, and write to memory that is used for something else then.
    if (MemoryOffer* memory = connections_[call.connection].memory.get();
        memory != nullptr && id.empty() && !memory->has_ended())
      return absl::Status(last_error_.code(),
                          absl::StrCat(last_error_.message(), ": it may still write to the shared memory"));
    if (call.status.error_code() == grpc::StatusCode::NOT_FOUND && pieces_.provide &&
        provided_ < kProvisions * connections_.size()) {
      ++provided_;
      if (auto status = pieces_.provide(connections_[call.connection]); !status.ok()) return status;
    } else {
      const auto rest = rest_after(call.status, !id.empty());
      if (!rest) return last_error_;
      server.rests_until = Clock::now() + *rest;
    }
    again_.emplace_back(call.piece, call.request);
    return in_flight_ == 0 ? given_up() : absl::OkStatus();
  }

  const std::vector<Connection>& connections_;
  const ConnectOptions& options_;
  const Pieces& pieces_;
  const std::string traceparent_;
  grpc::CompletionQueue queue_;
  std::vector<Call> calls_;
  std::vector<Server> servers_;  // of each connection
  std::size_t turn_;
  std::size_t next_ = 0;                                        // piece that has not been sent
  std::deque<std::pair<std::size_t, grpc::ByteBuffer>> again_;  // pieces that failed, and their requests
  std::size_t in_flight_ = 0;
  std::size_t provided_ = 0;
  absl::Status last_error_;
  std::optional<Clock::time_point> failing_since_;  // without an answer in between
};

}  // namespace

void wait_a_moment(grpc::Channel& channel) {
  const auto state = channel.GetState(true);
  const auto until = std::chrono::system_clock::now() + milliseconds(5);
  if (state == GRPC_CHANNEL_READY)
    std::this_thread::sleep_until(until);
  else
    channel.WaitForStateChange(state, until);
}

absl::Status send(const std::vector<Connection>& connections, const ConnectOptions& options, const Pieces& pieces,
                  std::size_t turn) {
  return Sender(connections, options, pieces, turn).run();
}

}  // namespace facetwise
