// SPDX-License-Identifier: Apache-2.0
// Every target gives the same bits, and one that is not there says so.
#include <algorithm>
#include <map>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

const std::size_t kLanes = kQuick ? 3000 : 30'000;

void expect_targets_agree(const Lanes& lanes) {
  for (const Call& call : all_calls()) {
    const Answer expected = compute(call, lanes, {.threads = Threads::one});
    for (const Target target : available_targets())
      for (const bool one_lane : {false, true}) {
        SCOPED_TRACE(std::string(name(target)) + (one_lane ? ", one lane" : ""));
        expect_same(call, expected,
                    compute(call, lanes, {.target = target, .one_lane = one_lane, .threads = Threads::one}));
      }
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Targets, SameBitsForOrdinaryLanes) { expect_targets_agree(hard_lanes(Kind::ordinary, kLanes, 11)); }
TEST(Targets, SameBitsForMixedLanes) { expect_targets_agree(hard_lanes(Kind::mixed, kLanes, 12)); }
TEST(Targets, SameBitsForAnyBits) { expect_targets_agree(hard_lanes(Kind::any_bits, kLanes, 13)); }

// The lanes above are as hard as they are said to be.
TEST(Targets, LanesReachEveryStatus) {
  for (const Call& call : plain_calls()) {
    const bool never_occluded = call.operation == Operation::masking ||
                                (call.operation == Operation::sample_normal && call.sampler != Sampler::ndf) ||
                                (call.operation == Operation::sample_reflection && call.sampler == Sampler::exact);
    for (const Kind kind : {Kind::mixed, Kind::any_bits}) {
      const Statistics statistics = compute(call, hard_lanes(kind, kLanes, 12)).statistics;
      const std::uint64_t kSome = kLanes / 200;
      EXPECT_GT(statistics.accepted, kSome) << call_name(call);
      EXPECT_GT(statistics.smooth, 0u) << call_name(call);
      EXPECT_GT(statistics.invalid, kSome) << call_name(call);
      if (!never_occluded) {
        EXPECT_GT(statistics.occluded, kSome) << call_name(call);
      }
    }
    const Statistics ordinary = compute(call, hard_lanes(Kind::ordinary, kLanes, 11)).statistics;
    EXPECT_EQ(ordinary.smooth + ordinary.invalid, 0u) << call_name(call);
    if (never_occluded) {
      EXPECT_EQ(ordinary.occluded, 0u) << call_name(call);
    }
  }
}

TEST(Targets, ListsThoseOfThisMachine) {
  const auto targets = available_targets();
  ASSERT_FALSE(targets.empty());
  EXPECT_EQ(targets.back(), Target::scalar) << "the fallback is everywhere, and slowest";
  EXPECT_EQ(resolve(Target::best), targets.front());
  EXPECT_EQ(vector_lanes(Target::best), vector_lanes(targets.front()));
#if defined(__x86_64__)
  const auto listed = [&](Target target) { return std::count(targets.begin(), targets.end(), target) == 1; };
  EXPECT_EQ(listed(Target::avx2), __builtin_cpu_supports("avx2") != 0);
  EXPECT_EQ(listed(Target::avx3), __builtin_cpu_supports("avx512dq") != 0);
#else
  EXPECT_EQ(targets.front(), Target::neon);
#endif
}

TEST(Targets, OneThatIsAbsentIsAnErrorAndWritesNothing) {
  const Call call{Operation::sample_reflection, Sampler::exact, Shadowing::correlated};
  const Lanes lanes = hard_lanes(Kind::mixed, 100, 14);
  const std::map<Target, std::size_t> widths = {
      {Target::scalar, 1}, {Target::avx2, 8}, {Target::avx3, 16}, {Target::neon, 4}};
  const auto available = available_targets();
  std::size_t absent = 0;
  for (const auto& [target, width] : widths) {
    SCOPED_TRACE(name(target));
    Answer answer;
    const Batch batch = make_batch(call, lanes, answer);
    if (std::find(available.begin(), available.end(), target) != available.end()) {
      EXPECT_EQ(resolve(target), target);
      EXPECT_EQ(vector_lanes(target), width);
      EXPECT_TRUE(run(call.operation, batch, {.target = target}).ok());
      continue;
    }
    ++absent;
    EXPECT_EQ(resolve(target), std::nullopt);
    const auto statistics = run(call.operation, batch, {.target = target});
    EXPECT_EQ(statistics.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(statistics.status().message().substr(0, 8), "target: ");
    expect_same(call, blank_answer(call, lanes.count), answer);
  }
  EXPECT_GE(absent, 1u) << "no machine has them all";
}

}  // namespace
}  // namespace facetwise::test
