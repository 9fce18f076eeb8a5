// SPDX-License-Identifier: Apache-2.0
#include "support/configurations.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "support/counts.h"

namespace facetwise::test {
namespace {

std::vector<Configuration> make() {
  std::vector<Configuration> all;
  // Isotropic.
  for (double theta : {0.0, 30.0, 60.0, 80.0, 89.9})
    for (double alpha : {1e-3, 0.03, 0.5, 1.0, 4.0}) all.push_back({theta, 0, alpha, alpha});
  for (double theta : {90.5, 100.0, 135.0, 170.0})
    for (double alpha : {0.01, 0.3, 1.0, 4.0}) all.push_back({theta, 20, alpha, alpha});
  // Anisotropic, to 20:1, rotated.
  const double roughness[][2] = {{1e-3, 0.02}, {0.02, 0.4}, {0.05, 1}, {1, 0.05}, {0.8, 0.1}, {4, 0.2}, {1.5, 4}};
  const double directions[][2] = {{45, 37}, {75, 90}, {89.9, 215}, {90.5, 300}};
  for (const auto& r : roughness)
    for (const auto& d : directions) all.push_back({d[0], d[1], r[0], r[1]});
  all.push_back({0, 0, 0.05, 1});
  all.push_back({0, 0, 4, 0.2});
  all.push_back({20, 160, 2, 0.1});
  all.push_back({60, 0, 0.3, 1});
  all.push_back({89.9, 0, 4, 4e-1});
  all.push_back({170, 75, 1, 0.05});
  all.push_back({130, 250, 0.1, 2});
  if (!kQuick) return all;
  std::vector<Configuration> few;
  for (std::size_t n = 3; n < all.size(); n += all.size() / 8) few.push_back(all[n]);
  return few;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  std::string out;
  for (const char* c = text; *c != 0; ++c) out += *c == '.' ? 'p' : *c == '-' ? 'm' : *c;
  return out;
}

}  // namespace

reference::Vector incident(const Configuration& c) {
  const double theta = c.theta * std::numbers::pi / 180, azimuth = c.azimuth * std::numbers::pi / 180;
  const double sin = c.theta == 0 ? 0 : std::sin(theta);
  return {static_cast<float>(sin * std::cos(azimuth)), static_cast<float>(sin * std::sin(azimuth)),
          static_cast<float>(std::cos(theta))};
}

reference::Roughness roughness(const Configuration& c) {
  return {static_cast<float>(c.alpha_x), static_cast<float>(c.alpha_y)};
}

std::string name(const Configuration& c) {
  return "theta_" + number(c.theta) + "_azimuth_" + number(c.azimuth) + "_alpha_" + number(c.alpha_x) + "_" +
         number(c.alpha_y);
}

const std::vector<Configuration>& configurations() {
  static const std::vector<Configuration> all = make();
  return all;
}

}  // namespace facetwise::test
