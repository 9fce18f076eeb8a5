// SPDX-License-Identifier: Apache-2.0
// Malformed compactions: refused by name, and nothing is written.
#include "facetwise/engine.h"
#include "gtest/gtest.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 10;

// A compaction that is right, of all lanes; spoil it and call refused().
struct Spoilt {
  std::vector<std::uint8_t> status = std::vector<std::uint8_t>(kLanes, 0);
  std::vector<std::uint32_t> index = std::vector<std::uint32_t>(kLanes, 7u);
  std::vector<float> from = std::vector<float>(2 * kLanes, 1.0f), to = std::vector<float>(2 * kLanes, 2.0f);
  std::vector<std::uint32_t> active = {4, 2, 9};
  std::vector<Compaction::DenseColumn> columns;
  Compaction call;

  Spoilt() {
    columns = {{Column<float>(from.data(), kLanes), OutputColumn<float>(to.data(), kLanes)},
               {Column<float>(from.data() + kLanes, kLanes), OutputColumn<float>(to.data() + kLanes, kLanes)}};
    call.lanes = kLanes;
    call.status = status;
    call.index = index;
    call.columns = columns;
  }
  Spoilt(const Spoilt&) = delete;

  void refused(const std::string& field) {
    SCOPED_TRACE(field);
    const auto accepted = compact(call);
    EXPECT_EQ(accepted.status().code(), absl::StatusCode::kInvalidArgument) << accepted.status();
    EXPECT_EQ(std::string(accepted.status().message()).substr(0, field.size() + 2), field + ": ");
    EXPECT_EQ(check(call), accepted.status());
    EXPECT_EQ(compact(call, {.threads = Threads::one}).status(), accepted.status());
    EXPECT_EQ(local_engine()->compact(call).status(), accepted.status());
    const Spoilt whole;
    EXPECT_EQ(status, whole.status);
    EXPECT_EQ(index, whole.index);
    EXPECT_EQ(from, whole.from);
    EXPECT_EQ(to, whole.to);
    EXPECT_EQ(active, whole.active);
  }
};

template <class T>
T* moved(T* pointer, std::ptrdiff_t bytes) {
  return reinterpret_cast<T*>(reinterpret_cast<std::intptr_t>(pointer) + bytes);
}

TEST(CompactFault, WholeCallsAreAccepted) {
  Spoilt all, listed, none;
  EXPECT_EQ(*compact(all.call), kLanes);
  listed.call.active = listed.active;
  listed.call.index = OutputColumn<std::uint32_t>(listed.index.data(), 3);
  for (auto& column : listed.columns) column.to = OutputColumn<float>(column.to.data(), 3);
  EXPECT_EQ(*compact(listed.call), 3u);
  EXPECT_EQ(listed.index, (std::vector<std::uint32_t>{4, 2, 9, 7, 7, 7, 7, 7, 7, 7}));
  Compaction empty;
  empty.status = Column<std::uint8_t>(nullptr, 0);
  EXPECT_EQ(*compact(empty), 0u);
}

TEST(CompactFault, Status) {
  const auto with = [](const auto& change) {
    Spoilt spoilt;
    change(spoilt);
    spoilt.refused("status");
  };
  with([](Spoilt& s) { s.call.status = {}; });
  with([](Spoilt& s) { s.call.status = Column<std::uint8_t>(s.status.data(), kLanes - 1); });
  with([](Spoilt& s) { s.call.status = Column<std::uint8_t>(s.status.data(), 0); });
  with([](Spoilt& s) { s.call.status = Column<std::uint8_t>(nullptr, kLanes); });
  with([](Spoilt& s) { s.call.status = Column<std::uint8_t>(s.status.data(), kLanes, ~std::size_t{0} / 2); });
}

