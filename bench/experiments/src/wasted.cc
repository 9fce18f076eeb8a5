// SPDX-License-Identifier: Apache-2.0
// A post of 2015 on sampling visible normals of GGX: wasted samples by method and angle, the range of the weights, and
// pictures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

constexpr Sampler kSamplers[] = {Sampler::ndf, Sampler::visible, Sampler::exact};
constexpr double kPi = std::numbers::pi;

struct Weights {
  double wasted = 0;
  double largest = 0, high = 0, median = 0, second_moment = 0;  // of accepted samples; `high`: 99.9 % lie below
};

absl::StatusOr<Weights> weights_of(Sampler sampler, float alpha, double theta, std::size_t samples) {
  std::vector<float> weight(samples);
  std::vector<std::uint8_t> status(samples);
  Batch batch;
  batch.sampler = sampler;
  batch.lanes = samples;
  batch.incident = {static_cast<float>(std::sin(theta)), 0.0f, static_cast<float>(std::cos(theta))};
  batch.alpha_x = batch.alpha_y = alpha;
  batch.generator = Generator{.seed = 20150823};
  batch.out.weight = weight;
  batch.out.status = status;
  const auto statistics = sample_reflection(batch);
  if (!statistics.ok()) return statistics.status();
  std::vector<float> accepted;
  double square = 0;
  for (std::size_t k = 0; k < samples; ++k)
    if (status[k] == static_cast<std::uint8_t>(LaneStatus::accepted)) {
      accepted.push_back(weight[k]);
      square += static_cast<double>(weight[k]) * weight[k];
    }
  std::sort(accepted.begin(), accepted.end());
  Weights result;
  result.wasted = static_cast<double>(statistics->occluded) / static_cast<double>(samples);
  if (accepted.empty()) return result;
  result.largest = accepted.back();
  result.high = accepted[accepted.size() * 999 / 1000];
  result.median = accepted[accepted.size() / 2];
  result.second_moment = square / static_cast<double>(samples);
  return result;
}

}  // namespace

