#include "targets.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <string>
#include <vector>

#include "limits.h"
#include "paired.h"
#include "runner.h"

namespace facetwise::bench {
namespace {

constexpr std::size_t kBatch = 65536;
constexpr int kRounds = 61;
constexpr double kRound = 0.001;  // seconds that each side of a pair runs per round

struct Roughness {
  float x, y;
};
constexpr Roughness kAlphas[] = {{0.3f, 0.3f}, {0.8f, 0.1f}};

// A case whose errors are kept for later, so that timing loops are plain.
class Timed {
 public:
  Timed(const Case& which, const Columns& columns, Target target, Engine* remote, absl::Status& status)
      : runner_(make_runner(which, columns, target, remote)), status_(status) {}
  void operator()() const {
    if (const auto occluded = runner_(); !occluded.ok()) status_.Update(occluded.status());
  }

 private:
  Runner runner_;
  absl::Status& status_;
};

std::string alpha_text(Roughness alpha) { return fmt::format("({:g}, {:g})", alpha.x, alpha.y); }

class Measuring {
 public:
  Measuring(const BenchOptions& options, Columns& columns, const std::function<bool()>& step,
            BenchReport& report)
      : options_(options), columns_(columns), step_(step), report_(report) {}

  absl::Status run() {
    for (const Target target : available_targets()) {
      if (vector_lanes(target) < 8) continue;
      over_scalar(target);
      if (!next()) return status_;
    }
    for (const Target target : available_targets()) {
      if (vector_lanes(target) < 4) continue;
      exact_over_bounded(target);
      if (!next()) return status_;
      exact_over_bounded_one_roughness(target);
      if (!next()) return status_;
    }
    for (const Sampler sampler : {Sampler::bounded, Sampler::exact}) {
      small_batch(sampler);
      if (!next()) return status_;
    }
    for (const Sampler sampler : {Sampler::bounded, Sampler::exact}) {
      large_batch(sampler);
      if (!next()) return status_;
    }
    for (const Sampler sampler : {Sampler::bounded, Sampler::exact}) {
      two_threads(sampler);
      if (!next()) return status_;
    }
    remote();
    next();
    return status_;
  }

 private:
  bool next() {
    if (status_.ok() && !step_()) status_ = absl::CancelledError("the benchmarks were stopped");
    return status_.ok();
  }

  Timed timed(const Case& which, Target target) {
    return {which, columns_, target, options_.remote, status_};
  }

  void roughness(Roughness alpha, std::size_t lanes) {
    columns_.set_roughness(alpha.x, alpha.y, lanes);
  }

  static Case sampling(Sampler sampler, Implementation implementation, std::size_t batch = kBatch) {
    return {.sampler = sampler, .batch = batch, .implementation = implementation};
  }

  void over_scalar(Target target) {
    TargetResult row{.what = fmt::format("bounded over scalar, {}", name(target)),
                     .required = target == Target::avx3 ? 24.0 : 13.0,
                     .measured = {},
                     .unit = "x",
                     .note = "smallest of"};
    for (const Roughness alpha : kAlphas) {
      roughness(alpha, kBatch);
      const Paired pair =
          measure_paired(timed(sampling(Sampler::bounded, Implementation::scalar), target),
                         timed(sampling(Sampler::bounded, Implementation::simd), target), kRounds, kRound);
      row.measured = std::min(row.measured.value_or(pair.ratio), pair.ratio);
      row.note += fmt::format(" {:.1f} at {}: {:.2f} over {:.3f} ns;", pair.ratio, alpha_text(alpha),
                              1e9 * pair.a / kBatch, 1e9 * pair.b / kBatch);
    }
    row.note.pop_back();
    report_.targets.push_back(row);
  }

  void exact_over_bounded(Target target) {
    TargetResult row{.what = fmt::format("exact's time over bounded's, {}", name(target)),
                     .required = 2.5,
                     .at_least = false,
                     .measured = {},
                     .unit = "x",
                     .note = "largest of"};
    const auto measure = [&](const std::string& where) {
      const Paired pair =
          measure_paired(timed(sampling(Sampler::exact, Implementation::simd), target),
                         timed(sampling(Sampler::bounded, Implementation::simd), target), kRounds, kRound);
      row.measured = std::max(row.measured.value_or(pair.ratio), pair.ratio);
      row.note += fmt::format(" {:.2f} {};", pair.ratio, where);
    };
    for (const Roughness alpha : kAlphas) {
      roughness(alpha, kBatch);
      measure("at " + alpha_text(alpha));
    }
    columns_.set_mixed_roughness(kBatch);
    measure("where it differs from lane to lane");
    row.note.pop_back();
    report_.targets.push_back(row);
  }

  void exact_over_bounded_one_roughness(Target target) {
    Case exact = sampling(Sampler::exact, Implementation::simd);
    exact.inputs = Inputs::one_roughness;
    Case bounded = exact;
    bounded.sampler = Sampler::bounded;
    const Paired pair = measure_paired(timed(exact, target), timed(bounded, target), kRounds, kRound);
    report_.targets.push_back({.what = fmt::format("the same, one isotropic roughness, {}", name(target)),
                               .required = 1.5,
                               .at_least = false,
                               .measured = pair.ratio,
                               .unit = "x",
                               .note = "alpha 0.3 for all lanes"});
  }

