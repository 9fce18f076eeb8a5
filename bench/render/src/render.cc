// SPDX-License-Identifier: Apache-2.0
// The wavefront: all paths of a wave take each step together.
#include "facetwise/render.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "facetwise/column_memory.h"
#include "src/geometry.h"
#include "src/light.h"
#include "src/numbers.h"
#include "src/surface.h"

namespace facetwise::render {
namespace {

constexpr std::size_t kWave = std::size_t{1} << 16;  // paths at once
constexpr int kRouletteFrom = 8;
constexpr std::uint8_t kLeftOut = 0xff;
constexpr float kInversePi = 0.318309886f;
constexpr float kShareOfBase = 0.5f;  // of the samples of surfaces that have a base

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

template <class Body>
void for_lanes(std::size_t lanes, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lanes, 1024),
                    [&](const auto& range) { body(range.begin(), range.end()); });
}

// Decisions of a path that need numbers. The engine's generator has dimensions of its own.
enum class Decision : std::uint32_t { light = 0, scattering = 1, roulette = 2, base = 3 };
constexpr std::uint32_t kPlaceInPixel = 0;
constexpr std::uint32_t dimension(int bounce, Decision decision) {
  return 1 + 4 * static_cast<std::uint32_t>(bounce) + static_cast<std::uint32_t>(decision);
}

// Surfaces that one call of the engine can answer: those of one model and sampler.
struct Group {
  Model model;
  Sampler sampler;
  bool compensated;
  bool sloped;  // has mean slopes
  bool base;    // has a matte base
  bool dielectric() const { return model.interface == Interface::dielectric; }
};

struct Vectors {
  float *x, *y, *z;
  void set(std::size_t lane, const std::array<float, 3>& v) const { x[lane] = v[0], y[lane] = v[1], z[lane] = v[2]; }
  std::array<float, 3> operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  Direction in(std::size_t lanes) const { return {{x, lanes}, {y, lanes}, {z, lanes}}; }
  OutputDirection out(std::size_t lanes) const { return {{x, lanes}, {y, lanes}, {z, lanes}}; }
};

// What goes on from surface to surface, once as it is and once as it is being compacted.
struct Paths {
  Vectors origin, direction, throughput;
  float* pdf;  // of the direction; 0 where it was not drawn from a density
  std::vector<std::uint32_t> slot;
};

bool has_base(const Material& material) {
  return material.model.interface != Interface::dielectric &&
         (material.metallic ? material.metallic->metalness < 1 : material.base != Color{});
}

float schlick(float f0, float im) {
  const float c = 1 - std::min(im, 1.0f), c2 = c * c;
  return f0 + (1 - f0) * c2 * c2 * c;
}

// Directions through points of the picture, in pixels from its upper left corner.
class Camera {
 public:
  Camera(const View& view, int width, int height)
      : size_(view.field / static_cast<float>(height)),
        middle_x_(0.5f * static_cast<float>(width)),
        middle_y_(0.5f * static_cast<float>(height)) {
    const Vector back = normalized(view.eye - view.target);
    right_ = normalized(cross(view.up, back));
    up_ = cross(back, right_);
    forward_ = -1.0f * back;
  }
  Vector direction(float x, float y) const {
    return normalized(forward_ + (size_ * (x - middle_x_)) * right_ - (size_ * (y - middle_y_)) * up_);
  }

 private:
  float size_, middle_x_, middle_y_;
  Vector right_{}, up_{}, forward_{};
};

