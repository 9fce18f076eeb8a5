// SPDX-License-Identifier: Apache-2.0
// compact(): accepted lanes of finished columns, stable in order.
#include <algorithm>
#include <array>
#include <limits>

#include "absl/strings/str_cat.h"
#include "src/check.h"
#include "src/parallel.h"

namespace facetwise {

absl::Status check(const Compaction& c) {
  if (auto status = check_active(c.active, c.lanes); !status.ok()) return status;
  if (!c.status.present()) return absl::InvalidArgumentError("status: missing");
  if (auto status = check_input("status", c.status, c.lanes); !status.ok()) return status;
  const std::size_t positions = c.active ? c.active->size() : c.lanes;
  if (c.index.present())
    if (auto status = check_output("index", c.index, positions); !status.ok()) return status;
  if (positions > 0 && c.lanes - 1 > std::numeric_limits<std::uint32_t>::max() && c.index.present())
    return absl::InvalidArgumentError("index: holds 32 bits, too few for this many lanes");

  const auto field = [](std::size_t k, const char* part) { return absl::StrCat("columns[", k, "].", part); };
  for (std::size_t k = 0; k < c.columns.size(); ++k) {
    if (auto status = check_input(field(k, "from"), c.columns[k].from, c.lanes); !status.ok()) return status;
    if (auto status = check_output(field(k, "to"), c.columns[k].to, positions); !status.ok()) return status;
  }
  // Outputs are separate memory from everything else, and from each other.
  const auto separate = [&](const std::string& name, const MemoryUse& use, std::size_t skip) -> absl::Status {
    const auto overlaps = [&](absl::string_view other) {
      return absl::InvalidArgumentError(absl::StrCat(name, ": overlaps ", other));
    };
    if (share_memory(use, memory_use(c.status))) return overlaps("status");
    if (c.active && share_memory(use, memory_use(c.active->data(), c.active->size(), 4, 4))) return overlaps("active");
    for (std::size_t j = 0; j < c.columns.size(); ++j) {
      if (share_memory(use, memory_use(c.columns[j].from))) return overlaps(field(j, "from"));
      if (j < skip && share_memory(use, memory_use(c.columns[j].to))) return overlaps(field(j, "to"));
    }
    return absl::OkStatus();
  };
  if (c.index.present())
    if (auto status = separate("index", memory_use(c.index), c.columns.size()); !status.ok()) return status;
  for (std::size_t k = 0; k < c.columns.size(); ++k)
    if (auto status = separate(field(k, "to"), memory_use(c.columns[k].to), k); !status.ok()) return status;
  return absl::OkStatus();
}

absl::StatusOr<std::size_t> compact(const Compaction& c, const Execution& execution) {
  if (auto status = check(c); !status.ok()) return status;
  const std::size_t positions = c.active ? c.active->size() : c.lanes;
  const auto lane_at = [&](std::size_t position) -> std::size_t { return c.active ? (*c.active)[position] : position; };
  const auto accepted = [&](std::size_t lane) {
    return c.status[lane] == static_cast<std::uint8_t>(LaneStatus::accepted);
  };

  // Two passes over a fixed number of chunks: count, then write behind the chunks before.
  constexpr std::size_t kChunks = 64;
  const std::size_t chunk = std::max<std::size_t>((positions + kChunks - 1) / kChunks, 4096);
  const std::size_t chunks = (positions + chunk - 1) / chunk;
  std::array<std::size_t, kChunks + 1> first{};
  const Threading threading(positions, 262144, execution);  // a nanosecond a lane or less
  const auto for_each_chunk = [&](const auto& body) {
    const auto some = [&](std::size_t first_chunk, std::size_t last) {
      for (std::size_t k = first_chunk; k < last; ++k) body(k, k * chunk, std::min(positions, (k + 1) * chunk));
    };
    if (!threading.spreads() || chunks < 2)
      some(0, chunks);
    else
      for_each_part(chunks, some);
  };
  for_each_chunk([&](std::size_t k, std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    for (std::size_t p = begin; p < end; ++p) count += accepted(lane_at(p));
    first[k + 1] = count;
  });
  for (std::size_t k = 0; k < chunks; ++k) first[k + 1] += first[k];
  for_each_chunk([&](std::size_t k, std::size_t begin, std::size_t end) {
    if (c.index.present()) {
      std::size_t to = first[k];
      for (std::size_t p = begin; p < end; ++p)
        if (const std::size_t lane = lane_at(p); accepted(lane)) c.index[to++] = static_cast<std::uint32_t>(lane);
    }
    for (const auto& column : c.columns) {
      std::size_t to = first[k];
      for (std::size_t p = begin; p < end; ++p)
        if (const std::size_t lane = lane_at(p); accepted(lane)) column.to[to++] = column.from[lane];
    }
  });
  return first[chunks];
}

}  // namespace facetwise
