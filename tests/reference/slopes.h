// SPDX-License-Identifier: Apache-2.0
// Quadrature over standard slopes, which knows only the definitions: slopes, normals, where they face i and
// where their reflections are not occluded. Shares nothing with the reference's own quadrature.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "facetwise/gauss.h"
#include "facetwise/reference.h"

namespace facetwise::test::slopes {

using reference::Surface;
using reference::Vector;

inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline Vector direction(double theta_degrees, double phi_degrees) {
  const double theta = theta_degrees * std::numbers::pi / 180, phi = phi_degrees * std::numbers::pi / 180;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

inline const GaussRule& rule(int count) {
  static std::vector<GaussRule> rules(65);
  GaussRule& r = rules[count];
  if (r.point.empty()) r = gauss_rule(count);
  return r;
}

template <class F>
double panel(const F& f, double a, double b, int count) {
  const GaussRule& r = rule(count);
  double sum = 0;
  for (int n = 0; n < count; ++n) sum += r.weight[n] * f(a + (b - a) * r.point[n]);
  return sum * (b - a);
}

// From `a` towards `b` (possibly below a, possibly infinite), in panels that double, the first `scale` wide.
template <class F>
double doubling(const F& f, double a, double b, double scale, int count = 20) {
  const double sign = b < a ? -1 : 1, length = std::abs(b - a);
  double sum = 0, done = 0;
  for (int n = 0; n < 48 && done < length; ++n) {
    const double next = std::min(length, n == 0 ? scale : 2 * done);
    sum += panel([&](double t) { return f(a + sign * t); }, done, next, count);
    done = next;
  }
  return sum;
}

// Standard slopes to the normal M with M_z = 1.
inline Vector normal(const Surface& s, double x, double y) {
  const double rho = s.slope_correlation;
  return {-(s.mean_slope_x + s.alpha.x * x), -(s.mean_slope_y + s.alpha.y * (rho * x + std::sqrt(1 - rho * rho) * y)),
          1};
}
inline double determinant(const Surface& s) {
  return s.alpha.x * s.alpha.y * std::sqrt(1 - s.slope_correlation * s.slope_correlation);
}
inline Vector unit(Vector a) {
  const double scale = 1 / std::sqrt(dot(a, a));
  return {scale * a.x, scale * a.y, scale * a.z};
}
// i.M = z - x s_x - y s_y.
inline Vector stretched(const Surface& s, Vector i) {
  const double rho = s.slope_correlation;
  return {s.alpha.x * i.x + rho * s.alpha.y * i.y, std::sqrt(1 - rho * rho) * s.alpha.y * i.y,
          i.z - s.mean_slope_x * i.x - s.mean_slope_y * i.y};
}

// How fast the density falls beyond r, at the fastest.
inline double falls_over(const Surface& s, double r) {
  const bool power = s.model.distribution == Distribution::ggx || s.model.distribution == Distribution::student_t;
  return power ? 1 + std::abs(r) : 1 / (1 + 2 * std::abs(r));
}

// Integral over normals of f(m, i.m) dm: along rays from the standard slope 0, whose pieces end where i.m =
// 0, where 2 m_z |i_z| = i.m, and where the reflection of the normal or of its opposite is at the horizon;
// for values, also where V-cavity's shadowing sets in.
template <class F>
double over_normals(const Surface& s, Vector i, const F& f, bool of_values = false) {
  const Vector w = stretched(s, i), centre = normal(s, 0, 0);
  const double jacobian = determinant(s), quarter = std::numbers::pi / 2, phi = std::atan2(w.y, w.x);

  // i_z > 0: c - 2 b r - a r^2 > 0 is o_z |M|^2 > 0.
  struct Horizon {
    double a, b, c;
    double discriminant() const { return b * b + a * c; }
  };
  const auto step = [&](double angle) {
    const Vector m = normal(s, std::cos(angle), std::sin(angle));
    return Vector{m.x - centre.x, m.y - centre.y, w.x * std::cos(angle) + w.y * std::sin(angle)};
  };
  const auto horizon = [&](Vector d) {
    return Horizon{i.z * (d.x * d.x + d.y * d.y), d.z + i.z * (d.x * centre.x + d.y * centre.y),
                   2 * w.z - i.z * dot(centre, centre)};
  };

  const auto along = [&](double angle) {
    const Vector d = step(angle);
    std::vector<double> ends;
    const auto end = [&](double r) {
      if (r > 0 && std::isfinite(r)) ends.push_back(r);
    };
    end(w.z / d.z);
    end((w.z - 2 * std::abs(i.z)) / d.z);
    const Horizon h = horizon(d);
    if (i.z > 0 && h.discriminant() >= 0) {
      const double root = std::sqrt(h.discriminant());
      for (double b : {h.b, -h.b}) {
        end(b > 0 ? h.c / (b + root) : (root - b) / h.a);
        end(-(b + root) / h.a);
      }
    }
    if (of_values && s.model.masking == Masking::vcavity) {
      // 2 m_z o_z = i.m, and o_z = i_z.
      for (bool equal : {false, true}) {
        const auto kink = [&](double r) {
          const double x = centre.x + r * d.x, y = centre.y + r * d.y, l2 = 1 + x * x + y * y, im = w.z - r * d.z;
          return equal ? im - i.z * l2 : 4 * im - 2 * i.z * l2 - im * l2;
        };
        for (int n = 0; n < 64; ++n) {
          double low = n / (64.0 - n), high = n == 63 ? 1e6 : (n + 1) / (63.0 - n);
          const bool sign = kink(low) > 0;
          if (sign == (kink(high) > 0)) continue;
          for (int k = 0; k < 50; ++k) ((kink((low + high) / 2) > 0) == sign ? low : high) = (low + high) / 2;
          end(low);
        }
      }
    }
    std::sort(ends.begin(), ends.end());
    const auto at = [&](double r) {
      const Vector m = unit({centre.x + r * d.x, centre.y + r * d.y, 1});
      const double im = (w.z - r * d.z) * m.z;
      return im > 0 ? f(m, im) * m.z * m.z * m.z * jacobian * r : 0;
    };
    double sum = 0, from = 0;
    for (double to : ends) {
      const double half = (to - from) / 2;
      sum += doubling(at, from, from + half, std::min(half, falls_over(s, from)), 10);
      // Densities may grow like an inverse root towards an end.
      sum += doubling([&](double t) { return 2 * t * at(to - t * t); }, 0, std::sqrt(half),
                      std::sqrt(std::min(half, falls_over(s, to))) / 2, 10);
      from = to;
    }
    // Phong's decay differs with the azimuth.
    const bool phong = s.model.distribution == Distribution::phong;
    const double scale = phong ? 1 : falls_over(s, from);
    const int panels = phong ? 10 : 4;
    for (int n = 0; n < panels; ++n) {
      const auto mapped = [&](double v) { return at(from + scale * v / (1 - v)) * scale / ((1 - v) * (1 - v)); };
      sum += panel(mapped, static_cast<double>(n) / panels, (n + 1.0) / panels, 12);
    }
    return sum;
  };

  // Azimuths crowd at those of i and across it, at the axes of roughness, where rays touch the horizon, and
  // where it is farthest along i.
  std::vector<double> cuts;
  const auto cut = [&](double angle) { cuts.push_back(std::fmod(angle + 4 * quarter, 4 * quarter)); };
  for (int n = 0; n < 4; ++n) {
    cut(n * quarter);
    cut(phi + n * quarter);
  }
  if (i.z > 0) {
    const auto discriminant = [&](double angle) {
      const Horizon h = horizon(step(angle));
      return h.discriminant();
    };
    const int count = 1000;
    for (int n = 0; n < count; ++n) {
      double low = 4 * quarter * n / count, high = 4 * quarter * (n + 1) / count;
      const bool sign = discriminant(low) > 0;
      if (sign == (discriminant(high) > 0)) continue;
      for (int k = 0; k < 60; ++k) ((discriminant((low + high) / 2) > 0) == sign ? low : high) = (low + high) / 2;
      cut(low);
    }
    const Vector x = step(phi), y = step(phi + quarter);
    const double xy = x.x * y.x + x.y * y.y, yy = y.x * y.x + y.y * y.y;
    const double tilt = std::atan2(-xy, yy);
    cut(phi + tilt);
    cut(phi + tilt + 2 * quarter);
  }
  std::sort(cuts.begin(), cuts.end());
  cuts.push_back(cuts.front() + 4 * quarter);
  double sum = 0;
  for (std::size_t n = 0; n + 1 < cuts.size(); ++n) {
    const double middle = (cuts[n] + cuts[n + 1]) / 2, half = middle - cuts[n];
    if (half < 1e-12) continue;
    sum += doubling(along, cuts[n], middle, half / 256, 7) + doubling(along, cuts[n + 1], middle, half / 256, 7);
  }
  return sum;
}

inline std::string describe(const Surface& s, Vector i) {
  return std::string(name(s.model.distribution)) + " " + std::string(name(s.model.masking)) + " alpha " +
         std::to_string(s.alpha.x) + " " + std::to_string(s.alpha.y) + " mean " + std::to_string(s.mean_slope_x) + " " +
         std::to_string(s.mean_slope_y) + " rho " + std::to_string(s.slope_correlation) + " i " + std::to_string(i.x) +
         " " + std::to_string(i.y) + " " + std::to_string(i.z);
}

}  // namespace facetwise::test::slopes
