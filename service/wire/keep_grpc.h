// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace facetwise::wire {

// Keeps gRPC's threads until the process ends. Otherwise the last server or channel to go stops them, and
// that can wait ten seconds for a poller that sleeps (gRPC 1.51).
void keep_grpc();

}  // namespace facetwise::wire
