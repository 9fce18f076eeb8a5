// How much a server takes on at once: calls, and bytes of messages.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>

#include "absl/status/status.h"

namespace facetwise {

class Admission {
 public:
  Admission(int max_calls, std::size_t max_bytes) : max_calls_(max_calls), max_bytes_(max_bytes) {}

  // A call's stay. A stream is one call.
  class Ticket {
   public:
    explicit Ticket(Admission& admission) : admission_(admission), status_(admission.enter()) {}
    ~Ticket();
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;

    // OK, or why the call is not taken: RESOURCE_EXHAUSTED, or UNAVAILABLE when the server drains.
    const absl::Status& status() const { return status_; }
    // Counts bytes that the call holds, until release() or its end. RESOURCE_EXHAUSTED if that is too many.
    absl::Status hold(std::size_t bytes);
    void release();

   private:
    Admission& admission_;
    absl::Status status_;
    std::size_t bytes_ = 0;
  };

  int calls() const;
  // No more calls from now on.
  void close();
  bool closed() const;
  // Returns when no call is left, or at the time given.
  void wait_until_idle(std::chrono::steady_clock::time_point until);

 private:
  absl::Status enter();
  void leave();

  const int max_calls_;
  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  int calls_ = 0;
  std::size_t bytes_ = 0;
  bool closed_ = false;
};

}  // namespace facetwise
