// SPDX-License-Identifier: Apache-2.0
// Scenes and shapes made by code.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "facetwise/render.h"

namespace facetwise::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr const char* kNormalMap = "/usr/share/assimp/models/glTF2/ClearCoat-glTF/PlasticWrap_normals.jpg";
constexpr const char* kProbes = "/usr/share/blender/datafiles/studiolights/world/";

// A point of a profile that is turned about the y axis: distance from it, height, and the normal there.
struct Turned {
  float r, y, normal_r, normal_y;
};

// Each neighbouring pair of points of a run makes a ring of triangles; runs do not share normals.
void turn(scene::Mesh& mesh, Vector center, const std::vector<Turned>& run, std::uint32_t part, int around) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const auto columns = static_cast<std::uint32_t>(around + 1);
  for (std::size_t k = 0; k < run.size(); ++k)
    for (int a = 0; a <= around; ++a) {
      const float phi = 2 * kPi * static_cast<float>(a % around) / static_cast<float>(around);
      const float c = std::cos(phi), s = std::sin(phi);
      mesh.positions.push_back(center + Vector{run[k].r * s, run[k].y, run[k].r * c});
      mesh.normals.push_back(normalized({run[k].normal_r * s, run[k].normal_y, run[k].normal_r * c}));
      mesh.tangents.push_back({c, 0, -s});
      mesh.texcoords.push_back({static_cast<float>(a) / static_cast<float>(around),
                                1 - static_cast<float>(k) / static_cast<float>(run.size() - 1)});
    }
  for (std::uint32_t k = 0; k + 1 < run.size(); ++k)
    for (std::uint32_t a = 0; a + 1 < columns; ++a) {
      const std::uint32_t at = first + k * columns + a;
      // From bottom to top, seen from outside: no triangle where the ring is a point.
      if (run[k].r > 1e-6f) mesh.triangles.push_back({at, at + 1, at + columns});
      if (run[k + 1].r > 1e-6f) mesh.triangles.push_back({at + 1, at + columns + 1, at + columns});
      mesh.parts.resize(mesh.triangles.size(), part);
    }
}

std::vector<Turned> arc(float radius, float from, float to, int steps) {
  std::vector<Turned> run;
  for (int k = 0; k <= steps; ++k) {
    const float latitude = from + (to - from) * static_cast<float>(k) / static_cast<float>(steps);
    const float c = std::max(0.0f, std::cos(latitude)), s = std::sin(latitude);
    run.push_back({radius * c, radius * s, c, s});
  }
  return run;
}

// A straight run of a profile; its normal is to the right of the way from the first to the second point.
std::vector<Turned> line(float r0, float y0, float r1, float y1, int steps = 8) {
  std::vector<Turned> run;
  for (int k = 0; k <= steps; ++k) {
    const float t = static_cast<float>(k) / static_cast<float>(steps);
    run.push_back({r0 + t * (r1 - r0), y0 + t * (y1 - y0), y1 - y0, r0 - r1});
  }
  return run;
}

Material conductor(float alpha, Sampler sampler = Sampler::exact) {
  Material material;
  material.sampler = sampler;
  material.alpha_x = material.alpha_y = alpha;
  return material;
}

Scene orbs(std::initializer_list<float> alphas) {
  Scene scene;
  const float spacing = 2.3f, middle = 0.5f * static_cast<float>(alphas.size() - 1);
  std::uint32_t part = 0;
  for (const float alpha : alphas) {
    append(scene.mesh, orb({spacing * (static_cast<float>(part) - middle), 0, 0}, 1, part));
    scene.materials.push_back(conductor(alpha));
    scene.materials.back().f0 = {0.91f, 0.92f, 0.92f};
    scene.materials.back().compensated = true;
    ++part;
  }
  scene.view = {{0, 0.55f, 14}, {0, -0.15f, 0}, {0, 1, 0}, 2.75f / 14};
  scene.aspect = static_cast<float>(alphas.size()) * spacing / 2.75f;
  return scene;
}

}  // namespace

