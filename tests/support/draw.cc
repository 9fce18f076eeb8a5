// SPDX-License-Identifier: Apache-2.0
#include "support/draw.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace facetwise::test {

Statistics draw(const Draw& what, const std::function<void(const Drawn&)>& each) {
  constexpr std::size_t kChunk = 16384;
  const bool reflection = what.operation == Operation::sample_reflection;
  std::vector<float> column[9];
  for (auto& c : column) c.resize(kChunk);
  std::vector<std::uint8_t> status(kChunk);
  Statistics total;
  for (std::uint64_t first = 0; first < what.count; first += kChunk) {
    const auto lanes = static_cast<std::size_t>(std::min<std::uint64_t>(kChunk, what.count - first));
    const auto out = [&](int n) { return OutputColumn<float>(column[n].data(), lanes); };
    Batch batch;
    batch.model = what.model;
    batch.sampler = what.sampler;
    batch.lanes = lanes;
    batch.incident = {static_cast<float>(what.i.x), static_cast<float>(what.i.y), static_cast<float>(what.i.z)};
    batch.alpha_x = static_cast<float>(what.alpha.x);
    batch.alpha_y = static_cast<float>(what.alpha.y);
    batch.generator = Generator{.seed = what.seed, .dimension = 0, .id = {}, .first_id = first};
    batch.out.normal = {out(3), out(4), out(5)};
    batch.out.incident_dot_normal = out(6);
    batch.out.pdf = out(7);
    if (reflection) {
      batch.out.outgoing = {out(0), out(1), out(2)};
      batch.out.weight = out(8);
    }
    batch.out.status = OutputColumn<std::uint8_t>(status.data(), lanes);
    Execution execution;
    execution.threads = Threads::one;
    const auto statistics = run(what.operation, batch, execution);
    if (!statistics.ok()) throw std::runtime_error(std::string(statistics.status().message()));
    total += *statistics;
    for (std::size_t n = 0; n < lanes; ++n) {
      each({{column[0][n], column[1][n], column[2][n]},
            {column[3][n], column[4][n], column[5][n]},
            column[6][n],
            column[7][n],
            column[8][n],
            static_cast<LaneStatus>(status[n])});
    }
  }
  return total;
}

}  // namespace facetwise::test
