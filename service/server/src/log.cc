// SPDX-License-Identifier: Apache-2.0
#include "src/log.h"

#include <nlohmann/json.hpp>
#include <string>

#include "spdlog/async_logger.h"
#include "spdlog/details/thread_pool.h"
#include "spdlog/pattern_formatter.h"
#include "spdlog/sinks/stdout_sinks.h"

namespace facetwise {
namespace {

constexpr std::size_t kLinesThatWait = 8192;
constexpr int kMostASecond = 20;

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::debug: return spdlog::level::debug;
    case LogLevel::info: return spdlog::level::info;
    case LogLevel::warning: return spdlog::level::warn;
  }
  return spdlog::level::off;
}

// What is not UTF-8 is replaced, and what could end the line is escaped.
std::string text_of(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

Log::Log(LogFormat format, LogLevel level) : format_(format) {
  if (format == LogFormat::none) return;
  thread_ = std::make_shared<spdlog::details::thread_pool>(kLinesThatWait, 1);
  logger_ = std::make_shared<spdlog::async_logger>("facetwise", std::make_shared<spdlog::sinks::stderr_sink_mt>(),
                                                   thread_, spdlog::async_overflow_policy::overrun_oldest);
  logger_->set_level(level_of(level));
  constexpr const char* kTime = "%Y-%m-%dT%H:%M:%S.%eZ";
  const std::string pattern = format == LogFormat::json ? std::string(R"({"time":")") + kTime + R"(","level":"%l",%v})"
                                                        : std::string(kTime) + " %-7l %v";
  logger_->set_formatter(std::make_unique<spdlog::pattern_formatter>(pattern, spdlog::pattern_time_type::utc));
}

Log::~Log() = default;

bool Log::takes(LogLevel level) const { return logger_ && logger_->should_log(level_of(level)); }

void Log::write(LogLevel level, std::string_view event, const nlohmann::ordered_json& fields) {
  if (!takes(level)) return;
  std::string line;
  if (format_ == LogFormat::json) {
    nlohmann::ordered_json all = {{"event", event}};
    all.update(fields);
    line = text_of(all);
    line = line.substr(1, line.size() - 2);  // the pattern has the braces
  } else {
    line = event;
    for (const auto& [name, value] : fields.items()) line += " " + name + "=" + text_of(value);
  }
  logger_->log(level_of(level), spdlog::string_view_t(line));
}

void Log::write_some(LogLevel level, std::string_view event, const nlohmann::ordered_json& fields) {
  if (!takes(level)) return;
  int missing = 0;
  {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      written_ = 0;
    }
    if (++written_ > kMostASecond) {
      ++missing_;
      return;
    }
    missing = std::exchange(missing_, 0);
  }
  if (missing == 0) return write(level, event, fields);
  nlohmann::ordered_json all = fields;
  all["lines_missing"] = missing;
  write(level, event, all);
}

}  // namespace facetwise
