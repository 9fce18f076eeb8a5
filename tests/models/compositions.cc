// SPDX-License-Identifier: Apache-2.0
#include "models/compositions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <ostream>

#include "support/counts.h"

namespace facetwise::test {
namespace {

using reference::Vector;

constexpr float kBelowOne = 1 - 0x1p-24f;

bool reads_interface(Operation operation) {
  return operation != Operation::sample_normal && operation != Operation::pdf_reflection &&
         operation != Operation::masking;
}
bool queries(Operation operation) { return !samples(operation) && operation != Operation::masking; }

float largest_alpha(Distribution distribution) {
  return distribution == Distribution::phong ? kLargestPhongAlpha : kLargestAlpha;
}

}  // namespace

std::string name(const Family& family) {
  return std::string(facetwise::name(family.distribution)) + "_" + std::string(facetwise::name(family.masking)) +
         (family.affine ? "_affine" : "");
}
void PrintTo(const Family& family, std::ostream* to) { *to << name(family); }

std::string describe(const Composition& c) {
  std::string text;
  for (const std::string_view part : {name(c.model.distribution), name(c.model.masking), name(c.sampler),
                                      name(c.model.shadowing), name(c.model.normalisation), name(c.model.interface)})
    text.append(part).append(" ");
  if (c.model.transport == Transport::importance) text += "importance ";
  if (c.model.retro) text += "retro ";
  if (c.affine) text += "affine ";
  return text;
}

std::string describe(const Point& p) {
  char buffer[500];
  std::snprintf(buffer, sizeof buffer,
                "i (%.9g, %.9g, %.9g) alpha %.9g %.9g mean (%.9g, %.9g) correlation %.9g eta %.9g f0 %.9g f90 %.9g "
                "o (%.9g, %.9g, %.9g) u %.9g %.9g %.9g",
                p.ix, p.iy, p.iz, p.alpha_x, p.alpha_y, p.mean_x, p.mean_y, p.correlation, p.eta, p.f0, p.f90, p.ox,
                p.oy, p.oz, p.u1, p.u2, p.u3);
  return buffer;
}

std::vector<Sampler> samplers_of(const Family& family, Operation operation) {
  std::vector<Sampler> fit;
  for (const Sampler sampler : all_samplers()) {
    Composition composition = plain(family, sampler);
    if (scatters(operation)) composition.model.interface = Interface::dielectric;
    const Point point[1];
    Result result[1];
    if (check(operation, make_batch(operation, composition, point, result)).ok()) fit.push_back(sampler);
  }
  return fit;
}

const std::vector<Family>& families() {
  static const std::vector<Family> all = [] {
    std::vector<Family> found;
    for (const Model& model : all_models())
      for (const bool affine : {false, true})
        if (!affine || takes_slopes(model)) found.push_back({model.distribution, model.masking, affine});
    return found;
  }();
  return all;
}

bool weighs_behind(const Model& model, const Point& point) {
  return model.masking == Masking::vcavity && model.distribution == Distribution::phong && point.iz < 0;
}

Composition plain(const Family& family, Sampler sampler) {
  Composition composition;
  composition.model.distribution = family.distribution;
  composition.model.masking = family.masking;
  composition.sampler = sampler;
  composition.affine = family.affine;
  return composition;
}

std::vector<Composition> compositions(const Family& family, Operation operation) {
  std::vector<Composition> all;
  for (const Sampler sampler : samplers_of(family, operation))
    for (const Shadowing shadowing : {Shadowing::correlated, Shadowing::uncorrelated})
      for (const Normalisation normalisation : {Normalisation::unbiased, Normalisation::biased})
        for (const Interface interface : {Interface::conductor, Interface::schlick, Interface::dielectric})
          for (const bool retro : {false, true}) {
            if (scatters(operation) && interface != Interface::dielectric) continue;
            if (!reads_interface(operation) && interface != Interface::conductor) continue;
            // An emulator tries each choice, not each combination: its bits are compared with those of all anyway.
            if (kQuick && ((shadowing == Shadowing::uncorrelated) != (normalisation == Normalisation::biased) ||
                           (interface == Interface::schlick) != retro))
              continue;
            Composition c = plain(family, sampler);
            c.model.shadowing = shadowing;
            c.model.normalisation = normalisation;
            c.model.interface = interface;
            c.model.retro = retro;
            all.push_back(c);
          }
  return all;
}

Batch make_batch(Operation operation, const Composition& c, std::span<const Point> points, std::span<Result> results) {
  const auto in = [&](float Point::*member) {
    return Column<float>(&(points.data()->*member), points.size(), sizeof(Point));
  };
  const auto out = [&](float Result::*member) {
    return OutputColumn<float>(&(results.data()->*member), results.size(), sizeof(Result));
  };
  Batch b;
  b.model = c.model;
  b.sampler = c.sampler;
  b.lanes = results.size();
  b.incident = {in(&Point::ix), in(&Point::iy), in(&Point::iz)};
  b.alpha_x = in(&Point::alpha_x);
  b.alpha_y = in(&Point::alpha_y);
  if (c.affine) {
    // Retro takes no mean slope.
    if (!c.model.retro) {
      b.mean_slope_x = in(&Point::mean_x);
      b.mean_slope_y = in(&Point::mean_y);
    }
    b.slope_correlation = in(&Point::correlation);
  }
  const bool fresnel = reads_interface(operation);
  if (fresnel && c.model.interface == Interface::dielectric) b.eta = in(&Point::eta);
  if (fresnel && c.model.interface == Interface::schlick) {
    b.f0 = in(&Point::f0);
    b.f90 = in(&Point::f90);
  }
  if (queries(operation)) b.outgoing = {in(&Point::ox), in(&Point::oy), in(&Point::oz)};
  if (samples(operation)) {
    b.u1 = in(&Point::u1);
    b.u2 = in(&Point::u2);
    if (uses_u3(c.model, c.sampler) || operation == Operation::sample_scattering) b.u3 = in(&Point::u3);
    b.out.normal = {out(&Result::mx), out(&Result::my), out(&Result::mz)};
    b.out.incident_dot_normal = out(&Result::im);
    b.out.pdf = out(&Result::pdf);
    if (operation != Operation::sample_normal) {
      b.out.outgoing = {out(&Result::ox), out(&Result::oy), out(&Result::oz)};
      b.out.weight = out(&Result::weight);
    }
    if (scatters(operation)) b.out.eta_scale = out(&Result::eta_scale);
  } else if (operation == Operation::masking) {
    if (c.model.masking == Masking::smith) b.out.masking = out(&Result::masking);
    b.out.projected_area = out(&Result::area);
  } else {
    b.out.pdf = out(&Result::pdf);
    if (operation != Operation::pdf_reflection) b.out.value = out(&Result::value);
  }
  if (operation == Operation::sample_scattering || operation == Operation::evaluate_scattering)
    b.out.branch_probability = out(&Result::branch);
  if (operation == Operation::sample_scattering)
    b.out.event = OutputColumn<std::uint8_t>(&results.data()->event, results.size(), sizeof(Result));
  b.out.status = OutputColumn<std::uint8_t>(&results.data()->status, results.size(), sizeof(Result));
  return b;
}

std::vector<Result> run_points(Operation operation, const Composition& composition, std::span<const Point> points,
                               const Execution& execution) {
  std::vector<Result> results(points.size());
  const auto statistics = run(operation, make_batch(operation, composition, points, results), execution);
  EXPECT_TRUE(statistics.ok()) << describe(composition) << statistics.status();
  return results;
}

reference::Surface surface_of(const Composition& composition, const Point& p) {
  reference::Surface s;
  s.model = composition.model;
  s.alpha = {p.alpha_x, p.alpha_y};
  if (composition.affine) {
    if (!composition.model.retro) {
      s.mean_slope_x = p.mean_x;
      s.mean_slope_y = p.mean_y;
    }
    s.slope_correlation = p.correlation;
  }
  s.eta = p.eta;
  s.f0 = p.f0;
  s.f90 = p.f90;
  return s;
}

Vector incident(const Point& p) { return {p.ix, p.iy, p.iz}; }
Vector outgoing(const Point& p) { return {p.ox, p.oy, p.oz}; }
void set_incident(Point& p, Vector i) {
  p.ix = static_cast<float>(i.x);
  p.iy = static_cast<float>(i.y);
  p.iz = static_cast<float>(i.z);
}
void set_outgoing(Point& p, Vector o) {
  p.ox = static_cast<float>(o.x);
  p.oy = static_cast<float>(o.y);
  p.oz = static_cast<float>(o.z);
}
Vector direction(double theta, double azimuth) {
  const double t = theta * std::numbers::pi / 180, a = azimuth * std::numbers::pi / 180;
  return {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)};
}
bool accepted(const Result& result) { return result.status == static_cast<std::uint8_t>(LaneStatus::accepted); }

