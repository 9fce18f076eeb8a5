// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace facetwise {

// Makes glibc keep freed blocks for the next message. By default it hands those above 128 KiB back to the
// kernel and takes them anew, cleared, for every message, which can cost half of the throughput of a server
// or of a client's process. For the whole process, so it is the program's choice: call it once at the start.
// Does nothing where the C library is another.
void tune_malloc();

}  // namespace facetwise
