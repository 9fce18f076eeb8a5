// SPDX-License-Identifier: Apache-2.0
#include "wire/keep_grpc.h"

#include "grpc/grpc.h"

namespace facetwise::wire {

void keep_grpc() {
  static const bool kept = (grpc_init(), true);
  (void)kept;
}

}  // namespace facetwise::wire
