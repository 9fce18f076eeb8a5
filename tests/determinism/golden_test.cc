// Every target gives the committed bits. To write them anew after a change that is meant to change them:
//   FACETWISE_WRITE_GOLDEN=tests/determinism/golden.txt build/release/bin/test_determinism --gtest_filter='Golden.*'
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>

#include "support/call.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 20'011;

TEST(Golden, EveryTargetGivesTheCommittedBits) {
  const Lanes lanes = adversarial_lanes(kLanes, 5);
  if (const char* path = std::getenv("FACETWISE_WRITE_GOLDEN")) {
    std::ofstream file(path);
    for (const Call& call : all_calls())
      file << call_name(call) << ' ' << std::hex << digest(run_call(call, lanes)) << '\n';
    GTEST_SKIP() << "wrote " << path;
  }
  std::ifstream file(FACETWISE_GOLDEN);
  ASSERT_TRUE(file) << FACETWISE_GOLDEN;
  std::map<std::string, std::uint64_t> golden;
  std::string name;
  std::uint64_t value;
  while (file >> name >> std::hex >> value) golden[name] = value;
  ASSERT_EQ(golden.size(), all_calls().size());

  for (const Call& call : all_calls()) {
    for (const Target target : available_targets()) {
      for (const bool one_lane : {false, true}) {
        const Answer answer = run_call(call, lanes, {.target = target, .one_lane = one_lane});
        EXPECT_EQ(answer.statistics.lanes(), kLanes);
        EXPECT_EQ(digest(answer), golden[call_name(call)])
            << call_name(call) << " on " << facetwise::name(target) << (one_lane ? ", one lane" : "");
      }
    }
  }
}

TEST(Targets, TheForcedOneRuns) {
  const std::vector<Target> targets = available_targets();
  ASSERT_FALSE(targets.empty());
  EXPECT_EQ(resolve(Target::best), targets.front());
  const std::map<Target, std::size_t> lanes = {
      {Target::avx3, 16}, {Target::avx2, 8}, {Target::neon, 4}, {Target::scalar, 1}};
  for (const auto& [target, count] : lanes) {
    const bool available = std::find(targets.begin(), targets.end(), target) != targets.end();
    EXPECT_EQ(resolve(target).has_value(), available);
    if (available) {
      EXPECT_EQ(resolve(target), target);
      EXPECT_EQ(vector_lanes(target), count);
    } else {
      EXPECT_EQ(run(Operation::masking, Batch{.incident = {0.f, 0.f, 1.f}, .alpha_x = 1.f, .alpha_y = 1.f},
                    {.target = target})
                    .status()
                    .code(),
                absl::StatusCode::kFailedPrecondition);
    }
  }
#if defined(__aarch64__)
  EXPECT_EQ(resolve(Target::best), Target::neon);
#endif
}

}  // namespace
}  // namespace facetwise::test
