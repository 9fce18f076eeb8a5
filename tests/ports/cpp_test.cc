// SPDX-License-Identifier: Apache-2.0
// ports/facetwise.hpp against the library.
#include <gtest/gtest.h>

#include <string>

#include "compare.h"
#include "ports/facetwise.hpp"

namespace facetwise::test {
namespace {

using port::Vec3;

class CppPort : public testing::TestWithParam<Sampler> {};

// Differences are those of rounding, which steep and grazing lanes magnify; weights are compared as they are, since those of o at
// the horizon go to 0 with o_z.
TEST_P(CppPort, IsTheLibrarys) {
  const auto& in = port_lanes();
  PortAnswer answer(port_outputs, std::vector<float>(kPortLanes));
  for (std::size_t k = 0; k < kPortLanes; ++k) {
    const Vec3 i{in[in_ix][k], in[in_iy][k], in[in_iz][k]}, o{in[in_ox][k], in[in_oy][k], in[in_oz][k]};
    const float ax = in[in_alpha_x][k], ay = in[in_alpha_y][k], u1 = in[in_u1][k], u2 = in[in_u2][k], u3 = in[in_u3][k];
    const bool cap = GetParam() == Sampler::cap, bounded = GetParam() == Sampler::bounded;
    const port::Sample s = cap       ? port::sample_cap(i, ax, ay, u1, u2)
                           : bounded ? port::sample_bounded(i, ax, ay, u1, u2)
                                     : port::sample_exact(i, ax, ay, u1, u2, u3);
    const auto pdf = cap ? port::pdf_cap : bounded ? port::pdf_bounded : port::pdf_exact;
    const float values[] = {s.o.x,
                            s.o.y,
                            s.o.z,
                            s.pdf,
                            s.weight,
                            pdf(i, o, ax, ay),
                            port::evaluate(i, o, ax, ay),
                            port::share_unoccluded(i, ax, ay)};
    for (int column = 0; column < port_outputs; ++column) answer[column][k] = values[column];
  }
  expect_the_librarys(GetParam(), answer);
}

INSTANTIATE_TEST_SUITE_P(Samplers, CppPort, testing::ValuesIn(kPortSamplers),
                         [](const auto& info) { return std::string(name(info.param)); });

}  // namespace
}  // namespace facetwise::test
