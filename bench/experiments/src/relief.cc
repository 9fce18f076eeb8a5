// SPDX-License-Identifier: Apache-2.0
// Non-centred distributions (Heitz & d'Eon 2014, section 4 of the supplement; LEADR: Dupuy et al. 2013): a displaced surface
// seen from afar by moments of its slopes, against its geometry.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "src/all.h"
#include "src/measure.h"

namespace facetwise::experiments {
namespace {

// A relief that repeats: waves of random directions and phases, more of them and lower the shorter they are.
std::vector<float> waves(int side) {
  std::mt19937 engine(2013);
  std::uniform_real_distribution<double> uniform(0, 1);
  struct Wave {
    int kx, ky;
    double amplitude, phase;
  };
  std::vector<Wave> all;
  const auto octave = [&](int count, int shortest, int longest, double slope) {
    for (int n = 0; n < count; ++n) {
      const double angle = 2 * std::numbers::pi * uniform(engine);
      const double k = shortest + uniform(engine) * (longest - shortest);
      const int kx = static_cast<int>(std::lround(k * std::cos(angle))),
                ky = static_cast<int>(std::lround(k * std::sin(angle) * 0.4));
      const double length = std::max(1.0, std::hypot(kx, ky));
      all.push_back({kx, ky, slope * std::sqrt(2.0 / count) / (2 * std::numbers::pi * length),
                     2 * std::numbers::pi * uniform(engine)});
    }
  };
  octave(6, 3, 6, 0.2);        // hills, wider than pixels
  octave(32, 110, 170, 0.35);  // relief within pixels, steeper along x than along y
  std::vector<float> heights(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      double sum = 0;
      for (const Wave& wave : all)
        sum += wave.amplitude * std::sin(2 * std::numbers::pi * (wave.kx * x + wave.ky * y) / side + wave.phase);
      heights[static_cast<std::size_t>(y * side + x)] = static_cast<float>(sum);
    }
  return heights;
}

// Lies the plate down, its face up.
scene::Mesh lying(scene::Mesh mesh) {
  for (auto* vectors : {&mesh.positions, &mesh.normals, &mesh.tangents})
    for (render::Vector& v : *vectors) v = {v[0], v[2], -v[1]};
  return mesh;
}

// Pixels of the plate, except those near its edge, which the relief moves.
std::vector<std::size_t> interior(const render::FirstHits& hits, int width, int height) {
  constexpr int kMargin = 3;
  std::vector<std::size_t> pixels;
  for (int y = kMargin; y < height - kMargin; ++y)
    for (int x = kMargin; x < width - kMargin; ++x) {
      bool inside = true;
      for (int dy = -kMargin; dy <= kMargin; ++dy)
        for (int dx = -kMargin; dx <= kMargin; ++dx)
          inside = inside && hits.z[static_cast<std::size_t>((y + dy) * width + x + dx)] > 0;
      if (inside) pixels.push_back(static_cast<std::size_t>(y * width + x));
    }
  return pixels;
}

double mean_over(const render::Picture& picture, const std::vector<std::size_t>& pixels) {
  double sum = 0;
  for (const std::size_t k : pixels) sum += picture.color(k)[1];
  return sum / static_cast<double>(pixels.size());
}

double error_over(const render::Picture& a, const render::Picture& b, const std::vector<std::size_t>& pixels) {
  double sum = 0;
  for (const std::size_t k : pixels)
    for (std::size_t c = 0; c < 3; ++c) sum += std::pow(a.color(k)[c] - b.color(k)[c], 2);
  return std::sqrt(sum / (3.0 * static_cast<double>(pixels.size())));
}

}  // namespace

absl::StatusOr<Page> relief_page(const Options& options) {
  Page page;
  page.id = "relief";
  page.title = "A displaced surface from afar";
  page.source =
      "Heitz & d'Eon 2014, supplement, section 4: non-centred distributions; LEADR mapping (Dupuy et al. 2013)";
  page.command = "facetwise experiment relief";
  Steps steps(options, 20);
  if (auto status = steps.begin("relief", 1); !status.ok()) return status;

  const int side = by_size(options, 1024, 1024, 2048);
  const std::vector<float> heights = waves(side);
  const auto slopes = std::make_shared<render::SlopeMap>(side, heights, 1 / static_cast<float>(side));
  constexpr float kAlpha = 0.15f;

  auto scene = lit("orb");
  if (!scene.ok()) return scene.status();
  scene->view = {{0.25f, 1.05f, 1.15f}, {0, 0, 0}, {0, 1, 0}, 0.55f};
  scene->aspect = 1.5f;
  scene->materials.resize(1);
  auto& material = scene->materials[0];
  material.model = {.distribution = Distribution::beckmann};
  material.sampler = Sampler::visible;
  material.alpha_x = material.alpha_y = kAlpha;
  material.compensated = false;
  material.f0 = {0.95f, 0.64f, 0.54f};

  render::Settings settings;
  settings.width = by_size(options, 72, 96, 192);
  settings.height = settings.width * 2 / 3;
  settings.depth = 1;  // one scattering: what the model describes. Light on its way to a second surface is shadowed
  settings.numbers = render::Numbers::sobol;
  const auto flat = lying(render::plate(1, 1, 0));
  scene->mesh = flat;
  const auto hits = render::first_hits(*scene, settings.width, settings.height);
  if (!hits.ok()) return hits.status();
  const auto inside = interior(*hits, settings.width, settings.height);

  if (auto status = steps.begin("geometry", 10, 2); !status.ok()) return status;
  scene->mesh = lying(render::relief(side, heights, *slopes, 0));
  const std::size_t triangles = scene->mesh.triangles.size();
  const std::uint32_t many = by_size(options, 512u, 8192u, 16384u);
  const auto truth = reference(*scene, settings, many, steps);
  if (!truth.ok()) return truth.status();

  scene->mesh = flat;
  material.slopes = slopes;
  settings.samples = by_size(options, many / 4, many / 256, many / 256);
  if (auto status = steps.begin("moments of slopes", 4); !status.ok()) return status;
  auto leadr = render_here(*scene, settings, steps);
  if (!leadr.ok()) return leadr.status();
  if (auto status = steps.begin("only mean slopes", 4, 2); !status.ok()) return status;
  material.mean_slopes_only = true;
  const auto mean_only = render_here(*scene, settings, steps);
  if (!mean_only.ok()) return mean_only.status();
  material.slopes = nullptr;
  const auto plain = render_here(*scene, settings, steps);
  if (!plain.ok()) return plain.status();

  struct {
    const char* name;
    const render::Picture& picture;
  } const rows[] = {{"moments of slopes", *leadr}, {"only mean slopes", *mean_only}, {"flat", *plain}};
  Pictures pictures{
      "A displaced plate of copper from afar",
      "Hills and, within pixels, a finer relief. With moments of slopes the flat plate looks like the geometry; with "
      "only mean slopes it is too sharp, and flat it has no hills.",
      settings.width,
      settings.height,
      {}};
  pictures.pictures.push_back(
      shown(truth->picture, "geometry",
            fmt::format("{} triangles, {} samples a pixel, RMSE about {:.4f}", triangles, many, truth->error), 1.2f));
  Table table{"Against the geometry", {"surface", "RMSE", "mean brightness", "of the geometry's", "seconds"}, {}};
  const double mean = mean_over(truth->picture, inside);
  std::vector<double> errors;
  for (const auto& [name, picture] : rows) {
    errors.push_back(error_over(picture, truth->picture, inside));
    pictures.pictures.push_back(
        shown(picture, name,
              fmt::format("2 triangles, {} samples a pixel, RMSE {:.4f}", settings.samples, errors.back()), 1.2f));
    table.rows.push_back({name, fmt::format("{:.4f}", errors.back()), fmt::format("{:.4f}", mean_over(picture, inside)),
                          fmt::format("{:.3f}", mean_over(picture, inside) / mean),
                          fmt::format("{:.2f}", picture.times.total)});
  }
  for (std::size_t k = 0; k < 2; ++k)
    pictures.pictures.push_back(difference(rows[k].picture, truth->picture, fmt::format("error of {}", rows[k].name),
                                           "Difference from the geometry, four times", 4));
  page.figures.emplace_back(std::move(pictures));
  page.figures.emplace_back(std::move(table));

  const auto whole = slopes->at(0, 0, 30);
  page.claims.push_back(
      {"Visible normals of non-centred distributions can be sampled, and fit LEADR mapping.",
       fmt::format("A plate of two triangles with mean slopes, roughness and correlation of each footprint comes to an "
                   "RMSE of {:.4f} from {} displaced triangles; only mean slopes to {:.4f}, the flat plate to {:.4f}.",
                   errors[0], triangles, errors[1], errors[2]),
       errors[0] < 0.6 * errors[1] && errors[0] < errors[2] ? Verdict::agrees
       : errors[0] < errors[1]                              ? Verdict::in_part
                                                            : Verdict::differs});
  page.notes = {
      fmt::format("Slopes of the relief have standard deviations {:.3f} and {:.3f}; its microfacets are Beckmann, "
                  "alpha {}. Seen from about "
                  "45 degrees, one scattering a path, light that meets a second surface is lost on both sides.",
                  std::sqrt(whole.xx), std::sqrt(whole.yy), kAlpha),
      "What is left of the error is the model's: Smith's masking takes heights and slopes as independent, where waves "
      "are "
      "smooth; and the slopes of few waves are not quite Gaussian."};
  return page;
}

}  // namespace facetwise::experiments