class Renderer {
 public:
  Renderer(const Scene& scene, const Settings& settings, Engine& engine, Geometry& geometry, Picture& picture)
      : scene_(scene),
        settings_(settings),
        engine_(engine),
        geometry_(geometry),
        picture_(picture),
        light_(scene.environment),
        camera_(scene.view, picture.width, picture.height) {
    for (const Material& material : scene.materials) {
      const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Group& group) {
        return group.sampler == material.sampler && group.compensated == material.compensated &&
               group.sloped == (material.slopes != nullptr) && group.base == has_base(material) &&
               group.model.distribution == material.model.distribution &&
               group.model.masking == material.model.masking && group.model.shadowing == material.model.shadowing &&
               group.model.normalisation == material.model.normalisation &&
               group.model.interface == material.model.interface && group.model.retro == material.model.retro &&
               group.model.table == material.model.table;
      });
      group_of_.push_back(static_cast<std::uint8_t>(same - groups_.begin()));
      if (same == groups_.end())
        groups_.push_back(
            {material.model, material.sampler, material.compensated, material.slopes != nullptr, has_base(material)});
    }
    Vector low = scene.mesh.positions[0], high = low;
    for (const Vector& p : scene.mesh.positions)
      for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
    const Vector size = high - low;
    step_ = 1e-5f * std::sqrt(dot(size, size));
  }

  // Has the engine build the tables of albedo that it will need, which takes seconds the first time.
  absl::Status prepare() {
    for (const Group& group : groups_) {
      if (!group.compensated && !group.base) continue;
      float albedo = 0;
      Batch one;
      one.model = group.model;
      one.lanes = 1;
      one.incident = {0.0f, 0.0f, 1.0f};
      one.alpha_x = one.alpha_y = 0.5f;
      one.out.albedo = {&albedo, 1};
      if (const auto result = engine_.run(Operation::albedo, one); !result.ok()) return result.status();
    }
    return absl::OkStatus();
  }

  // Samples [first, last) of pixels [begin, end).
  absl::Status wave(std::uint32_t first, std::uint32_t last, std::uint32_t begin, std::uint32_t end) {
    first_sample_ = first;
    first_pixel_ = begin;
    pixels_ = end - begin;
    const std::size_t lanes = std::size_t{last - first} * pixels_;
    reserve(lanes);
    std::fill_n(radiance_.begin(), lanes, Color{});
    std::fill_n(surfaces_.begin(), lanes, 0.0f);
    std::fill_n(rejected_.begin(), lanes, 0.0f);
    start(lanes);
    picture_.paths += lanes;
    std::size_t left = lanes;
    for (int bounce = 0; left > 0; ++bounce) {
      intersect(left, bounce);
      // Paths that meet one surface more than `depth` end there, black.
      shade(left, bounce);
      if (bounce == settings_.depth) break;
      list_groups(left);
      if (settings_.light_sampling)
        if (auto status = sample_light(left, bounce); !status.ok()) return status;
      if (auto status = scatter(left, bounce); !status.ok()) return status;
      go_on(left, bounce);
      if (auto status = compact(left); !status.ok()) return status;
    }
    add(last - first);
    return absl::OkStatus();
  }

 private:
  std::uint32_t pixel(std::uint32_t slot) const { return first_pixel_ + slot % pixels_; }
  std::uint32_t sample(std::uint32_t slot) const { return first_sample_ + slot / pixels_; }
  std::array<float, 3> numbers(std::uint32_t slot, std::uint32_t dimension) const {
    return numbers_of(settings_.numbers, settings_.seed, pixel(slot), sample(slot), dimension);
  }
  const Material& material(std::size_t lane) const { return scene_.materials[scene_.mesh.parts[triangle_[lane]]]; }

  void reserve(std::size_t lanes) {
    if (lanes <= capacity_) return;
    capacity_ = lanes;
    std::size_t next = 0;
    memory_ = ColumnMemory(59, lanes);
    const auto column = [&] { return memory_[next++]; };
    const auto vectors = [&] { return Vectors{column(), column(), column()}; };
    for (Paths* paths : {&now_, &next_}) {
      paths->origin = vectors(), paths->direction = vectors(), paths->throughput = vectors();
      paths->pdf = column();
      paths->slot.resize(lanes);
    }
    incident_ = vectors(), outgoing_ = vectors(), towards_light_ = vectors();
    shadow_origin_ = vectors(), shadow_direction_ = vectors(), from_light_ = vectors();
    for (float** one : {&u_, &v_, &distance_, &alpha_x_, &alpha_y_, &eta_, &u1_, &u2_, &u3_, &pdf_, &weight_, &value_,
                        &im_, &light_pdf_, &albedo_, &mean_slope_x_, &mean_slope_y_, &slope_correlation_})
      *one = column();
    triangle_.resize(lanes);
    group_.resize(lanes), status_.resize(lanes), event_.resize(lanes), visible_.resize(lanes);
    id_.resize(lanes), index_.resize(lanes);
    surface_.resize(lanes, Surface{{}, {}, scene::Frame({0, 0, 1}), true, {}});
    f0_.resize(lanes), base_.resize(lanes), from_base_.resize(lanes);
    radiance_.resize(lanes), surfaces_.resize(lanes), rejected_.resize(lanes);
  }

  // Rays from the eye.
  void start(std::size_t lanes) {
    const auto width = static_cast<std::uint32_t>(picture_.width);
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      for (std::size_t lane = begin; lane < end; ++lane) {
        const auto slot = static_cast<std::uint32_t>(lane);
        const auto u = numbers(slot, kPlaceInPixel);
        const std::uint32_t at = pixel(slot);
        now_.slot[lane] = slot;
        now_.origin.set(lane, scene_.view.eye);
        now_.direction.set(
            lane, camera_.direction(static_cast<float>(at % width) + u[0], static_cast<float>(at / width) + u[1]));
        now_.throughput.set(lane, {1, 1, 1});
        now_.pdf[lane] = 0;
      }
    });
  }

  void intersect(std::size_t lanes, int bounce) {
    const auto started = Clock::now();
    const RayColumns rays = columns(now_.origin, now_.direction);
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      geometry_.intersect(rays, {triangle_.data(), u_, v_, distance_}, begin, end, 0, bounce == 0);
    });
    picture_.rays += lanes;
    picture_.times.embree += seconds_since(started);
  }

  static RayColumns columns(const Vectors& origin, const Vectors& direction) {
    return {origin.x, origin.y, origin.z, direction.x, direction.y, direction.z};
  }

  // Light that reaches rays which hit nothing; the local frame of those that hit.
  void shade(std::size_t lanes, int bounce) {
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      for (std::size_t lane = begin; lane < end; ++lane) {
        const Vector direction = now_.direction[lane];
        const std::uint32_t slot = now_.slot[lane];
        status_[lane] = static_cast<std::uint8_t>(LaneStatus::invalid);
        group_[lane] = kLeftOut;
        if (triangle_[lane] == kMissed) {
          const float pdf = now_.pdf[lane];
          const float share = pdf > 0 && settings_.light_sampling ? pdf / (pdf + light_.pdf(direction)) : 1.0f;
          add_radiance(slot, share * (now_.throughput[lane] * light_.radiance(direction)));
          continue;
        }
        surfaces_[slot] += 1;
        const Material& here = material(lane);
        Surface& surface = surface_[lane];
        surface = surface_at(scene_.mesh, here, triangle_[lane], u_[lane], v_[lane], direction);
        const Vector i = surface.frame.to_local(-1.0f * direction);
        incident_.set(lane, normalized(i));
        alpha_x_[lane] = here.alpha_x;
        alpha_y_[lane] = here.alpha_y;
        f0_[lane] = here.f0;
        base_[lane] = here.base;
        if (here.metallic) set_metallic(lane, *here.metallic);
        if (here.slopes) set_slopes(lane, here, distance_[lane]);
        eta_[lane] = surface.entering ? here.eta : 1 / here.eta;
        id_[lane] = std::uint64_t{sample(slot)} * picture_.pixels.size() + pixel(slot);
        if (settings_.numbers != Numbers::random) {
          const auto u = numbers(slot, dimension(bounce, Decision::scattering));
          u1_[lane] = u[0], u2_[lane] = u[1], u3_[lane] = u[2];
        }
        group_[lane] = group_of_[scene_.mesh.parts[triangle_[lane]]];
      }
    });
  }

  void set_metallic(std::size_t lane, const Material::Metallic& here) {
    const auto& at = surface_[lane].texcoord;
    const Color color = here.color_map ? here.color * here.color_map->sample(at[0], at[1]) : here.color;
    float roughness = here.roughness, metalness = here.metalness;
    if (here.roughness_map) {
      const Color map = here.roughness_map->sample(at[0], at[1]);
      roughness *= map[1], metalness *= map[2];
    }
    alpha_x_[lane] = alpha_y_[lane] = alpha_from_perceptual(std::clamp(roughness, 0.0f, 1.0f));
    for (std::size_t k = 0; k < 3; ++k) {
      f0_[lane][k] = 0.04f + metalness * (color[k] - 0.04f);
      base_[lane][k] = (1 - metalness) * color[k];
    }
  }

  // Mean slopes and roughness over the path's footprint, as from the eye: that of a pixel, along its shorter side (its
  // samples spread over the longer one).
  void set_slopes(std::size_t lane, const Material& here, float distance) {
    const Surface& surface = surface_[lane];
    const SlopeMap& map = *here.slopes;
    const auto side = static_cast<float>(map.side());
    const float pixel = distance * scene_.view.field / static_cast<float>(picture_.height);
    const auto slope =
        map.at(surface.texcoord[0] * side, (1 - surface.texcoord[1]) * side, std::log2(std::max(1.0f, pixel * side)));
    const float relief = here.mean_slopes_only ? 0.0f : 2.0f;  // alpha^2 of Beckmann is twice the slopes' variance
    const float xx = relief * std::max(0.0f, slope.xx - slope.x * slope.x) + here.alpha_x * here.alpha_x;
    const float yy = relief * std::max(0.0f, slope.yy - slope.y * slope.y) + here.alpha_y * here.alpha_y;
    alpha_x_[lane] = std::sqrt(xx);
    alpha_y_[lane] = std::sqrt(yy);
    mean_slope_x_[lane] = slope.x;
    mean_slope_y_[lane] = slope.y;
    const float rho = relief * (slope.xy - slope.x * slope.y) / (alpha_x_[lane] * alpha_y_[lane]);
    slope_correlation_[lane] = std::clamp(rho, -0.99f, 0.99f);
  }

  void add_radiance(std::uint32_t slot, Color color) { radiance_[slot] = radiance_[slot] + color; }

  // Lanes of each group, in order: a count for each block, then each block's list behind those before it.
  void list_groups(std::size_t lanes) {
    constexpr std::size_t kBlock = 4096;
    const std::size_t blocks = (lanes + kBlock - 1) / kBlock, groups = groups_.size();
    std::vector<std::size_t> place(blocks * groups + 1);
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
      for (std::size_t lane = block * kBlock; lane < std::min(lanes, (block + 1) * kBlock); ++lane)
        if (group_[lane] != kLeftOut) ++place[group_[lane] * blocks + block + 1];
    });
    std::partial_sum(place.begin(), place.end(), place.begin());
    listed_.resize(place.back());
    group_end_.resize(groups);
    for (std::size_t group = 0; group < groups; ++group) group_end_[group] = place[(group + 1) * blocks];
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
      std::vector<std::size_t> at(groups);
      for (std::size_t group = 0; group < groups; ++group) at[group] = place[group * blocks + block];
      for (std::size_t lane = block * kBlock; lane < std::min(lanes, (block + 1) * kBlock); ++lane)
        if (group_[lane] != kLeftOut) listed_[at[group_[lane]]++] = static_cast<std::uint32_t>(lane);
    });
  }
  std::span<const std::uint32_t> list(std::size_t group) const {
    const std::size_t first = group == 0 ? 0 : group_end_[group - 1];
    return std::span(listed_).subspan(first, group_end_[group] - first);
  }

  Batch batch(std::size_t lanes, std::size_t group) const {
    Batch batch;
    batch.model = groups_[group].model;
    batch.sampler = groups_[group].sampler;
    batch.lanes = lanes;
    if (list(group).size() < lanes) batch.active = list(group);
    batch.incident = incident_.in(lanes);
    batch.alpha_x = {alpha_x_, lanes};
    batch.alpha_y = {alpha_y_, lanes};
    if (groups_[group].dielectric()) batch.eta = {eta_, lanes};
    if (groups_[group].sloped) {
      batch.mean_slope_x = {mean_slope_x_, lanes};
      batch.mean_slope_y = {mean_slope_y_, lanes};
      batch.slope_correlation = {slope_correlation_, lanes};
    }
    return batch;
  }
  absl::Status call(Operation operation, const Batch& batch, Statistics* statistics = nullptr) {
    const auto started = Clock::now();
    const auto result = engine_.run(operation, batch);
    picture_.times.engine += seconds_since(started);
    if (result.ok() && statistics) *statistics += *result;
    return result.status();
  }

  // E of the lanes that are compensated or have a base.
  absl::Status find_albedo(std::size_t lanes, std::size_t group) {
    if (!groups_[group].compensated && !groups_[group].base) return absl::OkStatus();
    Batch albedo = batch(lanes, group);
    albedo.out.albedo = {albedo_, lanes};
    return call(Operation::albedo, albedo);
  }

  // Fresnel's factor and the compensation, in colour. A dielectric's are in the engine's weights and values.
  Color factor(std::size_t lane, float im) const {
    const Material& here = material(lane);
    if (here.model.interface == Interface::dielectric) return {1, 1, 1};
    Color result;
    for (std::size_t k = 0; k < 3; ++k) {
      result[k] = schlick(f0_[lane][k], im);
      if (here.compensated) result[k] *= 1 + f0_[lane][k] * (1 - albedo_[lane]) / albedo_[lane];
    }
    return result;
  }

  // i.m of the microfacets that reflect towards o.
  float to_half_vector(std::size_t lane, const Vector& o) const {
    Vector i = incident_[lane];
    if (material(lane).model.retro) i = {-i[0], -i[1], i[2]};
    return std::sqrt(std::max(0.0f, 0.5f + 0.5f * dot(i, o)));
  }

  // The base's f cos(theta_o).
  Color base_value(std::size_t lane, float oz) const {
    if (oz <= 0) return {};
    const float f0 = *std::max_element(f0_[lane].begin(), f0_[lane].end());
    return (oz * kInversePi * (1 - f0 * albedo_[lane])) * base_[lane];
  }
  // The density of a direction, by either way of drawing it.
  static float with_base(float pdf, float oz) {
    return (1 - kShareOfBase) * pdf + kShareOfBase * kInversePi * std::max(0.0f, oz);
  }

  // Light from a direction that the environment chose.
  absl::Status sample_light(std::size_t lanes, int bounce) {
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      for (std::size_t lane = begin; lane < end; ++lane) {
        visible_[lane] = 0;
        if (group_[lane] == kLeftOut) continue;
        const auto u = numbers(now_.slot[lane], dimension(bounce, Decision::light));
        const Light::Drawn drawn = light_.draw(u[0], u[1]);
        const Surface& surface = surface_[lane];
        towards_light_.set(lane, normalized(surface.frame.to_local(drawn.direction)));
        shadow_direction_.set(lane, drawn.direction);
        shadow_origin_.set(lane, surface.origin(drawn.direction, step_));
        from_light_.set(lane, drawn.radiance);
        light_pdf_[lane] = drawn.pdf;
      }
    });
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      if (list(group).empty()) continue;
      if (auto status = find_albedo(lanes, group); !status.ok()) return status;
      Batch query = batch(lanes, group);
      query.outgoing = towards_light_.in(lanes);
      query.out.value = {value_, lanes};
      query.out.pdf = {pdf_, lanes};
      const auto status =
          call(groups_[group].dielectric() ? Operation::evaluate_scattering : Operation::evaluate_reflection, query);
      if (!status.ok()) return status;
    }
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      for (std::size_t lane = begin; lane < end; ++lane) {
        if (group_[lane] == kLeftOut || !(light_pdf_[lane] > 0)) continue;
        const bool base = groups_[group_[lane]].base;
        const Vector o = towards_light_[lane];
        if (!(value_[lane] > 0) && !(base && o[2] > 0)) continue;
        // On the side of the triangle that the shading normal says.
        if ((dot(shadow_direction_[lane], surface_[lane].facing) > 0) != (o[2] > 0)) continue;
        Color value = value_[lane] * factor(lane, to_half_vector(lane, o));
        if (base) value = value + base_value(lane, o[2]);
        const float pdf = base ? with_base(pdf_[lane], o[2]) : pdf_[lane];
        // f cos / pdf_light times the share of this way of drawing, pdf_light / (pdf_light + pdf).
        from_light_.set(lane, (1 / (light_pdf_[lane] + pdf)) * (now_.throughput[lane] * value * from_light_[lane]));
        visible_[lane] = 1;
      }
    });
    const auto started = Clock::now();
    const RayColumns rays = columns(shadow_origin_, shadow_direction_);
    for_lanes(lanes,
              [&](std::size_t begin, std::size_t end) { geometry_.occlude(rays, visible_.data(), begin, end, 0); });
    picture_.times.embree += seconds_since(started);
    picture_.shadow_rays += lanes;
    for_lanes(lanes, [&](std::size_t begin, std::size_t end) {
      for (std::size_t lane = begin; lane < end; ++lane)
        if (visible_[lane]) add_radiance(now_.slot[lane], from_light_[lane]);
    });
    return absl::OkStatus();
  }

  // The next direction.
  absl::Status scatter(std::size_t lanes, int bounce) {
    for (std::size_t group = 0; group < groups_.size(); ++group) {
      if (list(group).empty()) continue;
      if (!settings_.light_sampling)
        if (auto status = find_albedo(lanes, group); !status.ok()) return status;
      Batch draw = batch(lanes, group);
      const bool dielectric = groups_[group].dielectric();
      if (settings_.numbers == Numbers::random) {
        draw.generator = Generator{
            .seed = settings_.seed, .dimension = static_cast<std::uint32_t>(bounce), .id = {id_.data(), lanes}};
      } else {
        draw.u1 = {u1_, lanes}, draw.u2 = {u2_, lanes};
        if (dielectric || uses_u3(draw.model, draw.sampler)) draw.u3 = {u3_, lanes};
      }
      draw.out.outgoing = outgoing_.out(lanes);
      draw.out.incident_dot_normal = {im_, lanes};
      draw.out.pdf = {pdf_, lanes};
      draw.out.weight = {weight_, lanes};
      draw.out.status = {status_.data(), lanes};
      if (dielectric) draw.out.event = {event_.data(), lanes};
      std::vector<std::uint32_t> above, below;  // lanes drawn by the surface, and by its base
      if (groups_[group].base) {
        draw_base(group, bounce, above, below);
        draw.active = above;
      }
      const auto status =
          call(dielectric ? Operation::sample_scattering : Operation::sample_reflection, draw, &picture_.sampled);
      if (!status.ok()) return status;
      if (groups_[group].base) {
        Batch query = batch(lanes, group);
        query.active = below;
        query.outgoing = outgoing_.in(lanes);
        query.out.value = {value_, lanes};
        query.out.pdf = {pdf_, lanes};
        if (auto asked = call(Operation::evaluate_reflection, query); !asked.ok()) return asked;
      }
    }
    return absl::OkStatus();
  }

  // Chooses between a surface and its base, and draws the base's directions, by the cosine.
  void draw_base(std::size_t group, int bounce, std::vector<std::uint32_t>& above, std::vector<std::uint32_t>& below) {
    for (const std::uint32_t lane : list(group)) {
      const auto u = numbers(now_.slot[lane], dimension(bounce, Decision::base));
      from_base_[lane] = u[0] < kShareOfBase;
      if (!from_base_[lane]) {
        above.push_back(lane);
        continue;
      }
      below.push_back(lane);
      const float r = std::sqrt(u[1]), phi = 6.28318531f * u[2];
      const Vector o = {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1 - u[1]))};
      outgoing_.set(lane, normalized(o));
      status_[lane] = static_cast<std::uint8_t>(o[2] > 0 ? LaneStatus::accepted : LaneStatus::occluded);
    }
  }

  // Decides which paths go on: after this their status is `accepted`, and no other's is.
  void go_on(std::size_t lanes, int bounce) {
    constexpr auto kGoesOn = static_cast<std::uint8_t>(LaneStatus::accepted);
    constexpr auto kEnds = static_cast<std::uint8_t>(LaneStatus::invalid);
    std::vector<std::uint64_t> behind((lanes + 1023) / 1024);
    tbb::parallel_for(std::size_t{0}, behind.size(), [&](std::size_t block) {
      for (std::size_t lane = 1024 * block; lane < std::min(lanes, 1024 * (block + 1)); ++lane) {
        if (group_[lane] == kLeftOut) continue;
        behind[block] += incident_.z[lane] <= 0;
        const std::uint32_t slot = now_.slot[lane];
        rejected_[slot] += status_[lane] == static_cast<std::uint8_t>(LaneStatus::occluded);
        const std::uint8_t status = std::exchange(status_[lane], kEnds);
        if (status != static_cast<std::uint8_t>(LaneStatus::accepted) &&
            status != static_cast<std::uint8_t>(LaneStatus::smooth))
          continue;
        const Vector o = outgoing_[lane];
        const Surface& surface = surface_[lane];
        const Vector direction = normalized(surface.frame.to_world(o));
        if ((dot(direction, surface.facing) > 0) != (o[2] > 0)) continue;
        const Color weight = weight_of(lane, status == static_cast<std::uint8_t>(LaneStatus::smooth));
        Color throughput = weight * now_.throughput[lane];
        if (!(*std::max_element(throughput.begin(), throughput.end()) > 0)) continue;
        if (bounce >= kRouletteFrom) {
          const float go = std::min(1.0f, *std::max_element(throughput.begin(), throughput.end()));
          if (!(numbers(slot, dimension(bounce, Decision::roulette))[0] < go)) continue;
          throughput = (1 / go) * throughput;
        }
        now_.throughput.set(lane, throughput);
        now_.origin.set(lane, surface.origin(direction, step_));
        now_.direction.set(lane, direction);
        now_.pdf[lane] = pdf_[lane];
        status_[lane] = kGoesOn;
      }
    });
    picture_.backfacing += std::accumulate(behind.begin(), behind.end(), std::uint64_t{0});
  }

  // What a path is multiplied by. Where there is a base, pdf_ becomes the density of both ways of drawing.
  Color weight_of(std::size_t lane, bool smooth) {
    if (!groups_[group_[lane]].base) return weight_[lane] * factor(lane, im_[lane]);
    // A mirror's direction has no density: only the surface draws it.
    if (smooth) return (weight_[lane] / (1 - kShareOfBase)) * factor(lane, im_[lane]);
    const float oz = outgoing_.z[lane];
    float value = weight_[lane] * pdf_[lane], im = im_[lane];
    if (from_base_[lane]) {
      value = value_[lane];
      im = to_half_vector(lane, outgoing_[lane]);
    }
    pdf_[lane] = with_base(pdf_[lane], oz);
    return (1 / pdf_[lane]) * (value * factor(lane, im) + base_value(lane, oz));
  }

  absl::Status compact(std::size_t& lanes) {
    const auto started = Clock::now();
    std::vector<Compaction::DenseColumn> moved;
    const auto move = [&](float* from, float* to) { moved.push_back({{from, lanes}, {to, lanes}}); };
    for (auto member : {&Paths::origin, &Paths::direction, &Paths::throughput}) {
      move((now_.*member).x, (next_.*member).x);
      move((now_.*member).y, (next_.*member).y);
      move((now_.*member).z, (next_.*member).z);
    }
    move(now_.pdf, next_.pdf);
    Compaction compaction;
    compaction.lanes = lanes;
    compaction.status = {status_.data(), lanes};
    compaction.index = {index_.data(), lanes};
    compaction.columns = moved;
    const auto kept = facetwise::compact(compaction);
    if (!kept.ok()) return kept.status();
    for_lanes(*kept, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) next_.slot[k] = now_.slot[index_[k]];
    });
    std::swap(now_, next_);
    lanes = *kept;
    picture_.times.engine += seconds_since(started);
    return absl::OkStatus();
  }

  // Each pixel's samples in order, so that waves of any size add up to the same.
  void add(std::uint32_t samples) {
    for_lanes(pixels_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        Picture::Pixel& pixel = picture_.pixels[first_pixel_ + k];
        for (std::uint32_t s = 0; s < samples; ++s) {
          const std::size_t slot = std::size_t{s} * pixels_ + k;
          for (std::size_t c = 0; c < 3; ++c) pixel.radiance[c].add(radiance_[slot][c]);
          pixel.samples += 1;
          pixel.rejected += rejected_[slot];
          pixel.surfaces += surfaces_[slot];
        }
      }
    });
  }

  const Scene& scene_;
  const Settings& settings_;
  Engine& engine_;
  Geometry& geometry_;
  Picture& picture_;
  const Light light_;
  const Camera camera_;
  std::vector<Group> groups_;
  std::vector<std::uint8_t> group_of_;  // of each material
  float step_ = 0;

  std::uint32_t first_sample_ = 0, first_pixel_ = 0, pixels_ = 0;
  std::size_t capacity_ = 0;
  ColumnMemory memory_;
  Paths now_, next_;
  Vectors incident_{}, outgoing_{}, towards_light_{}, shadow_origin_{}, shadow_direction_{}, from_light_{};
  float *u_ = nullptr, *v_ = nullptr, *distance_ = nullptr, *alpha_x_ = nullptr, *alpha_y_ = nullptr, *eta_ = nullptr,
        *u1_ = nullptr, *u2_ = nullptr, *u3_ = nullptr, *pdf_ = nullptr, *weight_ = nullptr, *value_ = nullptr,
        *im_ = nullptr, *light_pdf_ = nullptr, *albedo_ = nullptr, *mean_slope_x_ = nullptr, *mean_slope_y_ = nullptr,
        *slope_correlation_ = nullptr;
  std::vector<std::uint32_t> triangle_, index_, listed_;
  std::vector<std::size_t> group_end_;
  std::vector<std::uint8_t> group_, status_, event_, visible_;
  std::vector<std::uint64_t> id_;
  std::vector<Surface> surface_;
  std::vector<Color> radiance_, f0_, base_;
  std::vector<std::uint8_t> from_base_;
  std::vector<float> surfaces_, rejected_;
};

