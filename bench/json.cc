// SPDX-License-Identifier: Apache-2.0
// The report as JSON.
#include <cmath>
#include <nlohmann/json.hpp>

#include "facetwise/bench.h"

namespace facetwise {
namespace {

using Json = nlohmann::ordered_json;

std::string text(std::string_view view) { return std::string(view); }

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json to_json(const BenchResult& r) {
  Json json = {
      {"operation", text(name(r.operation))},
      {"distribution", r.distribution},
      {"masking", r.masking},
      {"sampler", r.sampler},
      {"alpha", r.alpha_x == 0 ? Json(alpha_text(0, 0)) : Json({r.alpha_x, r.alpha_y})},
      {"implementation", r.implementation},
      {"batch", r.batch},
      {"ns_per_sample", r.ns_per_sample},
      {"samples_per_second", r.samples_per_second()},
      {"rejected", r.rejected},
      {"samples", r.samples},
      {"name", r.name()},
      {"inputs", r.inputs},
      {"threads", r.threads},
      {"ns_per_accepted", finite(r.ns_per_accepted())},
      {"share_occluded", r.share_occluded()},
  };
  // Left out where they were not measured.
  if (r.bytes_per_sample > 0) json["bytes_per_second"] = r.bytes_per_second();
  if (r.repetitions > 0) json["repetitions"] = r.repetitions;
  if (r.ns_per_sample_min > 0) json["ns_per_sample_min"] = r.ns_per_sample_min;
  if (r.share_of_copy > 0) json["share_of_copy"] = r.share_of_copy;
  if (r.share_of_fma > 0) json["share_of_fma"] = r.share_of_fma;
  return json;
}

Json to_json(const RejectionResult& r) {
  return {{"experiment", r.experiment},
          {"distribution", r.distribution},
          {"masking", r.masking},
          {"sampler", r.sampler},
          {"theta_degrees", r.theta_degrees},
          {"alpha", {r.alpha_x, r.alpha_y}},
          {"samples", r.samples},
          {"rejected", r.rejected},
          {"share", r.share()},
          {"predicted_share", r.predicted_share},
          {"deviations", finite(r.deviations())}};
}

Json to_json(const BenchLimits& limits) {
  Json json = {{"copy", Json::array()}, {"fma", Json::array()}};
  for (const CopyLimit& copy : limits.copy)
    json["copy"].push_back({{"inputs", copy.inputs},
                            {"outputs", copy.outputs},
                            {"batch", copy.batch},
                            {"threads", copy.threads},
                            {"ns_per_sample", copy.ns_per_sample},
                            {"bytes_per_second", copy.bytes_per_second()}});
  for (const FmaLimit& fma : limits.fma)
    json["fma"].push_back(
        {{"target", text(name(fma.target))}, {"threads", fma.threads}, {"flops_per_second", fma.flops_per_second}});
  return json;
}

Json to_json(const TargetResult& t) {
  Json json = {{"what", t.what}, {t.at_least ? "at_least" : "at_most", t.required}, {"unit", t.unit}};
  json["measured"] = t.measured ? finite(*t.measured) : Json(nullptr);
  json["met"] = t.met() ? Json(*t.met()) : Json(nullptr);
  json["note"] = t.note;
  return json;
}

template <class T>
Json array(const std::vector<T>& items) {
  Json json = Json::array();
  for (const T& item : items) json.push_back(to_json(item));
  return json;
}

}  // namespace

std::string bench_json(const BenchReport& report) {
  const Json json = {
      {"version", report.version},
      {"machine", {{"cpu", report.machine.cpu}, {"cores", report.machine.cores}, {"target", report.machine.target}}},
      {"threads", report.threads},
      {"results", array(report.results)},
      {"rejections", array(report.rejections)},
      {"limits", to_json(report.limits)},
      {"targets", array(report.targets)},
  };
  return json.dump(2) + "\n";
}

}  // namespace facetwise
