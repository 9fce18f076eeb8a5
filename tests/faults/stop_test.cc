// SPDX-License-Identifier: Apache-2.0
// Execution::stop ends a call between tiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "facetwise/engine.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

TEST(Stop, EndsACallOnOneThreadAndOnSeveral) {
  const std::size_t lanes = kQuick ? 1 << 16 : 1 << 24;
  std::vector<float> pdf(lanes, -1);
  Batch batch;
  batch.model.distribution = Distribution::beckmann;
  batch.sampler = Sampler::visible;
  batch.lanes = lanes;
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.5f;
  batch.generator = Generator{.seed = 1};
  batch.out.pdf = pdf;
  for (const Threads threads : {Threads::one, Threads::several}) {
    std::atomic<bool> stop = false;
    const Execution execution{.threads = threads, .stop = &stop};
    // Not set: the call is the same as without.
    ASSERT_TRUE(sample_reflection(batch, execution).ok());
    // Set before: nothing is written.
    std::fill(pdf.begin(), pdf.end(), -1.0f);
    stop = true;
    EXPECT_TRUE(absl::IsCancelled(sample_reflection(batch, execution).status()));
    for (const float value : pdf) ASSERT_EQ(value, -1);
    // Set meanwhile: if it came before the end, not all is written.
    if (kQuick) continue;
    stop = false;
    std::thread stopper([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      stop = true;
    });
    const auto status = sample_reflection(batch, execution).status();
    stopper.join();
    if (absl::IsCancelled(status)) {
      EXPECT_GT(std::count(pdf.begin(), pdf.end(), -1.0f), 0);
    }
  }
}

}  // namespace
}  // namespace facetwise::test
