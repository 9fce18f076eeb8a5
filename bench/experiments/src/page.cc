// SPDX-License-Identifier: Apache-2.0
#include <absl/strings/escaping.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "facetwise/experiments.h"

namespace facetwise::experiments {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Plot& plot) {
  Json json = {
      {"type", "plot"},         {"title", plot.title}, {"alt", plot.alt},     {"x", plot.x_label},
      {"y", plot.y_label},      {"log_x", plot.log_x}, {"log_y", plot.log_y}, {"equal_scales", plot.equal_scales},
      {"series", Json::array()}};
  for (const Series& series : plot.series) {
    Json points = Json::array();
    for (const auto& [x, y] : series.points)
      if (std::isfinite(x) && std::isfinite(y)) points.push_back({x, y});
    json["series"].push_back({{"name", series.name}, {"points", std::move(points)}});
  }
  return json;
}

Json to_json(const Pictures& pictures) {
  Json json = {{"type", "pictures"},      {"title", pictures.title},   {"alt", pictures.alt},
               {"width", pictures.width}, {"height", pictures.height}, {"pictures", Json::array()}};
  for (const auto& one : pictures.pictures)
    json["pictures"].push_back({{"name", one.name}, {"caption", one.caption}, {"png", absl::Base64Escape(one.png)}});
  return json;
}

Json to_json(const Table& table) {
  return {{"type", "table"}, {"title", table.title}, {"columns", table.columns}, {"rows", table.rows}};
}

}  // namespace

std::string_view name(Verdict verdict) {
  switch (verdict) {
    case Verdict::agrees: return "agrees";
    case Verdict::in_part: return "agrees in part";
    case Verdict::differs: return "differs";
  }
  return "";
}

std::string page_json(const Page& page) {
  Json json = {{"id", page.id},           {"title", page.title},     {"source", page.source},
               {"command", page.command}, {"seconds", page.seconds}, {"claims", Json::array()},
               {"notes", page.notes},     {"figures", Json::array()}};
  for (const auto& claim : page.claims)
    json["claims"].push_back(
        {{"says", claim.says}, {"measured", claim.measured}, {"verdict", std::string(name(claim.verdict))}});
  for (const auto& figure : page.figures)
    json["figures"].push_back(std::visit([](const auto& one) { return to_json(one); }, figure));
  return json.dump(1) + "\n";
}

}  // namespace facetwise::experiments
