// SPDX-License-Identifier: Apache-2.0
// A wavefront path tracer whose scattering is the engine's batch calls: what the samplers do to a picture.
//
// Embree traces, TBB spreads the work, an Engine (local, remote, or the scalar baseline) samples and evaluates. The same
// scene, settings and seed give the same picture bit for bit, whatever the threads and whichever engine of the library
// answers, on one machine (Embree's own bits differ between instruction sets).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "facetwise/engine.h"
#include "facetwise/scene.h"

namespace facetwise::render {

using scene::Vector;
using scene::operator+;
using scene::operator-;
using scene::operator*;
using scene::cross;
using scene::dot;
using scene::normalized;
using Color = std::array<float, 3>;  // linear, Rec. 709 primaries

// Pixels in rows from the top, `channels` floats each.
struct Image {
  int width = 0, height = 0, channels = 3;
  std::vector<float> values;

  const float* at(int x, int y) const {
    return &values[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels)];
  }
  // Bilinear, repeated in both directions; v goes downwards. RGB.
  Color sample(float u, float v) const;
};

// EXR as linear RGB; PNG, JPEG and the like as they are stored, in [0, 1]. Errors begin with the path.
absl::StatusOr<Image> load_image(const std::string& path);
// The same of bytes in memory, of PNG, JPEG and the like. `name` is for errors.
absl::StatusOr<Image> decode_image(std::string_view bytes, const std::string& name);
// From sRGB to linear.
void make_linear(Image& image);

// Moments of the slopes of a displacement map over squares of 1, 2, 4 ... texels: what a surface seen from afar has
// instead of its relief (LEADR: Dupuy et al. 2013).
class SlopeMap {
 public:
  struct Moments {
    float x = 0, y = 0;            // means
    float xx = 0, yy = 0, xy = 0;  // means of squares and of the product
  };
  // Heights of a square that repeats, `side` (a power of two) texels each way, `spacing` apart; x grows along rows, y from
  // row to row.
  SlopeMap(int side, const std::vector<float>& heights, float spacing);

  int side() const { return side_; }
  // At (x, y) in texels, over squares of 2^level texels, interpolated between texels and levels.
  Moments at(float x, float y, float level) const;
  const Moments& texel(int x, int y) const { return levels_[0][static_cast<std::size_t>(y * side_ + x)]; }

 private:
  Moments at_level(float x, float y, std::size_t level) const;
  int side_;
  std::vector<std::vector<Moments>> levels_;
};

struct Material {
  Model model{};  // its interface is conductor or dielectric: a conductor's Fresnel factor is the renderer's, in colour
  Sampler sampler = Sampler::exact;
  float alpha_x = 0.3f, alpha_y = 0.3f;
  Color f0 = {1, 1, 1};  // conductor: Schlick's reflectance at normal incidence
  float eta = 1.5f;      // dielectric: inside over outside
  // A matte base under a conductor: its reflectance, of which the surface above leaves 1 - F E (E: the engine's albedo, F:
  // the largest of f0). Half of the samples are drawn for it.
  Color base = {0, 0, 0};
  // Energy compensation (Turquin 2019) of conductors, in colour, by the engine's albedo.
  bool compensated = false;
  // Maps by the texture coordinates. Colour (linear), which f0 and base share by metalness: f0 of 0.04 to the colour, base of
  // the colour to 0; roughness (perceptual) in green, metalness in blue. Both multiply the values here.
  struct Metallic {
    Color color = {1, 1, 1};
    float roughness = 1, metalness = 1;
    std::shared_ptr<const Image> color_map, roughness_map;
  };
  std::optional<Metallic> metallic;         // instead of alpha, f0 and base: as glTF has materials
  std::shared_ptr<const Image> normal_map;  // tangent space, 0.5 is 0
  float normal_scale = 1;                   // of its x and y
  // Mean slopes and roughness per lane, from moments over each path's footprint, with alpha as the roughness of the relief
  // itself: Beckmann with Smith masking. One copy over the texture coordinates' unit square, y against v.
  std::shared_ptr<const SlopeMap> slopes;
  bool mean_slopes_only = false;  // leaves the relief's variance out, as plain filtered normal maps do
};

// Light from everywhere: a light probe (latitude-longitude, +y up) or a constant.
struct Environment {
  Color constant = {1, 1, 1};
  std::shared_ptr<const Image> probe;  // instead of `constant`, if given
  float turn = 0;                      // of the probe about +y, in turns
};

struct View {
  Vector eye = {0, 0, 5}, target = {0, 0, 0}, up = {0, 1, 0};
  float field = 0.6f;  // of view: height over distance
};

// Triangles, their materials by Mesh::parts, and light.
struct Scene {
  std::string name;
  scene::Mesh mesh;
  std::vector<Material> materials;  // of each part
  Environment environment;
  View view;
  float aspect = 1;  // width over height that the scene is made for
};

// How random numbers are made. `sobol` is an Owen-scrambled Sobol' sequence, scrambled apart for each pixel and each
// pair of dimensions (Burley 2020); `random` uses the engine's own generator in the kernels.
enum class Numbers : std::uint8_t { random = 0, sobol = 1 };
std::string_view name(Numbers);
std::optional<Numbers> parse_numbers(std::string_view);