void append(scene::Mesh& to, const scene::Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  const auto add = [](auto& all, const auto& some) { all.insert(all.end(), some.begin(), some.end()); };
  add(to.positions, mesh.positions);
  add(to.normals, mesh.normals);
  add(to.tangents, mesh.tangents);
  add(to.texcoords, mesh.texcoords);
  add(to.parts, mesh.parts);
  for (const auto& [a, b, c] : mesh.triangles) to.triangles.push_back({first + a, first + b, first + c});
}

scene::Mesh ball(Vector center, float radius, std::uint32_t part) {
  scene::Mesh mesh;
  turn(mesh, center, arc(radius, -kPi / 2, kPi / 2, 192), part, 384);
  return mesh;
}

scene::Mesh orb(Vector center, float radius, std::uint32_t part) {
  constexpr int kAround = 256;
  constexpr float kLow = 0.10f, kHigh = 0.62f, kInner = 0.80f;  // the groove's latitudes, and the ball within
  scene::Mesh mesh;
  const auto add = [&](std::vector<Turned> run) {
    for (Turned& point : run) point.r *= radius, point.y *= radius;
    turn(mesh, center, run, part, kAround);
  };
  const auto at = [](float size, float latitude) {
    return std::pair(size * std::cos(latitude), size * std::sin(latitude));
  };
  const auto [low_r, low_y] = at(1, kLow);
  const auto [high_r, high_y] = at(1, kHigh);
  const auto [inner_low_r, inner_low_y] = at(kInner, kLow);
  const auto [inner_high_r, inner_high_y] = at(kInner, kHigh);
  add(line(0.55f, -1.12f, 0.62f, -1.05f));
  add(line(0.62f, -1.05f, 0.40f, -0.90f));
  add(arc(1, -1.15f, kLow, 120));
  add(line(low_r, low_y, inner_low_r, inner_low_y));
  add(arc(kInner, kLow, kHigh, 64));
  add(line(inner_high_r, inner_high_y, high_r, high_y));
  add(arc(1, kHigh, kPi / 2, 96));
  return mesh;
}

scene::Mesh plate(float width, float height, std::uint32_t part) {
  scene::Mesh mesh;
  for (const auto& [x, y] : {std::pair(-0.5f, -0.5f), {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}}) {
    mesh.positions.push_back({width * x, height * y, 0});
    mesh.normals.push_back({0, 0, 1});
    mesh.tangents.push_back({1, 0, 0});
    mesh.texcoords.push_back({x + 0.5f, 0.5f - y});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.parts = {part, part};
  return mesh;
}

scene::Mesh box(float width, float height, float depth, std::uint32_t part) {
  scene::Mesh mesh;
  const auto side = [&](float across, float up, float away, Vector x, Vector y) {
    scene::Mesh one = plate(across, up, part);
    const Vector z = cross(x, y);
    for (Vector& p : one.positions) p = p[0] * x + p[1] * y + (0.5f * away) * z;
    for (Vector& n : one.normals) n = z;
    for (Vector& t : one.tangents) t = x;
    append(mesh, one);
  };
  side(width, height, depth, {1, 0, 0}, {0, 1, 0});
  side(width, height, depth, {-1, 0, 0}, {0, 1, 0});
  side(depth, height, width, {0, 0, -1}, {0, 1, 0});
  side(depth, height, width, {0, 0, 1}, {0, 1, 0});
  side(width, depth, height, {1, 0, 0}, {0, 0, -1});
  side(width, depth, height, {1, 0, 0}, {0, 0, 1});
  return mesh;
}

scene::Mesh relief(int side, const std::vector<float>& heights, const SlopeMap& slopes, std::uint32_t part) {
  scene::Mesh mesh;
  const auto n = static_cast<std::uint32_t>(side);
  // One more row and column: the square repeats.
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x) {
      const std::uint32_t at = (y % n) * n + x % n;
      const SlopeMap::Moments& slope = slopes.texel(static_cast<int>(x % n), static_cast<int>(y % n));
      const float u = static_cast<float>(x) / static_cast<float>(side),
                  v = static_cast<float>(y) / static_cast<float>(side);
      mesh.positions.push_back({u - 0.5f, v - 0.5f, heights[at]});
      mesh.normals.push_back(normalized({-slope.x, -slope.y, 1}));
      mesh.tangents.push_back({1, 0, slope.x});
      mesh.texcoords.push_back({u, 1 - v});
    }
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t at = y * (n + 1) + x;
      mesh.triangles.push_back({at, at + 1, at + n + 2});
      mesh.triangles.push_back({at, at + n + 2, at + n + 1});
    }
  mesh.parts.assign(mesh.triangles.size(), part);
  return mesh;
}

