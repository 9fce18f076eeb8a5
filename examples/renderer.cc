// A small renderer with threads of its own that scatters light by batch calls: here, or on servers in other processes, with the
// same picture. Rough metal balls on a chequered floor, under a sky with a sun.
//
//   renderer OUTPUT.ppm [--threads N] [--samples N] [unix:PATH|HOST:PORT ...]
//
// Each thread takes rows of the picture, traces all paths of a row at once, and gives each bounce to the engine as one batch.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "facetwise/client.h"
#include "facetwise/engine.h"

namespace {

struct Vec {
  float x, y, z;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
Vec operator*(float s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec unit(Vec a) { return 1 / std::sqrt(dot(a, a)) * a; }

constexpr int kWidth = 480, kHeight = 270, kBounces = 6;

struct Ball {
  Vec centre;
  float radius, alpha_x, alpha_y;
  Vec tint;
};
constexpr Ball kBalls[] = {
    {{-2.6f, 0, 0.8f}, 0.8f, 0.02f, 0.02f, {0.95f, 0.93f, 0.88f}},
    {{-0.9f, 0, 0.8f}, 0.8f, 0.1f, 0.1f, {1, 0.78f, 0.34f}},
    {{0.9f, 0, 0.8f}, 0.8f, 0.6f, 0.06f, {0.95f, 0.64f, 0.54f}},
    {{2.6f, 0, 0.8f}, 0.8f, 0.5f, 0.5f, {0.56f, 0.57f, 0.58f}},
    {{0.05f, -1.5f, 0.35f}, 0.35f, 0.25f, 0.25f, {0.9f, 0.9f, 0.9f}},
};

Vec sky(Vec d) {
  const Vec sun = unit({0.5f, -0.5f, 0.7f});
  const float up = std::max(d.z, 0.0f), glow = std::max(dot(d, sun), 0.0f);
  const Vec blue = (1 - up) * Vec{0.85f, 0.85f, 0.8f} + up * Vec{0.25f, 0.45f, 0.9f};
  return blue + (glow > 0.98f ? 10.0f : 1.5f * std::pow(glow, 40.0f)) * Vec{1, 0.9f, 0.7f};
}

struct Hit {
  float distance = 1e30f;
  Vec normal{}, tint{};
  float alpha_x = 0, alpha_y = 0;
};

Hit intersect(Vec origin, Vec direction) {
  Hit hit;
  for (const Ball& ball : kBalls) {
    const Vec to = origin - ball.centre;
    const float b = dot(to, direction), c = dot(to, to) - ball.radius * ball.radius, discriminant = b * b - c;
    if (discriminant <= 0) continue;
    const float distance = -b - std::sqrt(discriminant);
    if (distance < 1e-3f || distance > hit.distance) continue;
    hit = {distance, unit(to + distance * direction), ball.tint, ball.alpha_x, ball.alpha_y};
  }
  if (const float distance = -origin.z / direction.z; direction.z < 0 && distance > 1e-3f && distance < hit.distance) {
    const Vec at = origin + distance * direction;
    const bool dark = (static_cast<int>(std::floor(at.x)) + static_cast<int>(std::floor(at.y))) & 1;
    const Vec grey{0.6f, 0.6f, 0.6f}, black{0.2f, 0.2f, 0.22f};
    hit = {distance, {0, 0, 1}, dark ? black : grey, 0.3f, 0.3f};
  }
  return hit;
}

// The paths of a row, and the columns of their next batch: those that go on, side by side.
struct Paths {
  explicit Paths(std::size_t count) : columns(9 * count), ids(count), status(count) {}
  std::vector<Vec> origin, direction, throughput;
  std::vector<float> columns;
  std::vector<std::uint64_t> ids;
  std::vector<std::uint8_t> status;
};

absl::Status trace_row(facetwise::Engine& engine, int row, int samples, std::vector<Vec>& row_pixels,
                       std::atomic<std::size_t>& lanes) {
  const std::size_t count = static_cast<std::size_t>(kWidth) * samples;
  Paths paths(count);
  std::vector<std::size_t> alive(count);
  std::vector<Hit> hits(count);
  std::vector<std::array<Vec, 3>> frames(count);
  const Vec eye{0, -7, 2.2f}, forward = unit(Vec{0, 0, 0.7f} - eye), right = unit(cross(forward, {0, 0, 1})),
                              up = cross(right, forward);
  for (std::size_t k = 0; k < count; ++k) {
    // Samples on a lattice within the pixel.
    const int sample = static_cast<int>(k % samples);
    const float x = static_cast<float>(k / samples) + (sample + 0.5f) / samples;
    const float y = row + std::fmod(sample * 0.618034f, 1.0f);
    const Vec d = forward + (1.1f * (x / kWidth - 0.5f)) * right + (1.1f * (0.5f * kHeight - y) / kWidth) * up;
    paths.origin.push_back(eye);
    paths.direction.push_back(unit(d));
    paths.throughput.push_back({1, 1, 1});
    alive[k] = k;
  }
  for (int bounce = 0; bounce <= kBounces && !alive.empty(); ++bounce) {
    const auto column = [&](int n) { return std::span(paths.columns).subspan(n * count, alive.size()); };
    std::size_t lane = 0;
    for (const std::size_t k : alive) {
      const Vec d = paths.direction[k];
      const Hit hit = intersect(paths.origin[k], d);
      if (hit.distance > 1e29f) {
        row_pixels[k / samples] = row_pixels[k / samples] + 1.0f / samples * (paths.throughput[k] * sky(d));
        continue;
      }
      if (bounce == kBounces) continue;
      // Microfacets stretch along `tangent` by alpha_x: around the ball.
      const Vec n = hit.normal;
      const Vec tangent = std::fabs(n.z) < 0.999f ? unit(cross({0, 0, 1}, n)) : Vec{1, 0, 0};
      frames[k] = {tangent, cross(n, tangent), n};
      hits[k] = hit;
      alive[lane] = k;
      paths.ids[lane] = (static_cast<std::uint64_t>(row) << 32) | k;
      for (int axis = 0; axis < 3; ++axis) column(axis)[lane] = -dot(d, frames[k][axis]);
      column(3)[lane] = hit.alpha_x;
      column(4)[lane] = hit.alpha_y;
      ++lane;
    }
    alive.resize(lane);
    if (lane == 0) break;

    facetwise::Batch batch;
    batch.lanes = lane;
    batch.incident = {column(0), column(1), column(2)};
    batch.alpha_x = column(3);
    batch.alpha_y = column(4);
    // By path and bounce: the picture does not depend on who computes what, and when.
    batch.generator = {
        .seed = 1, .dimension = static_cast<std::uint32_t>(bounce), .id = std::span(paths.ids).first(lane)};
    batch.out.outgoing = {column(5), column(6), column(7)};
    batch.out.weight = column(8);
    batch.out.status = std::span(paths.status).first(lane);
    if (const auto done = engine.sample_reflection(batch); !done.ok()) return done.status();
    lanes += lane;

    std::size_t going_on = 0;
    for (std::size_t n = 0; n < lane; ++n) {
      const std::size_t k = alive[n];
      if (column(8)[n] <= 0) continue;  // occluded
      const auto& [t, b, normal] = frames[k];
      paths.origin[k] = paths.origin[k] + hits[k].distance * paths.direction[k];
      paths.direction[k] = column(5)[n] * t + column(6)[n] * b + column(7)[n] * normal;
      paths.throughput[k] = column(8)[n] * (paths.throughput[k] * hits[k].tint);
      alive[going_on++] = k;
    }
    alive.resize(going_on);
  }
  return absl::OkStatus();
}

int usage() {
  std::cerr << "Usage: renderer OUTPUT.ppm [--threads N] [--samples N] [unix:PATH|HOST:PORT ...]\n";
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  std::string output;
  std::vector<std::string> servers;
  int threads = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1), samples = 32;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word == "--threads" || word == "--samples") {
      if (k + 1 == argc || std::atoi(argv[k + 1]) < 1) return usage();
      (word == "--threads" ? threads : samples) = std::atoi(argv[++k]);
    } else if (output.empty()) {
      output = word;
    } else {
      servers.push_back(word);
    }
  }
  if (output.empty()) return usage();

