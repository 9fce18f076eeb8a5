// SPDX-License-Identifier: Apache-2.0
// The target that is asked for is the one that runs: a profile of the running calls names its kernels.
// Highway puts a target's code into a namespace of its own (N_AVX2 and so on), and this program exports its
// symbols, so that a sampled program counter gives the name of the kernel that it is in.
#include <cxxabi.h>
#include <dlfcn.h>
#include <signal.h>
#include <sys/time.h>
#include <ucontext.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <map>

#include "determinism/compare.h"
#include "support/hard_lanes.h"

namespace facetwise::test {
namespace {

std::array<std::atomic<std::uintptr_t>, 4096> counters;
std::atomic<std::size_t> sampled{0};

void sample(int, siginfo_t*, void* context) {
  const auto& machine = static_cast<ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  const auto counter = static_cast<std::uintptr_t>(machine.gregs[REG_RIP]);
#else
  const auto counter = static_cast<std::uintptr_t>(machine.pc);
#endif
  const std::size_t index = sampled.fetch_add(1);
  if (index < counters.size()) counters[index] = counter;
}

std::string function_at(std::uintptr_t counter) {
  Dl_info info;
  if (dladdr(reinterpret_cast<void*>(counter), &info) == 0 || info.dli_sname == nullptr) return {};
  int status = 0;
  char* demangled = abi::__cxa_demangle(info.dli_sname, nullptr, nullptr, &status);
  const std::string text(status == 0 ? demangled : info.dli_sname);
  std::free(demangled);
  return text;
}

// Samples per kernel, as "N_AVX2 8": the namespace and the lanes of the vector.
std::map<std::string, int> profile(const Call& call, const Lanes& lanes, const Execution& execution) {
  Answer answer;
  const Batch batch = make_batch(call, lanes, answer);
  struct sigaction action = {}, before = {};
  action.sa_sigaction = sample;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  sigaction(SIGPROF, &action, &before);
  const itimerval every_millisecond = {{0, 1000}, {0, 1000}}, never = {};
  sampled = 0;
  setitimer(ITIMER_PROF, &every_millisecond, nullptr);
  // Of the fallback many are in the C library's fma.
  while (sampled < 40) run_ok(call, batch, execution);
  setitimer(ITIMER_PROF, &never, nullptr);
  sigaction(SIGPROF, &before, nullptr);

  std::map<std::string, int> kernels;
  for (std::size_t k = 0; k < std::min(sampled.load(), counters.size()); ++k) {
    const std::string function = function_at(counters[k]);
    const auto space = function.find("facetwise::N_"), simd = function.find("Simd<float, ");
    if (space == function.npos || simd == function.npos) continue;
    const auto begin = space + 11, width = simd + 12;
    ++kernels[function.substr(begin, function.find("::", begin) - begin) + " " +
              std::to_string(std::atoi(function.c_str() + width))];
  }
  return kernels;
}

TEST(ForcedTarget, IsTheOneThatRuns) {
  const std::map<Target, std::string> names = {
      {Target::scalar, "N_SCALAR"}, {Target::avx2, "N_AVX2"}, {Target::avx3, "N_AVX3"}, {Target::neon, "N_NEON"}};
  const Lanes lanes = hard_lanes(Kind::ordinary, 4096, 15);
  for (const Operation operation : all_operations()) {
    Call call{operation, Sampler::cap, Shadowing::correlated};
    if (scatters(operation)) call.model.interface = Interface::dielectric;
    for (const Target target : available_targets())
      for (const bool one_lane : {false, true}) {
        const auto kernels = profile(call, lanes, {.target = target, .one_lane = one_lane, .threads = Threads::one});
        // AVX-512 has AVX2's kernels one lane wide.
        const Target compiled = one_lane && target == Target::avx3 ? Target::avx2 : target;
        const std::string expected = names.at(compiled) + " " + std::to_string(one_lane ? 1 : vector_lanes(target));
        ASSERT_EQ(kernels.size(), 1u) << call_name(call) << ", " << name(target);
        EXPECT_EQ(kernels.begin()->first, expected) << call_name(call);
      }
  }
  // Where no target is named, the best one runs.
  const auto kernels = profile(all_calls().back(), lanes, {.threads = Threads::one});
  const Target best = available_targets().front();
  ASSERT_EQ(kernels.size(), 1u);
  EXPECT_EQ(kernels.begin()->first, names.at(best) + " " + std::to_string(vector_lanes(best)));
}

}  // namespace
}  // namespace facetwise::test
