// SPDX-License-Identifier: Apache-2.0
// The report as a table for eyes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "facetwise/bench.h"

namespace facetwise {
namespace {

using Out = std::back_insert_iterator<std::string>;

// Results that differ only in the implementation.
struct Row {
  const BenchResult* any = nullptr;
  const BenchResult *scalar = nullptr, *vectorised = nullptr, *one_lane = nullptr, *simd = nullptr, *threads = nullptr,
                    *remote = nullptr;

  bool takes(const BenchResult& r) const {
    return any->operation == r.operation && any->distribution == r.distribution && any->masking == r.masking &&
           any->sampler == r.sampler && any->alpha_x == r.alpha_x && any->alpha_y == r.alpha_y &&
           any->inputs == r.inputs && any->batch == r.batch;
  }
  void set(const BenchResult& r) {
    any = &r;
    if (r.implementation == "scalar") scalar = &r;
    if (r.implementation == "auto") vectorised = &r;
    if (r.implementation == "one-lane") one_lane = &r;
    if (r.implementation == "simd") simd = &r;
    if (r.implementation == "simd-threads") threads = &r;
    if (r.implementation == "remote") remote = &r;
  }
};

std::vector<Row> rows_of(const std::vector<BenchResult>& results) {
  std::vector<Row> rows;
  for (const BenchResult& r : results) {
    if (rows.empty() || !rows.back().takes(r)) rows.emplace_back();
    rows.back().set(r);
  }
  return rows;
}

std::string batch_text(std::uint64_t batch) {
  if (batch >= 1000000 && batch % 1000000 == 0) return fmt::format("{} M", batch / 1000000);
  if (batch >= 1 << 20 && batch % (1 << 20) == 0) return fmt::format("{} M", batch >> 20);
  if (batch >= 1 << 10 && batch % (1 << 10) == 0) return fmt::format("{} k", batch >> 10);
  return fmt::format("{}", batch);
}

// "0.912 (24.1x)": nanoseconds, and how many times as fast as the baseline.
std::string time_text(const BenchResult* r, const BenchResult* scalar) {
  if (r == nullptr) return "";
  const std::string ns = fmt::format("{:.3g}", r->ns_per_sample);
  if (scalar == nullptr || scalar == r) return ns;
  return fmt::format("{} ({:.3g}x)", ns, scalar->ns_per_sample / r->ns_per_sample);
}

std::string percent(double share) { return share > 0 ? fmt::format("{:.0f} %", 100 * share) : ""; }

void add_results(const std::vector<BenchResult>& results, Out out) {
  const std::vector<Row> rows = rows_of(results);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Row& row = rows[k];
    const BenchResult& any = *row.any;
    if (k == 0 || rows[k - 1].any->operation != any.operation || rows[k - 1].any->inputs != any.inputs) {
      fmt::format_to(out, "\n{}{}\n", name(any.operation), any.inputs == "columns" ? "" : ", " + any.inputs);
      fmt::format_to(out, "  {:26}{:>11}{:>7}{:>9}{:>15}{:>15}{:>15}{:>15}{:>14}{:>9}{:>8}{:>8}{:>8}{:>7}{:>7}\n",
                     "sampler", "alpha", "batch", "scalar", "auto", "one-lane", "simd", "threads", "remote", "occluded",
                     "ns/acc.", "M/s", "GB/s", "copy", "FMA");
    }
    // The last columns are of the fastest way on one thread.
    const BenchResult* best = row.simd ? row.simd : row.any;
    fmt::format_to(
        out, "  {:26}{:>11}{:>7}{:>9}{:>15}{:>15}{:>15}{:>15}{:>14}{:>9}{:>8.3g}{:>8.0f}{:>8}{:>7}{:>7}\n",
        bench_name(any.distribution, any.masking, any.sampler), facetwise::alpha_text(any.alpha_x, any.alpha_y),
        batch_text(any.batch), time_text(row.scalar, nullptr), time_text(row.vectorised, row.scalar),
        time_text(row.one_lane, row.scalar), time_text(row.simd, row.scalar), time_text(row.threads, row.scalar),
        time_text(row.remote, row.scalar), fmt::format("{:.2f} %", 100 * best->share_occluded()),
        best->ns_per_accepted(), best->samples_per_second() / 1e6,
        best->bytes_per_sample > 0 ? fmt::format("{:.1f}", best->bytes_per_second() / 1e9) : "",
        percent(best->share_of_copy), percent(best->share_of_fma));
  }
}

void add_limits(const BenchLimits& limits, Out out) {
  fmt::format_to(out, "\nLimits of this machine in this run\n");
  for (const FmaLimit& fma : limits.fma)
    fmt::format_to(out, "  fused multiply-adds, {}, {} thread{}: {:.0f} GFLOP/s\n", name(fma.target), fma.threads,
                   fma.threads == 1 ? "" : "s", fma.flops_per_second / 1e9);
  if (limits.copy.empty()) return;
  fmt::format_to(out, "  copying the columns    in  out  batch\n");
  for (std::size_t first = 0; first < limits.copy.size();) {
    const CopyLimit& copy = limits.copy[first];
    fmt::format_to(out, "{:27}{:5}{:>7}", copy.inputs, copy.outputs, batch_text(copy.batch));
    // One thread and all of them side by side.
    const auto same = [&](const CopyLimit& other) {
      return other.inputs == copy.inputs && other.outputs == copy.outputs && other.batch == copy.batch;
    };
    for (; first < limits.copy.size() && same(limits.copy[first]); ++first)
      fmt::format_to(out, "   {} thread{:2}{:7.3f} ns a lane{:7.1f} GB/s", limits.copy[first].threads,
                     limits.copy[first].threads == 1 ? "" : "s", limits.copy[first].ns_per_sample,
                     limits.copy[first].bytes_per_second() / 1e9);
    fmt::format_to(out, "\n");
  }
}

void add_targets(const std::vector<TargetResult>& targets, Out out) {
  fmt::format_to(out, "\nPerformance to reach (ratios: medians of interleaved pairs)\n  {:54}{:>10}{:>10}\n", "",
                 "wanted", "measured");
  for (const TargetResult& t : targets) {
    const auto met = t.met();
    fmt::format_to(
        out, "  {:54}{:>10}{:>10}  {}\n", t.what, fmt::format("{} {:g}", t.at_least ? ">=" : "<=", t.required),
        t.measured ? fmt::format("{:.2f}", *t.measured) : "-", met ? (*met ? "met" : "NOT MET") : "not measured");
    if (!t.note.empty()) fmt::format_to(out, "      {}\n", t.note);
  }
}

std::string alpha_text(const RejectionResult& r) { return facetwise::alpha_text(r.alpha_x, r.alpha_y); }

// How many samplers each configuration was counted with: they stand next to each other.
std::size_t samplers_of(const std::vector<const RejectionResult*>& results) {
  const auto next = std::find_if(results.begin(), results.end(), [&](const RejectionResult* r) {
    return r != results.front() && r->sampler == results.front()->sampler;
  });
  return static_cast<std::size_t>(next - results.begin());
}

void add_configurations(const std::vector<const RejectionResult*>& results, Out out) {
  if (results.empty()) return;
  const std::size_t samplers = samplers_of(results);
  fmt::format_to(out, "  {:>7}{:>14}{:>10}", "theta", "alpha", "samples");
  for (std::size_t k = 0; k < samplers; ++k) fmt::format_to(out, "{:>18}", results[k]->sampler);
  fmt::format_to(out, "\n");
  for (std::size_t first = 0; first + samplers <= results.size(); first += samplers) {
    const RejectionResult& r = *results[first];
    fmt::format_to(out, "  {:>6.4g}°{:>14}{:>10}", r.theta_degrees, alpha_text(r), r.samples);
    for (std::size_t k = first; k < first + samplers; ++k) {
      const RejectionResult& s = *results[k];
      // Shares of many samples, counts of few.
      fmt::format_to(out, "{:>18}",
                     s.samples > 100000
                         ? fmt::format("{:.4f} [{:.4f}]", s.share(), s.predicted_share)
                         : fmt::format("{} [{:.1f}]", s.rejected, s.predicted_share * static_cast<double>(s.samples)));
    }
    fmt::format_to(out, "\n");
  }
}

// Counted shares of one sampler: roughness down, angle across.
void add_grid(const std::vector<const RejectionResult*>& results, std::string_view sampler, Out out) {
  std::vector<double> thetas;
  for (const RejectionResult* r : results)
    if (r->sampler == sampler && std::find(thetas.begin(), thetas.end(), r->theta_degrees) == thetas.end())
      thetas.push_back(r->theta_degrees);
  fmt::format_to(out, "  {:14}", sampler);
  for (const double theta : thetas) fmt::format_to(out, "{:>8.4g}°", theta);
  const RejectionResult* last = nullptr;
  for (const RejectionResult* r : results) {
    if (r->sampler != sampler) continue;
    if (last == nullptr || last->alpha_x != r->alpha_x || last->alpha_y != r->alpha_y)
      fmt::format_to(out, "\n  {:>14}", alpha_text(*r));
    fmt::format_to(out, "{:>9.4f}", r->share());
    last = r;
  }
  fmt::format_to(out, "\n");
}

void add_rejections(const std::vector<RejectionResult>& rejections, Out out) {
  const auto of = [&](std::string_view experiment) {
    std::vector<const RejectionResult*> results;
    for (const RejectionResult& r : rejections)
      if (r.experiment == experiment) results.push_back(&r);
    return results;
  };
  fmt::format_to(out, "\nShare of samples occluded: counted [predicted]\n");
  add_configurations(of("table"), out);
  fmt::format_to(out, "\nThe same over angle and roughness, counted (heitz is as cap, exact has none)\n");
  for (const Sampler sampler : {Sampler::ndf, Sampler::cap, Sampler::bounded})
    add_grid(of("sweep"), name(sampler), out);
  double largest = 0;
  std::uint64_t exact_samples = 0, exact_rejected = 0;
  for (const RejectionResult& r : rejections) {
    largest = std::max(largest, std::abs(r.deviations()));
    if (r.sampler != name(Sampler::exact)) continue;
    exact_samples += r.samples;
    exact_rejected += r.rejected;
  }
  fmt::format_to(out, "  largest deviation of a count from its prediction: {:.1f} standard deviations, of {} counts\n",
                 largest, rejections.size());
  fmt::format_to(out, "  exact: {} of {} samples occluded\n", exact_rejected, exact_samples);
  fmt::format_to(out,
                 "\nCounts of a post of 2015 (371 with ndf, 61 with visible normals at 1.5 rad; 52 at pi/4), "
                 "for the two\n"
                 "roughnesses and numbers of samples that fit those at 1.5 rad best: counted [expected]\n");
  add_configurations(of("post-2015"), out);
  // Models stand one after another.
  const auto models = of("models");
  for (auto first = models.begin(); first != models.end();) {
    const auto last = std::find_if(first, models.end(), [&](const RejectionResult* r) {
      return r->distribution != (*first)->distribution || r->masking != (*first)->masking;
    });
    fmt::format_to(out, "\nThe same of {}: counted [predicted]\n",
                   model_name((*first)->distribution, (*first)->masking));
    add_configurations({first, last}, out);
    first = last;
  }
}

}  // namespace

std::string bench_table(const BenchReport& report) {
  std::string text;
  const Out out = std::back_inserter(text);
  fmt::format_to(out, "facetwise {} on {}, {} core{}, {} thread{}, target {}\n", report.version, report.machine.cpu,
                 report.machine.cores, report.machine.cores == 1 ? "" : "s", report.threads,
                 report.threads == 1 ? "" : "s", report.machine.target);
  fmt::format_to(out,
                 "Times are nanoseconds a sample, medians of interleaved repetitions, in brackets how many times as "
                 "fast as\n"
                 "scalar; from `occluded` on they are of simd on one thread: per accepted sample, samples and bytes a\n"
                 "second, shares of the speed of copying the same columns and of the peak of multiply-adds "
                 "(estimate).\n");
  add_results(report.results, out);
  if (!report.limits.fma.empty() || !report.limits.copy.empty()) add_limits(report.limits, out);
  if (!report.rejections.empty()) add_rejections(report.rejections, out);
  if (!report.targets.empty()) add_targets(report.targets, out);
  return text;
}

}  // namespace facetwise
