// Computes a table of albedo by the engine's own samples: the mean of their weights.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <span>

#include "absl/strings/str_cat.h"
#include "facetwise/albedo_table.h"
#include "facetwise/engine.h"
#include "facetwise/slope_table.h"
#include "src/albedo/layout.h"
#include "src/work.h"

namespace facetwise {
namespace {

// The k-th of n points that are spread evenly over the cube: k / n, and the radical inverses of k to base 2 and 3
// (Hammersley 1960). The same at every node, so that their error is smooth.
struct Points {
  explicit Points(std::size_t n) : u1(n), u2(n), u3(n) {
    for (std::size_t k = 0; k < n; ++k) {
      u1[k] = uniform((static_cast<double>(k) + 0.5) / static_cast<double>(n));
      u2[k] = uniform(radical_inverse(k, 2));
      u3[k] = uniform(radical_inverse(k, 3));
    }
  }
  static double radical_inverse(std::size_t k, std::size_t base) {
    double inverse = 0, digit = 1 / static_cast<double>(base);
    for (; k != 0; k /= base, digit /= static_cast<double>(base)) inverse += digit * static_cast<double>(k % base);
    return inverse;
  }
  static float uniform(double u) { return std::min(static_cast<float>(u), 1 - 0x1p-24f); }
  std::vector<float> u1, u2, u3;
};

// Directions spread by their cosine, each with a point: a quarter disc, which is like the others, by points of its square.
struct Disc {
  explicit Disc(const Points& from) {
    for (std::size_t k = 0; k < from.u1.size(); ++k) {
      const double dx = Points::radical_inverse(k, 5), dy = Points::radical_inverse(k, 7), squared = dx * dx + dy * dy;
      if (squared >= 1) continue;
      x.push_back(static_cast<float>(dx));
      y.push_back(static_cast<float>(dy));
      z.push_back(static_cast<float>(std::sqrt(1 - squared)));
      points.u1.push_back(from.u1[k]);
      points.u2.push_back(from.u2[k]);
      points.u3.push_back(from.u3[k]);
    }
  }
  std::vector<float> x, y, z;
  Points points{0};
};

// A direction and a roughness that have the coordinates v, a, r, t.
struct Node {
  float x, y, z, alpha_x, alpha_y;
};
Node node_at(double v, double a, double r, double t, double range) {
  // Nodes beyond the roughness that there is only serve to interpolate.
  const double least = kSmallestAlpha / (1.0 + kSmallestAlpha), difference = r * std::min(a, 1 - a);
  const double x = std::clamp((a + difference) * range, least, range);
  const double y = std::clamp((a - difference) * range, least, range);
  const double up = v * v, along = (1 - v) * (1 - v);
  const double c = std::max(up / (up + along), 1e-7), s = std::sqrt(1 - c * c);
  const double scale = s / std::sqrt((1 - t) * (1 - t) + t * t);
  const double ix = scale * (1 - t) / x, iy = scale * t / y, length = std::sqrt(ix * ix + iy * iy + c * c);
  // alpha = x / (1 - x), rounded into what is allowed.
  const auto alpha = [&](double bounded) {
    return std::clamp(static_cast<float>(bounded / (1 - bounded)), kSmallestAlpha, kLargestAlpha);
  };
  return {static_cast<float>(ix / length), static_cast<float>(iy / length), static_cast<float>(c / length), alpha(x),
          alpha(y)};
}

// Runs the samples of nodes.
class AlbedoBuilder {
 public:
  AlbedoBuilder(const Model& model, const AlbedoTable::Options& options)
      : sizes_(options.sizes), range_(albedo_range(model.distribution)), values_(sizes_.total()) {
    // Compensation, interface and retro-reflection play no part.
    batch_.model = {.distribution = model.distribution,
                    .masking = model.masking,
                    .shadowing = model.shadowing,
                    .table = model.table};
    batch_.sampler = default_sampler(Operation::sample_reflection, batch_);
    // Three numbers of which some make occluded samples spread less evenly.
    const bool uneven = batch_.sampler != Sampler::exact && uses_u3(batch_.model, batch_.sampler);
    few_ = Points(options.samples * (uneven ? 4 : 1));
    many_ = Points(few_.u1.size() * 32);
    disc_ = Disc(many_);
  }

