// SPDX-License-Identifier: Apache-2.0
// Overlap of outputs with inputs, with each other and with the active list.
#include <cstring>

#include "faults/malformed_call.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = MalformedCall::kLanes;
const Call kSample{Operation::sample_reflection, Sampler::exact, Shadowing::correlated};

struct Present {
  std::vector<const InputField*> in;
  std::vector<const OutputField*> out;
  explicit Present(const Call& call) {
    for (const InputField& field : input_fields())
      if (reads(call, field)) in.push_back(&field);
    for (const OutputField& field : output_fields())
      if (writes(call, field)) out.push_back(&field);
  }
};

// Outputs over inputs are named, and name what they overlap.
TEST(Overlap, EveryOutputWithEveryInput) {
  for (const Call& call : plain_calls()) {
    const Present present(call);
    for (const OutputField* out : present.out)
      for (const InputField* in : present.in) {
        // A column of inputs with a lane of room on both sides.
        std::vector<float> memory(3 * kLanes, 0.5f);
        const std::vector<float> before = memory;
        float* const middle = memory.data() + kLanes;
        const auto place = [&](std::ptrdiff_t shift, std::size_t stride) {
          MalformedCall made(call);
          in->column(made.batch) = Column<float>(middle, kLanes);
          out->column(made.batch) = OutputColumn<float>(middle + shift, kLanes, stride);
          if (shift == 0 && stride == sizeof(float)) {
            EXPECT_TRUE(check(call.operation, made.batch).ok());
          } else if (shift <= -std::ptrdiff_t{kLanes} && stride == sizeof(float)) {
            EXPECT_TRUE(check(call.operation, made.batch).ok()) << "neighbours do not overlap";
          } else {
            made.refused(out->name);
            const std::string message(check(call.operation, made.batch).message());
            EXPECT_NE(message.find(std::string(in->name)), message.npos) << message;
          }
        };
        for (const std::ptrdiff_t shift : {-std::ptrdiff_t{kLanes}, 1 - std::ptrdiff_t{kLanes}, std::ptrdiff_t{-1},
                                           std::ptrdiff_t{0}, std::ptrdiff_t{1}, std::ptrdiff_t{kLanes - 1}})
          place(shift, sizeof(float));
        place(0, 2 * sizeof(float));  // the same start, other lanes
        EXPECT_TRUE(same_bytes(memory, before));

        // One value for all lanes is every lane's: not to be written by one.
        MalformedCall shared(call);
        in->column(shared.batch) = Column<float>(middle + 3, 1);
        out->column(shared.batch) = OutputColumn<float>(middle, kLanes);
        shared.refused(out->name);
      }
  }
}

TEST(Overlap, TwoOutputs) {
  for (const Call& call : plain_calls()) {
    const Present present(call);
    for (const OutputField* a : present.out)
      for (const OutputField* b : present.out) {
        if (a == b) continue;
        for (const std::ptrdiff_t shift : {0, 1, 11}) {
          std::vector<float> memory(2 * kLanes);
          MalformedCall spoilt(call);
          a->column(spoilt.batch) = OutputColumn<float>(memory.data(), kLanes);
          b->column(spoilt.batch) = OutputColumn<float>(memory.data() + shift, kLanes);
          spoilt.refused(a > b ? a->name : b->name);  // the later field
        }
      }
    for (const OutputField* out : present.out) {
      MalformedCall spoilt(call);
      const OutputColumn<float> column = out->column(spoilt.batch);
      // The last byte of the last lane.
      spoilt.batch.out.status = {reinterpret_cast<std::uint8_t*>(column.data()) + 4 * kLanes - 1, kLanes};
      spoilt.refused("out.status");
    }
  }
}

TEST(Overlap, StatusWithInputs) {
  for (const Call& call : plain_calls())
    for (const InputField* in : Present(call).in) {
      MalformedCall spoilt(call);
      const Column<float> column = in->column(spoilt.batch);
      auto* bytes = const_cast<std::uint8_t*>(reinterpret_cast<const std::uint8_t*>(column.data()));
      spoilt.batch.out.status = {bytes, kLanes, sizeof(float)};
      spoilt.refused("out.status");
    }
}

