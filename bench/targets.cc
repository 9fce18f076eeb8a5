// SPDX-License-Identifier: Apache-2.0
#include "targets.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "machine_limits.h"
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
constexpr Roughness kMixed = {0, 0};  // as in Case
constexpr Roughness kAlphas[] = {kMixed, {0.3f, 0.3f}, {0.8f, 0.1f}};

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

std::string alpha_text(Roughness alpha) { return facetwise::alpha_text(alpha.x, alpha.y); }

class Measuring {
 public:
  Measuring(const BenchOptions& options, Columns& columns, const std::function<bool()>& step, BenchReport& report)
      : options_(options), columns_(columns), step_(step), report_(report) {}

  absl::Status run() {
    for (const Target target : available_targets()) {
      if (vector_lanes(target) < 8) continue;
      const bool wide = target == Target::avx3;
      over_scalar("bounded", sampling(Sampler::bounded, Implementation::simd), target, wide ? 24 : 13);
      if (!next()) return status_;
      Case beckmann = sampling(Sampler::visible, Implementation::simd);
      beckmann.distribution = Distribution::beckmann;
      over_scalar("Beckmann's visible", beckmann, target, wide ? 20 : 12);
      if (!next()) return status_;
    }
    for (const Target target : available_targets()) {
      if (vector_lanes(target) < 4) continue;
      exact_over_bounded(target);
      if (!next()) return status_;
      exact_over_bounded_one_roughness(target);
      if (!next()) return status_;
    }
    for (const auto& [lanes, share] : {std::pair<std::size_t, double>{1024, 0.9}, {128, 0.6}}) {
      small_batch(lanes, share);
      if (!next()) return status_;
    }
    for (const Target target : available_targets()) {
      if (vector_lanes(target) < 8) continue;
      for (const Inputs inputs : {Inputs::columns, Inputs::fresh})
        for (const Sampler sampler : {Sampler::cap, Sampler::exact})
          for (const bool threads : {false, true}) {
            beyond_cache(target, sampler, inputs, threads);
            if (!next()) return status_;
          }
      for (const std::size_t lanes : {kBatch, kTargetLanes}) {
        placement(target, lanes);
        if (!next()) return status_;
      }
    }
    for (const auto& [lanes, gain] : {std::pair<std::size_t, double>{16384, 1.6}, {kBatch, 1.8}}) {
      two_threads(lanes, gain);
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

  Timed timed(const Case& which, Target target) { return {which, columns_, target, options_.remote, status_}; }

  void prepare(const Case& which) { status_.Update(columns_.prepare(which)); }

  static Case sampling(Sampler sampler, Implementation implementation, std::size_t batch = kBatch,
                       Roughness alpha = kMixed) {
    return {
        .sampler = sampler, .alpha_x = alpha.x, .alpha_y = alpha.y, .batch = batch, .implementation = implementation};
  }

  void over_scalar(const char* what, Case simd, Target target, double required) {
    TargetResult row{.what = fmt::format("{} over scalar, {}", what, name(target)),
                     .required = required,
                     .measured = {},
                     .unit = "x",
                     .note = "smallest of"};
    for (const Roughness alpha : kAlphas) {
      simd.alpha_x = alpha.x;
      simd.alpha_y = alpha.y;
      prepare(simd);
      Case scalar = simd;
      scalar.implementation = Implementation::scalar;
      const Paired pair = measure_paired(timed(scalar, target), timed(simd, target), kRounds, kRound);
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
    for (const Roughness alpha : kAlphas) {
      const Case exact = sampling(Sampler::exact, Implementation::simd, kBatch, alpha);
      prepare(exact);
      Case bounded = exact;
      bounded.sampler = Sampler::bounded;
      const Paired pair = measure_paired(timed(exact, target), timed(bounded, target), kRounds, kRound);
      row.measured = std::max(row.measured.value_or(pair.ratio), pair.ratio);
      row.note += fmt::format(" {:.2f} at {};", pair.ratio, alpha_text(alpha));
    }
    row.note.pop_back();
    report_.targets.push_back(row);
  }

  void exact_over_bounded_one_roughness(Target target) {
    Case exact = sampling(Sampler::exact, Implementation::simd, kBatch, {0.3f, 0.3f});
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

  void small_batch(std::size_t lanes, double required) {
    const Case large = sampling(Sampler::cap, Implementation::simd);
    Case small = large;
    small.batch = lanes;
    prepare(large);
    const Paired pair = measure_paired(timed(large, options_.target), timed(small, options_.target), kRounds, kRound);
    const double count = static_cast<double>(lanes);
    report_.targets.push_back(
        {.what = fmt::format("cap: rate of {} lanes over that of 64 k", lanes),
         .required = required,
         .measured = pair.ratio * count / kBatch,
         .unit = "x",
         .note = fmt::format("{:.3f} and {:.3f} ns a sample", 1e9 * pair.b / count, 1e9 * pair.a / kBatch)});
  }

  // Times of several things in turn, in seconds a lane; the median over the rounds of what `ratio` makes of each.
  struct Part {
    std::function<void()> once;
    double lanes;
    int calls = 1;
    std::vector<double> times{};
  };
  template <class Ratio>
  static double in_turn(std::vector<Part>& parts, const Ratio& ratio) {
    for (Part& part : parts) part.calls = calls_for(part.once, kRound);
    std::vector<double> ratios;
    for (int round = 0; round < 9; ++round) {
      for (Part& part : parts) {
        if (part.calls > 1) part.once();  // into the caches again, which the larger parts have filled
        part.times.push_back(time_calls(part.once, part.calls) / part.lanes);
      }
      ratios.push_back(ratio([&](std::size_t k) { return parts[k].times.back(); }));
    }
    return median_of(ratios);
  }

  // Batches that no cache holds: of 16 M lanes, or of 1 M in a stream of fresh columns.
  void beyond_cache(Target target, Sampler sampler, Inputs inputs, bool threads) {
    const bool fresh = inputs == Inputs::fresh;
    const double copies = threads ? 1.15 : 1.3, in_cache = 1.05;
    TargetResult row{.what = fmt::format("{}, {}, {}, {}: time over limit", name(sampler), name(target),
                                         fresh ? "fresh 1 M" : "16 M", threads ? "threads" : "1 thread"),
                     .required = 1,
                     .at_least = false,
                     .measured = {},
                     .unit = "x",
                     .note = {}};
    if (columns_.lanes() < kTargetLanes) {
      row.note = "not measured: not enough memory for 16 M lanes";
    } else if (threads && report_.threads < 2) {
      row.note = "not measured: one thread only";
    } else {
      Case large = sampling(sampler, threads ? Implementation::simd_threads : Implementation::simd,
                            fresh ? std::size_t{1} << 20 : kTargetLanes);
      large.inputs = inputs;
      Case small = large;
      small.inputs = Inputs::columns;
      small.batch = kBatch;
      prepare(large);
      std::vector<Part> parts = {{timed(large, target), static_cast<double>(large.batch)},
                                 {timed(small, target), static_cast<double>(kBatch)}};
      for (int order = 0; order < kCopyOrders; ++order)
        parts.push_back({make_copy(columns_, large.input_columns(), large.output_columns(), kTargetLanes, target,
                                   threads, static_cast<CopyOrder>(order)),
                         static_cast<double>(kTargetLanes)});
      const auto copy = [](const auto& time) { return std::min({time(2), time(3), time(4)}); };
      row.measured =
          in_turn(parts, [&](const auto& time) { return time(0) / std::max(copies * copy(time), in_cache * time(1)); });
      const auto median = [&](std::size_t k) { return 1e9 * median_of(parts[k].times); };
      row.note = fmt::format("{:.3f} ns a sample; limit: {:g} x copying {:.3f} or {:g} x 64 k lanes {:.3f}, the longer",
                             median(0), copies, copy(median), in_cache, median(1));
    }
    report_.targets.push_back(row);
  }

  void placement(Target target, std::size_t lanes) {
    TargetResult row{.what = fmt::format("cap, {}, {}: malloc's columns over kind ones", name(target),
                                         lanes == kBatch ? "64 k" : "16 M"),
                     .required = 1.15,
                     .at_least = false,
                     .measured = {},
                     .unit = "x",
                     .note = {}};
    if (columns_.malloc_lanes() < lanes) {
      row.note = "not measured: not enough memory for 16 M lanes twice";
    } else {
      const Case kind = sampling(Sampler::cap, Implementation::simd, lanes);
      Case placed = kind;
      placed.inputs = Inputs::malloc_placed;
      prepare(placed);
      const double count = static_cast<double>(lanes);
      std::vector<Part> parts = {{timed(placed, target), count}, {timed(kind, target), count}};
      row.measured = in_turn(parts, [](const auto& time) { return time(0) / time(1); });
      row.note = fmt::format("{:.3f} and {:.3f} ns a sample", 1e9 * median_of(parts[0].times),
                             1e9 * median_of(parts[1].times));
    }
    report_.targets.push_back(row);
  }

  void two_threads(std::size_t lanes, double required) {
    TargetResult row{.what = fmt::format("cap: two threads over one, {} k lanes", lanes / 1024),
                     .required = required,
                     .measured = {},
                     .unit = "x",
                     .note = {}};
    if (report_.threads < 2) {
      row.note = "not measured: one thread only";
    } else {
      const Case one = sampling(Sampler::cap, Implementation::simd, lanes);
      prepare(one);
      tbb::task_arena two(2);
      const Timed both = timed(sampling(Sampler::cap, Implementation::simd_threads, lanes), options_.target);
      const Paired pair = measure_paired(
          timed(one, options_.target), [&] { two.execute([&] { both(); }); }, kRounds, kRound);
      row.measured = pair.ratio;
      const double count = static_cast<double>(lanes);
      row.note = fmt::format("{:.3f} and {:.3f} ns a sample", 1e9 * pair.a / count, 1e9 * pair.b / count);
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
      prepare(sampling(Sampler::bounded, Implementation::simd, std::size_t{1} << 20));
      const Timed local = timed(sampling(Sampler::bounded, Implementation::simd), options_.target);
      const Timed far = timed(sampling(Sampler::bounded, Implementation::remote), options_.target);
      const Timed far_large =
          timed(sampling(Sampler::bounded, Implementation::remote, std::size_t{1} << 20), options_.target);
      constexpr int kFarRounds = 15;
      const Paired pair = measure_paired(far, local, kFarRounds, 0.02);
      const double large = measure_paired(far_large, local, kFarRounds, 0.02).a;
      row.measured = kBatch / pair.a / 1e6;
      row.note = fmt::format("batches of 64 k; of 1 M: {:.1f}; local, one thread: {:.0f}", (1 << 20) / large / 1e6,
                             kBatch / pair.b / 1e6);
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
