// SPDX-License-Identifier: Apache-2.0
// Every lane by ports/facetwise.hlsl: columns as in compare.h. The work group's y says by which sampler.
#include "ports/facetwise.hlsl"

[[vk::binding(0, 0)]] StructuredBuffer<float> columns;
[[vk::binding(1, 0)]] RWStructuredBuffer<float> answers;

[numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID, uint3 group : SV_GroupID) {
  uint count, stride;
  columns.GetDimensions(count, stride);
  count /= 11u;
  uint lane = thread.x, which = group.y;
  if (lane >= count) return;
  float v[11];
  for (uint k = 0u; k < 11u; ++k) v[k] = columns[k * count + lane];
  float3 i = float3(v[0], v[1], v[2]), o = float3(v[5], v[6], v[7]), u = float3(v[8], v[9], v[10]);
  float2 alpha = float2(v[3], v[4]);
  FwSample s;
  float asked;
  if (which == 0u) {
    s = fw_sample_cap(i, alpha, u.xy);
    asked = fw_pdf_cap(i, o, alpha);
  } else if (which == 1u) {
    s = fw_sample_bounded(i, alpha, u.xy);
    asked = fw_pdf_bounded(i, o, alpha);
  } else {
    s = fw_sample_exact(i, alpha, u);
    asked = fw_pdf_exact(i, o, alpha);
  }
  float a[8] = {s.o.x, s.o.y, s.o.z, s.pdf, s.weight, asked, fw_evaluate(i, o, alpha), fw_share_unoccluded(i, alpha)};
  for (uint c = 0u; c < 8u; ++c) answers[(which * 8u + c) * count + lane] = a[c];
}
