// SPDX-License-Identifier: Apache-2.0
// Tabulated distributions through the engine: values, areas and masking against the reference with the table's own density,
// samples against their densities, and what is refused. Radial and skewed, with Smith masking and V-cavity, with mean slopes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "facetwise/slope_table.h"
#include "models/compositions.h"
#include "facetwise/chi_square.h"
#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

double gauss(double x, double y) { return std::exp(-x * x - y * y) / std::numbers::pi; }

// Neither a Gaussian nor GGX: a narrow peak on a broad foot.
std::shared_ptr<const SlopeTable> radial_table() {
  static const auto table = *SlopeTable::build(
      [](double x, double y) {
        const double r2 = x * x + y * y;
        return 0.6 * 4 * gauss(2 * x, 2 * y) + 0.4 * 2 / (std::numbers::pi * std::pow(1 + r2, 3));
      },
      {.radial = true, .grid = 513, .incidence = 65, .slopes = 65, .uniforms = 128});
  return table;
}
// Two humps of different size: skewed, its mean slope is not 0, and it has no symmetry.
std::shared_ptr<const SlopeTable> skewed_table() {
  static const auto table = *SlopeTable::build(
      [](double x, double y) {
        return 0.7 * 1.5 * gauss(1.2 * (x - 0.3), 1.25 * (y + 0.1)) + 0.3 * gauss(x + 0.4, y - 0.5);
      },
      {.grid = 257, .incidence = 33, .slopes = 65, .uniforms = 64, .azimuths = 64});
  return table;
}

struct Kind {
  const char* name;
  bool skewed;
  Masking masking;
  bool affine;
};
void PrintTo(const Kind& kind, std::ostream* to) { *to << kind.name; }

Composition composition(const Kind& kind, Sampler sampler) {
  Composition c;
  c.model.distribution = Distribution::table;
  c.model.masking = kind.masking;
  c.model.table = kind.skewed ? skewed_table() : radial_table();
  c.sampler = sampler;
  c.affine = kind.affine;
  return c;
}

// Of the centred density, for w of any length: by the table's own areas in double, or by quadrature of its density.
double area_of(const SlopeTable& table, Vector w, double mean_x, double mean_y, bool by_quadrature) {
  const double z = w.z + w.x * mean_x + w.y * mean_y, across = std::hypot(w.x, w.y), length = std::hypot(across, z);
  const double theta = std::atan2(across, z), phi = std::atan2(w.y, w.x);
  return length * (by_quadrature ? table.projected_area(theta, phi) : table.tabulated_area(theta, phi));
}

// A table's own mean slope counts as if it were given with the batch, so the reference gets the centred density.
reference::Surface surface(const Composition& c, Point point) {
  if (c.model.table->radial() == false) point.correlation = 0;
  reference::Surface s = surface_of(c, point);
  const double x = c.model.table->view().mean_x, y = c.model.table->view().mean_y;
  s.table_density = [table = c.model.table, x, y](double u, double v) { return table->p22(u + x, v + y); };
  // The reference's own quadrature takes seconds a value; `area_of` has it for some directions.
  s.table_area = [table = c.model.table, x, y](Vector w) { return area_of(*table, w, x, y, false); };
  s.mean_slope_x += s.alpha.x * x;
  s.mean_slope_y += s.alpha.y * y;
  return s;
}

// Skewed tables take no correlation, retro-reflection and mean slopes do not go together: c.affine gives mean slopes.
Batch batch_of(Operation operation, const Composition& c, std::span<const Point> points, std::span<Result> results) {
  Batch batch = make_batch(operation, c, points, results);
  if (!c.model.table->radial()) batch.slope_correlation = {};
  return batch;
}
std::vector<Result> run_table(Operation operation, const Composition& c, std::span<const Point> points) {
  std::vector<Result> results(points.size());
  const auto statistics = run(operation, batch_of(operation, c, points, results), {.threads = Threads::one});
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  return results;
}

class Tables : public testing::TestWithParam<Kind> {};

