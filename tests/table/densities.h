// SPDX-License-Identifier: Apache-2.0
// Densities of slopes that the tests tabulate.
#pragma once

#include <memory>

#include "facetwise/slope_table.h"

namespace facetwise::test {

double ggx(double x, double y);
double beckmann(double x, double y);
// Skewed, in no direction symmetric, with a tail as heavy as that of measured surfaces; no closed form of
// anything.
double skewed(double x, double y);

// Fails the test, and returns nothing, where the table cannot be built.
std::shared_ptr<const SlopeTable> build(const SlopeDensity& p22, const SlopeTable::Options& options);

// Built once per process, with default sizes unless kQuick.
const SlopeTable& ggx_table();
const SlopeTable& beckmann_table();
const SlopeTable& skewed_table();
// The skewed density in few azimuths: quick to build, for tests that do not ask how exact it is.
const SlopeTable& coarse_table();

}  // namespace facetwise::test
