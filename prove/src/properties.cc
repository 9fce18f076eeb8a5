// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include "facetwise/chi_square.h"
#include "facetwise/gauss.h"
#include "facetwise/prove.h"

namespace facetwise::prove {
namespace {

using std::numbers::pi;

constexpr int kCells = kThetas * kPhis;
// What rounding in float may do to a quotient, and to how many of a thousand lanes it may do more.
constexpr double kClose = 1e-3, kFew = 1e-3;
// What an integral may be off beside its own error and the samples'.
constexpr double kSlack = 3e-4;

bool is_number(float value) { return std::isfinite(value) && value >= 0; }
double or_zero(float value) { return std::isfinite(value) ? static_cast<double>(value) : 0; }

std::string lane_text(const Lanes& lanes, std::size_t k) {
  return fmt::format(
      "i = ({:.9g}, {:.9g}, {:.9g}), alpha = ({:.9g}, {:.9g}), u = ({:.9g}, {:.9g}, {:.9g}), o = ({:.9g}, "
      "{:.9g}, {:.9g})",
      lanes.ix[k], lanes.iy[k], lanes.iz[k], lanes.alpha_x[k], lanes.alpha_y[k], lanes.u1[k], lanes.u2[k], lanes.u3[k],
      lanes.ox[k], lanes.oy[k], lanes.oz[k]);
}

// Which of two numbers that should be equal are not: a share of the lanes, and where it is worst.
class Agreement {
 public:
  explicit Agreement(const Lanes& lanes) : lanes_(lanes) {}
  void compare(std::size_t k, double a, double b) {
    ++compared_;
    const double larger = std::max(std::abs(a), std::abs(b));
    if (larger < 1e-12 && !std::isnan(b)) return;
    const bool finite = std::isfinite(a) && std::isfinite(b);
    const double error = finite ? std::abs(a - b) / larger : std::numeric_limits<double>::infinity();
    apart_ += error > kClose;
    if (!(error <= worst_)) worst_ = error, at_ = k, a_ = a, b_ = b;
  }
  Finding finding(Property property, const std::string& what) const {
    Finding f{.property = property};
    f.measured = compared_ == 0 ? 0 : static_cast<double>(apart_) / static_cast<double>(compared_);
    f.allowed = kFew;
    f.holds = f.measured <= f.allowed;
    f.what = fmt::format("{} differ in {:.4g} % of the lanes", what, 100 * f.measured);
    if (worst_ > kClose) f.where = fmt::format("{:.6g} and {:.6g} at {}", a_, b_, lane_text(lanes_, at_));
    return f;
  }

 private:
  const Lanes& lanes_;
  std::size_t compared_ = 0, apart_ = 0, at_ = 0;
  double worst_ = 0, a_ = 0, b_ = 0;
};

struct Integrals {
  std::vector<double> pdf = std::vector<double>(kCells), value = pdf;
};

class Examination {
 public:
  Examination(Bsdf& bsdf, const Options& options, const Configuration& configuration, int tests)
      : bsdf_(bsdf), options_(options), configuration_(configuration), tests_(tests) {
    const double theta = configuration.theta * pi / 180, phi = configuration.phi * pi / 180;
    i_[0] = static_cast<float>(std::sin(theta) * std::cos(phi));
    i_[1] = static_cast<float>(std::sin(theta) * std::sin(phi));
    i_[2] = static_cast<float>(std::cos(theta));
  }

  absl::StatusOr<Examined> run() {
    examined_.configuration = configuration_;
    if (auto status = integrate(); !status.ok()) return status;
    if (auto status = sample(); !status.ok()) return status;
    return std::move(examined_);
  }

 private:
  void fill(Lanes& lanes) const {
    std::fill(lanes.ix.begin(), lanes.ix.end(), i_[0]);
    std::fill(lanes.iy.begin(), lanes.iy.end(), i_[1]);
    std::fill(lanes.iz.begin(), lanes.iz.end(), i_[2]);
    std::fill(lanes.alpha_x.begin(), lanes.alpha_x.end(), configuration_.alpha_x);
    std::fill(lanes.alpha_y.begin(), lanes.alpha_y.end(), configuration_.alpha_y);
  }