std::vector<std::string> built_in_scenes() { return {"orbs", "orb", "furnace", "glass", "normal-map"}; }

absl::StatusOr<Scene> built_in_scene(std::string_view name) {
  Scene scene;
  if (name == "orbs") {
    scene = orbs({0.01f, 0.1f, 0.3f, 0.6f, 1.0f});
  } else if (name == "orb") {
    scene = orbs({0.6f});
  } else if (name == "furnace") {
    // A plate that fills the view, seen at 0 to 85 degrees from left to right.
    scene.mesh = plate(400, 400, 0);
    scene.materials = {conductor(0.5f)};
    const float turned = 42.5f * kPi / 180;
    scene.view = {{-std::sin(turned), 0, std::cos(turned)}, {0, 0, 0}, {0, 1, 0}, 2 * std::tan(turned)};
  } else if (name == "glass") {
    // A plate of glass, rough on all faces, seen from the side: the environment behind it and in it.
    scene.mesh = box(2, 2, 0.2f, 0);
    scene.materials = {conductor(0.1f)};
    scene.materials[0].model.interface = Interface::dielectric;
    scene.materials[0].sampler = Sampler::visible;
    scene.view = {{2.2f, 1.2f, 3.2f}, {0, 0, 0}, {0, 1, 0}, 0.6f};
  } else if (name == "normal-map") {
    // A ball on a floor, both under a real normal map, strong enough that many normals face away from the viewer.
    auto map = load_image(kNormalMap);
    if (!map.ok())
      return absl::NotFoundError(absl::StrCat(std::string(map.status().message()), " (Debian's assimp-testmodels)"));
    scene.mesh = ball({0, 1, 0}, 1, 0);
    for (auto& at : scene.mesh.texcoords) at = {6 * at[0], 3 * at[1]};
    scene::Mesh floor = plate(16, 16, 1);
    for (Vector& p : floor.positions) p = {p[0], 0, -p[1]};
    for (Vector& n : floor.normals) n = {0, 1, 0};
    for (auto& at : floor.texcoords) at = {8 * at[0], 8 * at[1]};
    append(scene.mesh, floor);
    scene.materials = {conductor(0.4f, Sampler::visible), conductor(0.4f, Sampler::visible)};
    for (Material& material : scene.materials) {
      material.normal_map = std::make_shared<Image>(*map);
      material.normal_scale = 3;
      material.f0 = {0.95f, 0.93f, 0.88f};
    }
    scene.view = {{0, 1.1f, 5.5f}, {0, 0.75f, 0}, {0, 1, 0}, 0.5f};
    scene.aspect = 2;
  } else {
    return absl::NotFoundError(absl::StrCat("scene \"", std::string(name), "\": none of that name; there are ",
                                            absl::StrJoin(built_in_scenes(), ", ")));
  }
  scene.name = std::string(name);
  return scene;
}

absl::StatusOr<Environment> load_environment(const std::string& name) {
  const bool is_name = name.find('/') == std::string::npos && !name.ends_with(".exr");
  const std::string path = is_name ? absl::StrCat(kProbes, name, ".exr") : name;
  if (is_name && !std::filesystem::exists(path)) {
    std::vector<std::string> there;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(kProbes, error))
      there.push_back(entry.path().stem().string());
    std::sort(there.begin(), there.end());
    return absl::NotFoundError(
        there.empty() ? absl::StrCat(kProbes, ": no light probes there; they come with Debian's blender-data")
                      : absl::StrCat("environment \"", name, "\": there are ", absl::StrJoin(there, ", "),
                                     ", or a path to an EXR file"));
  }
  auto image = load_image(path);
  if (!image.ok()) return image.status();
  Environment environment;
  environment.probe = std::make_shared<Image>(*std::move(image));
  return environment;
}

}  // namespace facetwise::render
