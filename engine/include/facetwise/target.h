// SPDX-License-Identifier: Apache-2.0
// Which instruction set the kernels run on, and on how many threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace facetwise {

// Every target gives the same bits for the same inputs.
enum class Target : std::uint8_t {
  best = 0,    // the fastest that this CPU has
  scalar = 1,  // the portable fallback
  avx2 = 2,
  avx3 = 3,  // AVX-512
  neon = 4,
};

std::string_view name(Target);
std::optional<Target> parse_target(std::string_view);

// The targets that were compiled in and that this CPU has, best first; never empty.
std::vector<Target> available_targets();

// The target that runs where `target` is asked for: itself if available, the first of
// available_targets() for `best`, nothing if this CPU or build lacks it.
std::optional<Target> resolve(Target target);

// Lanes in one vector of an available target: 16 for avx3, 8 avx2, 4 neon, 1 scalar.
std::size_t vector_lanes(Target target);

// How outputs are stored. Streaming stores write whole cache lines past the caches: quicker where a batch does not fit
// into them, slower where the results are read again at once. Only contiguous columns of a call without an active list
// are streamed, on x86.
enum class Stores : std::uint8_t {
  automatic = 0,  // streaming if the call's columns are larger than the caches
  cached = 1,
  streaming = 2,
};

// On how many threads a call of more than some thousand lanes runs. Others' threads are those of the caller's TBB arena.
enum class Threads : std::uint8_t {
  automatic = 0,  // several where it pays: a short call does not wake threads that sleep
  one = 1,        // the calling one
  several = 2,
};

// How a call runs. The defaults are right for everything but tests and benchmarks.
struct Execution {
  Target target = Target::best;
  // Kernels one lane wide: what the vector width is worth. For avx3 they are those of avx2. For benchmarks.
  bool one_lane = false;
  Threads threads = Threads::automatic;
  Stores stores = Stores::automatic;
  // If given, it is looked at between tiles (some thousand lanes): once it is true the call ends with Cancelled, some of
  // its outputs written. It outlives the call. compact() is short and does not look.
  const std::atomic<bool>* stop = nullptr;
};

}  // namespace facetwise
