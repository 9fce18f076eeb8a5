// SPDX-License-Identifier: Apache-2.0
// Compaction by a server gives what the local engine's does, piece by piece and stable in order.
#include <string>
#include <vector>

#include "columns.h"
#include "facetwise/client.h"
#include "gtest/gtest.h"
#include "server_process.h"

namespace facetwise {
namespace {

using testing::kUntouched;
using testing::Memory;
using testing::Shape;

class RemoteCompact : public ::testing::Test {
 protected:
  testing::TemporaryFolder folder_;
  testing::ServerProcess server_{{"--listen", "unix:" + folder_.path("s")}};
  absl::StatusOr<std::unique_ptr<Engine>> engine_ = connect(server_.addresses(), {.piece_bytes = 4096});
};

TEST_F(RemoteCompact, IsTheSameForEveryShapeOfColumn) {
  ASSERT_TRUE(engine_.ok()) << engine_.status();
  for (const std::size_t lanes : {0, 1, 2, 15, 16, 17, 333, 1009, 20011}) {
    for (const Shape shape : {Shape::contiguous, Shape::strided}) {
      for (const bool has_active : {false, true}) {
        for (const std::size_t width : {0, 1, 3, 150}) {
          if (width == 150 && lanes > 1009) continue;
          SCOPED_TRACE(::testing::Message() << lanes << " lanes, active " << has_active << ", columns " << width);
          Memory<std::uint8_t> status(lanes, shape, 0);
          Memory<float> values(lanes, shape, 0);
          std::vector<std::uint32_t> active;
          for (std::size_t k = 0; k < lanes; ++k) {
            status[k] = (k * 2654435761u >> 7) % 4;
            values[k] = static_cast<float>(k) + 0.5f;
            if (k % 5 != 2) active.insert(active.begin() + active.size() / 2, k);
          }
          const std::size_t room = has_active ? active.size() : lanes;
          struct Result {
            std::vector<Memory<float>> columns;
            Memory<std::uint32_t> index;
            std::size_t accepted = 0;
            bool operator==(const Result&) const = default;
          };
          const auto compact_on = [&](Engine& on) {
            Result result{{}, {room, shape, 12345}};
            std::vector<Compaction::DenseColumn> dense;
            for (std::size_t k = 0; k < width; ++k) result.columns.emplace_back(room, shape, kUntouched);
            for (std::size_t k = 0; k < width; ++k)
              dense.push_back({k == 1 ? Column<float>(3.5f) : values.in(), result.columns[k].out()});
            Compaction compaction{
                .lanes = lanes, .active = {}, .status = status.in(), .index = result.index.out(), .columns = dense};
            if (has_active) compaction.active = active;
            const auto accepted = on.compact(compaction);
            EXPECT_TRUE(accepted.ok()) << accepted.status();
            result.accepted = accepted.value_or(99999);
            return result;
          };
          const Result far = compact_on(**engine_), near = compact_on(*local_engine());
          EXPECT_EQ(far.accepted, near.accepted);
          EXPECT_TRUE(far == near);
        }
      }
    }
  }
}

TEST_F(RemoteCompact, TakesOneStatusForAll) {
  ASSERT_TRUE(engine_.ok()) << engine_.status();
  for (const std::uint8_t status : {0, 2}) {
    std::vector<std::uint32_t> index(5000, 1);
    Compaction compaction{.lanes = 5000, .active = {}, .status = status, .index = index, .columns = {}};
    const auto accepted = (*engine_)->compact(compaction);
    ASSERT_TRUE(accepted.ok()) << accepted.status();
    EXPECT_EQ(*accepted, status == 0 ? 5000u : 0u);
    EXPECT_EQ(index[4999], status == 0 ? 4999u : 1u);
  }
}

}  // namespace
}  // namespace facetwise
