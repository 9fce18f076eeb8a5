// SPDX-License-Identifier: Apache-2.0
#include "faults/malformed_call.h"

#include <cstring>

namespace facetwise::test {

bool same_bytes(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

MalformedCall::MalformedCall(const Call& call, std::size_t count) : lanes(ordinary_lanes(count, 1)), call_(call) {
  batch = make_batch(call, lanes, answer);
  lanes_before_ = lanes;
  answer_before_ = answer;
}

void MalformedCall::refused(std::string_view field) {
  SCOPED_TRACE(call_name(call_) + ", " + std::string(field));
  const absl::Status checked = check(call_.operation, batch);
  EXPECT_EQ(checked.code(), absl::StatusCode::kInvalidArgument) << checked;
  const std::string message(checked.message());
  const std::string start = std::string(field) + ": ";
  EXPECT_EQ(message.substr(0, start.size()), start);
  EXPECT_GT(message.size(), start.size()) << "it says what is wrong";
  for (const Execution& execution :
       {Execution{}, Execution{.threads = Threads::one}, Execution{.target = Target::scalar}})
    EXPECT_EQ(run(call_.operation, batch, execution).status(), checked);
  EXPECT_EQ(local_engine()->run(call_.operation, batch).status(), checked);

  for (std::size_t k = 0; k < lanes.in.size(); ++k)
    EXPECT_TRUE(same_bytes(lanes.in[k], lanes_before_.in[k])) << input_fields()[k].name << " was written";
  for (std::size_t k = 0; k < answer.out.size(); ++k)
    EXPECT_TRUE(same_bytes(answer.out[k], answer_before_.out[k])) << output_fields()[k].name << " was written";
  EXPECT_EQ(answer.status, answer_before_.status);
}

void MalformedCall::accepted() {
  SCOPED_TRACE(call_name(call_));
  EXPECT_EQ(check(call_.operation, batch), absl::OkStatus());
  EXPECT_EQ(run(call_.operation, batch).status(), absl::OkStatus());
}

}  // namespace facetwise::test
