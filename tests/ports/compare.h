// SPDX-License-Identifier: Apache-2.0
// A port against the library, on a million lanes that look for trouble.
#pragma once

#include <span>
#include <vector>

#include "facetwise/engine.h"

namespace facetwise::test {

inline constexpr std::size_t kPortLanes = 1'000'000;
inline constexpr Sampler kPortSamplers[] = {Sampler::cap, Sampler::bounded, Sampler::exact};

// What a port reads: columns of kPortLanes values each.
enum PortInput { in_ix, in_iy, in_iz, in_alpha_x, in_alpha_y, in_ox, in_oy, in_oz, in_u1, in_u2, in_u3, port_inputs };
const std::vector<std::vector<float>>& port_lanes();

// What it answers: a sample (its direction, pdf and weight); the pdf and the value of the o it was given; K / sigma.
enum PortOutput { out_ox, out_oy, out_oz, out_pdf, out_weight, out_asked, out_value, out_share, port_outputs };
using PortAnswer = std::vector<std::vector<float>>;

// Of a sample, half of the lanes agree to 2e-7 (o, weight) and 4e-7 (pdf, by ratio), 99.9 % to 1e-5, 4e-4 (weight) and 1e-3;
// of what is asked for, 99.9 % to 2e-5 by ratio; the same are accepted but for one in a thousand, at the horizon. Every number
// is finite, none negative; `exact` occludes no lane. Prints what it found.
void expect_the_librarys(Sampler sampler, const PortAnswer& port);

}  // namespace facetwise::test