absl::Status check(const Scene& scene, const Settings& settings) {
  const auto bad = [](auto... text) { return absl::InvalidArgumentError(absl::StrCat(text...)); };
  if (settings.width < 1 || settings.width > 16384) return bad("width: ", settings.width, " is not in [1, 16384]");
  if (settings.height < 1 || settings.height > 16384) return bad("height: ", settings.height, " is not in [1, 16384]");
  if (settings.samples < 1) return bad("samples: at least one a pixel");
  if (settings.depth < 1 || settings.depth > 1000) return bad("depth: ", settings.depth, " is not in [1, 1000]");
  const auto& mesh = scene.mesh;
  if (mesh.triangles.empty()) return bad("scene ", scene.name, ": no triangles in it");
  if (mesh.parts.size() != mesh.triangles.size()) return bad("scene ", scene.name, ": a part for each triangle");
  for (const std::uint32_t part : mesh.parts)
    if (part >= scene.materials.size()) return bad("scene ", scene.name, ": part ", part, " has no material");
  if (scene.materials.size() > kLeftOut) return bad("scene ", scene.name, ": more than 255 materials");
  for (const Material& material : scene.materials)
    if (material.model.interface == Interface::schlick || material.model.compensation != Compensation::none)
      return bad("scene ", scene.name, ": a material's Fresnel factor and compensation are f0 and `compensated`");
  return absl::OkStatus();
}

}  // namespace