TEST(Overlap, ActiveList) {
  std::vector<std::uint32_t> active = {3, 1, 2};
  const auto* memory = active.data();
  for (const std::ptrdiff_t first : {-11, 0, 2}) {
    MalformedCall spoilt(kSample);
    spoilt.batch.active = active;
    spoilt.batch.out.pdf = {const_cast<float*>(reinterpret_cast<const float*>(memory)) + first, kLanes};
    spoilt.refused("out.pdf");
    EXPECT_EQ(active, (std::vector<std::uint32_t>{3, 1, 2}));
  }
  // As many indices as lanes: never "the same lanes".
  std::vector<std::uint32_t> all(kLanes);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) all[lane] = lane;
  MalformedCall spoilt(kSample);
  spoilt.batch.active = all;
  spoilt.batch.out.pdf = {reinterpret_cast<float*>(all.data()), kLanes};
  spoilt.refused("out.pdf");
}

TEST(Overlap, Ids) {
  std::vector<std::uint64_t> ids(kLanes);
  for (const std::ptrdiff_t first : {0, 1}) {
    MalformedCall spoilt(kSample);
    spoilt.batch.u1 = spoilt.batch.u2 = spoilt.batch.u3 = {};
    spoilt.batch.generator = Generator{.seed = 1, .id = ids};
    spoilt.batch.out.weight = {reinterpret_cast<float*>(ids.data()) + first, kLanes, 8};
    spoilt.refused("out.weight");
  }
}

// Members of one array of structures are no overlap, whichever lie between which.
TEST(Overlap, MembersOfStructures) {
  for (const Call& call : plain_calls()) {
    const Present present(call);
    const std::size_t members = present.in.size() + present.out.size() + 1;
    std::vector<float> memory(members * kLanes, 0.5f);
    MalformedCall whole(call);
    std::size_t next = 0;
    const std::size_t stride = members * sizeof(float);
    for (const OutputField* out : present.out) out->column(whole.batch) = {memory.data() + next++, kLanes, stride};
    whole.batch.out.status = {reinterpret_cast<std::uint8_t*>(memory.data() + next++) + 3, kLanes, stride};
    for (const InputField* in : present.in) in->column(whole.batch) = {memory.data() + next++, kLanes, stride};
    whole.accepted();

    // One byte too far: the status in a member's memory.
    MalformedCall spoilt(call);
    spoilt.batch = whole.batch;
    spoilt.batch.out.status = {reinterpret_cast<std::uint8_t*>(memory.data()) + 3, kLanes, stride};
    spoilt.refused("out.status");
    // The same structure shifted by a lane.
    spoilt.batch = whole.batch;
    present.out[0]->column(spoilt.batch) = {memory.data() + present.out.size() + 1 + members, kLanes - 1, stride};
    spoilt.batch.lanes = kLanes - 1;
    for (const OutputField* out : present.out)
      if (out != present.out[0]) out->column(spoilt.batch) = {out->column(spoilt.batch).data(), kLanes - 1, stride};
    for (const InputField* in : present.in)
      in->column(spoilt.batch) = {in->column(spoilt.batch).data(), kLanes - 1, stride};
    spoilt.batch.out.status = {whole.batch.out.status.data(), kLanes - 1, stride};
    spoilt.refused(present.out[0]->name);
  }
}

// A pair of values per lane against columns of another stride: some lanes meet.
TEST(Overlap, DifferentStrides) {
  std::vector<float> memory(8 * kLanes, 0.25f);
  MalformedCall spoilt(kSample);
  spoilt.batch.u1 = {memory.data(), kLanes, 12};
  spoilt.batch.out.pdf = {memory.data() + 1, kLanes, 20};
  spoilt.refused("out.pdf");
  // Even and odd floats never meet.
  MalformedCall whole(kSample);
  whole.batch.u1 = {memory.data(), kLanes, 8};
  whole.batch.out.pdf = {memory.data() + 1, kLanes, 16};
  whole.accepted();
}

// Inputs may share memory as they like.
TEST(Overlap, InputsAmongThemselves) {
  for (const Call& call : plain_calls()) {
    MalformedCall whole(call);
    std::vector<float> memory(2 * kLanes, 0.5f);
    std::size_t shift = 0;
    for (const InputField* in : Present(call).in) in->column(whole.batch) = {memory.data() + shift++, kLanes};
    whole.accepted();
  }
}

}  // namespace
}  // namespace facetwise::test
