// SPDX-License-Identifier: Apache-2.0
// Samples of the kernels for one incident direction and roughness, from the generator.
#pragma once

#include <cstdint>
#include <functional>

#include "facetwise/engine.h"
#include "facetwise/reference.h"

namespace facetwise::test {

struct Drawn {
  reference::Vector o, m;  // the kernel's floats; o is 0 for sample_normal
  float incident_dot_normal, pdf, weight;
  LaneStatus status;
};

struct Draw {
  Operation operation = Operation::sample_reflection;  // or sample_normal
  Sampler sampler = Sampler::exact;
  Model model;
  reference::Roughness alpha;
  reference::Vector i;
  std::uint64_t seed = 1;
  std::uint64_t count = 0;
};

// Calls `each` for every sample, in order, and returns the call's statistics. Throws on an error of the
// engine.
Statistics draw(const Draw& draw, const std::function<void(const Drawn&)>& each);

}  // namespace facetwise::test
