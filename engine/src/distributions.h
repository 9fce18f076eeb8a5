// SPDX-License-Identifier: Apache-2.0
// All distributions, in the order of model.h's enumeration. Each has a file src/distributions/<name>.cc.
#pragma once

#define FACETWISE_DISTRIBUTIONS(X) X(Ggx) X(Beckmann) X(StudentT) X(Phong) X(Tabulated)
