// SPDX-License-Identifier: Apache-2.0
// How far a long computation is, on standard error.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

namespace facetwise::app {

// On a terminal one line that changes, with the time left, else a line for each tenth.
class Progress {
 public:
  explicit Progress(std::string what) : what_(std::move(what)) {}
  ~Progress() {
    if (terminal_ && shown_ >= 0) fmt::print(stderr, "\n");
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void operator()(double done) {
    const int percent = static_cast<int>(100 * done);
    if (percent == shown_ || (!terminal_ && percent / 10 == shown_ / 10 && shown_ >= 0)) return;
    shown_ = percent;
    if (terminal_) {
      const double taken = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
      const auto left = std::lround(taken * (1 - done) / std::max(done, 1e-9));
      fmt::print(stderr, "\r{}: {:3} %, {}:{:02} left ", what_, percent, left / 60, left % 60);
    } else {
      fmt::print(stderr, "{}: {} %\n", what_, percent);
    }
    std::fflush(stderr);
  }

 private:
  const std::string what_;
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  const std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  int shown_ = -1;
};

}  // namespace facetwise::app
