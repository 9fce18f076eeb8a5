// SPDX-License-Identifier: Apache-2.0
// The in-kernel generator: the same results as columns of Philox's numbers (support/philox.h), which belong
// to a lane's id.
#include <cstring>
#include <memory>
#include <numeric>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"
#include "support/philox.h"

namespace facetwise::test {
namespace {

const std::size_t kLanes = kQuick ? 1200 : 9000;

std::vector<Call> sampling_calls() {
  std::vector<Call> calls;
  for (const Call& call : all_calls())
    if (name(call.operation).starts_with("sample_")) calls.push_back(call);
  return calls;
}

Answer generate(const Call& call, const Lanes& lanes, const Generator& generator, const Execution& execution = {}) {
  Answer answer;
  Batch batch = make_batch(call, lanes, answer);
  batch.u1 = batch.u2 = batch.u3 = {};
  batch.generator = generator;
  answer.statistics = run_ok(call, batch, execution);
  return answer;
}

Lanes with_numbers(Lanes lanes, const Generator& generator, const std::vector<std::uint64_t>& ids) {
  for (std::size_t lane = 0; lane < lanes.count; ++lane) {
    const auto u = generated(generator.seed, generator.dimension, ids[lane]);
    for (std::size_t k = 0; k < 3; ++k) lanes.in[input::u1 + k][lane] = u[k];
  }
  return lanes;
}

std::vector<std::uint64_t> following(std::uint64_t first, std::size_t count) {
  std::vector<std::uint64_t> ids(count);
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

TEST(Generator, NumbersOfTheLanesIndex) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 71);
  // Among them, ids that carry into the upper word within the batch and within a vector, and that wrap.
  const std::uint64_t firsts[] = {
      0, 1, 0xFFFFFFFBu, 0x100000000u - kLanes / 2, 0x123456789ABCDEFu, ~std::uint64_t{0} - 20};
  for (std::size_t k = 0; k < std::size(firsts); ++k) {
    const Generator generator{.seed = hash(1, k),
                              .dimension = static_cast<std::uint32_t>(k == 0 ? 0 : hash(2, k)),
                              .id = {},
                              .first_id = firsts[k]};
    const Lanes columns = with_numbers(lanes, generator, following(firsts[k], kLanes));
    for (const Call& call : sampling_calls()) {
      const Answer expected = compute(call, columns);
      for (const Target target : available_targets())
        for (const bool one_lane : {false, true})
          expect_same(call, expected, generate(call, lanes, generator, {.target = target, .one_lane = one_lane}));
    }
  }
}

TEST(Generator, SeedAndDimensionMatter) {
  const Lanes lanes = hard_lanes(Kind::ordinary, 200, 72);
  const Call call{Operation::sample_reflection, Sampler::exact, Shadowing::correlated};
  std::vector<Answer> all;
  for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 32, std::uint64_t{1} << 63})
    for (const std::uint32_t dimension : {0u, 1u, 1u << 31})
      all.push_back(generate(call, lanes, {.seed = seed, .dimension = dimension}));
  for (std::size_t a = 0; a < all.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(same_bits(all[a], all[b]));
}

// 64-bit ids on and off their natural alignment, contiguous and strided. first_id counts only without them.
TEST(Generator, IdsInAnyPlace) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 73);
  std::vector<std::uint64_t> ids(kLanes);
  for (std::size_t lane = 0; lane < kLanes; ++lane) ids[lane] = hash(74, lane) >> (lane % 64);
  for (const std::size_t stride : {8u, 12u, 28u})
    for (const std::size_t offset : {0u, 4u}) {
      const std::unique_ptr<char[]> memory(new char[offset + (kLanes - 1) * stride + 8]);
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        std::memcpy(memory.get() + offset + lane * stride, &ids[lane], 8);
      const auto* first = reinterpret_cast<const std::uint64_t*>(memory.get() + offset);
      const Generator generator{.seed = 9, .dimension = 3, .id = {first, kLanes, stride}, .first_id = 77};
      const Lanes columns = with_numbers(lanes, generator, ids);
      for (const Call& call : sampling_calls())
        expect_same(call, compute(call, columns), generate(call, lanes, generator));
    }
}

TEST(Generator, OneIdForAllLanes) {
  const Lanes lanes = hard_lanes(Kind::mixed, 500, 75);
  const std::uint64_t id = 0xFEDCBA9876543210u;
  alignas(8) char memory[12];
  std::memcpy(memory + 4, &id, 8);
  for (const auto& column :
       {Column<std::uint64_t>(id), Column<std::uint64_t>(reinterpret_cast<const std::uint64_t*>(memory + 4), 1)}) {
    const Generator generator{.seed = 5, .dimension = 0, .id = column};
    const Lanes columns = with_numbers(lanes, generator, std::vector<std::uint64_t>(500, id));
    for (const Call& call : sampling_calls())
      expect_same(call, compute(call, columns), generate(call, lanes, generator));
  }
}

// A path keeps its numbers when its batch is split, or compacted to an active list.
TEST(Generator, SplitAndActive) {
  const Lanes lanes = hard_lanes(Kind::mixed, kLanes, 76);
  const Generator generator{.seed = 6, .dimension = 1, .id = {}, .first_id = 0xFFFFFE00u};
  auto active = shuffled(kLanes, 77);
  active.resize(kLanes / 2);
  for (const Call& call : sampling_calls()) {
    const Answer whole = generate(call, lanes, generator);
    for (std::size_t begin = 0, length = 0; begin < kLanes; begin += length) {
      length = std::min<std::size_t>(kLanes - begin, 1 + hash(78, begin) % 700);
      Generator moved = generator;
      moved.first_id += begin;
      const Answer part = generate(call, slice(lanes, begin, length), moved);
      for (std::size_t k = 0; k < length; ++k) expect_same_lane(call, whole, begin + k, part, k);
    }
    Answer got;
    Batch batch = make_batch(call, lanes, got);
    batch.u1 = batch.u2 = batch.u3 = {};
    batch.generator = generator;
    batch.active = active;
    EXPECT_EQ(run_ok(call, batch).lanes(), active.size());
    for (const std::uint32_t lane : active) expect_same_lane(call, whole, lane, got, lane);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace facetwise::test
