// SPDX-License-Identifier: Apache-2.0
// A lane's results depend only on its inputs: any length on every target, any order, outputs over any
// inputs.
#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

void expect_part(const Call& call, const Lanes& lanes, const Answer& whole, std::size_t begin, std::size_t count,
                 const Execution& execution) {
  SCOPED_TRACE(std::to_string(count) + " lanes from " + std::to_string(begin));
  const Answer part = compute(call, slice(lanes, begin, count), execution);
  for (std::size_t k = 0; k < count; ++k) expect_same_lane(call, whole, begin + k, part, k);
  EXPECT_EQ(part.statistics, recount(part.status)) << call_name(call);
}

TEST(HardLanes, AnyLengthOnEveryTarget) {
  const Lanes lanes = hard_lanes(Kind::mixed, 1200, 21);
  for (const Call& call : all_calls()) {
    const Answer whole = compute(call, lanes);
    for (const Target target : available_targets())
      for (std::size_t count = 0; count <= 67; ++count)
        expect_part(call, lanes, whole, count * 13 % 1100, count, {.target = target});
    // Around the buffers of 512 lanes.
    for (const std::size_t count : {511u, 512u, 513u, 543u, 544u, 545u, 1023u, 1025u, 1151u})
      expect_part(call, lanes, whole, 1200 - count, count, {});
    if (HasFailure()) return;
  }
}

TEST(HardLanes, AnySplit) {
  const std::size_t count = kQuick ? 3000 : 50000;
  const Lanes lanes = hard_lanes(Kind::mixed, count, 22);
  for (const Call& call : all_calls()) {
    const Answer whole = compute(call, lanes);
    Statistics sum;
    for (std::size_t begin = 0, length = 0; begin < count; begin += length) {
      const std::uint64_t bits = hash(23, begin);
      length = std::min<std::size_t>(count - begin, 1 + (bits >> 8) % (bits % 2 == 0 ? 40 : 3000));
      const Answer part = compute(call, slice(lanes, begin, length));
      for (std::size_t k = 0; k < length; ++k) expect_same_lane(call, whole, begin + k, part, k);
      sum += part.statistics;
    }
    EXPECT_EQ(sum, whole.statistics) << call_name(call);
    if (HasFailure()) return;
  }
}

TEST(HardLanes, AnyOrder) {
  const Lanes lanes = hard_lanes(Kind::mixed, kQuick ? 3000 : 50000, 24);
  const auto order = shuffled(lanes.count, 25);
  const Lanes reordered = pick(lanes, order);
  for (const Call& call : all_calls()) {
    const Answer whole = compute(call, lanes), other = compute(call, reordered);
    for (std::size_t k = 0; k < order.size(); ++k) expect_same_lane(call, whole, order[k], other, k);
    EXPECT_EQ(whole.statistics, other.statistics);
    if (HasFailure()) return;
  }
}

// As a value, or as memory of one value: each input by itself, the incident direction, all but one, all.
TEST(HardLanes, OneValueForAllLanes) {
  const Lanes lanes = hard_lanes(Kind::mixed, 700, 28);
  const auto fields = input_fields();
  const std::size_t n = fields.size();
  for (const Call& call : all_calls())
    for (std::size_t round = 0; round < 2 * n + 2; ++round) {
      Lanes expanded = lanes;
      Answer got;
      Batch batch = make_batch(call, lanes, got);
      for (std::size_t k = 0; k < n; ++k) {
        const bool shared = round < n ? k == round : round == n ? k < 3 : k + n + 1 != round;
        if (!shared || !reads(call, fields[k])) continue;
        const float& value = lanes.in[k][100 + round];
        fields[k].column(batch) = round & 1 ? Column<float>(value) : Column<float>(&value, 1);
        expanded.in[k].assign(lanes.count, value);
      }
      got.statistics = run_ok(call, batch);
      expect_same(call, compute(call, expanded), got);
    }
}

// One output at a time, only the status, and none at all, which still counts.
TEST(HardLanes, OneOutput) {
  const Lanes lanes = hard_lanes(Kind::mixed, 600, 29);
  const auto fields = output_fields();
  for (const Call& call : all_calls()) {
    const Answer whole = compute(call, lanes);
    for (std::size_t only = 0; only <= fields.size() + 1; ++only) {
      Answer got, expected = blank_answer(call, lanes.count);
      Batch batch = make_batch(call, lanes, got);
      for (std::size_t k = 0; k < fields.size(); ++k)
        if (k != only) fields[k].column(batch) = {};
      if (only != fields.size()) batch.out.status = {};
      batch.out.event = {};
      if (only < fields.size()) expected.out[only] = whole.out[only];
      if (only == fields.size()) expected.status = whole.status;
      expected.statistics = whole.statistics;
      got.statistics = run_ok(call, batch);
      expect_same(call, expected, got);
    }
  }
}

// Every output in the memory of every input of the same lanes, in turn, for lengths of all kinds.
TEST(HardLanes, OutputsOverAnyInputs) {
  const auto outputs = output_fields();
  for (const std::size_t count : {1u, 3u, 16u, 31u, 33u, 700u}) {
    const Lanes lanes = hard_lanes(Kind::mixed, count, 30 + count);
    for (const Call& call : all_calls()) {
      const Answer expected = compute(call, lanes);
      std::vector<std::size_t> read;
      for (std::size_t k = 0; k < input_fields().size(); ++k)
        if (reads(call, input_fields()[k])) read.push_back(k);
      for (std::size_t shift = 0; shift < read.size(); ++shift) {
        Lanes memory = lanes;
        Answer got;
        Batch batch = make_batch(call, memory, got);
        std::vector<std::pair<std::size_t, std::size_t>> moved;  // output, input
        for (std::size_t k = 0; k < outputs.size() && moved.size() < read.size(); ++k) {
          if (!writes(call, outputs[k])) continue;
          const std::size_t input = read[(shift + moved.size()) % read.size()];
          outputs[k].column(batch) = OutputColumn<float>(memory.in[input]);
          moved.emplace_back(k, input);
        }
        got.statistics = run_ok(call, batch);
        for (const auto& [output, input] : moved) got.out[output] = memory.in[input];
        expect_same(call, expected, got);
      }
    }
  }
}

}  // namespace
}  // namespace facetwise::test
