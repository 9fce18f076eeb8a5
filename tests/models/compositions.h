// SPDX-License-Identifier: Apache-2.0
// Every composition of a model with a sampler, called lane by lane: what the tests of this folder loop over.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "facetwise/engine.h"
#include "facetwise/reference.h"

namespace facetwise::test {

// A distribution with a masking, with or without the columns of mean slope and correlation. Tests are named
// after it.
struct Family {
  Distribution distribution = Distribution::ggx;
  Masking masking = Masking::smith;
  bool affine = false;
};
std::string name(const Family& family);  // letters, digits and _
void PrintTo(const Family& family, std::ostream* to);

// A family's model with all that it can vary.
struct Composition {
  Model model;
  Sampler sampler = Sampler::visible;
  bool affine = false;
};
std::string describe(const Composition& composition);

// The families that have a kernel. Tables have their own area.
const std::vector<Family>& families();
// The samplers that an operation takes with a family.
std::vector<Sampler> samplers_of(const Family& family, Operation operation);
// Every shadowing, normalisation, interface and retro of a family (retro: see Points), each with every
// sampler.
std::vector<Composition> compositions(const Family& family, Operation operation);
// The family's conductor, unbiased.
Composition plain(const Family& family, Sampler sampler);

// The inputs of a lane.
struct Point {
  float ix = 0, iy = 0, iz = 1;
  float alpha_x = 0.5f, alpha_y = 0.5f;
  float mean_x = 0, mean_y = 0, correlation = 0;
  float eta = 1.5f, f0 = 0.04f, f90 = 1;
  float ox = 0, oy = 0, oz = 1;
  float u1 = 0.5f, u2 = 0.5f, u3 = 0.5f;
};
inline constexpr int kPointFloats = sizeof(Point) / sizeof(float);
std::string describe(const Point& point);

// Whether the normals that `visible` draws there are not visible normals, but weighted: phong with V-cavity, behind.
bool weighs_behind(const Model& model, const Point& point);

// The outputs of a lane; those that an operation does not have stay 0.
struct Result {
  float ox = 0, oy = 0, oz = 0, mx = 0, my = 0, mz = 0;
  float im = 0, pdf = 0, weight = 0, value = 0, masking = 0, area = 0, branch = 0, eta_scale = 0;
  std::uint8_t event = 0, status = 0, unused[2] = {};
};

// The batch of a call: the columns that it reads, all of its outputs. Points are as many as results, or one.
Batch make_batch(Operation operation, const Composition& composition, std::span<const Point> points,
                 std::span<Result> results);
// Runs it; a failure of the test where the call is refused.
std::vector<Result> run_points(Operation operation, const Composition& composition, std::span<const Point> points,
                               const Execution& execution = {.threads = Threads::one});

// What the reference calls this lane: the composition with the point's floats.
reference::Surface surface_of(const Composition& composition, const Point& point);
reference::Vector incident(const Point& point);
reference::Vector outgoing(const Point& point);
void set_incident(Point& point, reference::Vector i);
void set_outgoing(Point& point, reference::Vector o);
// Of unit length; degrees from n and about it.
reference::Vector direction(double theta, double azimuth);
bool accepted(const Result& result);

double dot(reference::Vector a, reference::Vector b);
reference::Vector unit(reference::Vector a);
reference::Vector turned(reference::Vector i);  // (-i_x, -i_y, i_z)
// The reflection of i by m; its transmission, false for total reflection. eta = eta_o / eta_i.
reference::Vector reflection(reference::Vector i, reference::Vector m);
bool transmission(double eta, reference::Vector i, reference::Vector m, reference::Vector& o);
// The normal, of unit length, whose standard slopes are (r cos phi, r sin phi); its area per area of standard
// slopes.
reference::Vector normal_of(const reference::Surface& surface, double r, double phi, double* area = nullptr);

// Ordinary lanes of a family that look for trouble: front, behind, grazing, straight up and nearly straight
// down; alpha from 1e-3 to the distribution's largest, half of them isotropic; o anywhere, a reflection by a
// visible normal, the mirror direction, and grazing; u also at 0 and at the largest below 1. Mean slopes and correlations are
// moderate, or with `extreme` up to a mean slope of 100 and a correlation of 0.999. Mean slopes are 0 for a
// model with retro.
std::vector<Point> hard_points(const Composition& composition, std::size_t count, std::uint64_t seed,
                               bool extreme = false);
// The same for dielectrics: two thirds of the o are transmissions, where there are any.
std::vector<Point> scattering_points(const Composition& composition, std::size_t count, std::uint64_t seed);
// A handful of well-conditioned points for integrals: front, behind, anisotropic; with mean slopes where the
// family has them.
std::vector<Point> calm_points(const Composition& composition);
// Visible normals of Student-t with Smith masking next to straight up, where i.m is known to be wrong:
// StraightUp tests that.
bool student_t_straight_up(const Composition& composition, const Point& point);
// What is lost where the half vector i_hat + o_hat of standard directions is short, in samplers of ggx that
// form it: its rounding turns m, and i.m, a product of it with i, loses the square.
struct HalfVector {
  double turn = 0;  // units
  double im = 0;    // units, relative
};
HalfVector half_vector(const Composition& composition, const Point& point, reference::Vector i, reference::Vector m);

// Copies of a point with random u.
std::vector<Point> with_random(const Point& point, std::size_t count, std::uint64_t seed);

// Samples at one point from the generator.
std::vector<Result> draw(Operation operation, const Composition& composition, const Point& point, std::size_t count,
                         std::uint64_t seed, Statistics* statistics = nullptr);

// A grid of side^2 standard slopes: t = atan(r) in [0, pi/2] and the azimuth, both in equal parts, t of the
// part of [0, pi/2] that answers. What an operation (evaluate_reflection, evaluate_transmission or
// evaluate_scattering) answers for what a microfacet somewhere in each cell does to i, times the cell's part
// of the sphere of o. Not in the middle: edges of a density may run along the grid.
struct Grid {
  int side = 0;
  double low = 0, high = 1.57079632679489662;  // of t
  std::vector<double> pdf[2], value[2];        // by Event
  double t(double row) const { return low + (high - low) * row / side; }
  // The area of standard slopes of a cell, r dr dphi at t.
  double slopes(double t) const;
  double total_pdf() const;
  double total_value() const;
};
Grid make_grid(Operation operation, const Composition& composition, const Point& point, int side);
// The cell of a normal.
int cell_of(const Grid& grid, const reference::Surface& surface, reference::Vector m);

struct Integral {
  double pdf = 0, value = 0;
  double error = 0;  // between this grid and one of half the resolution, the larger of the two
};
Integral integrate(Operation operation, const Composition& composition, const Point& point, int side);

}  // namespace facetwise::test
