// SPDX-License-Identifier: Apache-2.0
// The baseline as it is: scalar code.
#include "bench/baseline/loops.h"

namespace facetwise::baseline {
namespace {

template <Masking masking>
std::uint64_t run_masking(const Loop& loop) {
  switch (loop.distribution) {
    case Distribution::ggx: return run_model<Model{Distribution::ggx, masking}>(loop);
    case Distribution::beckmann: return run_model<Model{Distribution::beckmann, masking}>(loop);
    case Distribution::student_t: return run_model<Model{Distribution::student_t, masking}>(loop);
    case Distribution::phong:
      if constexpr (masking == Masking::vcavity) return run_model<Model{Distribution::phong, masking}>(loop);
      return 0;
    default: return 0;
  }
}

}  // namespace

std::uint64_t run_scalar(const Loop& loop) {
  return loop.masking == Masking::smith ? run_masking<Masking::smith>(loop) : run_masking<Masking::vcavity>(loop);
}

}  // namespace facetwise::baseline
