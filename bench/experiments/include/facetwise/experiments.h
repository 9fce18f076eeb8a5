// SPDX-License-Identifier: Apache-2.0
// The experiments of the texts, each a page of the report: what is claimed, what was measured, and whether it agrees.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace facetwise::experiments {

// A curve; points in the order they are joined.
struct Series {
  std::string name;
  std::vector<std::pair<double, double>> points;
};
struct Plot {
  std::string title, alt;  // `alt` says in words what is to be seen
  std::string x_label, y_label;
  bool log_x = false, log_y = false;
  bool equal_scales = false;  // a drawing: x and y in the same unit
  std::vector<Series> series;
};
// Pictures to be compared with each other: shown under a slider.
struct Pictures {
  struct One {
    std::string name, caption;
    std::string png;  // the file's bytes
  };
  std::string title, alt;
  int width = 0, height = 0;
  std::vector<One> pictures;
};
struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
};

// Whether what was measured is what the text says.
enum class Verdict : std::uint8_t { agrees, in_part, differs };
std::string_view name(Verdict);

struct Page {
  std::string id, title, source;
  struct Claim {
    std::string says, measured;
    Verdict verdict;
  };
  std::vector<Claim> claims;
  std::vector<std::string> notes;  // what was done, and why it differs where it does
  std::vector<std::variant<Plot, Pictures, Table>> figures;
  std::string command;
  double seconds = 0;
};

struct Options {
  enum class Size : std::uint8_t {
    quick,     // a minute for all: fewer pixels, a poorer reference
    standard,  // at most 40 minutes for all on two cores
    paper,     // the texts' sizes: hours
  };
  Size size = Size::standard;
  // What is being done, and the share done; false stops (Cancelled).
  std::function<bool(std::string_view, double)> progress{};
};

struct Experiment {
  std::string_view id, title;
  absl::StatusOr<Page> (*run)(const Options&);
};
// In the report's order.
std::vector<Experiment> all_experiments();

// A page as JSON, pictures as base64.
std::string page_json(const Page& page);

}  // namespace facetwise::experiments
