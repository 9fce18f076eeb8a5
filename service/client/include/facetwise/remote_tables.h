// SPDX-License-Identifier: Apache-2.0
// A server's tables of slopes. Engines from connect() upload what they need by themselves; this is for those who look after
// a server.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "facetwise/channel.h"
#include "facetwise/slope_table.h"

namespace facetwise {

// Sends a table in pieces of at most `piece_bytes`, unless the server has it, until the time given. InvalidArgument where it is
// too large for the server, ResourceExhausted where the server's tables together would be.
absl::Status upload_table(const Channel& channel, const SlopeTable& table, std::size_t piece_bytes,
                          std::chrono::system_clock::time_point until);

struct RemoteTable {
  std::uint64_t id;  // SlopeTable::id()
  std::uint64_t bytes;
  bool radial;
  std::chrono::duration<double> idle;  // since it was last used
};
absl::StatusOr<std::vector<RemoteTable>> list_tables(const Channel& channel,
                                                     std::chrono::system_clock::time_point until);
// NotFound: the server has no such table.
absl::Status delete_table(const Channel& channel, std::uint64_t id, std::chrono::system_clock::time_point until);

}  // namespace facetwise
