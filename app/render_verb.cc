// SPDX-License-Identifier: Apache-2.0
// render: pictures by the wavefront path tracer.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "app/arguments.h"
#include "app/errors.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/verbs.h"
#include "facetwise/client.h"
#include "facetwise/render.h"

namespace facetwise::app {
namespace {

struct RenderVerb {
  std::string scene = "orbs", environment = "courtyard", output, png;
  ModelArguments model;
  EngineArguments engine;
  render::Settings settings;
  std::string alpha;
  std::optional<Sampler> sampler;
  int width = 512, height = 0, threads = 0;
  float exposure = 1;
  bool resume = false, scalar = false, no_light_sampling = false, compensated = false, json = false;

  int run() {
    const auto result = try_run();
    return result.ok() ? kDone : fail("render", result);
  }

 private:
  absl::StatusOr<render::Scene> open_scene() {
    const bool is_file = scene.find('/') != std::string::npos || scene.find('.') != std::string::npos;
    auto opened = is_file ? render::load_scene(scene) : render::built_in_scene(scene);
    if (!opened.ok()) return opened;
    if (environment == "white") {
      opened->environment = {};
    } else {
      auto light = render::load_environment(environment);
      if (!light.ok()) return light.status();
      opened->environment = *std::move(light);
    }
    opened->name += " in " + environment;
    const auto chosen = model.open();
    if (!chosen.ok()) return chosen.status();
    for (render::Material& material : opened->materials) {
      const Interface interface = material.model.interface;
      material.model = *chosen;
      material.model.compensation = Compensation::none;
      if (interface == Interface::dielectric) material.model.interface = interface;
      material.compensated = chosen->compensation != Compensation::none;
      const auto operation = material.model.interface == Interface::dielectric ? Operation::sample_scattering
                                                                               : Operation::sample_reflection;
      if (material.model.interface == Interface::dielectric) material.compensated = false;
      Batch batch;
      batch.model = material.model;
      material.sampler = sampler ? *sampler : default_sampler(operation, batch);
      if (!alpha.empty()) {
        char* end = nullptr;
        material.alpha_x = material.alpha_y = std::strtof(alpha.c_str(), &end);
        if (*end == ',') material.alpha_y = std::strtof(end + 1, &end);
        if (*end != 0) return invalid("--alpha: \"{}\" is not one number or two with a comma between them", alpha);
      }
    }
    return opened;
  }

