// SPDX-License-Identifier: Apache-2.0
#include "src/admission.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace facetwise {

// Half of the bytes for messages on their way, as far as one call can still be answered with the rest.
Admission::Admission(const Limits& limits)
    : limits_(limits),
      rooms_(static_cast<int>(std::max<std::size_t>(
          std::min(limits.bytes / 2, limits.bytes - kMessagesHeld * limits.message_bytes) / limits.message_bytes, 1))),
      most_bytes_(limits.bytes - rooms_ * limits.message_bytes),
      thread_([this] { look(); }) {}

Admission::~Admission() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  look_.notify_one();
  thread_.join();
}

absl::Status Admission::refuse(const std::string& message) {
  refused_ = true;
  look_.notify_one();
  return absl::ResourceExhaustedError(absl::StrCat(message, ": try again later"));
}

absl::Status Admission::Stay::enter() {
  const std::lock_guard lock(admission_.mutex_);
  if (admission_.closed_) return absl::UnavailableError("the server is shutting down");
  if (admission_.open_ == admission_.limits_.open)
    return admission_.refuse(absl::StrCat("the server has ", admission_.open_, " open calls, its limit"));
  ++admission_.open_;
  entered_ = true;
  return absl::OkStatus();
}

Admission::Stay::~Stay() {
  leave_room();
  release();
  if (!entered_) return;
  const std::lock_guard lock(admission_.mutex_);
  if (--admission_.open_ == 0) admission_.idle_.notify_all();
}

absl::Status Admission::Stay::work() {
  const std::lock_guard lock(admission_.mutex_);
  if (admission_.working_ == admission_.limits_.calls)
    return admission_.refuse(absl::StrCat("the server answers ", admission_.working_, " calls, its limit"));
  ++admission_.working_;
  works_ = true;
  return absl::OkStatus();
}

absl::Status Admission::Stay::hold(std::size_t bytes) {
  const std::lock_guard lock(admission_.mutex_);
  if (bytes > admission_.most_bytes_ - admission_.bytes_)
    return admission_.refuse(absl::StrCat("the server holds ", admission_.bytes_, " bytes of messages, its limit is ",
                                          admission_.most_bytes_));
  admission_.bytes_ += bytes;
  bytes_ += bytes;
  return absl::OkStatus();
}

void Admission::Stay::hold_no_more_than(std::size_t bytes) {
  const std::lock_guard lock(admission_.mutex_);
  bytes = std::min(bytes, bytes_);
  admission_.bytes_ -= bytes_ - bytes;
  bytes_ = bytes;
}

void Admission::Stay::release() {
  const std::lock_guard lock(admission_.mutex_);
  admission_.bytes_ -= std::exchange(bytes_, 0);
  if (std::exchange(works_, false)) --admission_.working_;
}

bool Admission::may_have_room(const Stay& stay) const {
  if (rooms_taken_ == rooms_) return false;
  if (stay.peer_.empty()) return true;
  const auto taken = rooms_of_peer_.find(stay.peer_);
  return taken == rooms_of_peer_.end() || taken->second < std::max(rooms_ / 2, 1);
}

void Admission::give_room(Stay& stay) {
  stay.has_room_ = true;
  ++rooms_taken_;
  if (!stay.peer_.empty()) ++rooms_of_peer_[stay.peer_];
}

void Admission::give_rooms(std::unique_lock<std::mutex>& lock) {
  std::vector<std::coroutine_handle<>> go_on;
  for (auto stay = want_room_.begin(); stay != want_room_.end() && rooms_taken_ < rooms_;) {
    if (!may_have_room(**stay)) {
      ++stay;
      continue;
    }
    give_room(**stay);
    go_on.push_back((*stay)->waits_for_room_);
    stay = want_room_.erase(stay);
  }
  lock.unlock();
  for (const auto& call : go_on) call.resume();
}

bool Admission::Stay::wait_for_room(std::coroutine_handle<> call) {
  const std::lock_guard lock(admission_.mutex_);
  if (cancelled_) return false;
  if (admission_.may_have_room(*this)) {
    admission_.give_room(*this);
    return false;
  }
  waits_for_room_ = call;
  admission_.want_room_.push_back(this);
  admission_.look_.notify_one();
  return true;
}

void Admission::Stay::leave_room() {
  if (!has_room_) return;
  std::unique_lock lock(admission_.mutex_);
  has_room_ = false;
  --admission_.rooms_taken_;
  if (!peer_.empty())
    if (const auto taken = admission_.rooms_of_peer_.find(peer_); --taken->second == 0)
      admission_.rooms_of_peer_.erase(taken);
  admission_.give_rooms(lock);
}

void Admission::Stay::cancelled() {
  std::unique_lock lock(admission_.mutex_);
  cancelled_ = true;
  const auto waits = std::find(admission_.want_room_.begin(), admission_.want_room_.end(), this);
  if (waits == admission_.want_room_.end()) return;
  admission_.want_room_.erase(waits);
  lock.unlock();
  waits_for_room_.resume();
}

Admission::Waiting::Waiting(Stay& stay, Client client, std::chrono::milliseconds limit)
    : stay_(stay), client_(client), since_(Clock::now()), until_(since_ + limit) {
  const std::lock_guard lock(stay_.admission_.mutex_);
  entry_ = stay_.admission_.waiting_.insert(stay_.admission_.waiting_.end(), this);
}

Admission::Waiting::~Waiting() {
  const std::lock_guard lock(stay_.admission_.mutex_);
  stay_.admission_.waiting_.erase(entry_);
}

// Cancels what waits too long. Under the lock, so that no call ends meanwhile; its end is told on another thread.
void Admission::look() {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    const bool pressed = !want_room_.empty() || refused_ || closed_;
    look_.wait_for(lock, pressed ? limits_.patience / 8 : std::chrono::milliseconds(500));
    const auto now = Waiting::Clock::now();
    std::size_t wanted = std::max<std::size_t>(want_room_.size(), refused_ ? 1 : 0);
    refused_ = false;
    for (Waiting* call : waiting_) {
      if (call->ended_) continue;
      const bool late = now - call->since_ > limits_.patience;
      const bool in_the_way = late && (wanted > 0 || (closed_ && call->client_ == Client::sends));
      if (in_the_way && wanted > 0) --wanted;
      if (!in_the_way && now <= call->until_) continue;
      call->ended_ = true;
      call->stay_.cancel_();
    }
  }
}

Admission::Load Admission::load() const {
  const std::lock_guard lock(mutex_);
  return {working_, open_, bytes_};
}

void Admission::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

bool Admission::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

void Admission::wait_until_idle(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(mutex_);
  idle_.wait_until(lock, until, [this] { return open_ == 0; });
}

}  // namespace facetwise
