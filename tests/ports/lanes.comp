#version 450
// SPDX-License-Identifier: Apache-2.0
// Every lane by ports/facetwise.glsl: columns as in compare.h. The work group's y says by which sampler.
#extension GL_GOOGLE_include_directive : require
#include "ports/facetwise.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer In { float values[]; } columns;
layout(set = 0, binding = 1) writeonly buffer Out { float values[]; } answers;

void main() {
  uint count = columns.values.length() / 11u, lane = gl_GlobalInvocationID.x, sampler_ = gl_WorkGroupID.y;
  if (lane >= count) return;
  float v[11];
  for (uint k = 0u; k < 11u; ++k) v[k] = columns.values[k * count + lane];
  vec3 i = vec3(v[0], v[1], v[2]), o = vec3(v[5], v[6], v[7]), u = vec3(v[8], v[9], v[10]);
  vec2 alpha = vec2(v[3], v[4]);
  FwSample s;
  float asked;
  if (sampler_ == 0u) {
    s = fw_sample_cap(i, alpha, u.xy);
    asked = fw_pdf_cap(i, o, alpha);
  } else if (sampler_ == 1u) {
    s = fw_sample_bounded(i, alpha, u.xy);
    asked = fw_pdf_bounded(i, o, alpha);
  } else {
    s = fw_sample_exact(i, alpha, u);
    asked = fw_pdf_exact(i, o, alpha);
  }
  float a[8] = float[8](s.o.x, s.o.y, s.o.z, s.pdf, s.weight, asked, fw_evaluate(i, o, alpha), fw_share_unoccluded(i, alpha));
  for (uint k = 0u; k < 8u; ++k) answers.values[(sampler_ * 8u + k) * count + lane] = a[k];
}
