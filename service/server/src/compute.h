// SPDX-License-Identifier: Apache-2.0
// The threads that compute, shared by the calls of a server.
#pragma once

#include <condition_variable>
#include <coroutine>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "facetwise/target.h"
#include "tbb/task_arena.h"

namespace facetwise {

// A call computes in turns of some lanes, in the order in which calls asked. Short calls go before long ones, which look
// for them after each piece of a turn; each fourth turn is a long one's, so that neither waits for ever. A call holds no
// thread while it waits for its turn.
class Compute {
 public:
  // threads: 0 for as many as the machine has.
  Compute(int threads, const Execution& execution);
  ~Compute();  // after the last call

  int threads() const { return arena_.max_concurrency(); }
  const Execution& execution() const { return execution_; }

  // On a piece [begin, end) of a call's lanes. False: the call needs no more.
  using Piece = std::function<bool(std::size_t begin, std::size_t end, const Execution& execution)>;

  // Awaitable: the call goes on on a thread that computes, when its turn comes. `is_long`: after those that are short.
  auto turn(bool is_long) { return Job{*this, is_long ? kPiece + 1 : 0, {}}; }

  // Whether no call computes or waits: one may then compute a little where it is.
  bool idle() const;

  // Awaitable, of a call that has its turn: piece() for pieces that make up [0, lanes), as long as it returns true; once if
  // there are no lanes. A piece spreads over threads only while no other call computes.
  auto each(std::size_t lanes, Piece piece) { return Job{*this, lanes, std::move(piece)}; }

  class Job {
   public:
    Job(Compute& compute, std::size_t lanes, Piece piece)
        : compute_(compute), lanes_(lanes), piece_(std::move(piece)) {}
    // The rest of a short call belongs to the turn that it has.
    bool await_ready() { return piece_ && lanes_ <= kPiece && compute_.run_piece(*this, 0, lanes_); }
    void await_suspend(std::coroutine_handle<> call) {
      call_ = call;
      compute_.add(this);
    }
    void await_resume() const {}

   private:
    friend Compute;
    Compute& compute_;
    const std::size_t lanes_;
    const Piece piece_;
    std::size_t begin_ = 0;
    std::coroutine_handle<> call_;
  };

 private:
  // Lanes: of a piece, about a twentieth of a millisecond; of a long call's turn; of a piece on all threads.
  static constexpr std::size_t kPiece = std::size_t{1} << 14, kTurn = std::size_t{1} << 17,
                               kAlone = std::size_t{1} << 18;

  void add(Job* job);
  void work();
  Job* take();
  // Always true.
  bool run_piece(Job& job, std::size_t begin, std::size_t end);
  // A turn of a job. True: it is done.
  bool run_turn(Job& job);
  bool alone() const;
  bool others_wait(bool whole_turn) const;

  tbb::task_arena arena_;
  const Execution execution_;
  mutable std::mutex mutex_;
  std::condition_variable added_;
  std::deque<Job*> short_, long_;
  int working_ = 0;
  unsigned turns_ = 0;
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace facetwise
