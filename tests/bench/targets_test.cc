// SPDX-License-Identifier: Apache-2.0
// The performance to reach: every row is measured, or says why not. Whether it is met is not tested: that is
// for a quiet machine.
#include "bench/targets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace facetwise::bench {
namespace {

TEST(Targets, EachIsMeasuredOrSaysWhyNot) {
  const auto engine = local_engine();
  BenchOptions options;
  options.remote = engine.get();
  auto columns = Columns::make(std::size_t{1} << 20, std::size_t{1} << 16);
  ASSERT_TRUE(columns.ok()) << columns.status();
  BenchReport report;
  report.threads = 2;
  const absl::Status status = measure_targets(
      options, *columns, [] { return true; }, report);
  ASSERT_TRUE(status.ok()) << status;
  std::size_t missing = 0;
  for (const TargetResult& t : report.targets) {
    SCOPED_TRACE(t.what);
    EXPECT_GT(t.required, 0);
    if (t.measured) {
      EXPECT_TRUE(std::isfinite(*t.measured));
      EXPECT_GT(*t.measured, 0);
      EXPECT_EQ(*t.met(), t.at_least ? *t.measured >= t.required : *t.measured <= t.required);
    } else {
      ++missing;
      EXPECT_EQ(t.note.substr(0, 13), "not measured:");
    }
  }
  std::size_t vector_targets = 0;
  for (const Target target : available_targets()) vector_targets += vector_lanes(target) >= 8;
  EXPECT_EQ(missing, 9 * vector_targets) << "16 M lanes do not fit into these columns";
  // Per vector target four rows of samplers, eight of large batches and two of placements; small batches, threads and
  // remote.
  EXPECT_EQ(report.targets.size(), 14 * vector_targets + 5);
}

TEST(Targets, WithoutServerOrThreads) {
  auto columns = Columns::make(std::size_t{1} << 17);
  ASSERT_TRUE(columns.ok());
  BenchReport report;
  report.threads = 1;
  ASSERT_TRUE(measure_targets(
                  {}, *columns, [] { return true; }, report)
                  .ok());
  EXPECT_FALSE(report.targets.back().measured);
  EXPECT_NE(report.targets.back().note.find("no server"), std::string::npos);
  EXPECT_FALSE(report.targets.back().met());
}

TEST(Targets, Stop) {
  auto columns = Columns::make(std::size_t{1} << 17);
  ASSERT_TRUE(columns.ok());
  BenchReport report;
  EXPECT_EQ(measure_targets(
                {}, *columns, [] { return false; }, report)
                .code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(report.targets.size(), 1u);
}

}  // namespace
}  // namespace facetwise::bench