TEST_P(Tables, ValuesAreaAndMaskingAreTheReferences) {
  const Composition c = composition(GetParam(), Sampler::visible);
  double worst = 0, worst_area = 0;
  for (const Point& calm : calm_points(c)) {
    std::vector<Point> points = with_random(calm, kQuick ? 2 : 12, 5);
    // Reflections by normals of all kinds.
    const reference::Surface s = surface(c, calm);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Vector m = normal_of(s, 0.1 + 0.15 * static_cast<double>(n), 1 + 2.4 * static_cast<double>(n));
      const Vector o = reflection(incident(calm), m);
      set_outgoing(points[n], o.z > 0 && dot(incident(calm), m) > 0 ? o : unit({0.3, -0.2, 0.5}));
    }
    const auto masking = run_table(Operation::masking, c, std::span(points).first(1));
    reference::Surface exact = s;
    exact.table_area = [&](Vector w) {
      return area_of(*c.model.table, w, c.model.table->view().mean_x, c.model.table->view().mean_y, true);
    };
    const double area = reference::projected_area(exact, incident(calm));
    if (c.model.masking == Masking::smith) {
      worst_area = std::max(worst_area, std::abs(masking[0].area / area - 1));
      EXPECT_NEAR(masking[0].masking, reference::masking(s, incident(calm)), 2e-3) << describe(calm);
    }
    const auto values = run_table(Operation::evaluate_reflection, c, points);
    for (std::size_t n = 0; n < points.size(); ++n) {
      const double value = reference::evaluate_reflection(s, incident(points[n]), outgoing(points[n]));
      if (value < 1e-6) {
        EXPECT_LT(values[n].value, 2e-6) << describe(points[n]);
        continue;
      }
      worst = std::max(worst, std::abs(values[n].value / value - 1));
      EXPECT_NEAR(values[n].value / value, 1, 1e-3) << describe(points[n]);
    }
  }
  std::printf("%s: values within %.2g, areas within %.2g\n", GetParam().name, worst, worst_area);
  EXPECT_LT(worst_area, 3e-4);
}

