// SPDX-License-Identifier: Apache-2.0
#include "src/call.h"

#include <new>

namespace facetwise {
namespace {

// Calls with the same name share the room that one client may have. All clients of Unix sockets have the same address,
// so they get no name.
std::string peer_of(const grpc::CallbackServerContext& context) {
  std::string peer = context.peer();
  return peer.starts_with("unix:") ? "" : peer;
}

}  // namespace

struct Call::Awaiter {
  Call& call;
  std::function<void()> start;
  bool await_ready() const { return false; }
  void await_suspend(std::coroutine_handle<> awaiting) {
    call.awaiting_ = awaiting;
    start();  // it may be over before this returns
  }
  bool await_resume() const { return call.good_; }
};

Call::Call(grpc::CallbackServerContext& context, Admission& admission, const Limits& limits, const Course& course)
    : context_(context),
      limits_(limits),
      stay_(
          admission, [&context] { context.TryCancel(); }, peer_of(context)) {
  run(*this, course);
}

// Once it has said how the call finishes, the call may be gone.
Detached Call::run(Call& call, Course course) {
  End end{{grpc::StatusCode::RESOURCE_EXHAUSTED, "the server is out of memory: try again later"}};
  try {
    auto task = course(call);
    end = co_await task;
  } catch (const std::bad_alloc&) {
  }
  if (!end.last) {
    call.Finish(end.status);
    co_return;
  }
  call.last_.Swap(&*end.last);
  call.leaving_.emplace(call.stay_, Admission::Client::receives, call.limits_.write);
  call.StartWriteAndFinish(&call.last_, {}, end.status);
}

Task<std::optional<grpc::ByteBuffer>> Call::read(std::chrono::milliseconds limit) {
  if (!co_await stay_.room()) co_return std::nullopt;
  const Admission::Waiting waiting(stay_, Admission::Client::sends, limit);
  Awaiter reading{*this, [this] { StartRead(&message_); }};
  const bool good = co_await reading;
  if (!good || cancelled()) co_return std::nullopt;
  grpc::ByteBuffer message;
  message.Swap(&message_);
  co_return message;
}

Task<bool> Call::write(const grpc::ByteBuffer& message) {
  const Admission::Waiting waiting(stay_, Admission::Client::receives, limits_.write);
  Awaiter writing{*this, [this, &message] { StartWrite(&message); }};
  co_return co_await writing;
}

void Call::go_on(bool good) {
  good_ = good;
  std::exchange(awaiting_, {}).resume();
}

void Call::OnCancel() {
  cancelled_.store(true, std::memory_order_relaxed);
  stay_.cancelled();
}

}  // namespace facetwise
