// The truth: double precision, one lane at a time, written straight from the definitions. Slow. Shares no
// code with the kernels, so that agreement means something. Inputs are taken as they are: no policy for
// smooth or invalid lanes.
#pragma once

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

}  // namespace facetwise::reference