  void small_batch(Sampler sampler) {
    roughness(kAlphas[0], kBatch);
    const Paired pair = measure_paired(timed(sampling(sampler, Implementation::simd), options_.target),
                                       timed(sampling(sampler, Implementation::simd, 1000), options_.target),
                                       kRounds, kRound);
    const double measured = pair.ratio * 1000 / kBatch;
    report_.targets.push_back(
        {.what = fmt::format("{}: rate of 1,000 lanes over that of 64 k", name(sampler)),
         .required = 0.85,
         .measured = measured,
         .unit = "x",
         .note = fmt::format("{:.3f} and {:.3f} ns a sample", 1e9 * pair.b / 1000, 1e9 * pair.a / kBatch)});
  }

  void large_batch(Sampler sampler) {
    TargetResult row{.what = fmt::format("{}: 16 M lanes' time over copying's or in-cache", name(sampler)),
                     .required = 1.4,
                     .at_least = false,
                     .measured = {},
                     .unit = "x",
                     .note = {}};
    if (columns_.lanes() < kTargetLanes) {
      row.note = "not measured: there is no memory for 16 M lanes";
      report_.targets.push_back(row);
      return;
    }
    roughness(kAlphas[0], kTargetLanes);
    const Case large = sampling(sampler, Implementation::simd, kTargetLanes);
    const Timed sample = timed(large, options_.target),
                in_cache = timed(sampling(sampler, Implementation::simd), options_.target);
    const auto copy = [&](CopyOrder order) {
      return make_copy(columns_, large.input_columns(), large.output_columns(), kTargetLanes, options_.target,
                       false, order);
    };
    const auto one_by_one = copy(CopyOrder::one_by_one), side_by_side = copy(CopyOrder::side_by_side);
    const int in_cache_calls = calls_for(in_cache, kRound);
    sample();
    std::vector<double> ratios, samples, copies, caches;
    for (int round = 0; round < 7; ++round) {
      constexpr double kLanes = kTargetLanes;
      samples.push_back(time_calls(sample, 1) / kLanes);
      copies.push_back(std::min(time_calls(one_by_one, 1), time_calls(side_by_side, 1)) / kLanes);
      caches.push_back(time_calls(in_cache, in_cache_calls) / kBatch);
      ratios.push_back(samples.back() / std::max(copies.back(), caches.back()));
    }
    row.measured = median_of(ratios);
    row.note = fmt::format("{:.3f} ns a sample; copying {:.3f}, 64 k lanes {:.3f}", 1e9 * median_of(samples),
                           1e9 * median_of(copies), 1e9 * median_of(caches));
    report_.targets.push_back(row);
  }

  void two_threads(Sampler sampler) {
    TargetResult row{.what = fmt::format("{}: two threads over one, in cache", name(sampler)),
                     .required = 1.8,
                     .measured = {},
                     .unit = "x",
                     .note = {}};
    if (report_.threads < 2) {
      row.note = "not measured: one thread only";
    } else {
      roughness(kAlphas[0], kBatch);
      tbb::task_arena two(2);
      const Timed both = timed(sampling(sampler, Implementation::simd_threads), options_.target);
      const Paired pair = measure_paired(
          timed(sampling(sampler, Implementation::simd), options_.target),
          [&] { two.execute([&] { both(); }); }, kRounds, kRound);
      row.measured = pair.ratio;
      row.note = fmt::format("{:.3f} and {:.3f} ns a sample", 1e9 * pair.a / kBatch, 1e9 * pair.b / kBatch);
    }
    report_.targets.push_back(row);
  }

  void remote() {
    TargetResult row{.what = "bounded: remote samples a second, in millions",
                     .required = 25,
                     .measured = {},
                     .unit = "M/s",
                     .note = {}};
    if (options_.remote == nullptr) {
      row.note = "not measured: no server was given";
    } else {
      roughness(kAlphas[0], std::size_t{1} << 20);
      const Timed local = timed(sampling(Sampler::bounded, Implementation::simd), options_.target);
      const Timed far = timed(sampling(Sampler::bounded, Implementation::remote), options_.target);
      const Timed far_large =
          timed(sampling(Sampler::bounded, Implementation::remote, std::size_t{1} << 20), options_.target);
      constexpr int kFarRounds = 15;
      const Paired pair = measure_paired(far, local, kFarRounds, 0.02);
      const double large = measure_paired(far_large, local, kFarRounds, 0.02).a;
      row.measured = kBatch / pair.a / 1e6;
      row.note = fmt::format("batches of 64 k; of 1 M: {:.1f}; local, one thread: {:.0f}",
                             (1 << 20) / large / 1e6, kBatch / pair.b / 1e6);
    }
    report_.targets.push_back(row);
  }

  const BenchOptions& options_;
  Columns& columns_;
  const std::function<bool()>& step_;
  BenchReport& report_;
  absl::Status status_;
};

}  // namespace

absl::Status measure_targets(const BenchOptions& options, Columns& columns, const std::function<bool()>& step,
                             BenchReport& report) {
  return Measuring(options, columns, step, report).run();
}

}  // namespace facetwise::bench