  absl::StatusOr<Integrals> integrals(int points) const {
    const GaussRule rule = gauss_rule(points);
    const double dt = pi / kThetas, dp = 2 * pi / kPhis;
    const auto n = static_cast<std::size_t>(points);
    Lanes lanes(kCells * n * n);
    fill(lanes);
    std::vector<double> weights(kThetas * n);
    std::size_t lane = 0;
    for (int row = 0; row < kThetas; ++row)
      for (int column = 0; column < kPhis; ++column)
        for (std::size_t a = 0; a < n; ++a) {
          const double theta = (row + rule.point[a]) * dt;
          weights[static_cast<std::size_t>(row) * n + a] = std::sin(theta) * rule.weight[a] * dt * dp;
          for (std::size_t b = 0; b < n; ++b, ++lane) {
            const double phi = (column + rule.point[b]) * dp;
            lanes.ox[lane] = static_cast<float>(std::sin(theta) * std::cos(phi));
            lanes.oy[lane] = static_cast<float>(std::sin(theta) * std::sin(phi));
            lanes.oz[lane] = static_cast<float>(std::cos(theta));
          }
        }
    if (auto status = bsdf_.evaluate(lanes); !status.ok()) return status;
    Integrals result;
    lane = 0;
    for (std::size_t cell = 0; cell < kCells; ++cell)
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = 0; b < n; ++b, ++lane) {
          const double weight = weights[cell / kPhis * n + a] * rule.weight[b];
          result.pdf[cell] += weight * or_zero(lanes.pdf[lane]);
          result.value[cell] += weight * or_zero(lanes.value[lane]);
        }
    return result;
  }

  // Twice, so that the difference says how good the better one is.
  absl::Status integrate() {
    auto coarse = integrals(4);
    if (!coarse.ok()) return coarse.status();
    auto fine = integrals(6);
    if (!fine.ok()) return fine.status();
    fine_ = *std::move(fine);
    pdf_ = std::accumulate(fine_.pdf.begin(), fine_.pdf.end(), 0.0);
    value_ = std::accumulate(fine_.value.begin(), fine_.value.end(), 0.0);
    for (std::size_t k = 0; k < kCells; ++k) {
      const double error = std::abs(fine_.pdf[k] - coarse->pdf[k]);
      pdf_error_ += error;
      value_error_ += std::abs(fine_.value[k] - coarse->value[k]);
      if (fine_.pdf[k] > 0) bias_ += static_cast<double>(options_.samples) * error * error / fine_.pdf[k];
    }
    Finding f{.property = Property::energy, .measured = value_, .wanted = 1, .allowed = kSlack + value_error_};
    f.holds = f.measured <= f.wanted + f.allowed;
    f.what = fmt::format("albedo {:.5f}", value_);
    examined_.findings.push_back(f);
    return absl::OkStatus();
  }

  absl::Status sample() {
    Lanes lanes(options_.samples);
    fill(lanes);
    std::mt19937_64 random(options_.seed);
    for (auto* column : {&lanes.u1, &lanes.u2, &lanes.u3})
      for (float& u : *column) u = static_cast<float>(random() >> 40) * 0x1p-24f;
    if (auto status = bsdf_.sample(lanes); !status.ok()) return status;
    const std::vector<float> pdf = lanes.pdf, weight = lanes.weight;

    const auto n = static_cast<double>(options_.samples);
    examined_.counts.assign(kCells, 0);
    std::size_t drawn = 0, worst = 0;
    double longest = 0, sum = 0, squares = 0;
    std::size_t wrong = 0, wrong_at = 0;
    for (std::size_t k = 0; k < options_.samples; ++k) {
      if (!is_number(pdf[k]) || !is_number(weight[k])) {
        ++wrong, wrong_at = k;
        continue;
      }
      const double w = static_cast<double>(weight[k]);
      sum += w;
      squares += w * w;
      if (!(pdf[k] > 0)) continue;
      ++drawn;
      const double x = lanes.ox[k], y = lanes.oy[k], z = lanes.oz[k], length2 = x * x + y * y + z * z;
      if (!(std::abs(length2 - 1) <= longest)) longest = std::abs(length2 - 1), worst = k;
      if (!std::isfinite(length2) || length2 == 0) continue;
      ++examined_.counts[cell_of(x, y, z)];
    }
    numbers(lanes, wrong, wrong_at);
    Finding f{.property = Property::directions, .measured = longest, .allowed = kClose};
    f.holds = f.measured <= f.allowed;
    f.what = fmt::format("|o|^2 is off by {:.3g}", longest);
    if (!f.holds) f.where = lane_text(lanes, worst);
    examined_.findings.push_back(f);
    density(static_cast<double>(drawn) / n);
    distribution(drawn);

    f = {.property = Property::albedo, .measured = sum / n, .wanted = value_};
    const double deviation = std::sqrt(std::max(squares / n - f.measured * f.measured, 0.0) / n);
    f.allowed = 5 * deviation + value_error_ + kSlack;
    f.holds = std::abs(f.measured - value_) <= f.allowed;
    f.what = fmt::format("mean weight {:.5f} instead of {:.5f}, give or take {:.5f}", f.measured, value_, f.allowed);
    examined_.findings.push_back(f);
    return ask_again(lanes, pdf, weight);
  }