TEST_P(Tables, SamplesAgreeWithQueriesAndFollowTheirDensity) {
  for (const Sampler sampler : {Sampler::ndf, Sampler::visible}) {
    const Composition c = composition(GetParam(), sampler);
    std::uint64_t seed = 40;
    for (const Point& point : calm_points(c)) {
      // A sample's pdf is a query's, except beside cells' ends; its weight times that is the value.
      std::vector<Point> points = with_random(point, kQuick ? 200 : 4000, ++seed);
      const auto samples = run_table(Operation::sample_reflection, c, points);
      for (std::size_t n = 0; n < points.size(); ++n)
        points[n].ox = samples[n].ox, points[n].oy = samples[n].oy, points[n].oz = samples[n].oz;
      const auto queries = run_table(Operation::evaluate_reflection, c, points);
      std::size_t apart = 0, compared = 0;
      for (std::size_t n = 0; n < points.size(); ++n) {
        if (!accepted(samples[n]) || samples[n].oz < 1e-3f) continue;
        ++compared;
        apart += std::abs(queries[n].pdf / samples[n].pdf - 1) > 2e-3f;
        if (std::abs(queries[n].pdf / samples[n].pdf - 1) < 1e-4f && queries[n].value > 1e-12f) {
          EXPECT_NEAR(samples[n].weight * samples[n].pdf / queries[n].value, 1, 2e-3) << describe(points[n]);
        }
      }
      // Of normals drawn whatever i is, few face an i behind.
      EXPECT_GT(compared, sampler == Sampler::visible ? points.size() / 4 : points.size() / 100) << describe(point);
      EXPECT_LE(apart, 1 + compared / 100) << name(sampler) << describe(point);

      // Chi-square over blocks of a grid of normals.
      const int kSide = kQuick ? 64 : 256, kBlocks = 16, kBlock = kSide / kBlocks;
      const std::size_t count = kQuick ? 5000 : 50000;
      const reference::Surface s = surface(c, point);
      std::vector<Point> places;
      std::vector<std::pair<int, double>> cells;
      const Grid grid{.side = kSide, .pdf = {}, .value = {}};
      for (int n = 0; n < kSide * kSide; ++n) {
        const double t = grid.t(n / kSide + 0.5);
        double area = 0;
        const Vector m = normal_of(s, std::tan(t), 2 * std::numbers::pi * (n % kSide + 0.5) / kSide, &area);
        const double im = dot(incident(point), m);
        const Vector o = reflection(incident(point), m);
        if (im <= 0 || o.z <= 0) continue;
        places.push_back(point);
        set_outgoing(places.back(), o);
        cells.emplace_back(n / kSide / kBlock * kBlocks + n % kSide / kBlock, area * grid.slopes(t) * 4 * im);
      }
      const auto densities = run_table(Operation::pdf_reflection, c, places);
      std::vector<double> expected(kBlocks * kBlocks + 1);
      double sum = 0;
      for (std::size_t n = 0; n < places.size(); ++n) {
        expected[static_cast<std::size_t>(cells[n].first)] +=
            cells[n].second * densities[n].pdf * static_cast<double>(count);
        sum += cells[n].second * densities[n].pdf;
      }
      std::vector<std::uint64_t> counts(expected.size());
      const auto drawn = run_table(Operation::sample_reflection, c, with_random(point, count, 900 + seed));
      double weights = 0, squares = 0;
      for (const Result& r : drawn) {
        weights += r.weight;
        squares += static_cast<double>(r.weight) * r.weight;
        const Vector i = incident(point);
        const int cell = accepted(r) ? cell_of(grid, s, unit({i.x + r.ox, i.y + r.oy, i.z + r.oz})) : -1;
        ++counts[cell < 0 ? counts.size() - 1
                          : static_cast<std::size_t>(cell / kSide / kBlock * kBlocks + cell % kSide / kBlock)];
      }
      expected.back() = std::max(0.0, (1 - sum) * static_cast<double>(count));
      const ChiSquare test = chi_square(counts, expected);
      EXPECT_GE(test.p_value, sidak(0.01, 100)) << "chi-square " << test.statistic << " at " << test.degrees
                                                << " degrees, " << name(sampler) << describe(point);
      EXPECT_GE(test.degrees, kQuick ? 1 : 15) << describe(point);
      // What weights add up to is the integral of the values.
      const auto values = run_table(Operation::evaluate_reflection, c, places);
      double integral = 0;
      for (std::size_t n = 0; n < places.size(); ++n) integral += cells[n].second * values[n].value;
      const double mean = weights / static_cast<double>(count);
      const double deviation =
          std::sqrt((squares / static_cast<double>(count) - mean * mean) / static_cast<double>(count));
      EXPECT_NEAR(mean, integral, 4.5 * deviation + (kQuick ? 0.03 : 2e-3)) << name(sampler) << describe(point);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Tables,
                         testing::Values(Kind{"radial_smith", false, Masking::smith, false},
                                         Kind{"radial_smith_affine", false, Masking::smith, true},
                                         Kind{"radial_vcavity", false, Masking::vcavity, false},
                                         Kind{"skewed_smith", true, Masking::smith, false},
                                         Kind{"skewed_smith_affine", true, Masking::smith, true}),
                         [](const auto& info) { return info.param.name; });

TEST(TableModels, RefuseWhatTheyCannotDo) {
  const auto refused = [](const Composition& c, Operation operation, std::string_view says, auto change) {
    Point point;
    Result result;
    Batch batch = batch_of(operation, c, std::span(&point, 1), std::span(&result, 1));
    change(batch);
    const auto status = check(operation, batch);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_NE(std::string(status.message()).find(says), std::string::npos) << status;
  };
  const auto nothing = [](Batch&) {};
  const Kind radial{"", false, Masking::smith, false}, skewed{"", true, Masking::smith, false};
  for (const Sampler sampler : {Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact})
    refused(composition(radial, sampler), Operation::sample_reflection, "sampler", nothing);
  refused(composition(skewed, Sampler::visible), Operation::sample_reflection, "model.masking",
          [](Batch& b) { b.model.masking = Masking::vcavity; });
  refused(composition(skewed, Sampler::visible), Operation::sample_reflection, "slope_correlation",
          [](Batch& b) { b.slope_correlation = 0.5f; });
  refused(composition(skewed, Sampler::visible), Operation::sample_reflection, "model.retro",
          [](Batch& b) { b.model.retro = true; });
  refused(composition(radial, Sampler::visible), Operation::sample_reflection, "model.table",
          [](Batch& b) { b.model.table = nullptr; });
  refused(composition(radial, Sampler::visible), Operation::sample_reflection, "model.table",
          [](Batch& b) { b.model.distribution = Distribution::ggx; });
  refused(composition(skewed, Sampler::visible), Operation::albedo, "radial", [](Batch&) {});
}

}  // namespace
}  // namespace facetwise::test
