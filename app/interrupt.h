// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM as a wish to stop, for verbs that then write what is done.
#pragma once

#include <atomic>
#include <csignal>

namespace facetwise::app {

inline std::atomic<bool> interrupted = false;

// The first signal sets `interrupted`; the second ends the process as ever.
inline void catch_interrupts() {
  for (const int signal : {SIGINT, SIGTERM})
    std::signal(signal, [](int number) {
      interrupted = true;
      std::signal(number, SIG_DFL);
    });
}

}  // namespace facetwise::app