double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector unit(Vector a) {
  const double length = std::sqrt(dot(a, a));
  return {a.x / length, a.y / length, a.z / length};
}
Vector turned(Vector i) { return {-i.x, -i.y, i.z}; }
Vector reflection(Vector i, Vector m) {
  const double twice = 2 * dot(i, m);
  return {twice * m.x - i.x, twice * m.y - i.y, twice * m.z - i.z};
}
bool transmission(double eta, Vector i, Vector m, Vector& o) {
  const double im = dot(i, m), g2 = eta * eta - 1 + im * im;
  if (g2 <= 0) return false;
  const double t = im - std::sqrt(g2);
  o = {(t * m.x - i.x) / eta, (t * m.y - i.y) / eta, (t * m.z - i.z) / eta};
  return true;
}

Vector normal_of(const reference::Surface& s, double r, double phi, double* area) {
  const double x = r * std::cos(phi), y = r * std::sin(phi), rho = s.slope_correlation,
               rest = std::sqrt((1 - rho) * (1 + rho));
  const double sx = s.mean_slope_x + s.alpha.x * x, sy = s.mean_slope_y + s.alpha.y * (rho * x + rest * y);
  const double length = std::sqrt(1 + sx * sx + sy * sy);
  if (area) *area = s.alpha.x * s.alpha.y * rest / (length * length * length);
  return {-sx / length, -sy / length, 1 / length};
}

