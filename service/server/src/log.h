// SPDX-License-Identifier: Apache-2.0
// What a server tells of itself on standard error: a line an event.
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "facetwise/server.h"

namespace spdlog {
class logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace facetwise {

// Lines are written by a thread of its own: who reads them slowly, or not at all, holds up no call; the oldest lines that wait
// are lost then.
class Log {
 public:
  Log(LogFormat format, LogLevel level);
  ~Log();  // when all is written

  bool takes(LogLevel level) const;
  // `fields` is an object; what is in it may come from clients.
  void write(LogLevel level, std::string_view event, const nlohmann::ordered_json& fields);
  // The same, for what clients can cause as often as they like: some lines a second, and in the next how many are missing.
  void write_some(LogLevel level, std::string_view event, const nlohmann::ordered_json& fields);

 private:
  const LogFormat format_;
  std::shared_ptr<spdlog::details::thread_pool> thread_;
  std::shared_ptr<spdlog::logger> logger_;  // null: no log
  std::mutex mutex_;                        // of the following
  std::chrono::steady_clock::time_point second_{};
  int written_ = 0, missing_ = 0;
};

}  // namespace facetwise
