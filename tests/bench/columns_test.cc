// SPDX-License-Identifier: Apache-2.0
// The columns that benchmarks use are placed as they say, and all implementations compute the same from them.
#include "bench/columns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <set>

#include "bench/runner.h"

namespace facetwise::bench {
namespace {

std::uintptr_t place(const float* column) { return reinterpret_cast<std::uintptr_t>(column) % 4096; }

TEST(Columns, KindOnesAreAlignedAndApartInTheirPages) {
  for (const std::size_t lanes : {100u, 1024u, 65536u}) {
    const auto columns = Columns::make(lanes);
    ASSERT_TRUE(columns.ok());
    std::set<std::uintptr_t> places;
    for (int k = 0; k < Columns::kInputs; ++k) {
      EXPECT_EQ(place(columns->input(k)) % 64, 0u);
      places.insert(place(columns->input(k)));
    }
    for (int k = 0; k < Columns::kOutputs; ++k) places.insert(place(columns->output(k)));
    if (lanes % 1024 == 0) {
      EXPECT_EQ(places.size(), Columns::kInputs + std::size_t{Columns::kOutputs});
    }
  }
}

TEST(Columns, OthersAreWhereMallocPutsThem) {
  constexpr std::size_t kLanes = 65536;
  auto columns = Columns::make(kLanes, kLanes);
  ASSERT_TRUE(columns.ok());
  Case which{.sampler = Sampler::exact};
  ASSERT_TRUE(columns->prepare(which).ok());
  const Batch kind = columns->batch(which);
  which.inputs = Inputs::malloc_placed;
  ASSERT_TRUE(columns->prepare(which).ok());
  const Batch placed = columns->batch(which);
  for (const auto& [a, b] :
       {std::pair{kind.incident.x, placed.incident.x}, {kind.alpha_y, placed.alpha_y}, {kind.u3, placed.u3}}) {
    EXPECT_EQ(place(b.data()), 16u);
    for (std::size_t lane = 0; lane < kLanes; ++lane) ASSERT_EQ(a[lane], b[lane]);
  }
  EXPECT_EQ(place(placed.out.pdf.data()), 16u);
}

// All that a case can be run by, on the same lanes: the same results up to rounding.
TEST(Columns, ImplementationsAgree) {
  constexpr std::size_t kLanes = 4096;
  auto columns = Columns::make(kLanes);
  ASSERT_TRUE(columns.ok());
  for (const Target target : available_targets()) {
    if (!has_auto_loops(target)) continue;
    for (const Sampler sampler : {Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact})
      for (const Operation operation : {Operation::sample_reflection, Operation::pdf_reflection}) {
        Case which{.operation = operation, .sampler = sampler, .batch = kLanes};
        ASSERT_TRUE(columns->prepare(which).ok());
        const int outputs = which.output_columns();
        std::vector<std::vector<float>> scalar;
        which.implementation = Implementation::scalar;
        ASSERT_TRUE(make_runner(which, *columns, target, nullptr)().ok());
        for (int k = 0; k < outputs; ++k) scalar.emplace_back(columns->output(k), columns->output(k) + kLanes);
        which.implementation = Implementation::auto_vectorised;
        ASSERT_TRUE(make_runner(which, *columns, target, nullptr)().ok());
        std::size_t differ = 0;
        for (int k = 0; k < outputs; ++k)
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const float a = scalar[static_cast<std::size_t>(k)][lane], b = columns->output(k)[lane];
            differ += !(std::abs(a - b) <= 2e-3f * std::max(1.0f, std::abs(a)));
          }
        EXPECT_LE(differ, kLanes / 100) << name(target) << ", " << name(sampler) << ", " << name(operation);
      }
  }
}

TEST(Columns, FreshBatchesAreAllDifferent) {
  const Case which{.sampler = Sampler::cap, .batch = kFreshLanes / 4, .inputs = Inputs::fresh};
  EXPECT_EQ(which.lanes(), kFreshLanes);
  auto columns = Columns::make(which.lanes());
  ASSERT_TRUE(columns.ok());
  ASSERT_TRUE(columns->prepare(which).ok());
  const Runner run = make_runner(which, *columns, Target::best, nullptr);
  std::set<std::uint64_t> occluded;
  std::uint64_t first = 0;
  for (int k = 0; k < 4; ++k) {
    const auto count = run();
    ASSERT_TRUE(count.ok());
    if (k == 0) first = *count;
    occluded.insert(*count);
  }
  EXPECT_EQ(occluded.size(), 4u);
  EXPECT_EQ(*run(), first);
}

}  // namespace
}  // namespace facetwise::bench
