// SPDX-License-Identifier: Apache-2.0
#include "rejection.h"

#include <cmath>
#include <numbers>
#include <span>

#include "facetwise/reference.h"

namespace facetwise::bench {
namespace {

constexpr double kPi = std::numbers::pi;

reference::Vector incident(double theta) { return {std::sin(theta), 0, std::cos(theta)}; }

// One configuration's count. `stream` sets its random numbers apart from the others'.
absl::Status count(const std::string& experiment, const Model& model, Sampler sampler, double alpha_x, double alpha_y,
                   double theta, std::size_t samples, std::uint32_t stream, Target target,
                   std::vector<RejectionResult>& results) {
  const reference::Vector i = incident(theta);
  Batch batch;
  batch.model = model;
  batch.sampler = sampler;
  batch.lanes = samples;
  batch.incident = {static_cast<float>(i.x), static_cast<float>(i.y), static_cast<float>(i.z)};
  batch.alpha_x = static_cast<float>(alpha_x);
  batch.alpha_y = static_cast<float>(alpha_y);
  batch.generator = Generator{.seed = 20150607, .dimension = stream, .id = {}, .first_id = 0};
  Execution execution;
  execution.target = target;
  const auto statistics = sample_reflection(batch, execution);
  if (!statistics.ok()) return statistics.status();
  RejectionResult result;
  result.experiment = experiment;
  result.distribution = std::string(name(model.distribution));
  result.masking = std::string(name(model.masking));
  result.sampler = std::string(name(sampler));
  result.theta_degrees = theta * 180 / kPi;
  result.alpha_x = alpha_x;
  result.alpha_y = alpha_y;
  result.samples = samples;
  result.rejected = statistics->occluded;
  result.predicted_share = predicted_share(model, sampler, alpha_x, alpha_y, theta);
  results.push_back(result);
  return absl::OkStatus();
}

struct Configuration {
  double theta_degrees, alpha_x, alpha_y;
};
constexpr Configuration kTable[] = {{0, 1, 1}, {30, .5, .5}, {60, .3, 1}, {60, .02, .9}, {89, .5, .5}};
constexpr double kSweepTheta[] = {0, 15, 30, 45, 60, 75, 85, 89, 100, 135};
constexpr std::pair<double, double> kSweepAlpha[] = {{.01, .01}, {.1, .1}, {.3, .3}, {.5, .5},
                                                     {1, 1},     {2, 2},   {.8, .1}, {.3, 1}};

// The post gives neither roughness nor the number of samples; these two fit its counts at 1.5 rad (371 by
// normals' density, 61 by visible normals) best.
struct Post {
  double alpha;
  std::size_t samples;
};
constexpr Post kPost[] = {{.046, 1900}, {1.26, 730}};
constexpr double kPostTheta[] = {1.5, kPi / 4};

// The other models, each at the table's configurations and one behind the surface.
struct Composition {
  Distribution distribution;
  Masking masking;
};
constexpr Composition kModels[] = {{Distribution::beckmann, Masking::smith},
                                   {Distribution::ggx, Masking::vcavity},
                                   {Distribution::beckmann, Masking::vcavity}};
constexpr Configuration kBehind = {100, .5, .5};
// GGX's `visible` is `cap`.
constexpr Sampler kGgxSamplers[] = {Sampler::ndf, Sampler::heitz, Sampler::cap, Sampler::bounded, Sampler::exact};
constexpr Sampler kModelSamplers[] = {Sampler::ndf, Sampler::visible, Sampler::exact};

// Share of the normals of density D(m) m_z whose stretched slope is longer than t.
double share_beyond(Distribution distribution, double t) {
  return distribution == Distribution::beckmann ? std::exp(-t * t) : 1 / (1 + t * t);
}

}  // namespace

double ndf_share_occluded(double alpha_x, double alpha_y, double theta, Distribution distribution) {
  const reference::Vector i = incident(theta);
  // Enough for a peak as narrow as an anisotropy of 100 makes it.
  constexpr int kPoints = 1 << 16;
  double accepted = 0;
  for (int k = 0; k < kPoints; ++k) {
    const double phi = 2 * kPi * (k + .5) / kPoints;
    const double ex = alpha_x * std::cos(phi), ey = alpha_y * std::sin(phi);
    // M = (t ex, t ey, 1): i.M = b t + i_z.
    const double b = ex * i.x + ey * i.y;
    if (i.z > 0) {
      // o_z > 0 where 2 (i.M) > i_z M.M, that is a t^2 - 2 b t - i_z < 0 with a = i_z (ex^2 + ey^2). The
      // larger root, without cancellation; i.M > 0 follows.
      const double a = i.z * (ex * ex + ey * ey);
      const double root = std::sqrt(b * b + a * i.z);
      const double t = b > 0 ? (b + root) / a : i.z / (root - b);
      accepted += 1 - share_beyond(distribution, t);
    } else if (b > 0) {
      // i.M > 0 where t > -i_z / b; o_z = 2 (i.M) m_z - i_z > 0 follows.
      const double t = -i.z / b;
      accepted += share_beyond(distribution, t);
    }
  }
  return 1 - accepted / kPoints;
}

double predicted_share(Sampler sampler, double alpha_x, double alpha_y, double theta) {
  if (sampler == Sampler::ndf) return ndf_share_occluded(alpha_x, alpha_y, theta);
  const reference::Vector i = incident(theta);
  if (sampler == Sampler::exact || i.z <= 0) return 0;
  const reference::Roughness alpha{alpha_x, alpha_y};
  const double sigma = reference::projected_area(alpha, i);
  const double k = reference::share_unoccluded(alpha, i) * sigma;
  if (sampler != Sampler::bounded) return 1 - k / sigma;
  // sigma = (nu + i_z) / 2
  const double sigma_b = sigma - (1 - reference::bounded_k(alpha, i)) * i.z / 2;
  return std::max(0.0, 1 - k / sigma_b);  // at normal incidence 1 - 1, to rounding
}

double predicted_share(const Model& model, Sampler sampler, double alpha_x, double alpha_y, double theta) {
  if (model.distribution == Distribution::ggx && model.masking == Masking::smith)
    return predicted_share(sampler, alpha_x, alpha_y, theta);
  if (sampler == Sampler::ndf) return ndf_share_occluded(alpha_x, alpha_y, theta, model.distribution);
  if (sampler == Sampler::exact) return 0;
  return 1 - reference::share_unoccluded({.model = model, .alpha = {alpha_x, alpha_y}}, incident(theta));
}

absl::Status count_rejections(std::size_t samples, Target target, const std::function<bool()>& step,
                              std::vector<RejectionResult>& results) {
  std::uint32_t stream = 0;
  const auto each = [&](const char* experiment, const Model& model, std::span<const Sampler> samplers, double alpha_x,
                        double alpha_y, double theta, std::size_t lanes) -> absl::Status {
    for (const Sampler sampler : samplers)
      if (const auto status =
              count(experiment, model, sampler, alpha_x, alpha_y, theta, lanes, stream++, target, results);
          !status.ok())
        return status;
    return step() ? absl::OkStatus() : absl::CancelledError("the benchmarks were stopped");
  };
  const auto all_at = [&](const char* experiment, double alpha_x, double alpha_y, double theta, std::size_t lanes) {
    return each(experiment, {}, kGgxSamplers, alpha_x, alpha_y, theta, lanes);
  };
  for (const auto& [theta, alpha_x, alpha_y] : kTable)
    if (auto status = all_at("table", alpha_x, alpha_y, theta * kPi / 180, samples); !status.ok()) return status;
  for (const auto& [alpha_x, alpha_y] : kSweepAlpha)
    for (const double theta : kSweepTheta)
      if (auto status = all_at("sweep", alpha_x, alpha_y, theta * kPi / 180, samples); !status.ok()) return status;
  for (const auto& [alpha, lanes] : kPost)
    for (const double theta : kPostTheta)
      if (auto status = all_at("post-2015", alpha, alpha, theta, lanes); !status.ok()) return status;
  std::vector<Configuration> configurations(std::begin(kTable), std::end(kTable));
  configurations.push_back(kBehind);
  for (const auto& [distribution, masking] : kModels)
    for (const auto& [theta, alpha_x, alpha_y] : configurations)
      if (auto status = each("models", {.distribution = distribution, .masking = masking}, kModelSamplers, alpha_x,
                             alpha_y, theta * kPi / 180, samples);
          !status.ok())
        return status;
  return absl::OkStatus();
}

}  // namespace facetwise::bench
