// SPDX-License-Identifier: Apache-2.0
// Tokuyoshi 2021, "Unbiased VNDF Sampling for Backfacing Shading Normals": the five configurations of V-cavities (figure 1 of
// the supplement) and a normal-mapped scene by the older and the unbiased normalisation (figure 2).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

constexpr double kPi = std::numbers::pi;

struct Point {
  double x, y;
};

// V-grooves of slope `slope` and period 2: facets run from (2 k - 1, slope) down to (2 k, 0) and up to (2 k + 1, slope).
// side -1: the descending one, whose normal leans to +x; +1 the ascending one.
struct Grooves {
  double slope;
  Point normal(int side) const {
    const double length = std::hypot(1, slope);
    return {-side * slope / length, 1 / length};
  }
  Point point(int side, double share) const {
    return {side * share, slope * share};
  }  // share 0 at the bottom, 1 at the top
  bool faces(int side, Point i) const { return normal(side).x * i.x + normal(side).y * i.y > 1e-12; }

  // Whether a point of a facet is seen from i: no other facet that faces i is between. Facets are single-sided: those that
  // face away hide nothing.
  bool visible(int side, double share, Point i) const {
    if (!faces(side, i)) return false;
    const Point p = point(side, share);
    for (int groove = -60; groove <= 60; ++groove)
      for (const int other : {-1, 1}) {
        if ((groove == 0 && other == side) || !faces(other, i)) continue;
        // p + t i = (2 groove + other s, slope s), s in (0, 1), t > 0.
        const double det = -i.x * slope + i.y * other;
        if (std::abs(det) < 1e-12) continue;
        const double dx = 2 * groove - p.x, dy = -p.y;
        const double t = (-dx * slope + dy * other) / det;
        const double s = (i.x * dy - i.y * dx) / det;
        if (t > 1e-9 && s > 1e-9 && s < 1 - 1e-9) return false;
      }
    return true;
  }
  double share_visible(int side, Point i) const {
    constexpr int kPoints = 4000;
    int count = 0;
    for (int k = 0; k < kPoints; ++k) count += visible(side, (k + 0.5) / kPoints, i);
    return static_cast<double>(count) / kPoints;
  }
  // Equation 3.
  double masking(int side, Point i) const {
    const Point m = normal(side);
    const double im = m.x * i.x + m.y * i.y;
    return im > 1e-12 ? std::min(2 * m.y * std::abs(i.y) / im, 1.0) : 0.0;
  }
};

Plot drawing(const char* letter, const std::string& what, const Grooves& grooves, double degrees) {
  const double theta = degrees * kPi / 180;
  const Point i = {std::sin(theta), std::cos(theta)};
  Plot plot{fmt::format("({}) {}", letter, what),
            fmt::format("Grooves of slope {:.2g}, seen at {} degrees from the shading normal. The visible part of the "
                        "facets is drawn apart.",
                        grooves.slope, degrees),
            "along the surface",
            "height",
            false,
            false,
            true,
            {}};
  Series profile{"microsurface", {}};
  for (int k = -3; k <= 3; ++k) profile.points.emplace_back(k, k % 2 == 0 ? 0 : grooves.slope);
  plot.series.push_back(std::move(profile));
  for (int groove = -1; groove <= 1; ++groove)
    for (const int side : {-1, 1}) {
      Series seen{"visible", {}};
      for (int k = 0; k <= 200; ++k)
        if (grooves.visible(side, (k + 0.5) / 201, i)) {
          const Point p = grooves.point(side, (k + 0.5) / 201), m = grooves.normal(side);
          seen.points.emplace_back(2 * groove + p.x + 0.05 * m.x, p.y + 0.05 * m.y);
        }
      if (!seen.points.empty()) plot.series.push_back({"visible", {seen.points.front(), seen.points.back()}});
    }
  plot.series.push_back({"incident", {{0, grooves.slope / 2}, {1.6 * i.x, grooves.slope / 2 + 1.6 * i.y}}});
  return plot;
}

struct Composition {
  Distribution distribution;
  Masking masking;
  const char* letter;
};
constexpr Composition kCompositions[] = {{Distribution::beckmann, Masking::smith, "a"},
                                         {Distribution::ggx, Masking::vcavity, "b"},
                                         {Distribution::beckmann, Masking::vcavity, "c"}};

// The integral of the older density over all normals: its ratio to the one that integrates to 1, at any normal.
absl::StatusOr<std::vector<float>> integrals(const Model& model, const std::vector<float>& x,
                                             const std::vector<float>& y, const std::vector<float>& z, float alpha) {
  const std::size_t lanes = x.size();
  std::vector<float> ox(lanes), oy(lanes), oz(lanes), old(lanes), right(lanes);
  Batch batch;
  batch.model = model;
  batch.sampler = Sampler::visible;
  batch.lanes = lanes;
  batch.incident = {x, y, z};
  batch.alpha_x = batch.alpha_y = alpha;
  batch.generator = Generator{.seed = 2021};
  batch.out.outgoing = {ox, oy, oz};
  batch.out.pdf = right;
  if (const auto status = sample_reflection(batch); !status.ok()) return status.status();
  batch.model.normalisation = Normalisation::biased;
  batch.out.pdf = old;
  if (const auto status = sample_reflection(batch); !status.ok()) return status.status();
  for (std::size_t k = 0; k < lanes; ++k) old[k] = right[k] > 0 ? old[k] / right[k] : 1;
  return old;
}

}  // namespace

