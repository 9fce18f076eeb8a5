#include "src/watch.h"

namespace facetwise {

using Clock = std::chrono::steady_clock;

Watch::Watch() : thread_([this] { look(); }) {}

Watch::~Watch() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Watch::look() {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    changed_.wait_for(lock, computing_.empty() ? std::chrono::milliseconds(1000) : std::chrono::milliseconds(2));
    for (Computing* call : computing_)
      if (call->context_.IsCancelled()) call->stop_.store(true, std::memory_order_relaxed);
    const auto now = Clock::now();
    for (Reader& reader : reading_)
      if (now > reader.until) {
        reader.context->TryCancel();
        reader.until = Clock::time_point::max();
      }
  }
}

Watch::Reading::Reading(Watch& watch, grpc::ServerContext& context, std::chrono::milliseconds limit) : watch_(watch) {
  const std::lock_guard lock(watch_.mutex_);
  entry_ = watch_.reading_.insert(watch_.reading_.end(), {&context, Clock::now() + limit});
}
Watch::Reading::~Reading() {
  const std::lock_guard lock(watch_.mutex_);
  watch_.reading_.erase(entry_);
}

Watch::Computing::Computing(Watch& watch, grpc::ServerContext& context) : watch_(watch), context_(context) {
  {
    const std::lock_guard lock(watch_.mutex_);
    entry_ = watch_.computing_.insert(watch_.computing_.end(), this);
  }
  watch_.changed_.notify_one();
}
Watch::Computing::~Computing() {
  const std::lock_guard lock(watch_.mutex_);
  watch_.computing_.erase(entry_);
}

}  // namespace facetwise
