// SPDX-License-Identifier: Apache-2.0
// The tables of slopes that clients have uploaded.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "absl/status/status.h"
#include "facetwise/slope_table.h"

namespace facetwise {

class Tables {
 public:
  Tables(std::size_t max_bytes, std::chrono::milliseconds max_idle) : max_bytes_(max_bytes), max_idle_(max_idle) {}

  // Null: there is none. Counts as a use.
  std::shared_ptr<const SlopeTable> find(std::uint64_t id);
  // RESOURCE_EXHAUSTED where the tables would be too large together.
  absl::Status put(std::shared_ptr<const SlopeTable> table);
  // False: there was none.
  bool erase(std::uint64_t id);

  struct Entry {
    std::shared_ptr<const SlopeTable> table;
    std::chrono::duration<double> idle;
  };
  std::vector<Entry> list();
  std::size_t bytes() const;

  std::size_t max_bytes() const { return max_bytes_; }
  std::chrono::milliseconds max_idle() const { return max_idle_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::shared_ptr<const SlopeTable> table;
    Clock::time_point used;
  };
  using Map = std::map<std::uint64_t, Kept>;
  Map::iterator drop(Map::iterator at);
  void drop_idle();

  const std::size_t max_bytes_;
  const std::chrono::milliseconds max_idle_;
  mutable std::mutex mutex_;
  Map kept_;
  std::size_t bytes_ = 0;
};

}  // namespace facetwise
