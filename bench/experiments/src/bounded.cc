// SPDX-License-Identifier: Apache-2.0
// Eto & Tokuyoshi 2023, "Bounded VNDF Sampling for Smith-GGX Reflections": figures 1 and 3 to 6, and what `exact` adds.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

constexpr Sampler kSamplers[] = {Sampler::cap, Sampler::bounded, Sampler::exact};
constexpr double kPi = std::numbers::pi;

void use(render::Scene& scene, Sampler sampler) {
  for (auto& material : scene.materials) material.sampler = sampler;
}

// Renders with each sampler, `repeats` times in turn: the pictures of the last, the shortest time of each.
struct Rendered {
  render::Picture picture;
  double seconds = 1e9;
};
absl::StatusOr<std::map<Sampler, Rendered>> render_each(render::Scene scene,
                                                        const std::map<Sampler, std::uint32_t>& samples,
                                                        render::Settings settings, int repeats, Steps& steps) {
  std::map<Sampler, Rendered> all;
  for (int k = 0; k < repeats; ++k)
    for (const Sampler sampler : kSamplers) {
      use(scene, sampler);
      settings.samples = samples.at(sampler);
      auto picture = render_here(scene, settings, steps);
      if (!picture.ok()) return picture.status();
      all[sampler].seconds = std::min(all[sampler].seconds, picture->times.total);
      all[sampler].picture = *std::move(picture);
    }
  return all;
}
std::map<Sampler, std::uint32_t> equal(std::uint32_t samples) {
  return {{Sampler::cap, samples}, {Sampler::bounded, samples}, {Sampler::exact, samples}};
}

// Figure 3 in the plane of incidence of the stretched space: which directions of the unit circle each range has.
Plot ranges(double theta_degrees, double alpha) {
  const double theta = theta_degrees * kPi / 180;
  const double ix = std::sin(theta), iz = std::cos(theta);
  const double nu = std::hypot(alpha * ix, iz), hx = alpha * ix / nu, hz = iz / nu;
  const double s = 1 + std::copysign(ix, 1 - alpha), a2 = std::min(1.0, alpha * alpha);
  const double k = (1 - a2) * s * s / (s * s + a2 * iz * iz);
  Plot plot;
  plot.title = fmt::format("Ranges of the samplers, incident at {}°, alpha {}", theta_degrees, alpha);
  plot.alt =
      "The unit circle of stretched directions in the plane of incidence. Arcs outside it show the range of cap, "
      "the smaller one of bounded, and the smallest, of exact, which has only reflections above the surface.";
  plot.x_label = "along the surface";
  plot.y_label = "along the normal";
  plot.equal_scales = true;
  const auto arc = [&](std::string name, double radius, auto inside) {
    Series series{std::move(name), {}};
    for (int n = 0; n <= 720; ++n) {
      const double phi = 2 * kPi * n / 720 - kPi, x = std::sin(phi), z = std::cos(phi);
      // A gap where the direction is outside of the range: curves break at NaN, which JSON leaves out, so runs are
      // series of their own.
      if (inside(x, z)) series.points.emplace_back(radius * x, radius * z);
    }
    plot.series.push_back(std::move(series));
  };
  const auto reflects = [&](double x, double z) {
    const double mx = alpha * (hx + x), mz = hz + z;
    if (mz <= 0) return false;
    const double im = (ix * mx + iz * mz) / (mx * mx + mz * mz);
    return 2 * im * mz - iz > 0;
  };
  arc("all directions", 1, [](double, double) { return true; });
  arc("cap", 1.06, [&](double, double z) { return z > -hz; });
  arc("bounded", 1.12, [&](double, double z) { return z > -k * hz; });
  arc("exact: reflected above the surface", 1.18, reflects);
  plot.series.push_back({"incident", {{0, 0}, {hx, hz}}});
  return plot;
}

}  // namespace