TEST(CompactFault, Index) {
  const auto with = [](const OutputColumn<std::uint32_t>& column) {
    Spoilt spoilt;
    spoilt.call.index = column;
    spoilt.refused("index");
  };
  std::vector<std::uint32_t> memory(2 * kLanes);
  with({memory.data(), kLanes - 1});
  with({memory.data(), kLanes + 1});
  with({memory.data(), 0});
  with({memory.data(), 1});
  with({nullptr, kLanes});
  with({moved(memory.data(), 2), kLanes});
  with({memory.data(), kLanes, 0});
  with({memory.data(), kLanes, 2});
  with({memory.data(), kLanes, 6});
  EXPECT_EQ(memory, std::vector<std::uint32_t>(2 * kLanes));
}

TEST(CompactFault, DenseColumns) {
  for (const std::size_t k : {0u, 1u}) {
    const std::string name = "columns[" + std::to_string(k) + "]";
    const auto with_from = [&](const Column<float>& from) {
      Spoilt spoilt;
      spoilt.columns[k].from = from;
      spoilt.refused(name + ".from");
    };
    const auto with_to = [&](const OutputColumn<float>& to) {
      Spoilt spoilt;
      spoilt.columns[k].to = to;
      spoilt.refused(name + ".to");
    };
    std::vector<float> memory(2 * kLanes);
    with_from({});
    with_from({memory.data(), kLanes - 1});
    with_from({nullptr, kLanes});
    with_from({moved(memory.data(), 1), kLanes});
    with_from({memory.data(), kLanes, 5});
    with_to({});
    with_to({memory.data(), kLanes - 1});
    with_to({nullptr, kLanes});
    with_to({moved(memory.data(), 3), kLanes});
    with_to({memory.data(), kLanes, 0});
    with_to({memory.data(), kLanes, 6});
    EXPECT_EQ(memory, std::vector<float>(2 * kLanes));
  }
}

TEST(CompactFault, Active) {
  const auto with = [](const std::vector<std::uint32_t>& active) {
    Spoilt spoilt;
    spoilt.call.active = active;
    spoilt.call.index = OutputColumn<std::uint32_t>(spoilt.index.data(), active.size());
    for (auto& column : spoilt.columns) column.to = OutputColumn<float>(column.to.data(), active.size());
    spoilt.refused("active");
  };
  with({0, 1, kLanes});
  with({~0u});
  with(std::vector<std::uint32_t>(kLanes + 1, 0));
  Spoilt null;
  null.call.active = std::span<const std::uint32_t>(static_cast<const std::uint32_t*>(nullptr), 3);
  null.refused("active");
}

// Outputs are memory of their own.
TEST(CompactFault, Overlap) {
  const auto with = [](const std::string& field, const auto& change) {
    Spoilt spoilt;
    change(spoilt);
    spoilt.refused(field);
  };
  with("index", [](Spoilt& s) { s.call.status = {reinterpret_cast<std::uint8_t*>(s.index.data()), kLanes}; });
  with("index", [](Spoilt& s) { s.columns[1].from = {reinterpret_cast<float*>(s.index.data()), kLanes}; });
  with("index", [](Spoilt& s) { s.columns[1].to = {reinterpret_cast<float*>(s.index.data()) + 9, kLanes}; });
  with("index", [](Spoilt& s) {
    s.call.active = s.active;
    s.call.index = OutputColumn<std::uint32_t>(s.active.data(), 3);
    for (auto& column : s.columns) column.to = OutputColumn<float>(column.to.data(), 3);
  });
  // In place, which compaction in chunks cannot do.
  with("columns[0].to", [](Spoilt& s) { s.columns[0].to = {s.from.data(), kLanes}; });
  with("columns[0].to", [](Spoilt& s) { s.columns[1].from = {s.to.data() + 3, kLanes}; });
  with("columns[1].to", [](Spoilt& s) { s.columns[1].to = {s.to.data() + 1, kLanes}; });
  with("columns[1].to", [](Spoilt& s) { s.columns[1].to = {s.from.data() + kLanes - 1, kLanes}; });
}

}  // namespace
}  // namespace facetwise::test
