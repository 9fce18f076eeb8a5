// SPDX-License-Identifier: Apache-2.0
#include "src/tasks.h"

namespace facetwise {

void for_each_part(std::size_t n, absl::FunctionRef<void(std::size_t, std::size_t)> body) {
  if (n > 0) body(0, n);
}

void isolated(absl::FunctionRef<void()> body) { body(); }

void with_threads(std::size_t, absl::FunctionRef<void()> body) { body(); }

}  // namespace facetwise