  void numbers(const Lanes& lanes, std::size_t wrong, std::size_t at) {
    Finding f{.property = Property::numbers, .holds = wrong == 0, .measured = static_cast<double>(wrong)};
    f.what = fmt::format("{} of {} samples have a pdf or a weight that is no number or negative", wrong, lanes.count());
    if (wrong > 0) f.where = lane_text(lanes, at);
    examined_.findings.push_back(f);
  }

  void density(double drawn) {
    Finding f{.property = Property::density, .measured = pdf_, .wanted = drawn};
    f.allowed = 5 * std::sqrt(drawn * (1 - drawn) / static_cast<double>(options_.samples)) + pdf_error_ + kSlack;
    f.holds = std::abs(pdf_ - drawn) <= f.allowed;
    f.what = fmt::format("the pdf's integral is {:.5f} instead of {:.5f}, give or take {:.5f}", pdf_, drawn, f.allowed);
    examined_.findings.push_back(f);
  }

  // Of the shape alone: how much there is of it is the density's matter.
  void distribution(std::size_t drawn) {
    examined_.expected = fine_.pdf;
    for (double& cell : examined_.expected) cell *= pdf_ > 0 ? static_cast<double>(drawn) / pdf_ : 0;
    const ChiSquare test = chi_square(examined_.counts, examined_.expected);
    // What the integrals' own errors may add must not be taken for the samples'.
    const double rest = std::max(test.statistic - 4 * bias_, 0.0);
    Finding f{.property = Property::distribution};
    f.measured = test.degrees > 0 ? upper_incomplete_gamma(test.degrees / 2.0, rest / 2) : test.p_value;
    f.allowed = sidak(options_.significance, tests_);
    f.holds = f.measured >= f.allowed;
    f.what =
        fmt::format("chi-square {:.6g} at {} degrees of freedom: probability {:.2g}", rest, test.degrees, f.measured);
    examined_.findings.push_back(f);
  }

  // The same directions, evaluated; and with i and o exchanged.
  absl::Status ask_again(Lanes& lanes, const std::vector<float>& pdf, const std::vector<float>& weight) {
    if (auto status = bsdf_.evaluate(lanes); !status.ok()) return status;
    Agreement pdfs(lanes), weights(lanes);
    for (std::size_t k = 0; k < options_.samples; ++k) {
      if (!(pdf[k] > 0)) continue;
      pdfs.compare(k, static_cast<double>(pdf[k]), static_cast<double>(lanes.pdf[k]));
      weights.compare(k, static_cast<double>(weight[k]),
                      static_cast<double>(lanes.value[k]) / static_cast<double>(lanes.pdf[k]));
    }
    examined_.findings.push_back(pdfs.finding(Property::pdf, "the pdfs of a sample and of its direction"));
    examined_.findings.push_back(weights.finding(Property::weight, "a sample's weight and its value / pdf"));

    // Lanes without a reflection, or with one too near to the horizon for its cosine, keep i.
    Lanes swapped = lanes;
    for (std::size_t k = 0; k < options_.samples; ++k) {
      if (!reciprocal(lanes, pdf, k)) continue;
      std::swap(swapped.ix[k], swapped.ox[k]);
      std::swap(swapped.iy[k], swapped.oy[k]);
      std::swap(swapped.iz[k], swapped.oz[k]);
    }
    if (auto status = bsdf_.evaluate(swapped); !status.ok()) return status;
    Agreement both(lanes);
    for (std::size_t k = 0; k < options_.samples; ++k)
      if (reciprocal(lanes, pdf, k))
        both.compare(k, static_cast<double>(lanes.value[k]) / static_cast<double>(lanes.oz[k]),
                     static_cast<double>(swapped.value[k]) / static_cast<double>(i_[2]));
    examined_.findings.push_back(both.finding(Property::reciprocity, "f(i, o) and f(o, i)"));
    return absl::OkStatus();
  }
  bool reciprocal(const Lanes& lanes, const std::vector<float>& pdf, std::size_t k) const {
    return pdf[k] > 0 && lanes.oz[k] > 0.01f && i_[2] > 0.01f;
  }

