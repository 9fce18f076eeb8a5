// SPDX-License-Identifier: Apache-2.0
// Every target of every architecture gives the committed bits.
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "determinism/compare.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 20'011;  // in quick builds too: hashes cannot be of fewer

constexpr const char* kHead =
    R"(# What every target on every architecture must compute, to the last bit: a hash of all outputs of each call
# (digest() in tests/support/call.cc) for adversarial_lanes(20011, 5). Written by a test; after a change that is meant
# to change results, from the project's folder:
#   FACETWISE_WRITE_GOLDEN=tests/determinism/golden.txt build/release/bin/test_determinism --gtest_filter='Golden.*'
)";

std::map<std::string, std::uint64_t> read_golden() {
  std::map<std::string, std::uint64_t> golden;
  std::ifstream file(FACETWISE_GOLDEN);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::string name;
    std::uint64_t value = 0;
    if (words >> name >> std::hex >> value) golden[name] = value;
  }
  return golden;
}

TEST(Golden, EveryTargetGivesTheCommittedBits) {
  const Lanes lanes = adversarial_lanes(kLanes, 5);
  std::map<std::string, std::uint64_t> golden = read_golden();
  const char* path = std::getenv("FACETWISE_WRITE_GOLDEN");
  const bool write = path != nullptr && *path != 0;
  if (write) {
    golden.clear();
    for (const Call& call : all_calls()) golden[call_name(call)] = digest(compute(call, lanes));
  }
  ASSERT_GE(golden.size(), all_calls().size()) << FACETWISE_GOLDEN;
  for (const Call& call : all_calls())
    for (const Target target : available_targets())
      for (const bool one_lane : {false, true}) {
        const Answer answer = compute(call, lanes, {.target = target, .one_lane = one_lane});
        EXPECT_EQ(answer.statistics.lanes(), kLanes);
        EXPECT_EQ(digest(answer), golden[call_name(call)])
            << call_name(call) << " on " << name(target) << (one_lane ? ", one lane" : "") << ": " << FACETWISE_GOLDEN
            << " says what to do if that is meant";
      }
  if (!write) return;
  ASSERT_FALSE(HasFailure()) << "the targets disagree: nothing is written";
  std::ofstream file(path);
  file << kHead;
  for (const Call& call : all_calls()) file << call_name(call) << ' ' << std::hex << golden[call_name(call)] << '\n';
  file.close();
  ASSERT_TRUE(file.good()) << "cannot write " << path;
  GTEST_SKIP() << "wrote " << path;
}

}  // namespace
}  // namespace facetwise::test