std::vector<Point> hard_points(const Composition& c, std::size_t count, std::uint64_t seed, bool extreme) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  // Correlated slopes have a principal roughness of up to sqrt(2) alpha.
  const double largest = largest_alpha(c.model.distribution) * (c.affine ? 0.7 : 1);
  std::vector<Point> points(count);
  for (std::size_t n = 0; n < count; ++n) {
    Point& p = points[n];
    double z = 0;
    switch (n % 8) {
      case 0: z = 1; break;
      case 1: z = std::pow(10, -8 * uniform(random)); break;
      case 2: z = -std::pow(10, -8 * uniform(random)); break;
      case 3: z = -1 + 1e-3 * uniform(random); break;
      case 4: z = -uniform(random); break;
      default: z = uniform(random); break;
    }
    const double azimuth = 2 * std::numbers::pi * uniform(random), r = std::sqrt((1 - z) * (1 + z));
    set_incident(p, unit({r * std::cos(azimuth), r * std::sin(azimuth), z}));
    const auto alpha = [&] {
      constexpr double kAlphas[] = {1e-3, 0.01, 0.1, 0.5, 1, 2, 10};
      const std::uint64_t bits = random();
      const double any = bits % 2 ? kAlphas[(bits >> 8) % 7] : std::pow(10, -3 + 4 * uniform(random));
      return static_cast<float>(std::min(any, largest));
    };
    p.alpha_x = alpha();
    p.alpha_y = random() % 2 ? p.alpha_x : alpha();
    if (c.affine) {
      if (!c.model.retro && random() % 4 != 0) {
        const double scale = extreme ? std::pow(10, -2 + 4 * uniform(random)) : uniform(random);
        const double at = 2 * std::numbers::pi * uniform(random);
        p.mean_x = static_cast<float>(scale * std::cos(at));
        p.mean_y = static_cast<float>(scale * std::sin(at));
      }
      if (random() % 4 != 0) p.correlation = static_cast<float>((extreme ? 0.999 : 0.9) * (2 * uniform(random) - 1));
      if (extreme && random() % 8 == 0) p.correlation = std::copysign(0.999f, p.correlation);
      if (extreme && random() % 8 == 0) p.mean_x = std::copysign(100.0f, p.mean_x), p.mean_y = 0;
    }
    p.eta = static_cast<float>(std::pow(10, -0.7 + 1.4 * uniform(random)));
    if (extreme && random() % 8 == 0) p.eta = random() % 2 ? 0.01f : 100.0f;
    p.f0 = static_cast<float>(uniform(random));
    p.f90 = static_cast<float>(uniform(random));
    const auto u = [&] {
      const std::uint64_t kind = random() % 16;
      return kind == 0 ? 0.0f : kind == 1 ? kBelowOne : static_cast<float>(random() >> 40) * 0x1p-24f;
    };
    p.u1 = u();
    p.u2 = u();
    p.u3 = u();
    const Vector i = c.model.retro ? turned(incident(p)) : incident(p);
    Vector o;
    switch (random() % 4) {
      case 0:
        z = random() % 2 ? uniform(random) : std::pow(10, -6 * uniform(random));
        o = {std::sqrt((1 - z) * (1 + z)), 0, z};
        break;
      case 1: o = {-i.x, -i.y, std::abs(i.z)}; break;
      default: {
        // A normal of the distribution, roughly, that i sees if one of some does.
        const reference::Surface s = surface_of(c, p);
        for (int attempt = 0; attempt < 16; ++attempt) {
          const double v = uniform(random);
          const Vector m = normal_of(s, std::sqrt(v / (1 - v)), 2 * std::numbers::pi * uniform(random));
          o = reflection(i, m);
          if (dot(i, m) > 0 && o.z > 0) break;
        }
        o.z = std::max(std::abs(o.z), 1e-6);
      }
    }
    set_outgoing(p, unit(o));
  }
  return points;
}

