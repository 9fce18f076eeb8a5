// SPDX-License-Identifier: Apache-2.0
// CSV and .npy tables.
#include "app/table/table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "app/errors.h"
#include "app/table/formats.h"
#include "app/table/npy_header.h"
#include "tests/app/command.h"
#include "tests/app/npy_file.h"

namespace facetwise::app {
namespace {

using test::Directory, test::npy_file, test::write_file;

std::string csv_error(const std::string& text) {
  const auto table = parse_csv("t.csv", text);
  if (!table.ok()) return message(table.status());
  for (std::size_t k = 0; k < (*table)->names().size(); ++k)
    if (const auto column = (*table)->column(k); !column.ok()) return message(column.status());
  return "no error";
}

TEST(Csv, AcceptsSpacesCrLfByteOrderMarkAndNoFinalLineEnd) {
  const auto table = parse_csv("t.csv", "\xEF\xBB\xBFix, iy\r\n 1 ,\t-2.5e-1\r\n+3,nan\r\n\r\n4,-inf");
  ASSERT_FALSE(table.ok()) << "the blank line is inside the table";
  const auto good = parse_csv("t.csv", "\xEF\xBB\xBFix, iy\r\n 1 ,\t-2.5e-1\r\n+3,nan\r\n4,-inf\r\n\r\n");
  ASSERT_TRUE(good.ok()) << good.status();
  ASSERT_EQ((*good)->rows(), 3u);
  EXPECT_EQ((*good)->names()[1], "iy");
  const auto x = *(*good)->column(0), y = *(*good)->column(1);
  EXPECT_EQ(x[0], 1.0f);
  EXPECT_EQ(x[1], 3.0f);
  EXPECT_EQ(y[0], -0.25f);
  EXPECT_TRUE(std::isnan(y[1]));
  EXPECT_EQ(y[2], -std::numeric_limits<float>::infinity());
}

TEST(Csv, NumbersBeyondFloatAreZeroOrInfinity) {
  const auto table = parse_csv("t.csv", "a\n1e-60\n1e60\n1e-42\n");
  ASSERT_TRUE(table.ok()) << table.status();
  const auto a = *(*table)->column(0);
  EXPECT_EQ(a[0], 0.0f);
  EXPECT_EQ(a[1], std::numeric_limits<float>::infinity());
  EXPECT_EQ(a[2], 1e-42f);
}

TEST(Csv, ErrorsNameFileLineAndColumn) {
  EXPECT_EQ(csv_error(""), "t.csv: empty; the first line names the columns");
  EXPECT_EQ(csv_error(" \n"), "t.csv: empty; the first line names the columns");
  EXPECT_EQ(csv_error("ix,,iz\n"), "t.csv, line 1: a column without a name");
  EXPECT_EQ(csv_error("ix,iy,ix\n"), "t.csv, line 1: column ix twice");
  EXPECT_EQ(csv_error("ix,iy\n1,2\n1,2x\n"), "t.csv, line 3, column iy: \"2x\" is not a number");
  EXPECT_EQ(csv_error("ix,iy\n1,\n"), "t.csv, line 2, column iy: \"\" is not a number");
  EXPECT_EQ(csv_error("ix,iy\n1,0x10\n"), "t.csv, line 2, column iy: \"0x10\" is not a number");
  EXPECT_EQ(csv_error("ix,iy\n1,2\n1\n"), "t.csv, line 3: 1 values for 2 columns");
  EXPECT_EQ(csv_error("ix,iy\n1,2,3\n"), "t.csv, line 2: 3 values for 2 columns");
  EXPECT_EQ(csv_error("ix,iy\n\n1,2\n"), "t.csv, line 2: 1 values for 2 columns");
  EXPECT_EQ(csv_error("ix,iy\n1,\"2\n"), "t.csv, line 2: a quote without its end, or text behind it");
  EXPECT_EQ(csv_error("ix,\"iy\"x\n1,2\n"), "t.csv, line 1: a quote without its end, or text behind it");
}

TEST(Csv, SemicolonsTabsAndQuotes) {
  for (const std::string text :
       {"\"ix\";\"a name\"\n1;2.5\n\"3\"; \"-4\" \n", "ix\ta name\n1\t2.5\n3\t-4\n", "ix,\"a name\"\n1,2.5\n3,-4\n"}) {
    const auto table = parse_csv("t.csv", text);
    ASSERT_TRUE(table.ok()) << table.status();
    ASSERT_EQ((*table)->rows(), 2u) << text;
    EXPECT_EQ((*table)->names()[1], "a name");
    const auto x = *(*table)->column(0), y = *(*table)->column(1);
    EXPECT_EQ(x[0], 1.0f);
    EXPECT_EQ(x[1], 3.0f);
    EXPECT_EQ(y[0], 2.5f);
    EXPECT_EQ(y[1], -4.0f);
  }
}

TEST(Csv, WritingAndReadingGivesTheSameBits) {
  const Directory directory;
  const std::string path = directory.path("t.csv");
  constexpr std::size_t kRows = 20000;
  std::mt19937 random(7);
  std::vector<float> values(kRows);
  for (auto& value : values) {
    do value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    while (std::isnan(value));
  }
  const app::TableColumns names{.floats = {"pdf"}};
  auto output = create_table(path, names, kRows);
  ASSERT_TRUE(output.ok()) << output.status();
  for (std::size_t k = 0; k < kRows; ++k) {
    (*output)->column(0)[k] = values[k];
    (*output)->byte_column(0)[k] = static_cast<std::uint8_t>(k % 4);
  }
  ASSERT_TRUE((*output)->commit().ok());
  const auto input = read_table(path);
  ASSERT_TRUE(input.ok()) << input.status();
  ASSERT_EQ((*input)->rows(), kRows);
  const auto pdf = *(*input)->column(0), status = *(*input)->column(1);
  for (std::size_t k = 0; k < kRows; ++k) {
    ASSERT_EQ(std::bit_cast<std::uint32_t>(pdf[k]), std::bit_cast<std::uint32_t>(values[k])) << values[k];
    ASSERT_EQ(status[k], static_cast<float>(k % 4));
  }
}

TEST(Output, AppearsOnCommitAndLeavesNothingWithoutIt) {
  const Directory directory;
  const app::TableColumns names{.floats = {"pdf"}};
  for (const char* name : {"t.csv", "t.npy"}) {
    const std::string path = directory.path(name);
    write_file(path, "old");
    {
      const auto abandoned = create_table(path, names, 10);
      ASSERT_TRUE(abandoned.ok()) << abandoned.status();
      EXPECT_EQ(test::read_file(path), "old");
    }
    EXPECT_EQ(test::read_file(path), "old");
    const auto committed = create_table(path, names, 10);
    ASSERT_TRUE(committed.ok()) << committed.status();
    ASSERT_TRUE((*committed)->commit().ok());
    EXPECT_NE(test::read_file(path), "old");
  }
  EXPECT_EQ(directory.files(), (std::vector<std::string>{"t.csv", "t.npy"})) << "no temporary file is left";
}

TEST(Output, FollowsLinksAndRefusesWhatIsNoFile) {
  const Directory directory;
  const app::TableColumns names{.floats = {"pdf"}};
  write_file(directory.path("real.csv"), "old");
  std::filesystem::create_symlink("real.csv", directory.path("link.csv"));
  const auto table = create_table(directory.path("link.csv"), names, 1);
  ASSERT_TRUE(table.ok()) << table.status();
  ASSERT_TRUE((*table)->commit().ok());
  EXPECT_TRUE(std::filesystem::is_symlink(directory.path("link.csv")));
  EXPECT_EQ(test::read_file(directory.path("real.csv")), "pdf,status\n0,0\n");
  std::filesystem::create_directory(directory.path("d.csv"));
  EXPECT_EQ(message(create_table(directory.path("d.csv"), names, 1).status()),
            directory.path("d.csv") + ": not a regular file");
  EXPECT_FALSE(create_table(directory.path("none/t.csv"), names, 1).ok());
  EXPECT_FALSE(create_table(directory.path("t.txt"), names, 1).ok());
}

TEST(Npy, ReadsEveryVersionAnyOrderAndPadding) {
  const Directory directory;
  std::string records;
  for (int row = 0; row < 5; ++row) {
    records += "abcd";  // an unnamed field
    test::append(records, 10.0f + static_cast<float>(row));
    records.append(8, 'x');  // a double
    test::append(records, 20.0f + static_cast<float>(row));
    records.append(12, 'y');  // an array
  }
  const std::string header =
      "{'shape': (5,), 'fortran_order': False, 'descr': [('', '|V4'), ('iy', '<f4'), (('a title', 'd'), "
      "'<f8'), "
      "(\"ix\", '<f4'), ('v', '<f4', (3,))]}";
  for (const int version : {1, 2, 3}) {
    write_file(directory.path("t.npy"), npy_file(header, records, version));
    const auto table = read_table(directory.path("t.npy"));
    ASSERT_TRUE(table.ok()) << table.status();
    ASSERT_EQ((*table)->names().size(), 4u);
    EXPECT_EQ((*table)->names()[1], "d");
    const auto y = *(*table)->column(0), x = *(*table)->column(2);
    EXPECT_EQ(y.stride(), 32u) << "in place, not copied";
    ASSERT_EQ(x.count(), 5u);
    for (std::size_t row = 0; row < 5; ++row) {
      EXPECT_EQ(y[row], 10.0f + static_cast<float>(row));
      EXPECT_EQ(x[row], 20.0f + static_cast<float>(row));
    }
    EXPECT_EQ((*(*table)->column(1)).count(), 5u) << "doubles are converted";
    EXPECT_NE(message((*table)->column(3).status()).find("field v is an array of <f4"), std::string::npos);
  }
}

// The same numbers in every type, order of bytes and layout.
TEST(Npy, ConvertsTypesAndReadsPlainArrays) {
  const Directory directory;
  const double values[3][2] = {{1, -0.5}, {0.25, 1024}, {-2, 6.103515625e-05}};  // exact in half precision
  const std::uint16_t halves[3][2] = {{0x3c00, 0xb800}, {0x3400, 0x6400}, {0xc000, 0x0400}};
  const auto bytes_of = [&](const std::string& type, int row, int column) {
    std::string bytes;
    const auto add = [&](auto value) { bytes.assign(reinterpret_cast<const char*>(&value), sizeof value); };
    if (type.substr(1) == "f2") add(halves[row][column]);
    if (type.substr(1) == "f4") add(static_cast<float>(values[row][column]));
    if (type.substr(1) == "f8") add(values[row][column]);
    if (type[0] == '>') std::reverse(bytes.begin(), bytes.end());
    return bytes;
  };
  const std::vector<std::string> names = {"ix", "iy"};
  for (const std::string type : {"<f2", ">f2", "<f4", ">f4", "<f8", ">f8"})
    for (const std::string layout : {"fields", "False", "True"}) {
      std::string data;
      if (layout == "True") {
        for (int column = 0; column < 2; ++column)
          for (int row = 0; row < 3; ++row) data += bytes_of(type, row, column);
      } else {
        for (int row = 0; row < 3; ++row)
          for (int column = 0; column < 2; ++column) data += bytes_of(type, row, column);
      }
      const bool fields = layout == "fields";
      const std::string header =
          fields ? "{'descr': [('ix', '" + type + "'), ('iy', '" + type + "')], 'fortran_order': False, 'shape': (3,)}"
                 : "{'descr': '" + type + "', 'fortran_order': " + layout + ", 'shape': (3, 2)}";
      write_file(directory.path("t.npy"), npy_file(header, data));
      const auto table = read_table(directory.path("t.npy"),
                                    fields ? std::span<const std::string>{} : std::span<const std::string>(names));
      ASSERT_TRUE(table.ok()) << table.status();
      ASSERT_EQ((*table)->rows(), 3u);
      for (std::size_t column = 0; column < 2; ++column) {
        const auto found = *(*table)->column(column);
        for (std::size_t row = 0; row < 3; ++row) EXPECT_EQ(found[row], values[row][column]) << type << " " << layout;
      }
    }
  EXPECT_FALSE(read_table(directory.path("t.npy")).ok()) << "without names";
  const std::vector<std::string> one = {"ix"};
  EXPECT_NE(message(read_table(directory.path("t.npy"), one).status()).find("2 columns, and 1 names"),
            std::string::npos);
  EXPECT_FALSE(read_table(directory.path("t.csv"), names).ok()) << "CSV names its columns itself";
}

TEST(Npy, HalfPrecisionHasAllItsValues) {
  const Directory directory;
  std::string data;
  for (std::uint32_t half = 0; half < 65536; ++half)
    data += {static_cast<char>(half & 0xff), static_cast<char>(half >> 8)};
  write_file(directory.path("t.npy"),
             npy_file("{'descr': [('ix', '<f2')], 'fortran_order': False, 'shape': (65536,)}", data));
  const auto table = read_table(directory.path("t.npy"));
  ASSERT_TRUE(table.ok()) << table.status();
  const auto x = *(*table)->column(0);
  for (std::uint32_t half = 0; half < 65536; ++half) {
    const int exponent = static_cast<int>(half >> 10 & 31), mantissa = static_cast<int>(half & 1023);
    double value = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    if (exponent == 31) value = mantissa == 0 ? INFINITY : NAN;
    if (half & 0x8000) value = -value;
    if (std::isnan(value))
      EXPECT_TRUE(std::isnan(x[half])) << half;
    else
      EXPECT_EQ(x[half], value) << half;
  }
}

TEST(Npy, ReadsRecordsOfOddLength) {
  const Directory directory;
  std::string records;
  for (int row = 0; row < 7; ++row) {
    records += 's';
    test::append(records, static_cast<float>(row));
  }
  write_file(
      directory.path("t.npy"),
      npy_file("{'descr': [('status', '|u1'), ('ix', '<f4')], 'fortran_order': False, 'shape': (7,), }", records));
  const auto table = read_table(directory.path("t.npy"));
  ASSERT_TRUE(table.ok()) << table.status();
  const auto x = *(*table)->column(1);
  ASSERT_EQ(x.count(), 7u);
  for (std::size_t row = 0; row < 7; ++row) EXPECT_EQ(x[row], static_cast<float>(row));
}

TEST(Npy, MalformedFilesAreErrors) {
  const auto error = [](const std::string& file) {
    const auto header = parse_npy_header(file);
    return header.ok() ? "no error" : message(header.status());
  };
  const auto with = [&](const std::string& header) { return error(npy_file(header, std::string(64, '\0'))); };
  const std::string good = "{'descr': [('ix', '<f4')], 'fortran_order': False, 'shape': (16,), }";
  EXPECT_EQ(with(good), "no error");
  EXPECT_EQ(error("ix,iy\n"), "not a .npy file: it does not begin with \\x93NUMPY");
  EXPECT_EQ(error(npy_file(good, std::string(63, '\0'))),
            "truncated: 16 records of 4 bytes need 192 bytes, the file has 191");
  std::string version = npy_file(good, "");
  version[6] = 4;
  EXPECT_EQ(error(version), "version 4 of the .npy format; known are 1, 2 and 3");
  // Every beginning of a good file is truncated, or at first not yet a .npy file.
  const std::string file = npy_file(good, std::string(64, '\0'));
  for (std::size_t size = 6; size < file.size(); ++size)
    EXPECT_EQ(error(file.substr(0, size)).substr(0, 9), "truncated") << size;
  EXPECT_EQ(with("{'descr': '<f4', 'fortran_order': False, 'shape': (16,), }").substr(0, 14), "a plain array,");
  EXPECT_EQ(with("{'descr': [('ix', '<f4')], 'fortran_order': False, 'shape': (4, 4), }").substr(0, 24),
            "an array of 2 dimensions");
  EXPECT_EQ(with("{'descr': [('ix', '<f4')], 'fortran_order': False, 'shape': (), }").substr(0, 24),
            "an array of 0 dimensions");
  EXPECT_EQ(with("{'descr': [('ix', '|O')], 'shape': (16,)}"), "field ix: unknown type \"|O\"");
  EXPECT_EQ(with("{'descr': [('ix', '<f4'), ('ix', '<f4')], 'shape': (1,)}"), "field ix twice");
  EXPECT_EQ(with("{'descr': [('ix',)], 'shape': (1,)}"), "malformed header: a field of descr is not (name, type)");
  // Sizes that overflow are truncations, not small numbers.
  EXPECT_EQ(with("{'descr': [('ix', '<f4')], 'shape': (4611686018427387905,)}").substr(0, 9), "truncated");
  EXPECT_EQ(with("{'descr': [('v', '<f4', (4611686018427387905,))], 'shape': (1,)}").substr(0, 9), "truncated");
  for (const char* header :
       {"", "{", "[]", "{'descr'}", "{'descr': [('ix', '<f4')]}", "{'shape': (1,)}",
        "{'descr': [('ix', '<f4')], 'shape': 1}", "{'descr': [('ix', '<f4')], 'shape': (-1,)}",
        "{'descr': [('ix', '<f4')], 'shape': (1,)} x", "{'descr: 1}", "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["})
    EXPECT_EQ(with(header), "malformed header: no descr and shape in it") << header;
}

TEST(Npy, WhatIsWrittenIsRead) {
  const Directory directory;
  const std::string path = directory.path("t.npy");
  const app::TableColumns names{.floats = {"pdf", "weight"}};
  for (const std::size_t rows : {0, 1, 1000}) {
    auto output = create_table(path, names, rows);
    ASSERT_TRUE(output.ok()) << output.status();
    for (std::size_t row = 0; row < rows; ++row) {
      (*output)->column(0)[row] = 0.5f + static_cast<float>(row);
      (*output)->column(1)[row] = -static_cast<float>(row);
      (*output)->byte_column(0)[row] = 3;
    }
    ASSERT_TRUE((*output)->commit().ok());
    const auto input = read_table(path);
    ASSERT_TRUE(input.ok()) << input.status();
    ASSERT_EQ((*input)->rows(), rows);
    ASSERT_EQ((*input)->names().size(), 3u);
    const auto pdf = *(*input)->column(0), weight = *(*input)->column(1);
    for (std::size_t row = 0; row < rows; ++row) {
      ASSERT_EQ(pdf[row], 0.5f + static_cast<float>(row));
      ASSERT_EQ(weight[row], -static_cast<float>(row));
    }
  }
}

}  // namespace
}  // namespace facetwise::app