absl::StatusOr<Page> wasted_page(const Options& options) {
  Page page;
  page.id = "wasted";
  page.title = "Wasted samples and the range of weights";
  page.source = "Sampling Visible Normals for GGX BRDF, a post of 23 August 2015; after Heitz & d'Eon 2014";
  page.command = "facetwise experiment wasted";
  Steps steps(options, 20);
  if (auto status = steps.begin("wasted samples", 1); !status.ok()) return status;
  const std::size_t samples = by_size(options, 1u << 18, 1u << 22, 1u << 22);

  std::map<std::pair<Sampler, float>, std::map<double, Weights>> all;
  constexpr float kAlpha[] = {0.05f, 0.3f, 1.0f};
  constexpr double kTheta[] = {0, 10, 20, 30, 40, 50, 60, 70, 75, 80, 83, 86, 88, 89, 89.5};
  for (const float alpha : kAlpha) {
    Plot wasted{
        fmt::format("Wasted samples, alpha {}", alpha),
        "Share of samples that are thrown away against the angle of incidence: with ndf it rises steeply towards "
        "grazing, with visible normals it stays low, with exact it is zero.",
        "angle of incidence [degrees]",
        "share of samples",
        false,
        false,
        false,
        {}};
    Plot weights{
        fmt::format("Largest weight of a thousand, alpha {}", alpha),
        "The weight that 99.9 percent of accepted samples stay below: with ndf it grows by orders of magnitude "
        "towards grazing, with the others it stays at or below one, or for exact just above.",
        "angle of incidence [degrees]",
        "weight",
        false,
        true,
        false,
        {}};
    for (const Sampler sampler : kSamplers) {
      Series share{text(name(sampler)), {}}, high{text(name(sampler)), {}};
      for (const double theta : kTheta) {
        const auto found = weights_of(sampler, alpha, theta * kPi / 180, samples);
        if (!found.ok()) return found.status();
        all[{sampler, alpha}][theta] = *found;
        share.points.emplace_back(theta, found->wasted);
        high.points.emplace_back(theta, found->high);
      }
      wasted.series.push_back(std::move(share));
      weights.series.push_back(std::move(high));
    }
    page.figures.emplace_back(std::move(wasted));
    page.figures.emplace_back(std::move(weights));
  }
  Table table{"Weights of accepted samples",
              {"alpha", "angle", "sampler", "wasted", "median", "99.9 % below", "largest", "mean square"},
              {}};
  for (const float alpha : kAlpha)
    for (const double theta : {0.0, 60.0, 86.0, 89.5})
      for (const Sampler sampler : kSamplers) {
        const Weights& w = all[{sampler, alpha}][theta];
        table.rows.push_back({fmt::format("{}", alpha), fmt::format("{}°", theta), text(name(sampler)),
                              fmt::format("{:.2f} %", 100 * w.wasted), fmt::format("{:.3g}", w.median),
                              fmt::format("{:.3g}", w.high), fmt::format("{:.3g}", w.largest),
                              fmt::format("{:.3g}", w.second_moment)});
      }
  page.figures.emplace_back(std::move(table));

  // The post's own counts: 1.5 rad and pi / 4.
  Table post{"The post's counts", {"angle", "sampler", "wasted of 730 at alpha 1.26", "the post says"}, {}};
  std::map<Sampler, double> at_grazing, at_quarter;
  for (const auto& [theta, which] : {std::pair(1.5, &at_grazing), {kPi / 4, &at_quarter}})
    for (const Sampler sampler : kSamplers) {
      const auto found = weights_of(sampler, 1.26f, theta, samples);
      if (!found.ok()) return found.status();
      (*which)[sampler] = 730 * found->wasted;
      const char* says = sampler == Sampler::exact ? "-"
                         : theta == 1.5            ? (sampler == Sampler::ndf ? "371" : "61")
                                                   : (sampler == Sampler::ndf ? "-" : "52");
      post.rows.push_back(
          {fmt::format("{:.4g} rad", theta), text(name(sampler)), fmt::format("{:.0f}", (*which)[sampler]), says});
    }
  page.figures.emplace_back(std::move(post));

  // Its three comparisons of pictures: the old way beside the new, at three roughnesses.
  auto scene = lit("orb");
  if (!scene.ok()) return scene.status();
  std::map<Sampler, double> errors;
  for (const float alpha : {0.1f, 0.3f, 0.6f}) {
    if (auto status = steps.begin(fmt::format("pictures at alpha {}", alpha), 6, 3); !status.ok()) return status;
    render::Settings settings;
    settings.width = by_size(options, 96, 160, 512);
    settings.height = static_cast<int>(static_cast<float>(settings.width) / scene->aspect);
    settings.light_sampling = false;
    scene->materials[0].alpha_x = scene->materials[0].alpha_y = alpha;
    constexpr std::uint32_t kSamples = 16;
    const std::uint32_t many = kSamples * by_size(options, 32u, 256u, 256u);
    scene->materials[0].sampler = Sampler::exact;
    const auto truth = reference(*scene, settings, many, steps);
    if (!truth.ok()) return truth.status();
    Pictures pictures{
        fmt::format("An orb, alpha {}, 16 samples a pixel", alpha),
        "A metal orb in a courtyard by each sampler. With ndf the edges, which are seen at grazing angles, "
        "are noisy and have bright specks; with visible normals they are clean.",
        settings.width,
        settings.height,
        {}};
    for (const Sampler sampler : kSamplers) {
      settings.samples = kSamples;
      scene->materials[0].sampler = sampler;
      const auto picture = render_here(*scene, settings, steps);
      if (!picture.ok()) return picture.status();
      const double rmse = render::rmse(*picture, truth->picture);
      if (alpha == 0.3f) errors[sampler] = rmse;
      pictures.pictures.push_back(shown(*picture, text(name(sampler)),
                                        fmt::format("RMSE {:.4f}, {:.2f} % rejected", rmse,
                                                    100 * static_cast<double>(picture->sampled.occluded) /
                                                        static_cast<double>(picture->sampled.lanes())),
                                        1.5f));
    }
    pictures.pictures.push_back(shown(truth->picture, "reference",
                                      fmt::format("{} samples a pixel, RMSE about {:.4f}", many, truth->error), 1.5f));
    page.figures.emplace_back(std::move(pictures));
  }

  const auto& ndf = all[{Sampler::ndf, 0.3f}];
  const auto& visible = all[{Sampler::visible, 0.3f}];
  page.claims.push_back(
      {"Sampling by the distribution of normals wastes lots of samples near grazing angles.",
       fmt::format(
           "At alpha = 0.3, ndf wastes {:.1f} % at 60° and {:.1f} % at 89.5°; visible normals {:.1f} % and {:.1f} %.",
           100 * ndf.at(60).wasted, 100 * ndf.at(89.5).wasted, 100 * visible.at(60).wasted,
           100 * visible.at(89.5).wasted),
       agrees(ndf.at(89.5).wasted > visible.at(89.5).wasted)});
  double largest = 0;
  for (const float alpha : kAlpha)
    for (const auto& [theta, w] : all[{Sampler::ndf, alpha}]) largest = std::max(largest, w.largest);
  double largest_visible = 0;
  for (const float alpha : kAlpha)
    for (const auto& [theta, w] : all[{Sampler::visible, alpha}])
      largest_visible = std::max(largest_visible, w.largest);
  page.claims.push_back(
      {"The weights of samples by the distribution of normals reach hundreds to millions at grazing angles.",
       fmt::format("The largest of {} samples a configuration is {:.3g}; with visible normals {:.3g}.", samples,
                   largest, largest_visible),
       largest >= 100 ? Verdict::agrees : Verdict::in_part});
  page.claims.push_back(
      {"At 1.5 rad visible normals save 310 wasted samples: 61 instead of 371.",
       fmt::format("With 730 samples at alpha = 1.26, {:.0f} and {:.0f} are wasted (the post gives neither number; "
                   "these fit best), with exact {:.0f}.",
                   at_grazing[Sampler::visible], at_grazing[Sampler::ndf], at_grazing[Sampler::exact]),
       agrees(std::abs(at_grazing[Sampler::visible] - 61) < 20 && std::abs(at_grazing[Sampler::ndf] - 371) < 40)});
  page.claims.push_back(
      {"At pi / 4 there are 52 invalid samples, as far as 3 pi / 4 from the normal: the author guesses at numerical "
       "errors.",
       fmt::format("There is no error. {:.0f} of 730 visible normals reflect below the surface there, because the "
                   "normals that are seen are not all those whose reflection leaves; exact has {:.0f}.",
                   at_quarter[Sampler::visible], at_quarter[Sampler::exact]),
       Verdict::in_part});
  page.claims.push_back(
      {"Pictures by visible normals have less noise at equal samples.",
       fmt::format("At alpha = 0.3 the RMSE is {:.4f} with ndf, {:.4f} with visible normals, {:.4f} with exact.",
                   errors[Sampler::ndf], errors[Sampler::visible], errors[Sampler::exact]),
       agrees(errors[Sampler::visible] < errors[Sampler::ndf])});
  page.notes = {
      "The post's pictures show a scene that is not given; ours is an orb in the courtyard of Blender's light probes.",
      "Light is found only by reflection, so that only the sampler differs."};
  return page;
}

}  // namespace facetwise::experiments
