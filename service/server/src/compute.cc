// SPDX-License-Identifier: Apache-2.0
#include "src/compute.h"

#include <algorithm>

namespace facetwise {
namespace {

// The Compute that this thread belongs to, if any.
thread_local const Compute* works_for = nullptr;

}  // namespace

Compute::Compute(int threads, const Execution& execution)
    : arena_(threads > 0 ? threads : tbb::task_arena::automatic), execution_(execution) {
  arena_.initialize();
  for (int n = 0; n < arena_.max_concurrency(); ++n) threads_.emplace_back([this] { work(); });
}

Compute::~Compute() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  added_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Compute::add(Job* job) {
  bool mine = works_for == this;
  {
    const std::lock_guard lock(mutex_);
    // A computing thread will take the next job by itself, so no other has to be woken for it.
    mine = mine && short_.empty() && long_.empty();
    (job->lanes_ - job->begin_ > kPiece ? long_ : short_).push_back(job);
  }
  if (!mine) added_.notify_one();
}

Compute::Job* Compute::take() {
  std::unique_lock lock(mutex_);
  added_.wait(lock, [this] { return ends_ || !short_.empty() || !long_.empty(); });
  if (short_.empty() && long_.empty()) return nullptr;
  const bool a_long_one = short_.empty() || (++turns_ % 4 == 0 && !long_.empty());
  std::deque<Job*>& queue = a_long_one ? long_ : short_;
  Job* job = queue.front();
  queue.pop_front();
  ++working_;
  return job;
}

void Compute::work() {
  works_for = this;
  while (Job* job = take()) {
    // The job belongs to the call: it may be gone once the call is resumed.
    if (run_turn(*job))
      job->call_.resume();
    else
      add(job);
    const std::lock_guard lock(mutex_);
    --working_;
  }
}

bool Compute::run_piece(Job& job, std::size_t begin, std::size_t end) {
  Execution execution = execution_;
  if (!alone() || end - begin <= kPiece) execution.threads = Threads::one;
  if (!arena_.execute([&] { return job.piece_(begin, end, execution); })) job.begin_ = job.lanes_;
  return true;
}

bool Compute::run_turn(Job& job) {
  if (!job.piece_) return true;
  const std::size_t turn_begin = job.begin_;
  do {
    const std::size_t begin = job.begin_;
    job.begin_ += std::min(job.lanes_ - begin, alone() ? kAlone : kPiece);
    run_piece(job, begin, job.begin_);
  } while (job.begin_ < job.lanes_ && !others_wait(job.begin_ - turn_begin >= kTurn));
  return job.begin_ >= job.lanes_;
}

bool Compute::idle() const {
  const std::lock_guard lock(mutex_);
  return working_ == 0 && short_.empty() && long_.empty();
}

bool Compute::alone() const {
  const std::lock_guard lock(mutex_);
  return working_ == 1;
}

bool Compute::others_wait(bool whole_turn) const {
  const std::lock_guard lock(mutex_);
  return !short_.empty() || (whole_turn && !long_.empty());
}

}  // namespace facetwise
