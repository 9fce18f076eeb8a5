// The threads that compute, shared by the calls of a server.
#pragma once

#include "facetwise/target.h"
#include "src/admission.h"
#include "tbb/task_arena.h"

namespace facetwise {

class Compute {
 public:
  // threads: 0 for as many as the machine has.
  Compute(int threads, const Execution& execution)
      : arena_(threads > 0 ? threads : tbb::task_arena::automatic), execution_(execution) {
    arena_.initialize();
  }

  int threads() const { return arena_.max_concurrency(); }
  const Execution& execution() const { return execution_; }

  // Calls body(execution) on at most threads() threads over all calls. A call spreads over threads only
  // where there are fewer calls than threads.
  template <class Body>
  auto run(int calls, const Body& body) {
    Execution execution = execution_;
    if (calls >= threads()) execution.threads = Threads::one;
    return arena_.execute([&] { return body(execution); });
  }

 private:
  tbb::task_arena arena_;
  Execution execution_;
};

}  // namespace facetwise
