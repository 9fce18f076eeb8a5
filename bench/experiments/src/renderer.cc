// SPDX-License-Identifier: Apache-2.0
// What a renderer gains in the end: whole pictures by the engine and by the scalar baseline, on one thread and on all.
#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

struct Times {
  render::Times best;
  double fastest = 1e9;
};

}  // namespace

absl::StatusOr<Page> renderer_page(const Options& options) {
  Page page;
  page.id = "renderer";
  page.title = "What a renderer gains";
  page.source = "facetwise's own: the share of scattering in a whole picture's time";
  page.command = "facetwise experiment renderer";
  const int repeats = by_size(options, 3, 5, 5);
  Steps steps(options, 2.0 * repeats);
  const int all = tbb::info::default_concurrency();

  Table table{
      "Seconds a picture, the fastest of several taken in turn",
      {"scene", "scattering by", "threads", "seconds", "scattering", "Embree", "the rest", "scattering: times scalar"},
      {}};
  struct Way {
    const char* name;
    bool scalar;
    int threads;
  };
  const Way ways[] = {{"scalar, path by path", true, 1},
                      {"engine", false, 1},
                      {"scalar, path by path", true, all},
                      {"engine", false, all}};
  double speed_up = 1e9, least_gain = 1e9, whole = 1e9;
  for (const char* name : {"orbs", "normal-map"}) {
    auto scene = lit(name);
    if (!scene.ok()) return scene.status();
    for (auto& material : scene->materials) material.sampler = Sampler::exact;
    render::Settings settings;
    settings.width = by_size(options, 192, 512, 512);
    settings.height = static_cast<int>(static_cast<float>(settings.width) / scene->aspect);
    settings.samples = by_size(options, 8u, 32u, 32u);
    settings.numbers = render::Numbers::sobol;
    Times times[4];
    for (int k = 0; k < repeats; ++k) {
      if (auto status = steps.begin(name); !status.ok()) return status;
      for (std::size_t w = 0; w < 4; ++w) {
        tbb::task_arena arena(ways[w].threads);
        const auto engine = ways[w].scalar
                                ? render::scalar_engine()
                                : local_engine({.threads = ways[w].threads == 1 ? Threads::one : Threads::automatic});
        absl::StatusOr<render::Picture> picture = absl::UnknownError("");
        arena.execute([&] { picture = render::render(*scene, settings, *engine); });
        if (!picture.ok()) return picture.status();
        if (picture->times.total < times[w].fastest) times[w] = {picture->times, picture->times.total};
      }
    }
    for (std::size_t w = 0; w < 4; ++w) {
      const render::Times& t = times[w].best;
      const double gain = times[w & 2].best.engine / t.engine;
      table.rows.push_back({name, ways[w].name, fmt::format("{}", ways[w].threads), fmt::format("{:.2f}", t.total),
                            percent(t.engine / t.total), percent(t.embree / t.total), percent(t.rest() / t.total),
                            fmt::format("{:.2f}", gain)});
    }
    speed_up = std::min(speed_up, times[1].fastest / times[3].fastest);
    least_gain = std::min(least_gain, times[0].best.engine / times[1].best.engine);
    whole = std::min(whole, times[0].fastest / times[1].fastest);
  }
  page.figures.emplace_back(std::move(table));
  if (all > 1)
    page.claims.push_back({fmt::format("The renderer uses all cores: at least {:.1f} times one thread.", 0.9 * all),
                           fmt::format("{:.2f} times, with {} threads.", speed_up, all),
                           agrees(speed_up >= 0.9 * all)});
  page.claims.push_back({"The engine scatters faster than plain code path by path.",
                         fmt::format("On one thread scattering takes {:.1f} times as long by the scalar baseline, and "
                                     "the whole picture {:.2f} times.",
                                     least_gain, whole),
                         agrees(least_gain > 1)});
  page.notes = {
      "Scattering is all calls of the engine: sampling, evaluation for light sampling, the albedo of compensation, and "
      "closing "
      "the gaps of paths that ended. The last two are the engine's in both rows.",
      "Tracing and everything around it take most of a picture's time. A renderer gains more by samples that are not "
      "rejected than by faster ones; a program that only samples gains all of the factor."};
  return page;
}

}  // namespace facetwise::experiments