struct Settings {
  int width = 512, height = 512;  // [1, 16384]
  std::uint32_t samples = 64;     // a pixel, over all passes, those of a resumed picture included
  std::uint64_t seed = 1;
  int depth = 16;  // longest path, in surfaces met; [1, 1000]. Roulette begins at the ninth
  Numbers numbers = Numbers::random;
  bool light_sampling =
      true;  // the environment too is sampled, and combined by multiple importance (balance heuristic)
  // Asked after each pass, with the share done; false ends the picture there.
  std::function<bool(double)> progress{};
};

// Where the time went, in seconds of the calling thread's clock.
struct Times {
  double engine = 0, embree = 0, total = 0;
  double rest() const { return total - engine - embree; }
};

// Sums over the samples of each pixel, kept as pairs of floats (a sum and what it lost by rounding), so that a file of
// floats holds them and a resumed picture is the one that would have been.
struct Picture {
  struct Sum {
    float high = 0, low = 0;
    void add(float value) {
      const float sum = high + value, kept = sum - high;
      low += (high - (sum - kept)) + (value - kept);
      high = sum + low;
      low -= high - sum;
    }
    double value() const { return static_cast<double>(high) + low; }
  };
  struct Pixel {
    std::array<Sum, 3> radiance;
    float samples = 0;   // paths
    float rejected = 0;  // of their scattering samples, those that were thrown away: occluded
    float surfaces = 0;  // met by paths
  };

  int width = 0, height = 0;
  std::string scene, made_by;  // `made_by` names what decides the bits; resuming asks that it is the same
  std::vector<Pixel> pixels;
  // Of this process's share.
  Times times;
  std::uint64_t paths = 0, rays = 0, shadow_rays = 0;
  Statistics sampled;            // lanes of sampling calls
  std::uint64_t backfacing = 0;  // of them with i_z <= 0

  Color color(std::size_t pixel) const;
  double mean_depth() const;  // surfaces a path meets
  std::uint32_t samples() const { return pixels.empty() ? 0 : static_cast<std::uint32_t>(pixels[0].samples); }
};

// Renders, going on from `resumed` if given. Errors: a setting out of its range, a scene that fits nothing, the
// engine's.
absl::StatusOr<Picture> render(const Scene& scene, const Settings& settings, Engine& engine,
                               std::optional<Picture> resumed = std::nullopt);

// What the camera sees first: the incident direction at the middle of each pixel, in the shading normal's frame. All zero
// where there is nothing.
struct FirstHits {
  std::vector<float> x, y, z;
};
absl::StatusOr<FirstHits> first_hits(const Scene& scene, int width, int height);

// An engine whose calls are the benchmarks' scalar baseline, path by path: what a renderer gains by the library.
// GGX, Beckmann and Student-t conductors.
std::unique_ptr<Engine> scalar_engine();

// EXR: R, G, B (mean), samples, rejected, surfaces, and the sums that a resumed picture goes on from.
absl::Status save_exr(const Picture& picture, const std::string& path);
absl::StatusOr<Picture> load_exr(const std::string& path);
// PNG, 8 bits: exposure, then a filmic curve or (`filmic` false) a plain clamp, then sRGB.
absl::Status save_png(const Picture& picture, const std::string& path, float exposure = 1, bool filmic = true);
std::string png_bytes(int width, int height, const std::vector<std::uint8_t>& rgb);
std::vector<std::uint8_t> tone_map(const Picture& picture, float exposure = 1, bool filmic = true);

// Root of the mean square difference of two pictures' colours, over all channels and the columns of pixels in
// [first, last), given as shares of the width.
double rmse(const Picture& a, const Picture& b, double first = 0, double last = 1);
// The picture of both's samples together.
Picture merge(const Picture& a, const Picture& b);

// --- Scenes ---------------------------------------------------------------------------------------------------------

// A scene from a file that assimp reads (glTF with Draco or without, and others): metallic roughness as GGX over a matte base,
// with its maps and normal maps.
absl::StatusOr<Scene> load_scene(const std::string& path);

// A ball with a groove, a ball within, and a foot, as material previews show it; anisotropy follows the parallels.
scene::Mesh orb(Vector center, float radius, std::uint32_t part);
// A ball of triangles with smooth normals.
scene::Mesh ball(Vector center, float radius, std::uint32_t part);
// A rectangle in the plane z = 0 with its normal to +z.
scene::Mesh plate(float width, float height, std::uint32_t part);
// A box about the origin, of six plates.
scene::Mesh box(float width, float height, float depth, std::uint32_t part);
// The relief of a displacement map over the unit square about the origin, with smooth normals.
scene::Mesh relief(int side, const std::vector<float>& heights, const SlopeMap& slopes, std::uint32_t part);
void append(scene::Mesh& to, const scene::Mesh& mesh);

// Scenes made by code, by name.
absl::StatusOr<Scene> built_in_scene(std::string_view name);
std::vector<std::string> built_in_scenes();

// A light probe of Debian's blender-data by its name ("studio", "forest", "city" ...), or a path to an EXR file.
absl::StatusOr<Environment> load_environment(const std::string& name_or_path);

}  // namespace facetwise::render
