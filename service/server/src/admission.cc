#include "src/admission.h"

#include "absl/strings/str_cat.h"

namespace facetwise {

Admission::Ticket::~Ticket() {
  release();
  if (status_.ok()) admission_.leave();
}

absl::Status Admission::Ticket::hold(std::size_t bytes) {
  const std::lock_guard lock(admission_.mutex_);
  if (bytes > admission_.max_bytes_ - admission_.bytes_)
    return absl::ResourceExhaustedError(absl::StrCat("the server holds ", admission_.bytes_,
                                                     " bytes of messages, its limit is ", admission_.max_bytes_,
                                                     ": try again later"));
  admission_.bytes_ += bytes;
  bytes_ += bytes;
  return absl::OkStatus();
}

void Admission::Ticket::release() {
  if (bytes_ == 0) return;
  const std::lock_guard lock(admission_.mutex_);
  admission_.bytes_ -= bytes_;
  bytes_ = 0;
}

absl::Status Admission::enter() {
  const std::lock_guard lock(mutex_);
  if (closed_) return absl::UnavailableError("the server is shutting down");
  if (calls_ == max_calls_)
    return absl::ResourceExhaustedError(
        absl::StrCat("the server answers ", max_calls_, " calls, its limit: try again later"));
  ++calls_;
  return absl::OkStatus();
}

void Admission::leave() {
  const std::lock_guard lock(mutex_);
  if (--calls_ == 0) idle_.notify_all();
}

int Admission::calls() const {
  const std::lock_guard lock(mutex_);
  return calls_;
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
  idle_.wait_until(lock, until, [this] { return calls_ == 0; });
}

}  // namespace facetwise