std::vector<Point> scattering_points(const Composition& c, std::size_t count, std::uint64_t seed) {
  std::vector<Point> points = hard_points(c, count, seed);
  std::mt19937_64 random(~seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::size_t n = 0; n < count; ++n) {
    Point& p = points[n];
    if (n % 3 == 0) continue;
    const reference::Surface s = surface_of(c, p);
    for (int attempt = 0; attempt < 16; ++attempt) {
      const double v = uniform(random);
      const Vector m = normal_of(s, std::sqrt(v / (1 - v)), 2 * std::numbers::pi * uniform(random));
      Vector o;
      if (dot(incident(p), m) <= 0 || !transmission(p.eta, incident(p), m, o) || o.z >= 0) continue;
      set_outgoing(p, unit(o));
      break;
    }
  }
  return points;
}

std::vector<Point> calm_points(const Composition& c) {
  struct Calm {
    double theta, azimuth;
    float alpha_x, alpha_y, mean_x, mean_y, correlation;
  };
  constexpr Calm kCalm[] = {
      {0, 0, 0.5f, 0.5f, 0, 0, 0},           {40, 25, 0.6f, 0.25f, 0.3f, -0.2f, 0.5f},
      {70, 200, 0.3f, 0.9f, -0.4f, 0.3f, 0}, {85, 100, 0.4f, 0.4f, 0, 0.2f, -0.7f},
      {97, 20, 0.5f, 0.3f, 0.2f, 0, 0.4f},   {130, 300, 0.9f, 0.7f, 0, 0, -0.5f},
  };
  std::vector<Point> points;
  for (const Calm& calm : kCalm) {
    // An emulator takes one in front, one near the horizon and one behind.
    if (kQuick && (&calm - kCalm) % 2 == 0) continue;
    Point p;
    set_incident(p, direction(calm.theta, calm.azimuth));
    p.alpha_x = calm.alpha_x;
    p.alpha_y = calm.alpha_y;
    if (c.affine) {
      if (!c.model.retro) p.mean_x = calm.mean_x, p.mean_y = calm.mean_y;
      p.correlation = calm.correlation;
    }
    points.push_back(p);
  }
  return points;
}

