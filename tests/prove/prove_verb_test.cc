// SPDX-License-Identifier: Apache-2.0
// The verb: plugins, Python modules and servers, and what is said of those that cannot be used.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "app/command.h"

namespace facetwise::test {
namespace {

using Json = nlohmann::json;

const std::string kPlugins = FACETWISE_PLUGINS;
const std::string kLambert = std::string("python:") + FACETWISE_LAMBERT;

std::set<std::string> failing(const Json& json) {
  std::set<std::string> names;
  for (const Json& property : json["properties"])
    if (property["failed"] > 0) names.insert(property["name"]);
  return names;
}

TEST(ProveVerb, PublishedSamplersHold) {
  for (const char* plugin : {"walter_2007.so", "heitz_2018.so"}) {
    const Result result = facetwise({"prove", kPlugins + plugin});
    EXPECT_EQ(result.code, 0) << result.out;
    EXPECT_NE(result.out.find("result: every property holds"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("16 configurations, 1048576 samples each"), std::string::npos) << result.out;
    EXPECT_NE(result.err.find("100 %"), std::string::npos) << result.err;
  }
}

// Samples and pdfs agree with each other, so that only integrals tell.
TEST(ProveVerb, APdfWithoutG1IsFound) {
  const Directory directory;
  const Result result = facetwise({"prove", kPlugins + "without_g1.so", "--json", directory.path("proof.json")});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.out.find("density       FAILS  in 12 of 16"), std::string::npos) << result.out;
  const Json json = Json::parse(read_file(directory.path("proof.json")));
  EXPECT_EQ(failing(json), (std::set<std::string>{"albedo", "density"}));
  EXPECT_EQ(json["configurations"].size(), 16u);
  // At normal incidence nothing is hidden, and G1 is 1.
  for (const Json& configuration : json["configurations"])
    for (const Json& finding : configuration["findings"])
      if (finding["property"] == "density") {
        EXPECT_EQ(finding["holds"], configuration["theta"] == 0) << configuration["label"];
      }
}

TEST(ProveVerb, PythonModules) {
  const std::vector<std::string> python = {"--python", "/usr/bin/python3", "--theta", "45", "--alpha",
                                           "0.5",      "--samples",        "100000"};
  const auto prove = [&](const std::string& what) {
    std::vector<std::string> arguments = {"prove", what};
    arguments.insert(arguments.end(), python.begin(), python.end());
    return facetwise(arguments);
  };
  EXPECT_EQ(prove(kLambert).code, 0);

  const Directory directory;
  const std::string lambert = read_file(FACETWISE_LAMBERT);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = lambert;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    write_file(directory.path("changed.py"), text);
    return prove("python:" + directory.path("changed.py"));
  };
  // Light that arrives at a slant, twice.
  Result result = changed("return cosine, cosine", "return cosine, 2 * cosine");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.out.find("energy        FAILS"), std::string::npos) << result.out;
  result = changed("return cosine, cosine", "return cosine, cosine[1:]");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("evaluate: an array of shape"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("Python ended in evaluate()"), std::string::npos) << result.err;
  result = changed("def evaluate", "def evaluated");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("Python ended in reading the module"), std::string::npos) << result.err;
  result = prove("python:no_such_module");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("No module named"), std::string::npos) << result.err;
}

TEST(ProveVerb, Servers) {
  const Directory directory;
  const Server server(directory);
  Result result = facetwise({"prove", server.address(), "--sampler", "exact", "--theta", "60", "--alpha", "0.3"});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_NE(result.out.find("ggx smith exact"), std::string::npos) << result.out;
  // Radiance that enters a thinner medium is measured by eta^-2 as much: only importance is conserved.
  const std::vector<std::string> glass = {"prove",      server.address(), "--interface", "dielectric", "--theta",
                                          "20",         "--alpha",        "0.3",         "--eta",      "0.8",
                                          "--transport"};
  for (const char* transport : {"importance", "radiance"}) {
    std::vector<std::string> arguments = glass;
    arguments.emplace_back(transport);
    result = facetwise(arguments);
    EXPECT_EQ(result.code, transport == std::string("radiance") ? 1 : 0) << result.out << result.err;
  }
  result = facetwise({"prove", server.address(), "--masking", "vcavity", "--sampler", "cap"});
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("sampler"), std::string::npos) << result.err;
}

TEST(ProveVerb, WhatCannotBeUsed) {
  const auto error = [](const std::vector<std::string>& arguments, int code) {
    const Result result = facetwise(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    return result.err;
  };
  EXPECT_NE(error({"prove", "./no_such.so"}, 1).find("no_such.so"), std::string::npos);
  EXPECT_NE(error({"prove", kPlugins + "no_plugin.so"}, 1).find("exports no fw_plugin_open"), std::string::npos);
  EXPECT_NE(error({"prove", kLambert, "--alpha", "0.1,0.2,0.3"}, 2).find("--alpha"), std::string::npos);
  EXPECT_NE(error({"prove", kLambert, "--python", "/no/such/python"}, 1).find("/no/such/python"), std::string::npos);
  error({"prove"}, 2);
}

}  // namespace
}  // namespace facetwise::test
