// SPDX-License-Identifier: Apache-2.0
// The library as it is built without oneTBB (this program has its tasks_alone.cc): the same bits, on the caller's thread.
#include <cmath>
#include <filesystem>

#include "determinism/compare.h"
#include "facetwise/albedo_table.h"
#include "facetwise/slope_table.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

std::size_t threads_of_this_process() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

// An emulator has threads of its own.
const std::size_t kAtStart = threads_of_this_process();

TEST(Alone, CallsThatMaySpread) {
  const Lanes lanes = hard_lanes(Kind::mixed, 20'011, 64);
  for (const Call& call : plain_calls()) {
    const Answer expected = compute(call, lanes, {.threads = Threads::one});
    const Answer got = compute(call, lanes, {.threads = Threads::several});
    expect_same(call, expected, got);
    std::vector<float> dense(lanes.count);
    const Compaction::DenseColumn column{lanes.in[input::alpha_x], dense};
    Compaction compaction;
    compaction.lanes = lanes.count;
    compaction.status = got.status;
    compaction.columns = {&column, 1};
    const auto accepted = compact(compaction, {.threads = Threads::several});
    ASSERT_TRUE(accepted.ok());
    std::size_t next = 0;
    for (std::size_t lane = 0; lane < lanes.count; ++lane)
      if (got.status[lane] == 0) {
        ASSERT_EQ(dense[next++], lanes.in[input::alpha_x][lane]) << lane;
      }
    EXPECT_EQ(*accepted, next);
  }
  EXPECT_EQ(threads_of_this_process(), kAtStart);
}

TEST(Alone, Tables) {
  double told = 0;
  const auto slopes = SlopeTable::build([](double x, double y) { return std::exp(-x * x - y * y); },
                                        {.radial = true,
                                         .grid = 65,
                                         .incidence = 17,
                                         .slopes = 17,
                                         .uniforms = 16,
                                         .threads = 4,
                                         .progress = [&](double done) { told = done; }});
  ASSERT_TRUE(slopes.ok()) << slopes.status();
  EXPECT_EQ(told, 1);
  const auto albedo = AlbedoTable::build({}, {.sizes = {17, 9, 5, 5, 3, 3}, .samples = 4});
  ASSERT_TRUE(albedo.ok()) << albedo.status();
  EXPECT_EQ(threads_of_this_process(), kAtStart);
}

}  // namespace
}  // namespace facetwise::test