absl::StatusOr<Page> backfacing_page(const Options& options) {
  Page page;
  page.id = "backfacing";
  page.title = "Shading normals that face away";
  page.source = "Tokuyoshi 2021, Unbiased VNDF Sampling for Backfacing Shading Normals: supplement, figures 1 and 2";
  page.command = "facetwise experiment backfacing";
  Steps steps(options, 31);
  if (auto status = steps.begin("V-cavities", 1); !status.ok()) return status;

  // Figure 1, and equation 3 against rays through the grooves.
  constexpr struct {
    const char* letter;
    const char* what;
    double slope, degrees;
  } kConfigurations[] = {{"a", "both sides seen whole", 0.6, 25},
                         {"b", "one side seen, in part", 1.2, 65},
                         {"c", "from behind: one side, in part", 1.2, 100},
                         {"d", "from behind: one side, whole", 1.2, 122},
                         {"e", "from behind: nothing", 0.6, 160}};
  Table cavities{"Share of a facet that is seen: rays through the grooves, and equation 3",
                 {"configuration", "slope", "angle", "side towards i", "equation 3", "side away", "equation 3 "},
                 {}};
  double worst = 0;
  for (const auto& [letter, what, slope, degrees] : kConfigurations) {
    const Grooves grooves{slope};
    page.figures.emplace_back(drawing(letter, what, grooves, degrees));
    const Point i = {std::sin(degrees * kPi / 180), std::cos(degrees * kPi / 180)};
    std::vector<std::string> row = {letter, fmt::format("{}", slope), fmt::format("{}°", degrees)};
    for (const int side : {-1, 1}) {
      const double seen = grooves.share_visible(side, i), formula = grooves.masking(side, i);
      worst = std::max(worst, std::abs(seen - formula));
      row.push_back(fmt::format("{:.3f}", seen));
      row.push_back(fmt::format("{:.3f}", formula));
    }
    cavities.rows.push_back(std::move(row));
  }
  page.figures.emplace_back(std::move(cavities));

  // The integral of the older density against the angle.
  Plot integral{
      "Integral of the older density of visible normals, alpha 0.5",
      "One for normals that face the viewer, and falling behind, to small values for the models with V-cavities.",
      "angle between viewer and shading normal [degrees]",
      "integral",
      false,
      false,
      false,
      {}};
  for (const auto& [distribution, masking, letter] : kCompositions) {
    std::vector<float> x, y, z;
    for (int degrees = 60; degrees <= 150; degrees += 3) {
      const double theta = degrees * kPi / 180;
      x.push_back(static_cast<float>(std::sin(theta))), y.push_back(0),
          z.push_back(static_cast<float>(std::cos(theta)));
    }
    const auto found = integrals({.distribution = distribution, .masking = masking}, x, y, z, 0.5f);
    if (!found.ok()) return found.status();
    Series series{fmt::format("{}, {}", name(distribution), name(masking)), {}};
    for (std::size_t k = 0; k < x.size(); ++k)
      series.points.emplace_back(60 + 3.0 * static_cast<double>(k), (*found)[k]);
    integral.series.push_back(std::move(series));
  }
  page.figures.emplace_back(std::move(integral));

  // Figure 2.
  auto scene = lit("normal-map");
  if (!scene.ok()) return scene.status();
  render::Settings settings;
  settings.width = by_size(options, 128, 256, 1024);
  settings.height = settings.width / 2;
  settings.samples = by_size(options, 64u, 256u, 2048u);
  settings.numbers = render::Numbers::sobol;
  const auto hits = render::first_hits(*scene, settings.width, settings.height);
  if (!hits.ok()) return hits.status();
  // Sampling by visible normals divides by their density; sampling by all normals, whose density is right whatever the
  // normalisation, shows what the BRDF itself would give.
  settings.light_sampling = false;
  Table table{"Brightness where the shading normal faces away, by visible normals over by all normals",
              {"model", "older normalisation", "unbiased", "smallest integral", "backfacing lanes"},
              {}};
  double least_ratio = 10, farthest = 0, smallest = 1;
  for (const auto& [distribution, masking, letter] : kCompositions) {
    if (auto status = steps.begin(fmt::format("{} with {}", name(distribution), name(masking)), 10, 4); !status.ok())
      return status;
    render::Picture found[2][2];  // [older][by visible normals]
    double mean[2][2] = {};
    for (const bool older : {false, true})
      for (const bool visible : {false, true}) {
        for (auto& material : scene->materials) {
          material.model = {.distribution = distribution,
                            .masking = masking,
                            .normalisation = older ? Normalisation::biased : Normalisation::unbiased};
          material.sampler = visible ? Sampler::visible : Sampler::ndf;
        }
        // Weights by all normals spread far: more samples.
        render::Settings enough = settings;
        if (!visible) enough.samples *= 8;
        auto picture = render_here(*scene, enough, steps);
        if (!picture.ok()) return picture.status();
        found[older][visible] = *std::move(picture);
        double count = 0;
        for (std::size_t p = 0; p < hits->z.size(); ++p)
          if (hits->z[p] < 0) mean[older][visible] += found[older][visible].color(p)[1], ++count;
        mean[older][visible] /= count;
      }
    const double old_ratio = mean[true][true] / mean[true][false], ratio = mean[false][true] / mean[false][false];
    const float alpha = scene->materials[0].alpha_x;
    const auto share = integrals({.distribution = distribution, .masking = masking}, hits->x, hits->y, hits->z, alpha);
    if (!share.ok()) return share.status();
    std::vector<std::uint8_t> bytes;
    float least = 1;
    for (std::size_t p = 0; p < share->size(); ++p) {
      const bool hit = hits->x[p] != 0 || hits->y[p] != 0 || hits->z[p] != 0;
      if (hit) least = std::min(least, (*share)[p]);
      const auto level = static_cast<std::uint8_t>(255 * std::clamp((*share)[p], 0.0f, 1.0f));
      bytes.insert(bytes.end(),
                   {hit ? level : std::uint8_t{60}, hit ? level : std::uint8_t{60}, hit ? level : std::uint8_t{90}});
    }
    Pictures pictures{fmt::format("({}) {} with {} masking", letter, name(distribution), name(masking)),
                      "A ball on a floor under a normal map, whose normals often face away from the viewer. The older "
                      "normalisation is brighter there than its own BRDF.",
                      settings.width,
                      settings.height,
                      {}};
    const std::string samples = fmt::format("{} samples a pixel", settings.samples);
    const std::string more = fmt::format("{} samples a pixel", 8 * settings.samples);
    pictures.pictures.push_back(shown(found[true][true], "older normalisation", samples, 1));
    pictures.pictures.push_back(shown(found[true][false], "older, by all normals", more, 1));
    pictures.pictures.push_back(shown(found[false][true], "unbiased normalisation", samples, 1));
    pictures.pictures.push_back(shown(found[false][false], "unbiased, by all normals", more, 1));
    pictures.pictures.push_back(difference(found[true][true], found[true][false], "error of the older",
                                           "By visible normals and by all, twice", 2));
    pictures.pictures.push_back(difference(found[false][true], found[false][false], "error of the unbiased",
                                           "By visible normals and by all, twice: noise", 2));
    pictures.pictures.push_back({"integral",
                                 "Of the older density at each pixel: white is 1, black 0; blue where there is nothing",
                                 render::png_bytes(settings.width, settings.height, bytes)});
    page.figures.emplace_back(std::move(pictures));
    table.rows.push_back(
        {fmt::format("{}, {}", name(distribution), name(masking)), fmt::format("{:.3f}", old_ratio),
         fmt::format("{:.3f}", ratio), fmt::format("{:.3f}", least),
         percent(static_cast<double>(found[0][1].backfacing) / static_cast<double>(found[0][1].sampled.lanes()))});
    least_ratio = std::min(least_ratio, old_ratio);
    farthest = std::max(farthest, std::abs(ratio - 1));
    smallest = std::min(smallest, static_cast<double>(least));
  }
  page.figures.emplace_back(std::move(table));

  page.claims.push_back(
      {"The visibility of single-sided V-cavities has the same form (equation 3) in all five configurations (figure "
       "1).",
       fmt::format("Rays through drawn grooves differ from equation 3 by at most {:.4f} in share of a facet.", worst),
       agrees(worst < 2e-3)});
  page.claims.push_back(
      {"With the older normalisation the density of visible normals integrates to less than one where the shading "
       "normal faces away.",
       fmt::format("In the picture it integrates to as little as {:.3f}.", smallest), agrees(smallest < 0.99)});
  page.claims.push_back(
      {"That makes pictures too bright; the unbiased normalisation avoids it (figure 2).",
       fmt::format("Where the normal faces away, the older pictures are brighter than their own BRDF by a factor of "
                   "{:.2f} at least; the unbiased ones differ by {:.1f} % at most, which is noise.",
                   least_ratio, 100 * farthest),
       agrees(least_ratio > 1.05 && farthest < 0.04)});
  page.notes = {
      "The text's normal maps are made of Sponza's textures; ours is the crumpled foil of a glTF test model, made "
      "three "
      "times steeper.",
      "With the older normalisation value and density are both too small, so that their quotient, a sample's weight, "
      "is right "
      "for another BRDF than the one that light sampling sees. Light is found only by scattering here."};
  return page;
}

}  // namespace facetwise::experiments
