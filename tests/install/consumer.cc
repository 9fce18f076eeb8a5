// SPDX-License-Identifier: Apache-2.0
// A program outside: finds the installed package, samples a batch, compares one lane with the reference.
#include <cmath>
#include <cstdio>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/reference.h"

int main() {
  std::vector<float> x(100), y(100), z(100);
  facetwise::Batch batch;
  batch.sampler = facetwise::Sampler::exact;
  batch.lanes = x.size();
  batch.incident = {0.6f, 0.0f, 0.8f};
  batch.alpha_x = batch.alpha_y = 0.3f;
  batch.u1 = 0.25f;
  batch.u2 = 0.125f;
  batch.u3 = 0.5f;
  batch.out.outgoing = {x, y, z};
  const auto statistics = facetwise::sample_reflection(batch);
  if (!statistics.ok() || statistics->accepted != x.size()) return 1;
  const auto truth = facetwise::reference::sample_reflection({}, batch.sampler, {double{0.3f}, double{0.3f}},
                                                             {double{0.6f}, 0, double{0.8f}}, 0.25, 0.125, 0.5);
  const double error = std::hypot(x[99] - truth.o.x, y[99] - truth.o.y, z[99] - truth.o.z);
  std::printf("%zu lanes accepted, error %.1e\n", x.size(), error);
  return error < 1e-6 ? 0 : 1;
}
