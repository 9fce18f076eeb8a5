// The in-kernel generator: Philox4x32-10, and which numbers a lane gets.
#include <gtest/gtest.h>

#include <cstring>

#include "support/call.h"
#include "support/philox.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 1000;
constexpr Call kCall{Operation::sample_reflection, Sampler::exact, Shadowing::correlated};

Lanes lanes_with_numbers(std::uint64_t seed, std::uint32_t dimension, const std::vector<std::uint64_t>& ids) {
  Lanes lanes = ordinary_lanes(ids.size(), 3);
  for (std::size_t lane = 0; lane < ids.size(); ++lane) {
    const auto u = generated(seed, dimension, ids[lane]);
    for (std::size_t k = 0; k < 3; ++k) lanes.in[8 + k][lane] = u[k];
  }
  return lanes;
}

Answer generate(const Lanes& lanes, const Generator& generator, const Execution& execution) {
  Answer answer;
  Batch batch = make_batch(kCall, lanes, answer);
  batch.u1 = batch.u2 = batch.u3 = {};
  batch.generator = generator;
  const auto statistics = run(kCall.operation, batch, execution);
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  if (statistics.ok()) answer.statistics = *statistics;
  return answer;
}

TEST(Generator, GivesTheNumbersOfPhilox) {
  const std::uint64_t seed = 0x0123456789ABCDEF;
  const std::uint64_t first = 0xFFFFFFFFu - 500;  // the counter carries into its upper word within the batch
  std::vector<std::uint64_t> following(kLanes), arbitrary(kLanes);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    following[lane] = first + lane;
    arbitrary[lane] = hash(1, lane);
  }
  // A column of ids has 4-byte alignment.
  std::vector<std::uint32_t> memory(2 * kLanes + 1);
  std::memcpy(memory.data() + 1, arbitrary.data(), 8 * kLanes);
  const Column<std::uint64_t> column(reinterpret_cast<const std::uint64_t*>(memory.data() + 1), kLanes);

  for (const Target target : available_targets()) {
    for (const bool one_lane : {false, true}) {
      const Execution execution{.target = target, .one_lane = one_lane};
      const Lanes by_index = lanes_with_numbers(seed, 7, following);
      EXPECT_TRUE(same_bits(generate(by_index, {.seed = seed, .dimension = 7, .first_id = first}, execution),
                            run_call(kCall, by_index)));
      const Lanes by_id = lanes_with_numbers(seed, 7, arbitrary);
      EXPECT_TRUE(same_bits(generate(by_id, {.seed = seed, .dimension = 7, .id = column}, execution),
                            run_call(kCall, by_id)));
    }
  }
  const Lanes one_id = lanes_with_numbers(seed, 7, std::vector<std::uint64_t>(kLanes, 42));
  EXPECT_TRUE(same_bits(generate(one_id, {.seed = seed, .dimension = 7, .id = std::uint64_t{42}}, {}),
                        run_call(kCall, one_id)));
}

TEST(Generator, ALaneKeepsItsNumbersWhenTheBatchIsCompacted) {
  const Lanes lanes = ordinary_lanes(kLanes, 3);
  const Answer whole = generate(lanes, {.seed = 5, .first_id = 1000}, {});
  std::vector<std::uint32_t> active;
  for (std::uint32_t lane = 0; lane < kLanes; lane += 1 + hash(8, lane) % 4) active.push_back(kLanes - 1 - lane);
  Answer answer;
  Batch batch = make_batch(kCall, lanes, answer);
  batch.u1 = batch.u2 = batch.u3 = {};
  batch.generator = Generator{.seed = 5, .first_id = 1000};
  batch.active = active;
  ASSERT_TRUE(run(kCall.operation, batch).ok());
  for (const std::uint32_t lane : active) {
    for (std::size_t k = 0; k < answer.out.size(); ++k) {
      if (answer.out[k].empty()) continue;
      ASSERT_EQ(answer.out[k][lane], whole.out[k][lane]);
    }
  }
}

TEST(Generator, SeedsAndDimensionsDiffer) {
  const Lanes lanes = ordinary_lanes(kLanes, 3);
  const Answer answer = generate(lanes, {.seed = 1, .dimension = 0}, {});
  EXPECT_FALSE(same_bits(answer, generate(lanes, {.seed = 2, .dimension = 0}, {})));
  EXPECT_FALSE(same_bits(answer, generate(lanes, {.seed = 1, .dimension = 1}, {})));
  EXPECT_FALSE(same_bits(answer, generate(lanes, {.seed = 1 + (std::uint64_t{1} << 32), .dimension = 0}, {})));
  EXPECT_TRUE(same_bits(answer, generate(lanes, {.seed = 1, .dimension = 0}, {})));
}

}  // namespace
}  // namespace facetwise::test
