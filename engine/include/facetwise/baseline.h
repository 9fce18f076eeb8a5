// The benchmarks' baseline: plain scalar float code with std:: maths, such as an expert would write in a
// renderer today, one path at a time. Not a kernel, and shares no code with the kernels. No policy for
// smooth or invalid lanes.
#pragma once

#include "facetwise/model.h"

namespace facetwise::baseline {

struct Vector {
  float x = 0, y = 0, z = 0;
};

struct Sample {
  Vector o, m;
  float incident_dot_normal = 0, pdf = 0, weight = 0;
  bool accepted = false;
};

// Each takes the incident direction, roughness and uniform numbers as model.h says.
Sample sample_normal(Sampler sampler, Vector i, float alpha_x, float alpha_y, float u1, float u2);
Sample sample_reflection(Sampler sampler, Shadowing shadowing, Vector i, float alpha_x, float alpha_y, float u1,
                         float u2, float u3);
float pdf_reflection(Sampler sampler, Vector i, Vector o, float alpha_x, float alpha_y);
float evaluate_reflection(Shadowing shadowing, Vector i, Vector o, float alpha_x, float alpha_y);
float masking(Vector i, float alpha_x, float alpha_y);

}  // namespace facetwise::baseline