  static std::size_t cell_of(double x, double y, double z) {
    const double theta = std::atan2(std::hypot(x, y), z), phi = std::atan2(y, x);
    const int row = std::min(static_cast<int>(theta / pi * kThetas), kThetas - 1);
    const int column = std::min(static_cast<int>((phi < 0 ? phi + 2 * pi : phi) / (2 * pi) * kPhis), kPhis - 1);
    return static_cast<std::size_t>(row * kPhis + column);
  }

  Bsdf& bsdf_;
  const Options& options_;
  const Configuration configuration_;
  const int tests_;
  float i_[3];
  Integrals fine_;
  double pdf_ = 0, value_ = 0, pdf_error_ = 0, value_error_ = 0, bias_ = 0;
  Examined examined_;
};

struct Hostile {
  std::vector<float> i, alpha, o;  // i and o: three to a direction
};
// What a renderer meets.
const Hostile kHard{
    {0, 0, 1, 0.999999f, 0, 0.00141421f, 0.6f, 0.8f, 1e-4f, 1, 0, 1e-7f, 0.0001f, 0, 1},
    {1e-4f, 1e-3f, 0.03f, 0.5f, 1},
    {0, 0, 1, -0.6f, -0.8f, 1e-4f, -1, 0, 1e-7f, 0.6f, 0, 0.8f, 0, 0.6f, -0.8f, 0, 0, -1, -0.6f, 0, 0.8f}};
// What it should not.
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();
const Hostile kGarbage{
    {0, 0, 0, 0, 0, -1, 0.6f, 0, -0.8f, 1, 0, 0, kNan, 0, 1, 0, 0, kInfinite, 30, 40, 50, 0, 0, 1e-40f},
    {0, -1, 1e-20f, 1e20f, kNan, kInfinite, 0.5f},
    {0, 0, 0, kNan, kNan, kNan, 0, 0, kInfinite, 1e30f, 0, 1, 0, 0, 1}};

absl::StatusOr<Finding> hostile(Bsdf& bsdf, Property property, const Hostile& lanes_of) {
  constexpr float kEnds[] = {0, 0.5f, 1 - 0x1p-24f};
  const std::size_t directions = lanes_of.i.size() / 3, roughnesses = lanes_of.alpha.size();
  const std::size_t others = lanes_of.o.size() / 3;
  Lanes lanes(directions * roughnesses * roughnesses * 27);
  std::size_t k = 0;
  for (std::size_t i = 0; i < directions; ++i)
    for (const float alpha_x : lanes_of.alpha)
      for (const float alpha_y : lanes_of.alpha)
        for (int u = 0; u < 27; ++u, ++k) {
          lanes.ix[k] = lanes_of.i[3 * i], lanes.iy[k] = lanes_of.i[3 * i + 1], lanes.iz[k] = lanes_of.i[3 * i + 2];
          lanes.alpha_x[k] = alpha_x, lanes.alpha_y[k] = alpha_y;
          lanes.u1[k] = kEnds[u % 3], lanes.u2[k] = kEnds[u / 3 % 3], lanes.u3[k] = kEnds[u / 9];
        }
  Finding f{.property = property};
  std::size_t asked = 0, wrong = 0;
  const auto count = [&](const char* function, auto... columns) {
    for (std::size_t lane = 0; lane < lanes.count(); ++lane) {
      ++asked;
      if ((is_number((*columns)[lane]) && ...)) continue;
      if (wrong++ > 0) continue;
      f.where = function + std::string("() at ") + lane_text(lanes, lane);
    }
  };
  if (auto status = bsdf.sample(lanes); !status.ok()) return status;
  count("sample", &lanes.pdf, &lanes.weight);
  for (k = 0; k < lanes.count(); ++k) {
    const std::size_t o = k % others;
    lanes.ox[k] = lanes_of.o[3 * o], lanes.oy[k] = lanes_of.o[3 * o + 1], lanes.oz[k] = lanes_of.o[3 * o + 2];
  }
  if (auto status = bsdf.evaluate(lanes); !status.ok()) return status;
  count("evaluate", &lanes.pdf, &lanes.value);
  f.measured = static_cast<double>(wrong);
  f.holds = wrong == 0;
  f.what = fmt::format("{} of {} {} lanes give what is no number, infinite or negative", wrong, asked,
                       property == Property::garbage ? "garbage" : "hard");
  return f;
}

struct Described {
  std::string_view name, meaning;
};
constexpr Described kDescribed[] = {
    {"numbers", "every number is finite and none negative, at grazing and normal incidence and at the ends of u"},
    {"garbage", "the same where the inputs are no directions or roughness at all"},
    {"directions", "what is drawn has unit length"},
    {"density", "the pdf integrates to the share of samples that draw something"},
    {"distribution", "samples follow the pdf"},
    {"pdf", "a sample's pdf is that of its direction"},
    {"weight", "a sample's weight is value / pdf"},
    {"albedo", "the mean weight is the integral of the value"},
    {"energy", "no more light leaves than arrives"},
    {"reciprocity", "f(i, o) = f(o, i)"},
};

// How bad it is, among findings of one property.
double badness(const Finding& f) {
  if (f.property == Property::distribution) return -f.measured;
  if (f.property == Property::energy) return f.measured;
  return std::abs(f.measured - f.wanted) / std::max(f.allowed, 1e-12);
}

}  // namespace