bool student_t_straight_up(const Composition& c, const Point& p) {
  return c.model.distribution == Distribution::student_t && c.model.masking == Masking::smith &&
         c.sampler == Sampler::visible && std::hypot(p.alpha_x * p.ix, p.alpha_y * p.iy) < 1e-3f * std::abs(p.iz);
}

HalfVector half_vector(const Composition& c, const Point& point, Vector i, Vector m) {
  const bool forms_it = c.model.distribution == Distribution::ggx && c.model.masking == Masking::smith &&
                        (c.sampler == Sampler::cap || c.sampler == Sampler::visible || c.sampler == Sampler::bounded ||
                         (c.sampler == Sampler::exact && i.z <= 0));
  if (!forms_it) return {};
  const reference::Surface s = surface_of(c, point);
  const double rho = s.slope_correlation, rest = std::sqrt((1 - rho) * (1 + rho));
  const double x = (-m.x / m.z - s.mean_slope_x) / s.alpha.x;
  const double y = ((-m.y / m.z - s.mean_slope_y) / s.alpha.y - rho * x) / rest;
  const double length = std::sqrt(1 + x * x + y * y) * m.z;
  const double nu = std::hypot(s.alpha.x * i.x + rho * s.alpha.y * i.y, rest * s.alpha.y * i.y,
                               i.z - s.mean_slope_x * i.x - s.mean_slope_y * i.y);
  const double half = 2 * dot(i, m) / (nu * length);
  return {(1 + std::max(s.alpha.x, s.alpha.y) + std::hypot(s.mean_slope_x, s.mean_slope_y)) * length / half,
          4 / (half * half)};
}

std::vector<Point> with_random(const Point& point, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point> points(count, point);
  for (Point& p : points) {
    p.u1 = static_cast<float>(random() >> 40) * 0x1p-24f;
    p.u2 = static_cast<float>(random() >> 40) * 0x1p-24f;
    p.u3 = static_cast<float>(random() >> 40) * 0x1p-24f;
  }
  return points;
}

std::vector<Result> draw(Operation operation, const Composition& c, const Point& point, std::size_t count,
                         std::uint64_t seed, Statistics* statistics) {
  std::vector<Result> results(count);
  Batch batch = make_batch(operation, c, {&point, 1}, results);
  batch.u1 = batch.u2 = batch.u3 = {};
  batch.generator = Generator{.seed = seed};
  const auto ran = run(operation, batch, {.threads = Threads::one});
  EXPECT_TRUE(ran.ok()) << describe(c) << ran.status();
  if (statistics && ran.ok()) *statistics = *ran;
  return results;
}

