// SPDX-License-Identifier: Apache-2.0
// The benchmarks: throughput of the library's operations, the machine's limits, and rejection counts.
// How to read them: docs/benchmarks.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"

namespace facetwise {

enum class BenchSuite {
  standard,  // what shows the headline: three minutes
  quick,     // the same at 64 k lanes, fewer operations, two samplers at other sizes: a minute and a half
  full,      // every operation, sampler, implementation, batch and roughness: about an hour
};

struct BenchOptions {
  // Regular expression (RE2) that is searched for in names such as
  // "sample_reflection/bounded/mixed/65536/simd": see BenchResult::name(). With a filter, and `suite` left
  // at standard, the choice is from all benchmarks; rejections and targets are left out.
  std::string filter;
  BenchSuite suite = BenchSuite::standard;
  // Seconds that each benchmark runs, over all its repetitions; in (0, 10].
  double min_seconds = 0.2;
  // Threads of "simd-threads"; 0: as many as the machine has for this process.
  int threads = 0;
  // The kernels' target.
  Target target = Target::best;
  // A connected server's engine (connect() in facetwise/client.h) for "remote"; none: those are left out.
  Engine* remote = nullptr;
  // Parts besides the throughput.
  bool limits = true;      // copy bandwidth and FMA peak
  bool rejections = true;  // the rejection-count experiment
  bool targets = true;     // the performance to reach
  // Google Benchmark's own flags, of those that change how a measurement runs: --benchmark_repetitions,
  // --benchmark_min_time, --benchmark_enable_random_interleaving, --v.
  std::vector<std::string> benchmark_flags;
};

// One benchmark's result. `samples` lanes were timed again and again, of which `rejected` are occluded.
struct BenchResult {
  Operation operation{};
  std::string distribution = "ggx", masking = "smith";
  std::string sampler;              // "none" where the operation has no use for one
  double alpha_x = 0, alpha_y = 0;  // both 0: "mixed", different in every lane, evenly spread over [0.05, 1]^2
  std::string implementation;       // "scalar" | "auto" | "one-lane" | "simd" | "simd-threads" | "remote"
  // How inputs are given: "columns" (everything per lane, all i_z > 0, columns placed kindly and used again and again),
  // or the same but "malloc" (columns placed as malloc does), "fresh" (every batch in columns that no cache holds),
  // "one-roughness" (one value for all lanes), "generator" (in-kernel random numbers) or "backfacing" (i_z < 0 in 10 %
  // of lanes).
  std::string inputs;
  std::uint64_t batch = 0;
  int threads = 1;               // that compute on this machine; 0 for remote
  double ns_per_sample = 0;      // median of the repetitions
  double ns_per_sample_min = 0;  // fastest repetition
  int repetitions = 0;
  std::uint64_t samples = 0, rejected = 0;
  double bytes_per_sample = 0;  // of input and output columns
  // Shares of what the machine can do, 0 where not measured: of the speed at which the same columns are
  // copied (same batch, same threads), and of its peak of fused multiply-adds (estimate).
  double share_of_copy = 0, share_of_fma = 0;

  double ns_per_accepted() const;  // infinite if all were rejected
  double samples_per_second() const { return 1e9 / ns_per_sample; }
  double bytes_per_second() const { return bytes_per_sample * samples_per_second(); }
  double share_occluded() const { return static_cast<double>(rejected) / static_cast<double>(samples); }
  // "operation/sampler/alpha_x,alpha_y/batch/implementation" ("mixed" for the roughness that is), and "/inputs" unless
  // they are "columns". The sampler of other models than GGX with Smith is as bench_name() says.
  std::string name() const;
};

// "0.3, 0.1" with ", " between them; "mixed" where both are 0.
std::string alpha_text(double alpha_x, double alpha_y, std::string_view between = ", ");
// "" for ggx with smith, else "beckmann-smith".
std::string model_name(std::string_view distribution, std::string_view masking);
// "exact", "beckmann-smith/exact": a sampler in the names of results.
std::string bench_name(std::string_view distribution, std::string_view masking, std::string_view sampler);

// Rejections of one sampler at one configuration, azimuth 0. Counted through the kernels, and predicted by a
// closed form (cap, heitz, bounded, exact) or by quadrature (ndf).
struct RejectionResult {
  std::string experiment;  // "table" | "sweep" | "post-2015" | "models"
  std::string distribution = "ggx", masking = "smith";
  std::string sampler;
  double theta_degrees = 0;  // of i
  double alpha_x = 0, alpha_y = 0;
  std::uint64_t samples = 0, rejected = 0;
  double predicted_share = 0;

  double share() const { return static_cast<double>(rejected) / static_cast<double>(samples); }
  // (counted - predicted) in standard deviations of the count; 0 where both are exactly 0 or all.
  double deviations() const;
};

struct CopyLimit {
  int inputs = 0, outputs = 0;  // float columns read and written
  std::uint64_t batch = 0;
  int threads = 1;
  double ns_per_sample = 0;
  double bytes_per_second() const { return 4.0 * (inputs + outputs) * 1e9 / ns_per_sample; }
};

struct FmaLimit {
  Target target{};
  int threads = 1;
  double flops_per_second = 0;  // a fused multiply-add is two
};

struct BenchLimits {
  std::vector<CopyLimit> copy;
  std::vector<FmaLimit> fma;
};

// One line of "performance to reach". Ratios are medians of interleaved pairs of measurements in this run.
struct TargetResult {
  std::string what;
  double required = 0;
  bool at_least = true;            // else at most
  std::optional<double> measured;  // nothing where this machine or call cannot measure it: see note
  std::string unit;                // "x" for ratios
  std::string note;
  std::optional<bool> met() const;
};

struct BenchMachine {
  std::string cpu;
  unsigned cores = 0;  // that this process may use
  std::string target;
};

struct BenchReport {
  std::string version;
  BenchMachine machine;
  int threads = 0;  // of "simd-threads"
  std::vector<BenchResult> results;
  std::vector<RejectionResult> rejections;
  BenchLimits limits;
  std::vector<TargetResult> targets;
};

// What has happened so far. `result` is the benchmark that has just finished, null for other parts' steps.
struct BenchProgress {
  std::size_t done = 0, total = 0;  // benchmarks
  const BenchResult* result = nullptr;
  std::string_view part;  // "limits", "throughput", "rejections", "targets"
};
// Returns false to stop: run_bench() then returns Cancelled.
using BenchCallback = std::function<bool(const BenchProgress&)>;

// Runs benchmarks; prints nothing. InvalidArgument for a filter that is not a regular expression or matches
// nothing and for other options that mean nothing; FailedPrecondition while another run is under way in this
// process (Google Benchmark's state is global) or for a target that is not here; ResourceExhausted if there
// is not enough memory for the columns; the remote engine's errors.
absl::StatusOr<BenchReport> run_bench(const BenchOptions& options, const BenchCallback& progress = {});

// A table for eyes.
std::string bench_table(const BenchReport& report);
// The report as JSON text, indented: {version, machine, results, rejections, limits, targets}.
std::string bench_json(const BenchReport& report);

}  // namespace facetwise