std::string_view name(Property property) { return kDescribed[static_cast<int>(property)].name; }
std::string_view meaning(Property property) { return kDescribed[static_cast<int>(property)].meaning; }

std::span<const Property> all_properties() {
  static const auto all = [] {
    std::array<Property, std::size(kDescribed)> some{};
    for (std::size_t k = 0; k < some.size(); ++k) some[k] = static_cast<Property>(k);
    return some;
  }();
  return all;
}

std::string label(const Configuration& c) {
  return fmt::format("theta {}, alpha {:g}, {:g}", c.theta, c.alpha_x, c.alpha_y);
}

bool Proof::holds() const {
  const auto right = [](const Finding& f) { return f.holds; };
  return std::all_of(everywhere.begin(), everywhere.end(), right) &&
         std::all_of(examined.begin(), examined.end(),
                     [&](const Examined& one) { return std::all_of(one.findings.begin(), one.findings.end(), right); });
}

Proof::Summary Proof::summary(Property property) const {
  Summary s;
  const auto look = [&](const Finding& f, const Configuration* at) {
    if (f.property != property) return;
    ++s.tried;
    s.failed += !f.holds;
    const bool worse = s.worst == nullptr || (s.worst->holds && !f.holds) ||
                       (s.worst->holds == f.holds && badness(f) > badness(*s.worst));
    if (worse) s.worst = &f, s.at = at;
  };
  for (const Finding& f : everywhere) look(f, nullptr);
  for (const Examined& one : examined)
    for (const Finding& f : one.findings) look(f, &one.configuration);
  return s;
}

absl::StatusOr<Proof> prove(Bsdf& bsdf, const Options& options) {
  Proof proof{.bsdf = bsdf.name(), .samples = options.samples};
  const auto tests = static_cast<int>(options.configurations.size());
  for (const auto& [property, lanes] : {std::pair{Property::numbers, &kHard}, {Property::garbage, &kGarbage}}) {
    if (property == Property::garbage && !options.strict) continue;
    auto found = hostile(bsdf, property, *lanes);
    if (!found.ok()) return found.status();
    proof.everywhere.push_back(*std::move(found));
  }
  for (const Configuration& configuration : options.configurations) {
    auto examined = Examination(bsdf, options, configuration, tests).run();
    if (!examined.ok()) return examined.status();
    proof.examined.push_back(*std::move(examined));
    if (options.progress) options.progress(static_cast<double>(proof.examined.size()) / tests);
  }
  return proof;
}

}  // namespace facetwise::prove
