// SPDX-License-Identifier: Apache-2.0
// sample, pdf and evaluate as a process: what is written is what the library computes, bit for bit.
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/app/command.h"
#include "tests/app/lanes.h"

namespace facetwise::test {
namespace {

constexpr std::size_t kLanes = 3001;

struct Case {
  std::string name;
  std::vector<std::string> arguments;
  Operation operation;
  Sampler sampler;
  std::vector<std::string> outputs;  // in the file's order, without status
};

void PrintTo(const Case& c, std::ostream* stream) { *stream << c.name; }

std::vector<Case> cases() {
  const std::vector<std::string> reflection = {"ox", "oy", "oz", "mx", "my", "mz", "pdf", "weight"};
  return {
      {"exact", {"sample"}, Operation::sample_reflection, Sampler::exact, reflection},
      {"bounded", {"sample", "--sampler", "bounded"}, Operation::sample_reflection, Sampler::bounded, reflection},
      {"visible", {"sample", "--sampler", "visible"}, Operation::sample_reflection, Sampler::cap, reflection},
      {"ndf", {"sample", "--sampler", "ndf"}, Operation::sample_reflection, Sampler::ndf, reflection},
      {"normals", {"sample", "--normals"}, Operation::sample_normal, Sampler::cap, {"mx", "my", "mz", "pdf"}},
      {"heitz_normals",
       {"sample", "--normals", "--sampler", "heitz"},
       Operation::sample_normal,
       Sampler::heitz,
       {"mx", "my", "mz", "pdf"}},
      {"pdf", {"pdf", "--sampler", "bounded"}, Operation::pdf_reflection, Sampler::bounded, {"pdf"}},
      {"evaluate", {"evaluate"}, Operation::evaluate_reflection, Sampler::exact, {"pdf", "value"}},
      {"albedo", {"albedo"}, Operation::albedo, Sampler::visible, {"albedo", "mean_albedo"}},
  };
}

OutputColumn<float>& output_column(Batch& batch, const std::string& name) {
  if (name == "ox") return batch.out.outgoing.x;
  if (name == "oy") return batch.out.outgoing.y;
  if (name == "oz") return batch.out.outgoing.z;
  if (name == "mx") return batch.out.normal.x;
  if (name == "my") return batch.out.normal.y;
  if (name == "mz") return batch.out.normal.z;
  if (name == "pdf") return batch.out.pdf;
  if (name == "weight") return batch.out.weight;
  if (name == "albedo") return batch.out.albedo;
  if (name == "mean_albedo") return batch.out.mean_albedo;
  return batch.out.value;
}

// The library's own answer, as a file would hold it.
Output expected_output(const Case& c, Batch batch) {
  Output output{.names = c.outputs, .columns = {}};
  output.columns.assign(c.outputs.size(), std::vector<float>(batch.lanes));
  for (std::size_t k = 0; k < c.outputs.size(); ++k)
    output_column(batch, c.outputs[k]) = OutputColumn<float>(output.columns[k]);
  std::vector<std::uint8_t> status(batch.lanes);
  batch.out.status = status;
  const auto statistics = run(c.operation, batch);
  EXPECT_TRUE(statistics.ok()) << statistics.status();
  output.names.push_back("status");
  output.columns.emplace_back(status.begin(), status.end());
  return output;
}

void expect_same_bits(const Output& a, const Output& b) {
  ASSERT_EQ(a.names, b.names);
  for (std::size_t c = 0; c < a.names.size(); ++c) {
    ASSERT_EQ(a.columns[c].size(), b.columns[c].size());
    for (std::size_t row = 0; row < a.columns[c].size(); ++row)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(a.columns[c][row]), std::bit_cast<std::uint32_t>(b.columns[c][row]))
          << a.names[c] << " in row " << row << ": " << a.columns[c][row] << " and " << b.columns[c][row];
  }
}

std::vector<std::string> plus(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

class FileVerbs : public testing::TestWithParam<Case> {};

TEST_P(FileVerbs, CsvAndNpyHoldWhatTheLibraryComputes) {
  const Lanes lanes(kLanes);
  const Directory directory;
  write_file(directory.path("in.csv"), lanes.csv(Lanes::kColumns));
  write_file(directory.path("in.npy"), lanes.npy());
  const Output expected = expected_output(GetParam(), lanes.batch(GetParam().operation, GetParam().sampler));
  for (const std::string in : {"in.csv", "in.npy"})
    for (const std::string out : {"out.csv", "out.npy"}) {
      SCOPED_TRACE(in + " to " + out);
      const auto result =
          facetwise(plus(GetParam().arguments, {"--input", directory.path(in), "--output", directory.path(out)}));
      ASSERT_EQ(result.code, 0) << result.err;
      EXPECT_EQ(result.out, "");
      expect_same_bits(read_output(directory.path(out)), expected);
    }
}

TEST_P(FileVerbs, ServersGiveTheSameFiles) {
  const Lanes lanes(kLanes);
  const Directory directory;
  const Server one(directory, "one.sock"), two(directory, "two.sock");
  write_file(directory.path("in.npy"), lanes.npy());
  const auto with = [&](const std::string& out, const std::vector<std::string>& more) {
    const auto result = facetwise(
        plus(plus(GetParam().arguments, more), {"--input", directory.path("in.npy"), "--output", directory.path(out)}));
    EXPECT_EQ(result.code, 0) << result.err;
    return read_file(directory.path(out));
  };
  for (const std::string extension : {".csv", ".npy"}) {
    const std::string local = with("local" + extension, {});
    EXPECT_EQ(local, with("remote" + extension, {"--remote", one.address()}));
    EXPECT_EQ(local, with("both" + extension, {"--remote", one.address() + "," + two.address()}));
    EXPECT_EQ(local, with("scalar" + extension, {"--target", "scalar"}));
  }
}

INSTANTIATE_TEST_SUITE_P(Verbs, FileVerbs, testing::ValuesIn(cases()),
                         [](const auto& info) { return info.param.name; });

TEST(Sample, ReadsStandardInputAndWritesStandardOutput) {
  const auto result = facetwise({"sample", "--normals", "--alpha", "0.5"}, "ix,iy,iz,u1,u2\n0,0,1,0,0\n");
  ASSERT_EQ(result.code, 0) << result.err;
  // u1 = 0 is the middle of the cap: the normal is i itself, with density D(i) = 1 / (pi alpha^2).
  EXPECT_EQ(result.out.substr(0, 26), "mx,my,mz,pdf,status\n0,0,1,");
  EXPECT_NEAR(std::stof(result.out.substr(26)), 1.2732395f, 1e-6f);
}

TEST(Sample, SeedGivesTheGeneratorsNumbersHoweverAFileIsSplit) {
  const Lanes lanes(1000);
  const auto all = facetwise({"sample", "--seed", "5"}, lanes.csv(5));
  const auto rest = facetwise({"sample", "--seed", "5", "--first-id", "600"}, lanes.csv(5, 600));
  ASSERT_EQ(all.code, 0) << all.err;
  ASSERT_EQ(rest.code, 0) << rest.err;
  const std::string body = rest.out.substr(rest.out.find('\n') + 1);
  ASSERT_GT(body.size(), 1000u);
  EXPECT_TRUE(all.out.ends_with(body));
  EXPECT_NE(facetwise({"sample", "--seed", "6"}, lanes.csv(5)).out, all.out);

  Batch batch = lanes.batch(Operation::sample_reflection, Sampler::exact);
  batch.u1 = batch.u2 = batch.u3 = {};
  batch.generator.emplace().seed = 5;
  const Directory directory;
  write_file(directory.path("all.csv"), all.out);
  expect_same_bits(read_output(directory.path("all.csv")), expected_output(cases().front(), batch));
}

TEST(Sample, AlphaFlagsReplaceColumns) {
  const std::string header = "ix,iy,iz,u1,u2,u3", lane = "0.6,0,0.8,0.3,0.4,0.5";
  const auto columns = facetwise({"sample"}, header + ",alpha_x,alpha_y\n" + lane + ",0.8,0.1\n");
  const auto flags = facetwise({"sample", "--alpha", "0.8", "0.1"}, header + "\n" + lane + "\n");
  ASSERT_EQ(columns.code, 0) << columns.err;
  EXPECT_EQ(columns.out, flags.out);
  const auto isotropic = facetwise({"sample", "--alpha", "0.8"}, header + "\n" + lane + "\n");
  EXPECT_EQ(isotropic.out, facetwise({"sample", "--alpha", "0.8", "0.8"}, header + "\n" + lane + "\n").out);
  EXPECT_NE(isotropic.out, flags.out);
}

TEST(Evaluate, ShadowingIsRead) {
  const std::string lanes = "ix,iy,iz,ox,oy,oz\n0.6,0,0.8,0,0.8,0.6\n";
  const auto correlated = facetwise({"evaluate", "--alpha", "0.5"}, lanes);
  const auto uncorrelated = facetwise({"evaluate", "--alpha", "0.5", "--shadowing", "uncorrelated"}, lanes);
  ASSERT_EQ(correlated.code, 0) << correlated.err;
  ASSERT_EQ(uncorrelated.code, 0) << uncorrelated.err;
  EXPECT_NE(correlated.out, uncorrelated.out);
}

// Where no sampler is named it is one that the columns allow: `exact` of Beckmann takes no mean slopes, GGX's does.
TEST(Albedo, TablesAreKeptInFiles) {
  const Directory directory;
  const std::string rows = "ix,iy,iz\n0,0,1\n0.6,0,0.8\n", table = directory.path("ggx.albedo");
  const std::vector<std::string> call = {"albedo", "--alpha", "0.5", "--albedo-table", table};
  const auto first = facetwise(call, rows);
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_NE(first.err.find("table of albedo: "), std::string::npos) << "it shows its progress: " << first.err;
  const std::string bytes = read_file(table);
  const auto second = facetwise(call, rows);
  ASSERT_EQ(second.code, 0) << second.err;
  EXPECT_EQ(second.err.find("table of albedo: "), std::string::npos) << second.err;
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(read_file(table), bytes);

  // A white furnace: weights are 1 / E where nothing is occluded or shadowed.
  const std::string random = "ix,iy,iz,u1,u2,u3\n0.6,0,0.8,0.5,0.5,0.5\n";
  const auto compensated =
      facetwise({"sample", "--alpha", "0.5", "--compensation", "turquin", "--albedo-table", table}, random);
  ASSERT_EQ(compensated.code, 0) << compensated.err;
  const auto plain = facetwise({"sample", "--alpha", "0.5"}, random);
  EXPECT_NE(compensated.out, plain.out);

  const auto fails = [&](const std::vector<std::string>& arguments, const std::string& says) {
    const auto result = facetwise(arguments, rows);
    EXPECT_EQ(result.code, 1);
    EXPECT_NE(result.err.find(says), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "");
  };
  fails(plus(call, {"--masking", "vcavity"}), "ggx.albedo: a table of ggx with smith masking");
  fails({"pdf", "--alpha", "0.5", "--albedo-table", table}, "--albedo-table: read by");
  fails(plus(call, {"--remote", "unix:/nowhere"}), "--albedo-table: a server has its own");
  write_file(table, bytes.substr(0, 1000));
  fails(call, "ggx.albedo: truncated");
}

TEST(Sample, DefaultSamplerFitsTheColumns) {
  const std::string plain = "ix,iy,iz,alpha_x,alpha_y\n0.6,0,0.8,0.3,0.4\n";
  const std::string sloped = "ix,iy,iz,alpha_x,alpha_y,mean_slope_x\n0.6,0,0.8,0.3,0.4,0.1\n";
  const auto sampler = [](const std::string& distribution, const std::string& input) {
    const auto result = facetwise({"sample", "--distribution", distribution, "--seed", "1", "--json"}, input);
    EXPECT_EQ(result.code, 0) << result.err;
    return nlohmann::json::parse(result.err)["sampler"].get<std::string>();
  };
  EXPECT_EQ(sampler("beckmann", plain), "exact");
  EXPECT_EQ(sampler("beckmann", sloped), "visible");
  EXPECT_EQ(sampler("ggx", sloped), "exact");
  EXPECT_EQ(sampler("student_t", plain), "visible");
}

TEST(Sample, EmptyAndSingleRowTables) {
  for (const std::string extension : {"csv", "npy"}) {
    const Directory directory;
    const std::string out = directory.path("out." + extension);
    ASSERT_EQ(facetwise({"sample", "--alpha", "1", "--seed", "1", "--output", out}, "ix,iy,iz\n").code, 0);
    EXPECT_EQ(read_output(out)["status"].size(), 0u);
    ASSERT_EQ(facetwise({"sample", "--alpha", "1", "--seed", "1", "--output", out}, "ix,iy,iz\n0,0,1\n").code, 0);
    EXPECT_EQ(read_output(out)["status"].size(), 1u);
  }
}

TEST(Sample, BadLanesAreCountedNotErrors) {
  const std::string lanes =
      "ix,iy,iz,alpha_x,alpha_y,pdf\n0,0,1,.5,.5,0\nnan,0,1,.5,.5,0\n0,0,2,.5,.5,0\n0,0,1,5e-5,.5,0\n";
  const auto text = facetwise({"sample", "--seed", "1"}, lanes);
  ASSERT_EQ(text.code, 0);
  EXPECT_NE(text.err.find("4 lanes, 0 backfacing: 1 accepted, 0 occluded, 1 smooth, 2 invalid"), std::string::npos)
      << text.err;
  EXPECT_NE(text.err.find("columns not read: pdf"), std::string::npos) << text.err;
  const auto json = facetwise({"sample", "--seed", "1", "--json"}, lanes);
  EXPECT_EQ(json.out, text.out);
  const auto statistics = nlohmann::json::parse(json.err);
  EXPECT_EQ(statistics["lanes"], 4);
  EXPECT_EQ(statistics["accepted"], 1);
  EXPECT_EQ(statistics["smooth"], 1);
  EXPECT_EQ(statistics["invalid"], 2);
  EXPECT_EQ(statistics["ignored_columns"], nlohmann::json::array({"pdf"}));
}

// Columns that facetwise does not know are in the output as they were, from each format to each.
TEST(Sample, UnknownColumnsArePassedOn) {
  const Directory directory;
  const std::string rows =
      "name,ix,iy,iz,id,\"a, b\"\n\"Ann \"\"A\"\"\",0,0,1,9007199254740993,x\nÉva,0.6,0,0.8,-2,\"y, z\"\n";
  const auto text = facetwise({"sample", "--alpha", "0.5", "--seed", "1"}, rows);
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.err.find("not known, passed on: name id a, b"), std::string::npos) << text.err;
  EXPECT_TRUE(text.out.starts_with("name,id,\"a, b\",ox,")) << text.out;
  EXPECT_NE(text.out.find("\n\"Ann \"\"A\"\"\",9007199254740993,x,"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("\nÉva,-2,\"y, z\","), std::string::npos) << text.out;

  // To .npy, and from there back to CSV.
  const std::string npy = directory.path("samples.npy"), again = directory.path("again.csv");
  ASSERT_EQ(facetwise({"sample", "--alpha", "0.5", "--seed", "1", "--output", npy}, rows).code, 0);
  const std::string python = R"(
import numpy, sys
a = numpy.load(sys.argv[1])
assert a['name'].tolist() == ['Ann "A"'.encode(), 'Éva'.encode()], a['name']
assert a['id'].tolist() == [b'9007199254740993', b'-2'], a['id']
assert a['a, b'].tolist() == [b'x', b'y, z']
b = numpy.zeros(2, dtype=[('n', '<U3'), ('ix', '>f8'), ('iy', '<f2'), ('iz', '<f4'), ('id', '>i8'), ('flag', '?')])
b['n'], b['ix'], b['iz'], b['id'], b['flag'] = ['Éva', '𝛼'], [0, .6], [1, .8], [2**62, -5], [True, False]
numpy.save(sys.argv[2], b)
numpy.savez_compressed(sys.argv[3], **{name: b[name] for name in b.dtype.names})
numpy.save(sys.argv[4], numpy.array([[0, 0, 1], [.6, 0, .8]]))
)";
  const std::string fields = directory.path("fields.npy"), zipped = directory.path("zipped.npz"),
                    plain = directory.path("plain.npy");
  write_file(directory.path("check.py"), python);
  const std::string command =
      "/usr/bin/python3 " + directory.path("check.py") + " " + npy + " " + fields + " " + zipped + " " + plain;
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto expected = facetwise({"sample", "--alpha", "0.5", "--seed", "1"}, "ix,iy,iz\n0,0,1\n0.6,0,0.8\n");
  for (const std::string& input : {fields, zipped}) {
    const auto result = facetwise({"sample", "--alpha", "0.5", "--seed", "1", "--input", input});
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_TRUE(result.out.starts_with("n,id,flag,ox,")) << result.out;
    EXPECT_NE(result.out.find("\nÉva,4611686018427387904,True,"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("\n𝛼,-5,False,"), std::string::npos) << result.out;
    // The same samples.
    const std::string last = expected.out.substr(expected.out.rfind('\n', expected.out.size() - 2) + 1);
    EXPECT_TRUE(result.out.ends_with("False," + last)) << result.out;
  }
  const auto array = facetwise({"sample", "--alpha", "0.5", "--seed", "1", "--input", plain, "--columns", "ix,iy,iz"});
  EXPECT_EQ(array.out, expected.out) << array.err;
  write_file(directory.path("broken.npz"), read_file(zipped).substr(0, 100));
  const auto broken = facetwise({"sample", "--alpha", "0.5", "--seed", "1", "--input", directory.path("broken.npz")});
  EXPECT_EQ(broken.code, 1);
  EXPECT_NE(broken.err.find("broken.npz"), std::string::npos) << broken.err;
}

TEST(Sample, DirectionsAreNormalisedWhenAsked) {
  const std::string end = "0,0,0\nnan,0,1\n", rows = "ix,iy,iz\n0,0,1.25\n" + end, unit = "ix,iy,iz\n0,0,1\n" + end;
  const auto without = facetwise({"sample", "--alpha", "0.5", "--seed", "1"}, rows);
  const auto with = facetwise({"sample", "--alpha", "0.5", "--seed", "1", "--normalise"}, rows);
  ASSERT_EQ(with.code, 0) << with.err;
  EXPECT_NE(without.err.find("3 invalid"), std::string::npos) << without.err;
  EXPECT_NE(with.err.find("2 invalid"), std::string::npos) << with.err;
  EXPECT_EQ(with.out, facetwise({"sample", "--alpha", "0.5", "--seed", "1"}, unit).out);
}

TEST(Sample, AFileMayReplaceItsInput) {
  const Lanes lanes(500);
  const Directory directory;
  const std::string path = directory.path("t.npy");
  write_file(path, lanes.npy());
  const Output expected = expected_output(cases().front(), lanes.batch(Operation::sample_reflection, Sampler::exact));
  ASSERT_EQ(facetwise({"sample", "--input", path, "--output", path}).code, 0);
  expect_same_bits(read_output(path), expected);
}

}  // namespace
}  // namespace facetwise::test
