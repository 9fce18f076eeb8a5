// SPDX-License-Identifier: Apache-2.0
#include "facetwise/report.h"

#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

// embedded.S
extern "C" const char facetwise_report_html_begin[], facetwise_report_html_end[], facetwise_report_css_begin[],
    facetwise_report_css_end[], facetwise_report_js_begin[], facetwise_report_js_end[], facetwise_report_d3_begin[],
    facetwise_report_d3_end[];

namespace facetwise::report {
namespace {

using Json = nlohmann::ordered_json;

std::string_view between(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

absl::StatusOr<Json> read(const std::string& path, std::initializer_list<const char*> members, const char* what) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat(path, ": cannot be read"));
  Json json = Json::parse(file, nullptr, false);
  bool fits = json.is_object();
  for (const char* member : members) fits = fits && json.contains(member);
  if (!fits) return absl::InvalidArgumentError(absl::StrCat(path, ": not the JSON of facetwise ", what));
  return json;
}
absl::StatusOr<Json> read_bench(const std::string& path) {
  return read(path, {"version", "machine", "results", "rejections"}, "bench");
}

std::string put_together(const Json& data) {
  // In a script element only "</" could end it.
  const std::string json = absl::StrReplaceAll(data.dump(), {{"</", "<\\/"}});
  std::string page;
  std::string_view html = between(facetwise_report_html_begin, facetwise_report_html_end);
  const std::pair<std::string_view, std::string_view> parts[] = {
      {"@CSS@", between(facetwise_report_css_begin, facetwise_report_css_end)},
      {"@DATA@", json},
      {"@D3@", between(facetwise_report_d3_begin, facetwise_report_d3_end)},
      {"@JS@", between(facetwise_report_js_begin, facetwise_report_js_end)}};
  for (const auto& [mark, text] : parts) {
    const std::size_t at = html.find(mark);
    page.append(html.substr(0, at)).append(text);
    html.remove_prefix(at + mark.size());
  }
  return page.append(html);
}

}  // namespace

absl::StatusOr<std::string> page(const Inputs& inputs) {
  Json data = {{"experiments", Json::array()}, {"commands", inputs.commands}};
  if (!inputs.bench.empty()) {
    auto bench = read_bench(inputs.bench);
    if (!bench.ok()) return bench.status();
    data["bench"] = *std::move(bench);
  }
  if (!inputs.verification.empty()) {
    auto verification = read(inputs.verification, {"lanes", "equal"}, "verify");
    if (!verification.ok()) return verification.status();
    data["verification"] = *std::move(verification);
  }
  for (const std::string& path : inputs.pages) {
    auto one = read(path, {"id", "claims", "figures"}, "experiment");
    if (!one.ok()) return one.status();
    data["commands"].push_back((*one)["command"]);
    data["experiments"].push_back(*std::move(one));
  }
  char made[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(made, sizeof made, "%Y-%m-%d %H:%M UTC", std::gmtime(&now));
  data["made"] = made;
  return put_together(data);
}

absl::StatusOr<std::string> comparison(const std::string& first, const std::string& second) {
  Json data = {{"compared", Json::array()}, {"names", {first, second}}};
  for (const std::string& path : {first, second}) {
    auto bench = read_bench(path);
    if (!bench.ok()) return bench.status();
    data["compared"].push_back(*std::move(bench));
  }
  return put_together(data);
}

}  // namespace facetwise::report
