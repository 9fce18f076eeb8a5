// SPDX-License-Identifier: Apache-2.0
// A call allocates nothing of its own. This program counts what goes through operator new.
#include <atomic>
#include <cstdlib>
#include <new>

#include "determinism/compare.h"
#include "support/counts.h"
#include "support/hard_lanes.h"

namespace {

std::atomic<std::size_t> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
  if (void* memory = std::aligned_alloc(alignment, rounded == 0 ? alignment : rounded)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t align) { return counted(size, static_cast<std::size_t>(align)); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace facetwise::test {
namespace {

TEST(Allocation, IsCounted) {
  const std::size_t before = allocations;
  delete new volatile int(1);
  EXPECT_EQ(allocations - before, 1u);
}

// Contiguous; an active list; strided and generated. On the calling thread, and on all: TBB's own memory,
// which a first call may get, is not got by operator new.
TEST(Allocation, NoneByCalls) {
  const std::size_t count = kQuick ? 10'000 : 50'000;
  const Lanes lanes = hard_lanes(Kind::mixed, count, 81);
  const std::vector<std::uint32_t> active = {5, 3, 9'999};
  for (const Call& call : all_calls()) {
    Answer answer;
    const Batch contiguous = make_batch(call, lanes, answer);
    Batch listed = contiguous, strided = contiguous;
    listed.active = active;
    strided.lanes = count / 2;
    for (const InputField& field : input_fields())
      if (reads(call, field)) field.column(strided) = {field.column(strided).data(), count / 2, 8};
    for (const OutputField& field : output_fields())
      if (writes(call, field)) field.column(strided) = {field.column(strided).data(), count / 2, 8};
    strided.out.status = {answer.status.data(), count / 2, 2};
    if (strided.out.event.present()) strided.out.event = {answer.event.data(), count / 2, 2};
    if (strided.u1.present()) {
      strided.u1 = strided.u2 = strided.u3 = {};
      strided.generator = Generator{.seed = 1};
    }
    for (const Batch& batch : {contiguous, listed, strided})
      for (const Threads threads : {Threads::one, Threads::several}) {
        const Execution execution = {.threads = threads};
        ASSERT_TRUE(run(call.operation, batch, execution).ok()) << call_name(call);
        const std::size_t before = allocations;
        const bool ok = run(call.operation, batch, execution).ok();
        const std::size_t after = allocations;
        EXPECT_TRUE(ok);
        EXPECT_EQ(after - before, 0u) << call_name(call) << (threads == Threads::one ? ", one thread" : "");
      }
  }
}

TEST(Allocation, NoneByCompaction) {
  std::vector<std::uint8_t> status(100000);
  for (std::size_t k = 0; k < status.size(); ++k) status[k] = k % 3 == 0 ? 1 : 0;
  std::vector<std::uint32_t> index(status.size());
  Compaction compaction;
  compaction.lanes = status.size();
  compaction.status = status;
  compaction.index = index;
  for (const Threads threads : {Threads::one, Threads::several}) {
    ASSERT_TRUE(compact(compaction, {.threads = threads}).ok());
    const std::size_t before = allocations;
    const auto accepted = compact(compaction, {.threads = threads});
    EXPECT_EQ(allocations - before, 0u);
    EXPECT_EQ(*accepted, 66666u);
  }
}

}  // namespace
}  // namespace facetwise::test