  absl::StatusOr<std::vector<float>> run(const std::function<void(double)>& progress) {
    const Node node = node_at(0.5, 0.5, 0, 0, range_);
    if (auto status = facetwise::check(Operation::sample_reflection, with(node, few_)); !status.ok()) return status;

    const std::size_t cells = std::size_t{sizes_.ratio_v} * sizes_.ratio_a;
    const std::size_t turns = std::size_t{sizes_.ratio_r} * sizes_.ratio_t;
    Work work(progress, static_cast<double>((sizes_.isotropic() + sizes_.mean()) * many_.u1.size() +
                                            sizes_.ratio() * few_.u1.size()));
    float* const isotropic = values_.data();
    float* const ratio = isotropic + sizes_.isotropic();
    float* const mean = ratio + sizes_.ratio();
    work.each(sizes_.isotropic(), static_cast<double>(many_.u1.size()), [&](std::size_t k) {
      isotropic[k] = albedo(node_at(at(k % sizes_.v, sizes_.v), at(k / sizes_.v, sizes_.a), 0, 0, range_), many_);
    });
    // All turns of a cell together: they share what they are divided by.
    work.each(cells, static_cast<double>(turns * few_.u1.size()), [&](std::size_t k) {
      const double v = at(k % sizes_.ratio_v, sizes_.ratio_v), a = at(k / sizes_.ratio_v, sizes_.ratio_a);
      const float whole = albedo(node_at(v, a, 0, 0, range_), few_);
      for (std::size_t turn = 0; turn < turns; ++turn) {
        const std::size_t r = turn % sizes_.ratio_r, t = turn / sizes_.ratio_r;
        ratio[turn * cells + k] =
            r == 0 ? 1 : albedo(node_at(v, a, at(r, sizes_.ratio_r), at(t, sizes_.ratio_t), range_), few_) / whole;
      }
    });
    work.each(sizes_.mean(), static_cast<double>(many_.u1.size()), [&](std::size_t k) {
      mean[k] = mean_albedo(node_at(0.5, at(k % sizes_.a, sizes_.a), at(k / sizes_.a, sizes_.ratio_r), 0.5, range_));
    });
    return std::move(values_);
  }

 private:
  static double at(std::size_t k, std::uint32_t nodes) { return static_cast<double>(k) / (nodes - 1); }

  Batch with(const Node& node, const Points& points) const {
    Batch batch = batch_;
    batch.lanes = points.u1.size();
    batch.incident = {node.x, node.y, node.z};
    batch.alpha_x = node.alpha_x;
    batch.alpha_y = node.alpha_y;
    batch.u1 = points.u1;
    batch.u2 = points.u2;
    if (uses_u3(batch.model, batch.sampler)) batch.u3 = points.u3;
    return batch;
  }

  float albedo(const Node& node, const Points& points) const {
    thread_local std::vector<float> weights;
    weights.resize(points.u1.size());
    return mean_weight(with(node, points), weights);
  }
  static float mean_weight(Batch batch, std::span<float> weights) {
    batch.out.weight = weights;
    // Nothing of a node can be wrong where run() has checked one.
    if (!facetwise::run(Operation::sample_reflection, batch, {.threads = Threads::one}).ok()) std::abort();
    double sum = 0;
    for (const float weight : weights) sum += weight;
    // Few samples may all be occluded; nothing is divided by 0.
    return std::max(static_cast<float>(sum / static_cast<double>(weights.size())), 1e-6f);
  }

  float mean_albedo(const Node& node) const {
    thread_local std::vector<float> weights;
    weights.resize(disc_.points.u1.size());
    Batch batch = with(node, disc_.points);
    batch.incident = {disc_.x, disc_.y, disc_.z};
    return mean_weight(batch, weights);
  }

  AlbedoSizes sizes_;
  double range_;
  Points few_{0}, many_{0};
  Disc disc_{many_};
  std::vector<float> values_;
  Batch batch_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const AlbedoTable>> AlbedoTable::build(const Model& model, const Options& options) {
  if (auto status = check_sizes(options.sizes); !status.ok()) return status;
  if (options.samples < 2 || options.samples > 65536 || !std::has_single_bit(options.samples))
    return absl::InvalidArgumentError(
        absl::StrCat("samples: ", options.samples, " is not a power of two in [2, 65536]"));
  if (model.table != nullptr && !model.table->radial())
    return absl::InvalidArgumentError(
        "model.table: albedo needs normals that are distributed symmetrically: a radial table");
  auto values = AlbedoBuilder(model, options).run(options.progress);
  if (!values.ok()) return values.status();
  return AlbedoTableMaker::make(options.sizes, key_of(model), *std::move(values));
}

}  // namespace facetwise