  absl::Status try_run() {
    if (output.empty() && png.empty()) return invalid("--output or --png: where does the picture go?");
    auto opened = open_scene();
    if (!opened.ok()) return opened.status();
    settings.width = width;
    settings.height =
        height > 0 ? height : std::max(1, static_cast<int>(std::lround(static_cast<float>(width) / opened->aspect)));
    settings.light_sampling = !no_light_sampling;
    std::unique_ptr<Engine> calls;
    if (scalar) {
      calls = render::scalar_engine();
    } else {
      auto made = engine.open();
      if (!made.ok()) return made.status();
      calls = *std::move(made);
    }
    std::optional<tbb::global_control> limit;
    if (threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    std::optional<render::Picture> before;
    if (resume && std::filesystem::exists(output)) {
      auto loaded = render::load_exr(output);
      if (!loaded.ok()) return loaded.status();
      before = *std::move(loaded);
    }
    catch_interrupts();
    Progress progress("render");
    settings.progress = [&](double done) {
      progress(done);
      return !interrupted;
    };
    auto picture = render::render(*opened, settings, *calls, std::move(before));
    if (!picture.ok()) return picture.status();
    if (!output.empty())
      if (auto status = render::save_exr(*picture, output); !status.ok()) return status;
    if (!png.empty())
      if (auto status = render::save_png(*picture, png, exposure); !status.ok()) return status;
    report(*picture);
    return absl::OkStatus();
  }

  void report(const render::Picture& picture) const {
    const auto& times = picture.times;
    const auto share = [&](double part) { return 100 * part / std::max(times.total, 1e-9); };
    fmt::print("{} x {}, {} samples a pixel{}; {:.2f} s: engine {:.0f} %, Embree {:.0f} %, the rest {:.0f} %\n",
               picture.width, picture.height, picture.samples(), interrupted ? " (stopped; --resume goes on)" : "",
               times.total, share(times.engine), share(times.embree), share(times.rest()));
    const auto lanes = std::max<std::uint64_t>(1, picture.sampled.lanes());
    fmt::print("{} paths meet {:.3f} surfaces each; of {} scattering samples {:.3f} % occluded, {:.3f} % backfacing\n",
               picture.paths, picture.mean_depth(), picture.sampled.lanes(),
               100 * static_cast<double>(picture.sampled.occluded) / static_cast<double>(lanes),
               100 * static_cast<double>(picture.backfacing) / static_cast<double>(lanes));
  }
};

}  // namespace

Verb add_render(CLI::App& app) {
  auto arguments = std::make_shared<RenderVerb>();
  CLI::App& command = *app.add_subcommand("render", "Render a picture, all of its scattering by batch calls");
  command.footer(
      R"(SCENE is orbs (five, alpha 0.01 to 1), orb, furnace or glass, or a file: glTF, with Draco or without, or another format
that assimp reads; its metallic roughness becomes GGX metal. The model's options are for all of its surfaces.

The EXR has the mean (R, G, B), the samples, those that were rejected and the surfaces met of each pixel, and the sums that
--resume goes on from. Ctrl-C writes what is done. The same seed gives the same picture, local or remote.

Examples:
  facetwise render orbs --samples 8 --png orbs.png
  facetwise render orbs --sampler cap --samples 8 --output cap.exr
  facetwise render model.glb --environment forest --samples 256 --output model.exr --png model.png
  facetwise render orb --alpha 0.6,0.1 --remote unix:/tmp/facetwise.sock --png orb.png)");
  command.add_option("scene", arguments->scene, "orbs (default)|orb|furnace|glass|FILE")->option_text("SCENE");
  command
      .add_option(
          "--environment", arguments->environment,
          "Light: a probe of Debian's blender-data (courtyard, the default, city, studio ...), an EXR file, or white")
      ->option_text("NAME|FILE");
  command.add_option("--output", arguments->output, "The picture as EXR")->option_text("FILE");
  command.add_option("--png", arguments->png, "The picture as PNG, tone-mapped")->option_text("FILE");
  command.add_option("--exposure", arguments->exposure, "Factor before tone-mapping; default 1")->option_text("X");
  command.add_option("--width", arguments->width, "Pixels; default 512")->check(CLI::Range(1, 16384))->option_text("N");
  command.add_option("--height", arguments->height, "Pixels; default what the scene's shape asks for")
      ->check(CLI::Range(1, 16384))
      ->option_text("N");
  command.add_option("--samples", arguments->settings.samples, "Paths a pixel; default 64")->option_text("N");
  command.add_option("--depth", arguments->settings.depth, "Surfaces that a path meets at most; default 16")
      ->option_text("N");
  command.add_option("--seed", arguments->settings.seed, "Seed of all random numbers; default 1")->option_text("N");
  add_named(command, "--numbers", arguments->settings.numbers, render::parse_numbers,
            "How numbers are drawn; default random (by the kernels)", "random|sobol");
  command.add_flag("--no-light-sampling", arguments->no_light_sampling,
                   "Let only the scattering choose directions, not the environment too");
  arguments->model.add(command);
  command
      .add_option_function<std::string>(
          "--sampler",
          [arguments](const std::string& text) {
            const auto parsed = parse_sampler(text);
            if (!parsed)
              throw CLI::ValidationError("--sampler", fmt::format("\"{}\" is not one of {}", text, kSamplerNames));
            arguments->sampler = parsed;
          },
          "Default exact where the model has it, else visible")
      ->type_name(kSamplerNames);
  command.add_option("--alpha", arguments->alpha, "Roughness of all surfaces instead of the scene's")
      ->option_text("X[,Y]");
  command.add_flag("--resume", arguments->resume, "Go on from the picture in --output, if there is one");
  command.add_option("--threads", arguments->threads, "Default all cores")
      ->check(CLI::Range(1, 4096))
      ->option_text("N");
  arguments->engine.add_remote(command);
  arguments->engine.add_target(command);
  command
      .add_flag("--scalar", arguments->scalar,
                "Call the scalar baseline path by path instead of the engine, to compare; needs --numbers sobol")
      ->excludes(command.get_option("--remote"));
  return {&command, [arguments] { return arguments->run(); }};
}

}  // namespace facetwise::app
