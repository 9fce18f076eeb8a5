// SPDX-License-Identifier: Apache-2.0
#include "support/hypothesis.h"

#include <algorithm>
#include <cmath>

#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vector unit(Vector a) {
  const double length = std::sqrt(dot(a, a));
  return {a.x / length, a.y / length, a.z / length};
}

Hypothesis claim(const Draw& draw, double factor, double epsilon) {
  const reference::Roughness alpha = {draw.alpha.x * factor, draw.alpha.y * factor};
  const bool reflections = draw.operation == Operation::sample_reflection;
  return {{alpha, draw.i, reflections}, [=](const Vector& m, const Vector& o) {
            const double pdf = reflections ? reference::pdf_reflection(draw.sampler, alpha, draw.i, o)
                                           : reference::pdf_normal(draw.sampler, alpha, draw.i, m);
            if (epsilon == 0) return pdf;
            const double xy = m.x * m.x + m.y * m.y;
            return pdf * (1 + epsilon * (xy > 0 ? (m.x * m.x - m.y * m.y) / xy : 0));
          }};
}

struct Cells {
  Grid grid;
  std::vector<double> expected;  // the last is for occluded samples
  std::vector<std::uint64_t> counts;
};

Cells make_cells(const Hypothesis& hypothesis, std::uint64_t count) {
  const int kAcross = kQuick ? 10 : 32;
  Cells cells;
  cells.grid = make_grid(hypothesis.lobe, hypothesis.density, kAcross, kAcross);
  const double n = static_cast<double>(count);
  // Wrong by 0.05 samples a cell at most.
  cells.expected = integrate_cells(hypothesis.lobe, cells.grid, hypothesis.density, 0.05 / n);
  double accepted = 0;
  for (double& e : cells.expected) {
    accepted += e;
    e *= n;
  }
  // Where nothing can be occluded, what is left is the quadrature's error.
  cells.expected.push_back(std::max(0.0, 1 - accepted) * n);
  cells.counts.resize(cells.expected.size());
  return cells;
}

}  // namespace

Hypothesis truth(const Draw& draw) { return claim(draw, 1, 0); }
Hypothesis modulated(const Draw& draw, double epsilon) { return claim(draw, 1, epsilon); }
Hypothesis rougher(const Draw& draw, double epsilon) { return claim(draw, 1 + epsilon, 0); }

Verdict test_hypotheses(const Draw& what, const std::vector<Hypothesis>& hypotheses) {
  const bool reflections = what.operation == Operation::sample_reflection;
  std::vector<Cells> all;
  for (const Hypothesis& hypothesis : hypotheses) all.push_back(make_cells(hypothesis, what.count));

  // A sample's normal is the half vector of i and o. Where o's mere rounding to float would move that by
  // more than 3e-4 of the lobe, it is the normal that the kernel returns with o; that o is its reflection is
  // checked.
  const double alpha = std::min(what.alpha.x, what.alpha.y);
  const bool from_o = reflections && 0x1p-24 / (alpha * std::max(std::abs(what.i.z), alpha)) < 3e-4;

  Verdict verdict;
  verdict.statistics = draw(what, [&](const Drawn& sample) {
    if (sample.status != LaneStatus::accepted) {
      for (Cells& cells : all) ++cells.counts.back();
      return;
    }
    Vector m = sample.m;
    if (!reflections) verdict.outside = std::max({verdict.outside, -dot(what.i, m), -m.z});
    if (reflections) {
      const Vector o = reflect(what.i, m);
      const double error = std::hypot(sample.o.x - o.x, sample.o.y - o.y, sample.o.z - o.z);
      if (error > 0x1p-20) ++verdict.unreflected;
      verdict.outside = std::max({verdict.outside, -sample.o.z, -sample.o.z - what.i.z});
      if (from_o) m = unit({what.i.x + sample.o.x, what.i.y + sample.o.y, what.i.z + sample.o.z});
    }
    for (std::size_t n = 0; n < all.size(); ++n) ++all[n].counts[all[n].grid.cell(hypotheses[n].lobe.alpha, m)];
  });
  for (const Cells& cells : all) verdict.tests.push_back(chi_square(cells.counts, cells.expected));
  verdict.share_expected = 1 - all[0].expected.back() / static_cast<double>(what.count);
  return verdict;
}

}  // namespace facetwise::test
