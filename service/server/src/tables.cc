// SPDX-License-Identifier: Apache-2.0
#include "src/tables.h"

#include "absl/strings/str_cat.h"
#include "facetwise/albedo_table.h"

namespace facetwise {

std::shared_ptr<const SlopeTable> Tables::find(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto at = kept_.find(id);
  if (at == kept_.end()) return nullptr;
  at->second.used = Clock::now();
  return at->second.table;
}

absl::Status Tables::put(std::shared_ptr<const SlopeTable> table) {
  const std::lock_guard lock(mutex_);
  drop_idle();
  const std::uint64_t id = table->id();
  if (kept_.contains(id)) return absl::OkStatus();
  if (table->bytes() > max_bytes_ - bytes_)
    return absl::ResourceExhaustedError(absl::StrCat("table: ", table->bytes(), " bytes beside ", bytes_,
                                                     " of other tables are above the limit of ", max_bytes_,
                                                     ": delete one, or try again when one has expired"));
  bytes_ += table->bytes();
  kept_.emplace(id, Kept{std::move(table), Clock::now()});
  return absl::OkStatus();
}

bool Tables::erase(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto at = kept_.find(id);
  if (at == kept_.end()) return false;
  drop(at);
  return true;
}

std::vector<Tables::Entry> Tables::list() {
  const std::lock_guard lock(mutex_);
  drop_idle();
  std::vector<Entry> entries;
  for (const auto& [id, kept] : kept_) entries.push_back({kept.table, Clock::now() - kept.used});
  return entries;
}

std::size_t Tables::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

Tables::Map::iterator Tables::drop(Map::iterator at) {
  bytes_ -= at->second.table->bytes();
  // What was made of it goes too: else a client could fill the memory table by table.
  drop_albedo_tables(at->first);
  return kept_.erase(at);
}

void Tables::drop_idle() {
  const auto now = Clock::now();
  for (auto at = kept_.begin(); at != kept_.end();) at = now - at->second.used > max_idle_ ? drop(at) : std::next(at);
}

}  // namespace facetwise