absl::StatusOr<Page> bounded_page(const Options& options) {
  Page page;
  page.id = "bounded";
  page.title = "Bounded and exact sampling of reflections";
  page.source = "Eto & Tokuyoshi 2023, Bounded VNDF Sampling for Smith-GGX Reflections: figures 1, 3, 4 to 6";
  page.command = "facetwise experiment bounded";
  Steps steps(options, 100);

  auto opened = lit("orbs");
  if (!opened.ok()) return opened.status();
  render::Scene scene = *std::move(opened);
  render::Settings settings;
  settings.width = by_size(options, 256, 416, 4096);
  settings.height = static_cast<int>(static_cast<float>(settings.width) / scene.aspect);
  constexpr std::uint32_t kSamples = 8;
  const std::uint32_t reference_samples = kSamples * by_size(options, 64u, 256u, 256u);

  if (auto status = steps.begin("orbs: the reference", 45, 2); !status.ok()) return status;
  const auto truth = reference(scene, settings, reference_samples, steps);
  if (!truth.ok()) return truth.status();

  // Figure 1.
  Table table{"Five orbs, 8 samples a pixel",
              {"numbers", "light", "sampler", "RMSE", "α 0.01", "α 0.1", "α 0.3", "α 0.6", "α 1", "rejected",
               "surfaces a path", "seconds"},
              {}};
  std::map<Sampler, Rendered> main;  // random numbers, no light sampling: as the text
  for (const bool light_sampling : {false, true})
    for (const render::Numbers numbers : {render::Numbers::random, render::Numbers::sobol}) {
      if (auto status = steps.begin("orbs: eight samples", 3, 9); !status.ok()) return status;
      settings.light_sampling = light_sampling;
      settings.numbers = numbers;
      auto all = render_each(scene, equal(kSamples), settings, 3, steps);
      if (!all.ok()) return all.status();
      for (const Sampler sampler : kSamplers) {
        const Rendered& one = all->at(sampler);
        std::vector<std::string> row = {text(name(numbers)), light_sampling ? "sampled too" : "found by reflection",
                                        text(name(sampler)),
                                        fmt::format("{:.4f}", render::rmse(one.picture, truth->picture))};
        for (int k = 0; k < 5; ++k)
          row.push_back(fmt::format("{:.4f}", render::rmse(one.picture, truth->picture, k / 5.0, (k + 1) / 5.0)));
        row.push_back(percent(share_rejected(one.picture)));
        row.push_back(fmt::format("{:.4f}", one.picture.mean_depth()));
        row.push_back(fmt::format("{:.2f}", one.seconds));
        table.rows.push_back(std::move(row));
      }
      if (!light_sampling && numbers == render::Numbers::random) main = *std::move(all);
    }
  const auto error = [&](Sampler sampler, int orb = -1) {
    const render::Picture& picture = main.at(sampler).picture;
    return orb < 0 ? render::rmse(picture, truth->picture)
                   : render::rmse(picture, truth->picture, orb / 5.0, (orb + 1) / 5.0);
  };
  Pictures pictures{
      "Five orbs, 8 samples a pixel, random numbers, light found only by reflection",
      "Five metal orbs with roughness 0.01, 0.1, 0.3, 0.6 and 1 in a courtyard. The rougher, the noisier; "
      "the noise falls from cap over bounded to exact.",
      settings.width,
      settings.height,
      {}};
  for (const Sampler sampler : kSamplers)
    pictures.pictures.push_back(shown(main.at(sampler).picture, text(name(sampler)),
                                      fmt::format("RMSE {:.4f}, {} rejected, {:.3f} surfaces a path, {:.2f} s",
                                                  error(sampler), percent(share_rejected(main.at(sampler).picture)),
                                                  main.at(sampler).picture.mean_depth(), main.at(sampler).seconds),
                                      1.5f));
  pictures.pictures.push_back(
      shown(truth->picture, "reference",
            fmt::format("{} samples a pixel, RMSE about {:.4f}", reference_samples, truth->error), 1.5f));
  for (const Sampler sampler : kSamplers)
    pictures.pictures.push_back(difference(main.at(sampler).picture, truth->picture,
                                           fmt::format("error of {}", name(sampler)),
                                           "Difference from the reference, twice", 2));
  page.figures.emplace_back(std::move(pictures));
  page.figures.emplace_back(std::move(table));

  // Equal time.
  if (auto status = steps.begin("orbs: equal time", 12, 30); !status.ok()) return status;
  const std::uint32_t base = by_size(options, 16u, 64u, 64u);
  Table times{"Equal time: as many samples as fit into the time that cap takes",
              {"numbers", "light", "sampler", "samples", "seconds", "RMSE", "of cap's"},
              {}};
  std::map<Sampler, double> equal_time;
  for (const bool light_sampling : {false, true}) {
    settings.light_sampling = light_sampling;
    settings.numbers = render::Numbers::random;
    const auto timed = render_each(scene, equal(base), settings, 3, steps);
    if (!timed.ok()) return timed.status();
    std::map<Sampler, std::uint32_t> fitting;
    for (const Sampler sampler : kSamplers)
      fitting[sampler] =
          static_cast<std::uint32_t>(std::lround(base * timed->at(Sampler::cap).seconds / timed->at(sampler).seconds));
    const auto all = render_each(scene, fitting, settings, 2, steps);
    if (!all.ok()) return all.status();
    const double cap = render::rmse(all->at(Sampler::cap).picture, truth->picture);
    for (const Sampler sampler : kSamplers) {
      const double rmse = render::rmse(all->at(sampler).picture, truth->picture);
      if (!light_sampling) equal_time[sampler] = rmse / cap;
      times.rows.push_back({"random", light_sampling ? "sampled too" : "found by reflection", text(name(sampler)),
                            fmt::format("{}", fitting[sampler]), fmt::format("{:.2f}", all->at(sampler).seconds),
                            fmt::format("{:.4f}", rmse), fmt::format("{:.3f}", rmse / cap)});
    }
  }
  page.figures.emplace_back(std::move(times));

  // Figure 3.
  page.figures.emplace_back(ranges(60, 0.5));
  page.figures.emplace_back(ranges(30, 1));

  // Figures 4 to 6.
  auto one_orb = lit("orb");
  if (!one_orb.ok()) return one_orb.status();
  scene = *std::move(one_orb);
  settings = {};
  settings.width = by_size(options, 24, 64, 1024);
  settings.height = static_cast<int>(static_cast<float>(settings.width) / scene.aspect);
  settings.samples = 16;
  settings.light_sampling = false;
  const std::uint32_t many = 16 * by_size(options, 64u, 256u, 256u);
  // RMSE over three seeds: such small pictures have few bright pixels.
  const auto errors = [&](float alpha_x, float alpha_y, std::map<Sampler, double>& found) -> absl::Status {
    scene.materials[0].alpha_x = alpha_x;
    scene.materials[0].alpha_y = alpha_y;
    use(scene, Sampler::exact);
    const auto converged = reference(scene, settings, many, steps);
    if (!converged.ok()) return converged.status();
    for (const Sampler sampler : kSamplers) {
      use(scene, sampler);
      double square = 0;
      constexpr int kSeeds = 3;
      for (int seed = 1; seed <= kSeeds; ++seed) {
        settings.seed = static_cast<std::uint64_t>(seed);
        const auto picture = render_here(scene, settings, steps);
        if (!picture.ok()) return picture.status();
        square += std::pow(render::rmse(*picture, converged->picture), 2) / kSeeds;
      }
      found[sampler] = std::sqrt(square);
    }
    return absl::OkStatus();
  };
  const auto curves = [&](std::string title, std::string alt) {
    Plot plot{std::move(title), std::move(alt), "alpha", "RMSE", false, true, false, {}};
    for (const Sampler sampler : kSamplers) plot.series.push_back({text(name(sampler)), {}});
    return plot;
  };
  Plot isotropic = curves("RMSE against isotropic roughness, 16 samples a pixel",
                          "Error grows with roughness for cap, less for bounded, least for exact.");
  std::map<Sampler, double> found, rough;
  for (const double alpha : {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0}) {
    if (auto status = steps.begin(fmt::format("isotropic alpha {}", alpha), 1.2, 3); !status.ok()) return status;
    if (auto status = errors(static_cast<float>(alpha), static_cast<float>(alpha), found); !status.ok()) return status;
    for (std::size_t k = 0; k < 3; ++k) isotropic.series[k].points.emplace_back(alpha, found[kSamplers[k]]);
    if (alpha == 0.8) rough = found;
  }
  const double smooth_gain = isotropic.series[1].points[1].second / isotropic.series[0].points[1].second;
  page.figures.emplace_back(std::move(isotropic));
  double low_anisotropy = 0, high_anisotropy = 0, exact_anisotropy = 0;
  for (const double alpha_y : {1.0, 0.5}) {
    Plot plot = curves(fmt::format("RMSE against alpha_x, alpha_y = {}, 16 samples a pixel", alpha_y),
                       "Error of the three samplers; bounded comes close to cap where the two roughnesses differ much, "
                       "exact does not.");
    for (const double alpha_x : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0}) {
      if (auto status = steps.begin(fmt::format("anisotropic alpha {}, {}", alpha_x, alpha_y), 1.2, 3); !status.ok())
        return status;
      if (auto status = errors(static_cast<float>(alpha_x), static_cast<float>(alpha_y), found); !status.ok())
        return status;
      for (std::size_t k = 0; k < 3; ++k) plot.series[k].points.emplace_back(alpha_x, found[kSamplers[k]]);
      if (alpha_y == 1.0 && alpha_x == 0.1) {
        high_anisotropy = found[Sampler::bounded] / found[Sampler::cap];
        exact_anisotropy = found[Sampler::exact] / found[Sampler::cap];
      }
      if (alpha_y == 1.0 && alpha_x == 0.8) low_anisotropy = found[Sampler::bounded] / found[Sampler::cap];
    }
    page.figures.emplace_back(std::move(plot));
  }

  page.claims.push_back(
      {"Bounded sampling reduces noise compared with the spherical cap, especially for rough surfaces (figure 1).",
       fmt::format("RMSE of all five orbs {:.4f} with cap, {:.4f} with bounded; at alpha = 1 {:.4f} and {:.4f}, at "
                   "0.01 {:.4f} and {:.4f}.",
                   error(Sampler::cap), error(Sampler::bounded), error(Sampler::cap, 4), error(Sampler::bounded, 4),
                   error(Sampler::cap, 0), error(Sampler::bounded, 0)),
       agrees(error(Sampler::bounded) < error(Sampler::cap) &&
              error(Sampler::bounded, 4) / error(Sampler::cap, 4) <
                  error(Sampler::bounded, 0) / error(Sampler::cap, 0))});
  const double depth = main.at(Sampler::bounded).picture.mean_depth() - main.at(Sampler::cap).picture.mean_depth();
  page.claims.push_back(
      {"It makes paths longer, since fewer end at a rejected sample (figure 1).",
       fmt::format("{:.4f} surfaces a path with cap, {:.4f} with bounded, {:.4f} with exact.",
                   main.at(Sampler::cap).picture.mean_depth(), main.at(Sampler::bounded).picture.mean_depth(),
                   main.at(Sampler::exact).picture.mean_depth()),
       agrees(depth > 0)});
  page.claims.push_back(
      {"The time that this costs is small beside the gain (section 4).",
       fmt::format("In the time that cap takes, bounded comes to {:.3f} and exact to {:.3f} times its RMSE.",
                   equal_time[Sampler::bounded], equal_time[Sampler::exact]),
       agrees(equal_time[Sampler::bounded] < 1)});
  page.claims.push_back({"At alpha = 0.8 the gain is clear, at 0.2 insignificant (figure 4).",
                         fmt::format("Bounded's RMSE is {:.3f} of cap's at 0.8 and {:.3f} at 0.2.",
                                     rough[Sampler::bounded] / rough[Sampler::cap], smooth_gain),
                         agrees(rough[Sampler::bounded] / rough[Sampler::cap] < smooth_gain)});
  page.claims.push_back(
      {"The gain is larger for low anisotropy (figures 5 and 6).",
       fmt::format("With alpha_y = 1, bounded's RMSE is {:.3f} of cap's at alpha_x = 0.8 and {:.3f} at 0.1.",
                   low_anisotropy, high_anisotropy),
       agrees(low_anisotropy < high_anisotropy)});
  page.claims.push_back(
      {"A method that avoids all occluded reflections is left for future work (section 4).",
       fmt::format(
           "exact is one: {} of its samples rejected (bounded {}, cap {}), RMSE {:.3f} of bounded's at equal samples "
           "and {:.3f} at equal time.",
           percent(share_rejected(main.at(Sampler::exact).picture)),
           percent(share_rejected(main.at(Sampler::bounded).picture)),
           percent(share_rejected(main.at(Sampler::cap).picture)), error(Sampler::exact) / error(Sampler::bounded),
           equal_time[Sampler::exact] / equal_time[Sampler::bounded]),
       agrees(main.at(Sampler::exact).picture.sampled.occluded == 0)});
  page.claims.push_back(
      {"A tighter bound for highly anisotropic roughness is left for future work too (section 4).",
       fmt::format("At alpha_x = 0.1, alpha_y = 1 exact's RMSE is {:.3f} of cap's, where bounded's is {:.3f}.",
                   exact_anisotropy, high_anisotropy),
       agrees(exact_anisotropy < high_anisotropy)});
  page.notes = {
      "The text's orb model and light probe are not free; ours are an orb of revolution and the courtyard of Blender's "
      "light probes. The numbers are therefore ours, the comparison the same.",
      "The text's renderer finds light only by reflection, as far as it says. Where the environment is sampled too "
      "(as "
      "renderers do), the samplers differ less: both are in the tables.",
      "Energy compensation after Turquin 2019, as in the text, by the engine's tables of albedo."};
  return page;
}

}  // namespace facetwise::experiments