  absl::StatusOr<std::unique_ptr<facetwise::Engine>> engine =
      facetwise::local_engine({.threads = facetwise::Threads::one});
  if (!servers.empty()) engine = facetwise::connect(servers);
  if (!engine.ok()) {
    std::cerr << engine.status().message() << '\n';
    return 1;
  }
  const auto begin = std::chrono::steady_clock::now();
  std::vector<std::vector<Vec>> rows(kHeight, std::vector<Vec>(kWidth, Vec{}));
  std::vector<absl::Status> ends(threads);
  std::atomic<int> next = 0;
  std::atomic<std::size_t> lanes = 0;
  std::vector<std::thread> workers;
  for (int n = 0; n < threads; ++n)
    workers.emplace_back([&, n] {
      for (int row; ends[n].ok() && (row = next++) < kHeight;)
        ends[n] = trace_row(**engine, row, samples, rows[row], lanes);
    });
  for (std::thread& worker : workers) worker.join();
  for (const absl::Status& end : ends)
    if (!end.ok()) {
      std::cerr << end.message() << '\n';
      return 1;
    }
  std::ofstream file(output, std::ios::binary);
  file << "P6\n" << kWidth << ' ' << kHeight << "\n255\n";
  for (const auto& row : rows)
    for (const Vec pixel : row)
      for (const float value : {pixel.x, pixel.y, pixel.z})
        file.put(
            static_cast<char>(std::lround(255 * std::pow(std::clamp(value / (0.6f + value), 0.0f, 1.0f), 1 / 2.2f))));
  if (!file.flush()) {
    std::cerr << output << ": cannot be written\n";
    return 1;
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  std::printf("%s: %.1f million reflections by %d threads %s, %.2f s\n", output.c_str(), lanes / 1e6, threads,
              servers.empty() ? "here" : "on servers", time.count());
  return 0;
}
