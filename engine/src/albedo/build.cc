// SPDX-License-Identifier: Apache-2.0
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

// eta of a coordinate, whose middle is 1: (eta - 1) / (eta + 1) is the square of what it is from there, over the largest.
float eta_at(double e) {
  const double from = 2 * e - 1, largest = (kLargestEta - 1.0) / (kLargestEta + 1.0);
  const double r = std::copysign(from * from, from) * largest;
  // At 1 itself light goes straight on; beside it, it is masked on both sides.
  const double eta = std::abs(r) < 1e-6 ? 1.000002 : (1 + r) / (1 - r);
  return std::clamp(static_cast<float>(eta), kSmallestEta, kLargestEta);
}

// Fresnel's equations without polarisation.
double fresnel(double c, double eta) {
  const double g2 = c * c + (eta - 1) * (eta + 1);
  if (g2 <= 0) return 1;
  const double g = std::sqrt(g2), s = (c - g) / (c + g), p = (eta * eta * c - g) / (eta * eta * c + g);
  return (s * s + p * p) / 2;
}

// Runs the samples of nodes.
class AlbedoBuilder {
 public:
  AlbedoBuilder(const Model& model, const AlbedoTable::Options& options)
      : sizes_(model.interface == Interface::dielectric ? options.dielectric_sizes : options.sizes),
        range_(albedo_range(model.distribution)),
        values_(sizes_.total()) {
    // Compensation and retro-reflection play no part.
    batch_.model = {
        .distribution = model.distribution,
        .masking = model.masking,
        .shadowing = model.shadowing,
        .interface = model.interface == Interface::dielectric ? Interface::dielectric : Interface::conductor,
        .transport = Transport::importance,
        .table = model.table};
    if (sizes_.dielectric()) batch_.eta = 1.5f;
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
    return sizes_.dielectric() ? run_dielectric(progress) : run_conductor(progress);
  }

 private:
  std::vector<float> run_conductor(const std::function<void(double)>& progress) {
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

  // The event is forced, and Fresnel's reflectance is in the weights: their mean is smoother than that of chosen events.
  std::vector<float> run_dielectric(const std::function<void(double)>& progress) {
    const std::size_t plane = sizes_.isotropic(), nodes = plane * sizes_.e;
    const double cost = static_cast<double>(few_.u1.size());
    Work work(progress, static_cast<double>(4 * nodes) * cost + static_cast<double>(sizes_.mean() * many_.u1.size()));
    float* const both = values_.data();
    float* const share = both + nodes;
    float* const mean = share + nodes;
    work.each(nodes, 4 * cost, [&](std::size_t k) {
      const double first = at(k % sizes_.v, sizes_.v), a = at(k % plane / sizes_.v, sizes_.a);
      const float eta = eta_at(at(k / plane, sizes_.e));
      const auto shares = [&](const Node& node) {
        return std::pair(albedo(node, few_, eta), albedo(node, few_, eta, Operation::sample_transmission));
      };
      Node node = node_at(first, a, 0, 0, range_);
      const auto stretched = shares(node);
      both[k] = stretched.first + stretched.second;
      const double z = std::max(first * first, 1e-7);
      node.x = static_cast<float>(std::sqrt((1 - z) * (1 + z)));
      node.y = 0;
      node.z = static_cast<float>(z);
      const auto [reflected, transmitted] = shares(node);
      share[k] = static_cast<float>(reflected / (static_cast<double>(reflected) + transmitted) - fresnel(z, eta));
    });
    work.each(sizes_.mean(), static_cast<double>(many_.u1.size()), [&](std::size_t k) {
      mean[k] =
          mean_albedo(node_at(0.5, at(k % sizes_.a, sizes_.a), 0, 0.5, range_), eta_at(at(k / sizes_.a, sizes_.e)));
    });
    return std::move(values_);
  }

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

  float albedo(const Node& node, const Points& points, float eta = 0,
               Operation operation = Operation::sample_reflection) const {
    thread_local std::vector<float> weights;
    weights.resize(points.u1.size());
    Batch batch = with(node, points);
    if (eta != 0) batch.eta = eta;
    if (operation == Operation::sample_transmission) {
      batch.sampler = default_sampler(operation, batch);
      batch.u3 = uses_u3(batch.model, batch.sampler) ? Column<float>(points.u3) : Column<float>();
    }
    return mean_weight(operation, batch, weights);
  }
  static float mean_weight(Operation operation, Batch batch, std::span<float> weights) {
    batch.out.weight = weights;
    // Nothing of a node can be wrong where run() has checked one.
    if (!facetwise::run(operation, batch, {.threads = Threads::one}).ok()) std::abort();
    double sum = 0;
    for (const float weight : weights) sum += weight;
    // Few samples may all be occluded; nothing is divided by 0.
    return std::max(static_cast<float>(sum / static_cast<double>(weights.size())), 1e-6f);
  }

  float mean_albedo(const Node& node, float eta = 0) const {
    thread_local std::vector<float> weights;
    weights.resize(disc_.points.u1.size());
    Batch batch = with(node, disc_.points);
    batch.incident = {disc_.x, disc_.y, disc_.z};
    if (eta != 0) batch.eta = eta;
    return mean_weight(Operation::sample_reflection, batch, weights);
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
  const bool dielectric = model.interface == Interface::dielectric;
  const AlbedoSizes& sizes = dielectric ? options.dielectric_sizes : options.sizes;
  if (sizes.dielectric() != dielectric)
    return absl::InvalidArgumentError("sizes: those of a dielectric have `e`, others not");
  if (auto status = check_sizes(sizes); !status.ok()) return status;
  if (options.samples < 2 || options.samples > 65536 || !std::has_single_bit(options.samples))
    return absl::InvalidArgumentError(
        absl::StrCat("samples: ", options.samples, " is not a power of two in [2, 65536]"));
  if (model.table != nullptr && !model.table->radial())
    return absl::InvalidArgumentError(
        "model.table: albedo needs normals that are distributed symmetrically: a radial table");
  auto values = AlbedoBuilder(model, options).run(options.progress);
  if (!values.ok()) return values.status();
  return AlbedoTableMaker::make(sizes, key_of(model), *std::move(values));
}

}  // namespace facetwise
