// The threads that compute, shared by the calls of a server.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>

#include "facetwise/target.h"
#include "tbb/task_arena.h"

namespace facetwise {

// A call computes in turns of some lanes, in the order in which calls asked. Short calls go before long ones, which look
// for them after each piece of a turn; each fourth turn is a long one's, so that neither waits for ever.
class Compute {
 public:
  // threads: 0 for as many as the machine has.
  Compute(int threads, const Execution& execution)
      : arena_(threads > 0 ? threads : tbb::task_arena::automatic), execution_(execution) {
    arena_.initialize();
  }

  int threads() const { return arena_.max_concurrency(); }
  const Execution& execution() const { return execution_; }

  // Calls body(begin, end, execution) on pieces that make up [0, lanes), as long as it returns true; once if there are no
  // lanes. A piece spreads over threads only while no other call computes.
  template <class Body>
  void each(std::size_t lanes, const Body& body) {
    std::size_t begin = 0;
    do {
      const Turn turn(*this, lanes - begin > kPiece);
      const std::size_t turn_begin = begin;
      do {
        const bool alone = turn.alone();
        const std::size_t end = begin + std::min(lanes - begin, alone ? kAlone : kPiece);
        Execution execution = execution_;
        if (!alone) execution.threads = Threads::one;
        if (!arena_.execute([&] { return body(begin, end, execution); })) return;
        begin = end;
      } while (begin < lanes && !turn.ends(begin - turn_begin >= kTurn));
    } while (begin < lanes);
  }

 private:
  // Lanes: of a piece, about a twentieth of a millisecond; of a long call's turn; of a piece on all threads.
  static constexpr std::size_t kPiece = std::size_t{1} << 14, kTurn = std::size_t{1} << 17,
                               kAlone = std::size_t{1} << 18;

  struct Waiting {
    std::condition_variable called;
    bool turn = false;
  };
  // One of as many as there are threads.
  class Turn {
   public:
    Turn(Compute& compute, bool is_long) : compute_(compute) {
      std::unique_lock lock(compute_.mutex_);
      if (compute_.running_ < compute_.threads()) {
        ++compute_.running_;
        return;
      }
      Waiting waiting;
      (is_long ? compute_.long_ : compute_.short_).push_back(&waiting);
      waiting.called.wait(lock, [&] { return waiting.turn; });
    }
    ~Turn() {
      const std::lock_guard lock(compute_.mutex_);
      std::deque<Waiting*>* queue = &compute_.short_;
      if (queue->empty() || (++compute_.turns_ % 4 == 0 && !compute_.long_.empty())) queue = &compute_.long_;
      if (queue->empty()) {
        --compute_.running_;
        return;
      }
      queue->front()->turn = true;
      queue->front()->called.notify_one();
      queue->pop_front();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

    bool alone() const {
      const std::lock_guard lock(compute_.mutex_);
      return compute_.running_ == 1;
    }
    // Whether a short call waits, or, of a whole turn, any.
    bool ends(bool whole) const {
      const std::lock_guard lock(compute_.mutex_);
      return !compute_.short_.empty() || (whole && !compute_.long_.empty());
    }

   private:
    Compute& compute_;
  };

  tbb::task_arena arena_;
  const Execution execution_;
  std::mutex mutex_;
  std::deque<Waiting*> short_, long_;
  int running_ = 0;
  unsigned turns_ = 0;
};

}  // namespace facetwise
