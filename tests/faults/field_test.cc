// SPDX-License-Identifier: Apache-2.0
// Each column of each operation: missing, unknown, of the wrong length, null, misaligned, badly strided.
#include "faults/malformed_call.h"

namespace facetwise::test {
namespace {

template <class Column>
Column over(const Column& column, std::size_t count, std::size_t stride) {
  return {column.data(), count, stride};
}
template <class T>
T* moved(T* pointer, std::ptrdiff_t bytes) {
  return reinterpret_cast<T*>(reinterpret_cast<std::intptr_t>(pointer) + bytes);
}

// Calls body(call, field) for every input (every output) that the operation has, or has not.
template <class Body>
void for_each_input(bool known, const Body& body) {
  for (const Call& call : plain_calls())
    for (const InputField& field : input_fields())
      if (known ? reads(call, field) || (field.name == "u3" && (field.operations & bit(call.operation)) != 0)
                : !(field.operations & bit(call.operation)))
        body(call, field);
}
template <class Body>
void for_each_output(bool known, const Body& body) {
  for (const Call& call : plain_calls())
    for (const OutputField& field : output_fields())
      if (known ? writes(call, field) : !(field.operations & bit(call.operation))) body(call, field);
}

TEST(Field, WholeCallsAreAccepted) {
  for (const Call& call : plain_calls()) MalformedCall(call).accepted();
}

TEST(Field, MissingInput) {
  for_each_input(true, [](const Call& call, const InputField& field) {
    MalformedCall spoilt(call);
    field.column(spoilt.batch) = {};
    if (field.name == "u3" && !uses_u3({}, call.sampler)) {
      spoilt.accepted();
    } else {
      spoilt.refused(field.name);
    }
  });
}

TEST(Field, OutputsAreOptional) {
  for_each_output(true, [](const Call& call, const OutputField& field) {
    MalformedCall whole(call);
    field.column(whole.batch) = {};
    whole.accepted();
  });
  for (const Call& call : plain_calls()) {
    MalformedCall whole(call);
    whole.batch.out = {};
    whole.accepted();
  }
}

TEST(Field, InputThatTheOperationDoesNotRead) {
  for_each_input(false, [](const Call& call, const InputField& field) {
    MalformedCall spoilt(call);
    field.column(spoilt.batch) = 0.5f;
    spoilt.refused(field.name);
    field.column(spoilt.batch) = spoilt.lanes.in[0];
    spoilt.refused(field.name);
  });
}

TEST(Field, OutputThatTheOperationDoesNotCompute) {
  for_each_output(false, [](const Call& call, const OutputField& field) {
    MalformedCall spoilt(call);
    std::vector<float> memory(MalformedCall::kLanes, 3.0f);
    field.column(spoilt.batch) = memory;
    spoilt.refused(field.name);
    EXPECT_EQ(memory, std::vector<float>(MalformedCall::kLanes, 3.0f));
  });
}

TEST(Field, InputOfTheWrongLength) {
  constexpr std::size_t kLanes = MalformedCall::kLanes;
  for_each_input(true, [](const Call& call, const InputField& field) {
    for (const std::size_t count : {std::size_t{0}, std::size_t{2}, kLanes - 1, kLanes + 1, ~std::size_t{0}}) {
      MalformedCall spoilt(call);
      field.column(spoilt.batch) = over(field.column(spoilt.batch), count, sizeof(float));
      spoilt.refused(field.name);
    }
  });
  // The message has both numbers.
  MalformedCall spoilt({Operation::masking, Sampler::cap, Shadowing::correlated});
  spoilt.batch.alpha_x = over(spoilt.batch.alpha_x, 10, sizeof(float));
  EXPECT_EQ(check(Operation::masking, spoilt.batch).message(), "alpha_x: 10 values for 12 lanes");
}

TEST(Field, OutputOfTheWrongLength) {
  constexpr std::size_t kLanes = MalformedCall::kLanes;
  const auto counts = {std::size_t{0}, std::size_t{1}, kLanes - 1, kLanes + 1};
  for_each_output(true, [&](const Call& call, const OutputField& field) {
    for (const std::size_t count : counts) {
      MalformedCall spoilt(call);
      field.column(spoilt.batch) = over(field.column(spoilt.batch), count, sizeof(float));
      spoilt.refused(field.name);
    }
  });
  for (const Call& call : plain_calls())
    for (const std::size_t count : counts) {
      MalformedCall spoilt(call);
      spoilt.batch.out.status = over(spoilt.batch.out.status, count, 1);
      spoilt.refused("out.status");
    }
}

TEST(Field, NullPointer) {
  for_each_input(true, [](const Call& call, const InputField& field) {
    for (const std::size_t count : {std::size_t{1}, MalformedCall::kLanes}) {
      MalformedCall spoilt(call);
      field.column(spoilt.batch) = Column<float>(nullptr, count);
      spoilt.refused(field.name);
    }
  });
  for_each_output(true, [](const Call& call, const OutputField& field) {
    MalformedCall spoilt(call);
    field.column(spoilt.batch) = OutputColumn<float>(nullptr, MalformedCall::kLanes);
    spoilt.refused(field.name);
  });
  for (const Call& call : plain_calls()) {
    MalformedCall spoilt(call);
    spoilt.batch.out.status = OutputColumn<std::uint8_t>(nullptr, MalformedCall::kLanes);
    spoilt.refused("out.status");
  }
}

TEST(Field, MisalignedPointer) {
  for (const std::ptrdiff_t bytes : {1, 2, 3}) {
    for_each_input(true, [&](const Call& call, const InputField& field) {
      for (const std::size_t count : {std::size_t{1}, MalformedCall::kLanes}) {
        MalformedCall spoilt(call);
        const Column<float> column = field.column(spoilt.batch);
        field.column(spoilt.batch) = Column<float>(moved(column.data(), bytes), count);
        spoilt.refused(field.name);
      }
    });
    for_each_output(true, [&](const Call& call, const OutputField& field) {
      MalformedCall spoilt(call);
      const OutputColumn<float> column = field.column(spoilt.batch);
      field.column(spoilt.batch) = OutputColumn<float>(moved(column.data(), bytes), MalformedCall::kLanes);
      spoilt.refused(field.name);
    });
  }
}

TEST(Field, BadStride) {
  constexpr std::size_t kLanes = MalformedCall::kLanes, kNegative = ~std::size_t{0} - 3;
  for_each_input(true, [](const Call& call, const InputField& field) {
    for (const std::size_t stride : {std::size_t{1}, std::size_t{5}, std::size_t{6}, kNegative, kNegative / 8 * 4}) {
      MalformedCall spoilt(call);
      field.column(spoilt.batch) = over(field.column(spoilt.batch), kLanes, stride);
      spoilt.refused(field.name);
    }
  });
  for_each_output(true, [](const Call& call, const OutputField& field) {
    for (const std::size_t stride : {std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{6}, kNegative}) {
      MalformedCall spoilt(call);
      field.column(spoilt.batch) = over(field.column(spoilt.batch), kLanes, stride);
      spoilt.refused(field.name);
    }
  });
  for (const Call& call : plain_calls()) {
    MalformedCall spoilt(call);
    spoilt.batch.out.status = over(spoilt.batch.out.status, kLanes, 0);
    spoilt.refused("out.status");
  }
}

// The stride of a column of one value means nothing.
TEST(Field, AnyStrideOfOneValue) {
  for_each_input(true, [](const Call& call, const InputField& field) {
    MalformedCall whole(call);
    field.column(whole.batch) = over(field.column(whole.batch), 1, 7);
    whole.accepted();
  });
}

}  // namespace
}  // namespace facetwise::test