namespace {

Grid answer(Grid grid, Operation operation, const Composition& c, const Point& point) {
  const int side = grid.side;
  const reference::Surface s = surface_of(c, point);
  const bool reflects = operation != Operation::evaluate_transmission;
  const bool scatters = operation == Operation::evaluate_scattering || !reflects;
  // Of the microfacets that reflect: i turned for retro.
  const Vector i = incident(point), from = c.model.retro ? turned(i) : i;
  struct Place {
    int event, cell;
    double area;
  };
  std::vector<Point> points;
  std::vector<Place> places;
  const auto add = [&](int event, int cell, Vector o, double area) {
    if (!(area > 0)) return;
    points.push_back(point);
    set_outgoing(points.back(), o);
    places.push_back({event, cell, area});
  };
  std::minstd_rand random(side);
  const auto jitter = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  for (int a = 0; a < side; ++a) {
    for (int b = 0; b < side; ++b) {
      const double t = grid.t(a + jitter());
      double area = 0;
      const Vector m = normal_of(s, std::tan(t), 2 * std::numbers::pi * (b + jitter()) / side, &area);
      area *= grid.slopes(t);
      if (const double im = dot(from, m); im > 0 && reflects) {
        const Vector o = reflection(from, m);
        if (o.z > 0) add(0, a * side + b, o, area * 4 * im);
      }
      if (const double im = dot(i, m); im > 0 && scatters) {
        Vector o;
        if (!transmission(s.eta, i, m, o) || o.z >= 0) continue;
        const double om = -dot(o, m), sum = im - s.eta * om;
        add(1, a * side + b, o, area * sum * sum / (s.eta * s.eta * om));
      }
    }
  }
  for (int event = 0; event < 2; ++event) {
    grid.pdf[event].resize(static_cast<std::size_t>(side) * side);
    grid.value[event].resize(static_cast<std::size_t>(side) * side);
  }
  const std::vector<Result> results = run_points(operation, c, points);
  for (std::size_t n = 0; n < results.size(); ++n) {
    grid.pdf[places[n].event][places[n].cell] = places[n].area * results[n].pdf;
    grid.value[places[n].event][places[n].cell] = places[n].area * results[n].value;
  }
  return grid;
}

}  // namespace

Grid make_grid(Operation operation, const Composition& c, const Point& point, int side) {
  // The rows that answer, from a coarse grid; from behind they may be few.
  const Grid coarse = answer({.side = 96, .pdf = {}, .value = {}}, operation, c, point);
  const double enough = 1e-7 * (coarse.total_pdf() + coarse.total_value());
  int first = coarse.side, last = -1;
  for (int row = 0; row < coarse.side; ++row) {
    double sum = 0;
    for (int n = row * coarse.side; n < (row + 1) * coarse.side; ++n)
      sum += coarse.pdf[0][n] + coarse.pdf[1][n] + coarse.value[0][n] + coarse.value[1][n];
    if (sum <= enough) continue;
    first = std::min(first, row);
    last = row;
  }
  Grid grid{.side = side, .pdf = {}, .value = {}};
  if (last >= 0) {
    grid.low = coarse.t(std::max(first - 1, 0));
    grid.high = coarse.t(std::min(last + 2, coarse.side));
  }
  return answer(grid, operation, c, point);
}

double Grid::slopes(double t) const {
  return std::tan(t) / (std::cos(t) * std::cos(t)) * (high - low) * 2 * std::numbers::pi / side / side;
}

namespace {
double sum(const std::vector<double> (&of)[2]) {
  double total = 0;
  for (const auto& all : of)
    for (const double one : all) total += one;
  return total;
}
}  // namespace
double Grid::total_pdf() const { return sum(pdf); }
double Grid::total_value() const { return sum(value); }

int cell_of(const Grid& grid, const reference::Surface& s, Vector m) {
  const double rho = s.slope_correlation, rest = std::sqrt((1 - rho) * (1 + rho));
  const double x = (-m.x / m.z - s.mean_slope_x) / s.alpha.x;
  const double y = ((-m.y / m.z - s.mean_slope_y) / s.alpha.y - rho * x) / rest;
  double phi = std::atan2(y, x) / (2 * std::numbers::pi);
  if (phi < 0) phi += 1;
  const double t = (std::atan(std::hypot(x, y)) - grid.low) / (grid.high - grid.low);
  const auto part = [&](double at) { return std::clamp(static_cast<int>(at * grid.side), 0, grid.side - 1); };
  return part(t) * grid.side + part(phi);
}

Integral integrate(Operation operation, const Composition& c, const Point& point, int side) {
  const Grid fine = make_grid(operation, c, point, side), coarse = make_grid(operation, c, point, side / 2);
  Integral integral{fine.total_pdf(), fine.total_value(), 0};
  integral.error =
      std::max(std::abs(integral.pdf - coarse.total_pdf()), std::abs(integral.value - coarse.total_value()));
  return integral;
}

}  // namespace facetwise::test
