// SPDX-License-Identifier: Apache-2.0
// What is asked for: enumerations, samplers that do not fit, random numbers, active lists, no lanes.
#include "faults/malformed_call.h"

namespace facetwise::test {
namespace {

const Call kSample{Operation::sample_reflection, Sampler::exact, Shadowing::correlated};

bool samples(const Call& call) {
  return call.operation == Operation::sample_normal || call.operation == Operation::sample_reflection;
}

TEST(Selection, UnknownValues) {
  for (const Call& call : plain_calls())
    for (const int value : {200, 255}) {
      MalformedCall distribution(call), masking(call), shadowing(call), sampler(call);
      distribution.batch.model.distribution = static_cast<Distribution>(value);
      distribution.refused("model.distribution");
      masking.batch.model.masking = static_cast<Masking>(value);
      masking.refused("model.masking");
      shadowing.batch.model.shadowing = static_cast<Shadowing>(value);
      shadowing.refused("model.shadowing");
      sampler.batch.sampler = static_cast<Sampler>(value);
      sampler.refused("sampler");
    }
  // The first value past each end.
  MalformedCall distribution(kSample), masking(kSample), shadowing(kSample), sampler(kSample);
  distribution.batch.model.distribution = static_cast<Distribution>(5);
  distribution.refused("model.distribution");
  masking.batch.model.masking = static_cast<Masking>(2);
  masking.refused("model.masking");
  shadowing.batch.model.shadowing = static_cast<Shadowing>(2);
  shadowing.refused("model.shadowing");
  sampler.batch.sampler = static_cast<Sampler>(6);
  sampler.refused("sampler");
}

TEST(Selection, UnknownOperation) {
  for (const int value : {10, 11, 200, 255}) {
    MalformedCall spoilt(kSample);
    const Answer before = spoilt.answer;
    const auto statistics = run(static_cast<Operation>(value), spoilt.batch);
    EXPECT_EQ(statistics.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(statistics.status().message().substr(0, 11), "operation: ");
    EXPECT_EQ(check(static_cast<Operation>(value), spoilt.batch), statistics.status());
    EXPECT_TRUE(same_bits(before, spoilt.answer));
  }
}

TEST(Selection, UnknownTarget) {
  for (const int value : {5, 200, 255}) {
    MalformedCall whole(kSample);
    const Answer before = whole.answer;
    const auto statistics = run(kSample.operation, whole.batch, {.target = static_cast<Target>(value)});
    EXPECT_EQ(statistics.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(statistics.status().message().substr(0, 8), "target: ");
    EXPECT_TRUE(same_bits(before, whole.answer));
    EXPECT_EQ(resolve(static_cast<Target>(value)), std::nullopt);
  }
}

TEST(Selection, ReflectionSamplersDoNotSampleNormals) {
  for (const Sampler sampler : {Sampler::bounded, Sampler::exact}) {
    MalformedCall spoilt({Operation::sample_normal, Sampler::cap, Shadowing::correlated});
    spoilt.batch.sampler = sampler;
    spoilt.refused("sampler");
    const std::string message(check(Operation::sample_normal, spoilt.batch).message());
    EXPECT_NE(message.find("cap"), message.npos) << "it says what fits: " << message;
  }
}

TEST(Selection, GeneratorWhereItDoesNotBelong) {
  for (const Call& call : plain_calls()) {
    MalformedCall spoilt(call);
    spoilt.batch.generator = Generator{};
    spoilt.refused("generator");  // not read at all, or given together with u1, u2, u3
  }
  for (const auto column : {&Batch::u1, &Batch::u2, &Batch::u3}) {
    MalformedCall spoilt(kSample);
    const Column<float> kept = spoilt.batch.*column;
    spoilt.batch.u1 = spoilt.batch.u2 = spoilt.batch.u3 = {};
    spoilt.batch.generator = Generator{};
    spoilt.accepted();
    spoilt.batch.*column = kept;
    spoilt.answer = MalformedCall(kSample).answer;  // accepted() has written to it
    spoilt.batch.out = make_batch(kSample, spoilt.lanes, spoilt.answer).out;
    spoilt.refused("generator");
  }
}

TEST(Selection, NoRandomNumbersAtAll) {
  for (const Call& call : plain_calls()) {
    if (!samples(call)) continue;
    MalformedCall spoilt(call);
    spoilt.batch.u1 = spoilt.batch.u2 = spoilt.batch.u3 = {};
    spoilt.refused("u1");
  }
}

TEST(Selection, IdsThatAreWrong) {
  constexpr std::size_t kLanes = MalformedCall::kLanes;
  std::vector<std::uint64_t> ids(kLanes + 1);
  const auto with_ids = [&](const Column<std::uint64_t>& id, bool right) {
    MalformedCall call(kSample);
    call.batch.u1 = call.batch.u2 = call.batch.u3 = {};
    call.batch.generator = Generator{.seed = 1, .id = id};
    right ? call.accepted() : call.refused("generator.id");
  };
  const auto at = [&](std::ptrdiff_t bytes) {
    return reinterpret_cast<const std::uint64_t*>(reinterpret_cast<std::intptr_t>(ids.data()) + bytes);
  };
  with_ids({at(0), kLanes}, true);
  with_ids({at(4), kLanes}, true);  // 4 bytes of alignment are enough
  with_ids({at(0), 1}, true);
  with_ids({at(0), kLanes, 4}, true);  // overlapping inputs are no one's business
  with_ids({at(0), kLanes - 1}, false);
  with_ids({at(0), kLanes + 1}, false);
  with_ids({at(0), 0}, false);
  with_ids({nullptr, kLanes}, false);
  with_ids({nullptr, 1}, false);
  with_ids({at(2), kLanes - 1}, false);
  with_ids({at(1), 1}, false);
  with_ids({at(0), kLanes, 10}, false);
  with_ids({at(0), kLanes, ~std::size_t{0} - 7}, false);
}

TEST(Selection, ActiveLists) {
  constexpr std::uint32_t kLanes = MalformedCall::kLanes;
  for (const Call& call : plain_calls()) {
    for (const std::uint32_t index : {kLanes, kLanes + 1, 0x7FFFFFFFu, ~0u})
      for (const std::size_t place : {0u, 1u, 2u}) {
        std::vector<std::uint32_t> active = {0, 5, 3};
        active[place] = index;
        MalformedCall spoilt(call);
        spoilt.batch.active = active;
        spoilt.refused("active");
      }
    // More indices than there are lanes: one is there twice.
    const std::vector<std::uint32_t> too_many(kLanes + 1, 0);
    MalformedCall spoilt(call);
    spoilt.batch.active = too_many;
    spoilt.refused("active");
  }
  MalformedCall null(kSample), misaligned(kSample), empty(kSample);
  null.batch.active = std::span<const std::uint32_t>(static_cast<const std::uint32_t*>(nullptr), 2);
  null.refused("active");
  const std::vector<std::uint32_t> memory(4);
  const auto odd = reinterpret_cast<const std::uint32_t*>(reinterpret_cast<std::intptr_t>(memory.data()) + 2);
  misaligned.batch.active = std::span(odd, 3);
  misaligned.refused("active");
  const Answer before = empty.answer;
  empty.batch.active = std::span<const std::uint32_t>();
  const auto statistics = run(kSample.operation, empty.batch);
  ASSERT_TRUE(statistics.ok());
  EXPECT_EQ(statistics->lanes(), 0u);
  EXPECT_TRUE(same_bits(before, empty.answer));
}

// No lanes: columns may be empty, null or of one value, and the checks are made all the same.
TEST(Selection, NoLanes) {
  for (const Call& call : plain_calls()) {
    Batch batch;
    batch.model.shadowing = call.shadowing;
    batch.sampler = call.sampler;
    for (const InputField& field : input_fields())
      if (reads(call, field)) field.column(batch) = Column<float>(nullptr, 0);
    for (const OutputField& field : output_fields())
      if (field.operations & bit(call.operation)) field.column(batch) = OutputColumn<float>(nullptr, 0);
    batch.out.status = OutputColumn<std::uint8_t>(nullptr, 0);
    const auto statistics = run(call.operation, batch);
    ASSERT_TRUE(statistics.ok()) << call_name(call) << ": " << statistics.status();
    EXPECT_EQ(*statistics, Statistics{});

    Batch one_value = batch;
    for (const InputField& field : input_fields())
      if (reads(call, field)) field.column(one_value) = 0.5f;
    EXPECT_TRUE(run(call.operation, one_value).ok());
    one_value.active = std::span<const std::uint32_t>();
    EXPECT_TRUE(run(call.operation, one_value).ok());

    for (const InputField& field : input_fields()) {
      if (!reads(call, field) && (field.operations & bit(call.operation))) continue;  // optional
      Batch spoilt = batch;
      field.column(spoilt) = field.operations & bit(call.operation) ? Column<float>() : Column<float>(0.5f);
      if (field.name == "u3" && (field.operations & bit(call.operation)) && !uses_u3({}, call.sampler)) continue;
      const std::string message(run(call.operation, spoilt).status().message());
      EXPECT_EQ(message.substr(0, field.name.size()), field.name) << call_name(call);
    }
    std::vector<float> memory(2);
    Batch spoilt = batch;
    spoilt.alpha_y = memory;
    EXPECT_EQ(run(call.operation, spoilt).status().message(), "alpha_y: 2 values for 0 lanes");
  }
}

// A number of lanes that no memory has.
TEST(Selection, LanesBeyondTheAddressSpace) {
  MalformedCall spoilt(kSample);
  for (const std::size_t lanes : {~std::size_t{0}, ~std::size_t{0} / 4}) {
    Batch batch = spoilt.batch;
    batch.lanes = lanes;
    for (const InputField& field : input_fields())
      if (field.column(batch).present()) field.column(batch) = 0.5f;
    batch.out = {};
    batch.out.pdf = OutputColumn<float>(spoilt.answer.out[7].data(), lanes);
    const auto status = run(kSample.operation, batch).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(status.message().substr(0, 9), "out.pdf: ") << status;
  }
}

}  // namespace
}  // namespace facetwise::test
