// SPDX-License-Identifier: Apache-2.0
// A CompactRequest from a stranger, from its bytes to the answer's.
#include "tests/fuzz/server_call.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  facetwise::fuzz::answer(facetwise::answer_compact, data, size);
  return 0;
}
