// SPDX-License-Identifier: Apache-2.0
// A call as gRPC sees it: messages that come and go by callbacks, so that a call that waits holds no thread.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>

#include "absl/strings/string_view.h"
#include "grpcpp/server_context.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"
#include "src/admission.h"
#include "src/task.h"

namespace facetwise {

// What of a call is told when it ends: what its last message asked for, and all messages together.
struct CallFacts {
  absl::string_view operation, distribution, masking, sampler;
  std::uint64_t lanes = 0;
  std::size_t received = 0, sent = 0;
};

class Call final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // How it ends: with a status, and before it a last message.
  struct End {
    grpc::Status status;
    std::optional<grpc::ByteBuffer> last = std::nullopt;
  };
  using Course = std::function<Task<End>(Call&)>;

  struct Limits {
    std::chrono::milliseconds write;  // how long a client may take to receive a message
  };

  // Begins its course; deletes itself at its end.
  Call(grpc::CallbackServerContext& context, Admission& admission, const Limits& limits, const Course& course);

  const grpc::CallbackServerContext& context() const { return context_; }
  Admission::Stay& stay() { return stay_; }
  CallFacts& facts() { return facts_; }
  // Adds to what the client gets at the call's end. Before that.
  void add_trailer(const std::string& name, const std::string& value) { context_.AddTrailingMetadata(name, value); }
  // The client has gone, its deadline has passed, or it took too long.
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  const std::atomic<bool>& stop() const { return cancelled_; }

  // The next message; waits for room in the server, then no longer than `limit`. Nothing: the client has ended its side, or
  // the call is cancelled. The room stays the call's until stay().leave_room().
  Task<std::optional<grpc::ByteBuffer>> read(std::chrono::milliseconds limit);
  // Returns when the message has left. False: cancelled.
  Task<bool> write(const grpc::ByteBuffer& message);

 private:
  // Awaitable: what `start` starts, until one of the callbacks below.
  struct Awaiter;

  static Detached run(Call& call, Course course);
  void go_on(bool good);
  void OnReadDone(bool good) override { go_on(good); }
  void OnWriteDone(bool good) override { go_on(good); }
  void OnCancel() override;
  void OnDone() override { delete this; }

  grpc::CallbackServerContext& context_;
  const Limits limits_;
  Admission::Stay stay_;
  CallFacts facts_;
  std::atomic<bool> cancelled_{false};
  grpc::ByteBuffer message_, last_;
  std::optional<Admission::Waiting> leaving_;
  std::coroutine_handle<> awaiting_;
  bool good_ = false;
};

}  // namespace facetwise
