// SPDX-License-Identifier: Apache-2.0
// Comparisons of answers, bit by bit.
#pragma once

#include <cstdint>
#include <vector>

#include "gtest/gtest.h"
#include "support/call.h"

namespace facetwise::test {

// Memory of an answer as make_batch() leaves it: nothing is written yet.
Answer blank_answer(const Call& call, std::size_t lanes);
// run(); an error fails the test.
Statistics run_ok(const Call& call, const Batch& batch, const Execution& execution = {});
// All lanes, in contiguous columns; an error fails the test.
Answer compute(const Call& call, const Lanes& lanes, const Execution& execution = {});

// Fail the test at the first difference in bits, naming field and lane.
void expect_same(const Call& call, const Answer& expected, const Answer& got);
void expect_same_lane(const Call& call, const Answer& expected, std::size_t expected_lane, const Answer& got,
                      std::size_t got_lane);

// Those lanes, in that order; a run of lanes.
Lanes pick(const Lanes& lanes, const std::vector<std::uint32_t>& which);
Lanes slice(const Lanes& lanes, std::size_t begin, std::size_t count);

// A random order of `count` lanes.
std::vector<std::uint32_t> shuffled(std::size_t count, std::uint64_t seed);

// What the status column says. A status that does not exist fails the test.
Statistics recount(const std::vector<std::uint8_t>& status);

}  // namespace facetwise::test
