// SPDX-License-Identifier: Apache-2.0
// The caller's floating-point control register changes no result and is left as it was: callers built on
// Embree flush denormals, some round otherwise, some trap.
#include <cstdint>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"
#include "tbb/global_control.h"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace facetwise::test {
namespace {

#if defined(__x86_64__)
using Register = unsigned;
Register control() { return _mm_getcsr(); }
void set_control(Register value) { _mm_setcsr(value); }
constexpr Register kDefault = 0x1F80;
constexpr Register kFlush = 0x8040;  // FTZ and DAZ
constexpr Register kNearest = 0, kDown = 0x2000, kUp = 0x4000, kToZero = 0x6000;
#elif defined(__aarch64__)
using Register = std::uint64_t;
Register control() {
  Register value;
  asm volatile("mrs %0, fpcr" : "=r"(value));
  return value;
}
void set_control(Register value) { asm volatile("msr fpcr, %0" : : "r"(value) : "memory"); }
constexpr Register kDefault = 0;
constexpr Register kFlush = 1u << 24;
constexpr Register kNearest = 0, kUp = 1u << 22, kDown = 2u << 22, kToZero = 3u << 22;
#endif

// What a register's value does to a calculation here.
bool flushes(Register value) {
  volatile float small = 0x1p-126f;
  set_control(value);
  const volatile float half = small * 0.5f;
  set_control(kDefault);
  return half == 0.0f;
}
float third(Register value, float sign) {
  volatile float one = sign, three = 3.0f;
  set_control(value);
  const volatile float result = one / three;
  set_control(kDefault);
  return result;
}

void expect_same_under(Register value, std::size_t count, const Execution& execution) {
  const Lanes lanes = hard_lanes(Kind::mixed, count, 51);
  for (const Call& call : all_calls()) {
    const Answer expected = compute(call, lanes, execution);
    Answer got;
    const Batch batch = make_batch(call, lanes, got);
    set_control(value);
    const auto statistics = run(call.operation, batch, execution);
    const Register after = control();
    set_control(kDefault);
    ASSERT_TRUE(statistics.ok()) << call_name(call);
    EXPECT_EQ(after, value) << call_name(call);
    got.statistics = *statistics;
    expect_same(call, expected, got);
  }
}

TEST(Environment, FlushToZero) {
  ASSERT_TRUE(flushes(kDefault | kFlush)) << "the mode that this test is about";
  ASSERT_FALSE(flushes(kDefault));
  for (const Target target : available_targets())
    expect_same_under(kDefault | kFlush, kQuick ? 1000 : 5000, {.target = target, .threads = Threads::one});
}

TEST(Environment, RoundingModes) {
  const float nearest = third(kDefault | kNearest, 1);  // above 1/3
  ASSERT_LT(third(kDefault | kDown, 1), nearest);
  ASSERT_EQ(third(kDefault | kUp, 1), nearest);
  ASSERT_LT(third(kDefault | kToZero, 1), nearest);
  ASSERT_GT(third(kDefault | kUp, -1), -nearest);
  for (const Register rounding : {kDown, kUp, kToZero}) {
    for (const Target target : available_targets())
      expect_same_under(kDefault | rounding, kQuick ? 500 : 5000, {.target = target, .threads = Threads::one});
    expect_same_under(kDefault | rounding | kFlush, 700, {});
  }
}

// Worker threads have registers of their own, or get the caller's.
TEST(Environment, WithThreads) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 2);
  expect_same_under(kDefault | kFlush | kDown, kQuick ? 20000 : 60000, {.threads = Threads::several});
}

#if defined(__x86_64__)
// A caller that traps on every exception, and one that keeps the sticky flags in view: both are in the
// register.
TEST(Environment, TrapsAndStickyFlags) {
  expect_same_under(0, 5000, {.threads = Threads::one});
  expect_same_under(kDefault | 0x3F, 1000, {.threads = Threads::one});
}
#endif

TEST(Environment, AfterAnError) {
  Batch batch;
  batch.lanes = 3;
  set_control(kDefault | kFlush | kUp);
  const auto statistics = masking(batch);
  const Register after = control();
  set_control(kDefault);
  EXPECT_FALSE(statistics.ok());
  EXPECT_EQ(after, kDefault | kFlush | kUp);
}

}  // namespace
}  // namespace facetwise::test
