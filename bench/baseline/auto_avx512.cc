// SPDX-License-Identifier: Apache-2.0
// The baseline, vectorised by the compiler. Nothing but the function below may leave this file: it is compiled for
// instructions that not every CPU has.
#define FACETWISE_BASELINE_BUILD auto_avx512
#define FACETWISE_BASELINE_VECTORISED
#include "bench/baseline/loops.h"

std::uint64_t facetwise::baseline::run_auto_avx512(const Loop& loop) {
  return run_model<Model{Distribution::ggx, Masking::smith}>(loop);
}
