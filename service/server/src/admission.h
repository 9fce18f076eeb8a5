// SPDX-License-Identifier: Apache-2.0
// How much a server takes on at once: calls, and bytes of messages.
#pragma once

#include <chrono>
#include <condition_variable>
#include <coroutine>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/status.h"

namespace facetwise {

// Every byte of a message is counted before it can come, and until it has left. What is not counted is bounded: what gRPC
// takes before a message is asked for, kReadAhead of each call that is open.
class Admission {
 public:
  static constexpr std::size_t kReadAhead = std::size_t{1} << 16;
  // What one call may hold, in messages: a request as received and as decoded, an answer as made and as sent.
  static constexpr std::size_t kMessagesHeld = 4;

  struct Limits {
    int calls;          // that are worked on
    int open;           // among them those that wait for their client
    std::size_t bytes;  // of messages; (kMessagesHeld + 1) * message_bytes at least
    std::size_t message_bytes;
    // A call that has waited for its client for so long is ended when others want its place.
    std::chrono::milliseconds patience;
  };

  explicit Admission(const Limits& limits);
  ~Admission();  // after the last Stay

  // A call, from its first moment until its last byte has left.
  class Stay {
   public:
    // `cancel` ends the call, from any thread. Calls with the same `peer` share the room of one client, unless it is empty.
    Stay(Admission& admission, std::function<void()> cancel, std::string peer)
        : admission_(admission), cancel_(std::move(cancel)), peer_(std::move(peer)) {}
    ~Stay();
    Stay(const Stay&) = delete;
    Stay& operator=(const Stay&) = delete;

    // RESOURCE_EXHAUSTED where too many are open, UNAVAILABLE when the server drains. Once, and first.
    absl::Status enter();

    // Awaitable: room for a message to be read, kept until leave_room(). False: cancelled() came first.
    auto room() {
      struct Awaiter {
        bool await_ready() const { return stay.has_room_; }
        bool await_suspend(std::coroutine_handle<> call) { return stay.wait_for_room(call); }
        bool await_resume() const { return stay.has_room_; }
        Stay& stay;
      };
      return Awaiter{*this};
    }
    void leave_room();
    // The call has been cancelled.
    void cancelled();

    // Counts the call as worked on, and bytes that it holds, until release() or its end. RESOURCE_EXHAUSTED where that is
    // too many.
    absl::Status work();
    absl::Status hold(std::size_t bytes);
    void hold_no_more_than(std::size_t bytes);
    void release();

   private:
    friend Admission;
    bool wait_for_room(std::coroutine_handle<> call);

    Admission& admission_;
    const std::function<void()> cancel_;
    const std::string peer_;
    bool entered_ = false, works_ = false, has_room_ = false, cancelled_ = false;
    std::size_t bytes_ = 0;
    std::coroutine_handle<> waits_for_room_;
  };

  // As long as it lives the call waits for its client, to send a message or to receive one: it is cancelled when that takes
  // longer than `limit`.
  enum class Client { sends, receives };
  class Waiting {
   public:
    Waiting(Stay& stay, Client client, std::chrono::milliseconds limit);
    ~Waiting();
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;

   private:
    friend Admission;
    using Clock = std::chrono::steady_clock;
    Stay& stay_;
    const Client client_;
    const Clock::time_point since_, until_;
    bool ended_ = false;
    std::list<Waiting*>::iterator entry_;
  };

  // What is taken of the limits.
  struct Load {
    int working, open;
    std::size_t bytes;
  };
  Load load() const;
  std::size_t most_bytes() const { return most_bytes_; }
  // No more calls from now on.
  void close();
  bool closed() const;
  // Returns when no call is left, or at the time given.
  void wait_until_idle(std::chrono::steady_clock::time_point until);

 private:
  void look();
  absl::Status refuse(const std::string& message);
  bool may_have_room(const Stay& stay) const;
  void give_room(Stay& stay);
  // Gives room to those that wait for it, who go on without the lock.
  void give_rooms(std::unique_lock<std::mutex>& lock);

  const Limits limits_;
  const int rooms_;               // messages that may be on their way at once
  const std::size_t most_bytes_;  // that may be held
  mutable std::mutex mutex_;
  std::condition_variable idle_, look_;
  int open_ = 0, working_ = 0, rooms_taken_ = 0;
  std::size_t bytes_ = 0;
  bool closed_ = false, ends_ = false, refused_ = false;
  std::map<std::string, int> rooms_of_peer_;
  std::deque<Stay*> want_room_;
  std::list<Waiting*> waiting_;  // oldest first
  std::thread thread_;
};

}  // namespace facetwise