std::string_view name(Numbers numbers) { return numbers == Numbers::random ? "random" : "sobol"; }
std::optional<Numbers> parse_numbers(std::string_view text) {
  for (const Numbers numbers : {Numbers::random, Numbers::sobol})
    if (text == name(numbers)) return numbers;
  return std::nullopt;
}

absl::StatusOr<FirstHits> first_hits(const Scene& scene, int width, int height) {
  Settings settings;
  settings.width = width, settings.height = height;
  if (auto status = check(scene, settings); !status.ok()) return status;
  auto geometry = Geometry::create(scene.mesh);
  if (!geometry.ok()) return geometry.status();
  const Camera camera(scene.view, width, height);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  ColumnMemory memory(9, pixels);
  std::vector<std::uint32_t> triangle(pixels);
  const RayColumns rays{memory[0], memory[1], memory[2], memory[3], memory[4], memory[5]};
  const auto direction = [&](std::size_t k) {
    return camera.direction(static_cast<float>(k % static_cast<std::size_t>(width)) + 0.5f,
                            static_cast<float>(k / static_cast<std::size_t>(width)) + 0.5f);
  };
  for (std::size_t k = 0; k < pixels; ++k)
    for (std::size_t c = 0; c < 3; ++c) memory[c][k] = scene.view.eye[c], memory[3 + c][k] = direction(k)[c];
  (*geometry)->intersect(rays, {triangle.data(), memory[6], memory[7], memory[8]}, 0, pixels, 0, true);
  FirstHits hits{std::vector<float>(pixels), std::vector<float>(pixels), std::vector<float>(pixels)};
  for (std::size_t k = 0; k < pixels; ++k) {
    if (triangle[k] == kMissed) continue;
    const Material& material = scene.materials[scene.mesh.parts[triangle[k]]];
    const Surface surface = surface_at(scene.mesh, material, triangle[k], memory[6][k], memory[7][k], direction(k));
    const Vector i = normalized(surface.frame.to_local(-1.0f * direction(k)));
    hits.x[k] = i[0], hits.y[k] = i[1], hits.z[k] = i[2];
  }
  return hits;
}

