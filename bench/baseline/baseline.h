// SPDX-License-Identifier: Apache-2.0
// The benchmarks' baseline: plain scalar float code with std:: maths, such as an expert would write in a
// renderer today, one path at a time. Not a kernel, and shares no code with the kernels. No policy for
// smooth or invalid lanes.
//
// Everything is inline, so that a loop with a fixed sampler that does not use the weight does not pay for
// it, as in a renderer. Files that are compiled for other instruction sets define FACETWISE_BASELINE_BUILD, so that
// their functions have names of their own.
#pragma once

#include "facetwise/model.h"

#ifndef FACETWISE_BASELINE_BUILD
#define FACETWISE_BASELINE_BUILD plain
#endif

namespace facetwise::baseline {
inline namespace FACETWISE_BASELINE_BUILD {

struct Vector {
  float x = 0, y = 0, z = 0;
};

struct Sample {
  Vector o, m;
  float incident_dot_normal = 0, pdf = 0, weight = 0;
  bool accepted = false;
};

// Each takes the incident direction, roughness and uniform numbers as model.h says.
inline Sample sample_normal(Sampler sampler, Vector i, float alpha_x, float alpha_y, float u1, float u2);
inline Sample sample_reflection(Sampler sampler, Shadowing shadowing, Vector i, float alpha_x, float alpha_y, float u1,
                                float u2, float u3);
inline float pdf_reflection(Sampler sampler, Vector i, Vector o, float alpha_x, float alpha_y);
inline float evaluate_reflection(Shadowing shadowing, Vector i, Vector o, float alpha_x, float alpha_y);
inline float masking(Vector i, float alpha_x, float alpha_y);

// Of any of these models (has_baseline()): GGX with Smith masking as above; Beckmann and Student-t with Smith by `ndf` and
// `visible` (slope inversion by Newton's method: Heitz & d'Eon 2014, Jakob 2014), Beckmann by `exact` too; V-cavity with
// these three and Phong, only for i_z > 0, by `ndf` and `visible` (flipping: Heitz & d'Eon 2014), and but for Phong by
// `exact`. `exact` is facetwise's own (docs/models.md), written as a renderer would: std::erf, Newton's method.
struct Model {
  Distribution distribution = Distribution::ggx;
  Masking masking = Masking::smith;
};
constexpr bool has_baseline(Model model, Sampler sampler);
inline Sample sample_normal(Model model, Sampler sampler, Vector i, float alpha_x, float alpha_y, float u1, float u2,
                            float u3);
inline Sample sample_reflection(Model model, Sampler sampler, Shadowing shadowing, Vector i, float alpha_x,
                                float alpha_y, float u1, float u2, float u3);
inline float pdf_reflection(Model model, Sampler sampler, Vector i, Vector o, float alpha_x, float alpha_y);
inline float evaluate_reflection(Model model, Shadowing shadowing, Vector i, Vector o, float alpha_x, float alpha_y);
inline float masking(Model model, Vector i, float alpha_x, float alpha_y);  // Smith

}  // namespace FACETWISE_BASELINE_BUILD
}  // namespace facetwise::baseline

#include "bench/baseline/ggx.h"     // IWYU pragma: export
#include "bench/baseline/models.h"  // IWYU pragma: export
