// SPDX-License-Identifier: Apache-2.0
// A call that a test spoils in one way, and the proof that it is refused and writes nothing.
#pragma once

#include <string_view>

#include "gtest/gtest.h"
#include "support/call.h"

namespace facetwise::test {

// A batch that is right, over memory of its own. Spoil `batch`, then call refused().
class MalformedCall {
 public:
  static constexpr std::size_t kLanes = 12;

  explicit MalformedCall(const Call& call, std::size_t lanes = kLanes);
  MalformedCall(const MalformedCall&) = delete;  // `batch` points into this

  Batch batch;
  Lanes lanes;
  Answer answer;

  // Fails the test unless check() and run(), however it runs, give InvalidArgument with a message that begins
  // with `field` and ": ", and every byte of the inputs and outputs is as it was.
  void refused(std::string_view field);
  // Fails the test unless the call is accepted by both.
  void accepted();

 private:
  Call call_;
  Lanes lanes_before_;
  Answer answer_before_;
};

// Whether the bytes of two columns are the same.
bool same_bytes(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace facetwise::test
