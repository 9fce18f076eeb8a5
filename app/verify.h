// SPDX-License-Identifier: Apache-2.0
// Comparing two engines on real input, every byte.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "facetwise/engine.h"
#include "facetwise/scene.h"

namespace facetwise::app {

// One batch of the comparison.
struct VerifyCase {
  Operation operation;
  Model model{};
  Sampler sampler = Sampler::exact;
  bool generator = true;  // the random numbers: the generator's, or columns
  bool affine = false;    // mean slopes and correlated roughness too
};

// What the batches are, in turn. Of GGX with Smith masking: reflections by every sampler, by the generator and by
// columns of random numbers, then normals, queries and masking. Then of every other distribution and masking that
// has one of the samplers: reflections, normals, queries, and what a dielectric transmits. Never empty for a list
// of samplers that is not.
std::vector<VerifyCase> verify_cases(std::span<const Sampler> samplers);

struct VerifiedBatch {
  VerifyCase what;
  Statistics statistics;
  std::uint64_t backfacing = 0;
  std::uint64_t bytes = 0;  // compared
  double remote_seconds = 0, local_seconds = 0;
  std::string difference;  // empty if every byte and the statistics are equal
};

struct Verification {
  std::vector<VerifiedBatch> batches;
  std::uint64_t triangles = 0, rays = 0, hits = 0;

  bool equal() const;
  std::uint64_t lanes() const;
};

struct VerifyOptions {
  std::size_t batches = 0;                   // 0: each of verify_cases() once
  std::size_t lanes = std::size_t{1} << 20;  // per batch
  std::vector<Sampler> samplers;
  std::uint64_t seed = 1;
};

// Traces the batches, has each answered by both engines and compares the answers. An error is a call that
// failed; a difference is in the result. `progress` is called after each batch.
absl::StatusOr<Verification> verify(Engine& remote, Engine& local, scene::Camera& camera, const VerifyOptions& options,
                                    const std::function<void(const VerifiedBatch&)>& progress);

}  // namespace facetwise::app
