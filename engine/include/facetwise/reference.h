// SPDX-License-Identifier: Apache-2.0
// The truth: double precision, one lane at a time, written straight from the definitions. Slow. Shares no
// code with the kernels, so that agreement means something. Inputs are taken as they are: no policy for
// smooth or invalid lanes.
#pragma once

#include <functional>

#include "facetwise/model.h"

namespace facetwise::reference {

struct Vector {
  double x = 0, y = 0, z = 0;
};
struct Roughness {
  double x = 0, y = 0;
};

// GGX distribution of normals D(m), 1/sr; 0 for m_z <= 0. m of unit length.
double distribution(Roughness alpha, Vector m);
// Projected area sigma(i) = integral of D(m) max(i.m, 0) dm. Tokuyoshi 2021, section 1.
double projected_area(Roughness alpha, Vector i);
// Smith masking G1(i) = i_z / sigma(i); 0 for i_z <= 0.
double masking(Roughness alpha, Vector i);
// K(i) / sigma(i): share of the visible normals whose reflection is not occluded; 1 for i_z <= 0.
double share_unoccluded(Roughness alpha, Vector i);
// w = f cos(theta_o) / pdf_visible(o) with F = 1: how much of the outgoing light is not shadowed.
double shadowing_weight(Shadowing shadowing, Roughness alpha, Vector i, Vector o);
// k of `bounded`, whose stretched o_z starts at -k c (Eto & Tokuyoshi 2023, Eq. 5 and 6); 1 for i_z <= 0.
double bounded_k(Roughness alpha, Vector i);

// Density of normals m (samplers that draw normals) and of outgoing directions o, 1/sr.
double pdf_normal(Sampler sampler, Roughness alpha, Vector i, Vector m);
double pdf_reflection(Sampler sampler, Roughness alpha, Vector i, Vector o);
// f cos(theta_o) with F = 1.
double evaluate_reflection(const Model& model, Roughness alpha, Vector i, Vector o);

struct Sample {
  Vector o, m;
  double incident_dot_normal = 0, pdf = 0, weight = 0;
  LaneStatus status = LaneStatus::accepted;
};
// The samples that model.h's mappings give for u1, u2, u3. sample_normal leaves o and weight 0.
Sample sample_normal(Sampler sampler, Roughness alpha, Vector i, double u1, double u2, double u3);
Sample sample_reflection(const Model& model, Sampler sampler, Roughness alpha, Vector i, double u1, double u2,
                         double u3);

// ---- Every model ----
//
// What a lane of any model is: the model and its columns. Lengths of the functions below: directions and normals
// are of unit length; densities are in 1/sr, of normals for pdf_normal and of outgoing directions for the others;
// values are f |cos(theta_o)|, F included. Formulas and sources: docs/models.md. NaN where a sampler has no
// density of that model (see each function).
struct Surface {
  Model model{};
  Roughness alpha{};
  // Mean of the normals' slopes, and the correlation that makes their covariance proportional to
  // [[ax^2, rho ax ay], [rho ax ay, ay^2]]. Smith masking only.
  double mean_slope_x = 0, mean_slope_y = 0, slope_correlation = 0;
  double eta = 1.5;           // eta_o / eta_i
  double f0 = 0.04, f90 = 1;  // Schlick

  // Distribution::table: density of standard slopes s (of integral 1), where
  //   x = mean_x + ax s_x,   y = mean_y + ay (rho s_x + sqrt(1 - rho^2) s_y).
  std::function<double(double, double)> table_density{};
  // Its projected area integral of density(s) max(w_z - w_x s_x - w_y s_y, 0) ds for w of any length, where it is
  // known; else each use is a two-dimensional quadrature.
  std::function<double(Vector)> table_area{};
};

// Density of slopes P22(x, y) at x = -m_x / m_z, y = -m_y / m_z.
double slope_density(const Surface& surface, double x, double y);
// D(m) = P22 / m_z^4; 0 for m_z <= 0.
double distribution(const Surface& surface, Vector m);
// sigma(i) = integral of D(m) max(i.m, 0) dm, for any length of i. Phong and tables: by quadrature.
double projected_area(const Surface& surface, Vector i);
// Smith G1 = z' / sigma, z' = i_z - mean.i; 0 for z' <= 0.
double masking(const Surface& surface, Vector i);
// V-cavity G(i, m) = min(2 m_z |i_z| / i.m, 1); 0 for i.m <= 0.
double vcavity_masking(Vector i, Vector m);
// V-cavity: share H(i) of rays that hit, 1 for i_z >= 0. Phong: by quadrature; tables: a difference of areas.
// Model::normalisation plays no part.
double hit_probability(const Surface& surface, Vector i);
// What densities of visible normals are divided by. Smith: p(m) = D (i.m)+ / normaliser, sigma(i) or, biased, that
// with |z'|. V-cavity: p(m) = D min(2 m_z |i_z|, i.m)+ / normaliser, H |i_z| or, biased, |i_z|.
double normaliser(const Surface& surface, Vector i);
// Share of the visible normals whose reflection is not occluded; 1 for i_z <= 0. Closed for ggx with Smith, else
// by quadrature to about 1e-8.
double share_unoccluded(const Surface& surface, Vector i);

// F(cos), cos = i.m in [0, 1]: 1, Schlick's, or Fresnel's for unpolarised light (total reflection: 1).
double fresnel(const Surface& surface, double cos);

// `heitz` and `cap` are `visible`. For i_z <= 0 so are `bounded` (ggx with Smith, centred and uncorrelated) and
// `exact` (ggx, beckmann without a mean slope, ggx, beckmann and student_t with V-cavity); else these two are 0
// for normals whose reflection is occluded. Of phong behind `visible` has a density of its own; a table's is not known
// here. Model::retro plays no part: turn i for it.
double pdf_normal(const Surface& surface, Sampler sampler, Vector i, Vector m);
// Retro: of the turned i, (-i_x, -i_y, i_z).
double pdf_reflection(const Surface& surface, Sampler sampler, Vector i, Vector o);
double evaluate_reflection(const Surface& surface, Vector i, Vector o);

// Transmission through the microfacet m ~ -(i + eta o), given that it transmits; 0 for o_z >= 0. Samplers that draw
// normals. Retro plays no part.
double pdf_transmission(const Surface& surface, Sampler sampler, Vector i, Vector o);
double evaluate_transmission(const Surface& surface, Vector i, Vector o);
// Probability of reflecting (else of transmitting) at m: in proportion to F v_R and (1 - F) v_T, where v_R, v_T
// say whether the direction is on its side. 0 where neither is. An interface that does not transmit reflects.
double branch_probability(const Surface& surface, Vector i, Vector m, bool reflection);
// Either side of o: o_z > 0 reflection, o_z < 0 transmission. The density has branch_probability as a factor.
double pdf_scattering(const Surface& surface, Sampler sampler, Vector i, Vector o);
double evaluate_scattering(const Surface& surface, Vector i, Vector o);

// Integral of evaluate_reflection over o, to about 1e-7. Slow, slower where projected_area is a quadrature.
double albedo(const Surface& surface, Vector i);

}  // namespace facetwise::reference