absl::StatusOr<Picture> render(const Scene& scene, const Settings& settings, Engine& engine,
                               std::optional<Picture> resumed) {
  if (auto status = check(scene, settings); !status.ok()) return status;
  Picture picture;
  picture.width = settings.width;
  picture.height = settings.height;
  picture.scene = scene.name;
  picture.made_by =
      absl::StrCat(scene.name, " ", settings.width, "x", settings.height, " seed ", settings.seed, " depth ",
                   settings.depth, " numbers ", std::string(name(settings.numbers)),
                   settings.light_sampling ? "" : " without light sampling", " version ", std::string(version()));
  for (const Material& material : scene.materials)
    picture.made_by += absl::StrCat("; ", std::string(name(material.model.distribution)), "-",
                                    std::string(name(material.model.masking)), "/", std::string(name(material.sampler)),
                                    " ", material.alpha_x, ",", material.alpha_y,
                                    material.compensated ? " compensated" : "", material.model.retro ? " retro" : "");
  if (resumed) {
    if (resumed->made_by != picture.made_by)
      return absl::InvalidArgumentError(absl::StrCat("the picture to resume is another: \"", resumed->made_by,
                                                     "\" and not \"", picture.made_by, "\""));
    picture.pixels = std::move(resumed->pixels);
  } else {
    picture.pixels.resize(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height));
  }
  auto geometry = Geometry::create(scene.mesh);
  if (!geometry.ok()) return geometry.status();

  Renderer renderer(scene, settings, engine, **geometry, picture);
  if (auto status = renderer.prepare(); !status.ok()) return status;
  const auto started = Clock::now();
  const auto pixels = static_cast<std::uint32_t>(picture.pixels.size());
  const std::uint32_t passes = std::max<std::uint32_t>(1, kWave / pixels);
  for (std::uint32_t first = picture.samples(); first < settings.samples;) {
    const std::uint32_t last = std::min(settings.samples, first + passes);
    for (std::uint32_t begin = 0; begin < pixels; begin += kWave)
      if (auto status = renderer.wave(first, last, begin, std::min<std::uint32_t>(pixels, begin + kWave)); !status.ok())
        return status;
    first = last;
    if (settings.progress && !settings.progress(static_cast<double>(first) / settings.samples)) break;
  }
  picture.times.total = seconds_since(started);
  return picture;
}

}  // namespace facetwise::render
