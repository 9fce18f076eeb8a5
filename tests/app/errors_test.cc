// SPDX-License-Identifier: Apache-2.0
// What goes wrong says what and where, sets the exit code, and writes nothing.
#include <gtest/gtest.h>

#include "tests/app/command.h"
#include "tests/app/lanes.h"

namespace facetwise::test {
namespace {

// Runs with --output on a file that exists: it must be left as it was, with nothing beside it.
void expect_failure(std::vector<std::string> arguments, const std::string& input, const std::string& message,
                    int code = 1) {
  SCOPED_TRACE(message);
  const Directory directory;
  write_file(directory.path("out.csv"), "old");
  arguments.insert(arguments.end(), {"--output", directory.path("out.csv")});
  const auto result = facetwise(arguments, input);
  EXPECT_EQ(result.code, code);
  EXPECT_EQ(result.out, "");
  EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
  EXPECT_EQ(read_file(directory.path("out.csv")), "old");
  EXPECT_EQ(directory.files(), std::vector<std::string>{"out.csv"});
}

TEST(Errors, Columns) {
  expect_failure({"sample"}, "ix,iy,iz,alpha_x,alpha_y\n", "standard input: no column u1 (or give --seed");
  expect_failure({"sample"}, "ix,iy,iz,alpha_x,alpha_y,u1,u2\n", "standard input: no column u3 (or give --seed");
  expect_failure({"sample", "--seed", "1"}, "ix,iy,iz,alpha_x\n",
                 "standard input: no column alpha_y (or give --alpha)");
  expect_failure({"sample", "--seed", "1", "--alpha", "1"}, "ix,iz\n", "standard input: no column iy");
  expect_failure({"pdf", "--alpha", "1"}, "ix,iy,iz,ox,oy\n", "standard input: no column oz");
  expect_failure({"sample", "--seed", "1", "--alpha", "1"}, "ix,iy,iz,u2\n",
                 "--seed: standard input has a column u2 too");
  expect_failure({"sample", "--seed", "1", "--alpha", "1"}, "ix,iy,iz,alpha_y\n",
                 "--alpha: standard input has a column alpha_y too");
}

TEST(Errors, Numbers) {
  expect_failure({"sample", "--seed", "1", "--alpha", "1"}, "ix,iy,iz\n0,0,1\n0,zero,1\n",
                 "standard input, line 3, column iy: \"zero\" is not a number");
  expect_failure({"sample", "--seed", "1", "--alpha", "1"}, "ix,iy,iz\n0,0,1\n0,1\n",
                 "standard input, line 3: 2 values for 3 columns");
}

TEST(Errors, NpyFiles) {
  const Directory directory;
  const std::string in = directory.path("in.npy");
  const auto expect = [&](const std::string& bytes, const std::string& message) {
    write_file(in, bytes);
    expect_failure({"sample", "--seed", "1", "--alpha", "1", "--input", in}, "", in + ": " + message);
  };
  const auto with_type = [](const std::string& type, std::size_t bytes) {
    return npy_file("{'descr': [('ix', '<f4'), ('iy', '" + type +
                        "'), ('iz', '<f4')], 'fortran_order': False, "
                        "'shape': (2,), }",
                    std::string(2 * (8 + bytes), '\0'));
  };
  expect(with_type("<i4", 4), "field iy is <i4; it must be float32, float64 or float16 (numpy: array.astype)");
  expect(with_type("<c8", 8), "field iy is <c8; it must be");
  expect(with_type("<f4", 3), "truncated: 2 records of 12 bytes need");
  expect("", "empty");
  expect("ix,iy,iz\n", "not a .npy file");
  std::filesystem::remove(in);
  expect_failure({"sample", "--seed", "1", "--alpha", "1", "--input", in}, "", in + ": No such file or directory");
  expect_failure({"sample", "--seed", "1", "--alpha", "1", "--input", directory.path("in.txt")}, "",
                 "in.txt: a file is named .csv, .npy or");
}

TEST(Errors, Calls) {
  expect_failure({"sample", "--normals", "--sampler", "bounded", "--seed", "1", "--alpha", "1"}, "ix,iy,iz\n0,0,1\n",
                 "sampler: bounded does not fit sample_normal");
}

TEST(Errors, Servers) {
  const Directory directory;
  expect_failure({"sample", "--seed", "1", "--alpha", "1", "--remote", "unix:" + directory.path("none.sock")},
                 "ix,iy,iz\n0,0,1\n", "none.sock");
}

TEST(Errors, CommandLine) {
  expect_failure({"sample", "--sampler", "best"}, "", "\"best\" is not one of ndf|heitz|cap|bounded|exact", 2);
  expect_failure({"sample", "--seed", "one"}, "", "--seed", 2);
  expect_failure({"sample", "--alpha", "1", "2", "3"}, "", "3", 2);
  expect_failure({"sample", "--first-id", "1"}, "", "--first-id requires --seed", 2);
  expect_failure({"pdf", "--seed", "1"}, "", "--seed", 2);
  EXPECT_EQ(facetwise({}).code, 2);
  EXPECT_EQ(facetwise({"paint"}).code, 2);
  EXPECT_EQ(facetwise({"verify"}).code, 2);
  EXPECT_EQ(facetwise({"serve"}).code, 2);
}

}  // namespace
}  // namespace facetwise::test
