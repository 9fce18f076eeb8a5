// SPDX-License-Identifier: Apache-2.0
// Tables as bytes: the same bits come back, and nothing else is taken.
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "gtest/gtest.h"
#include "table/densities.h"

namespace facetwise::test {
namespace {

std::shared_ptr<const SlopeTable> small_table() {
  return build(ggx, {.radial = true, .grid = 17, .incidence = 5, .slopes = 5, .uniforms = 8});
}

// A file of this test's own, gone with it.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name)
      : path_(testing::TempDir() + "facetwise_" + testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
              name) {}
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }
  void write(std::string_view bytes) const {
    std::ofstream(path_, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::string path_;
};

std::string refusal(std::string_view bytes) { return std::string(SlopeTable::parse(bytes).status().message()); }

TEST(SlopeTableFile, SameBits) {
  const TemporaryFile file("table");
  for (const SlopeTable* table : {&ggx_table(), &coarse_table()}) {
    ASSERT_TRUE(table->save(file.path()).ok());
    const auto loaded = SlopeTable::load(file.path());
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    EXPECT_EQ((*loaded)->serialise(), table->serialise());
    EXPECT_EQ((*loaded)->id(), table->id());
    EXPECT_EQ((*loaded)->description(), table->description());
    EXPECT_EQ((*loaded)->bytes(), table->bytes());
    EXPECT_EQ((*loaded)->p22(0.3, 0.4), table->p22(0.3, 0.4));
    const auto any = SlopeTable::load_any(file.path(), {});
    ASSERT_TRUE(any.ok()) << any.status();
    EXPECT_EQ((*any)->id(), table->id());
  }
}

TEST(SlopeTableFile, EveryByteCounts) {
  const std::string bytes = small_table()->serialise();
  ASSERT_TRUE(SlopeTable::parse(bytes).ok());
  for (std::size_t k = 0; k < bytes.size(); ++k)
    for (const char flip : {'\x01', '\x80', '\xff'}) {
      std::string wrong = bytes;
      wrong[k] = static_cast<char>(wrong[k] ^ flip);
      ASSERT_FALSE(SlopeTable::parse(wrong).ok()) << "byte " << k;
      if (k < 2048) continue;
      break;
    }
  for (std::size_t k = 0; k < bytes.size(); ++k)
    ASSERT_FALSE(SlopeTable::parse(std::string_view(bytes).substr(0, k)).ok()) << k << " bytes";
  EXPECT_NE(refusal(bytes + "x").find("corrupted"), std::string::npos);
}

TEST(SlopeTableFile, ErrorsSayWhatToDo) {
  const std::string bytes = small_table()->serialise();
  EXPECT_EQ(refusal(""), "not a table of slopes; make one with SlopeTable::save");
  EXPECT_NE(refusal(bytes.substr(0, 500)).find("truncated: 500 bytes of "), std::string::npos);
  std::string wrong = bytes;
  wrong[8] = 2;
  EXPECT_EQ(refusal(wrong), "version 2; this facetwise reads version 1: rebuild the table");
  wrong = bytes;
  wrong[100] ^= 1;
  EXPECT_EQ(refusal(wrong), "corrupted: its hash is another; copy it again or rebuild it");
  const auto missing = SlopeTable::load("/nonexistent/table").status();
  EXPECT_EQ(missing.message(), "/nonexistent/table: cannot open: No such file or directory");
  EXPECT_EQ(small_table()->save("/nonexistent/table").message(),
            "/nonexistent/table: cannot create: No such file or directory");
}

// The right hash does not make a table.
TEST(SlopeTableFile, ValuesAreChecked) {
  std::string bytes = small_table()->serialise();
  const auto put = [&](std::size_t value, float to) {
    std::string wrong = bytes;
    std::memcpy(wrong.data() + 40 + 4 * value, &to, 4);
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (std::size_t k = 0; k < wrong.size() - 8; ++k)
      hash = (hash ^ static_cast<unsigned char>(wrong[k])) * 0x100000001b3u;
    std::memcpy(wrong.data() + wrong.size() - 8, &hash, 8);
    return refusal(wrong);
  };
  EXPECT_EQ(put(0, -1), "a density or area of -1; rebuild it");
  EXPECT_EQ(put(17 + 1025 + 3, 2), "a row of samples does not rise; rebuild it");
}

TEST(SlopeTableFile, Text) {
  const TemporaryFile file("text");
  const SlopeTable::Options options{.grid = 17, .incidence = 5, .slopes = 5, .uniforms = 8, .azimuths = 4};
  const auto load = [&](std::string_view text) {
    file.write(text);
    return SlopeTable::load_any(file.path(), options);
  };
  const auto refused = [&](std::string_view text) {
    const std::string message(load(text).status().message());
    EXPECT_EQ(message.find(file.path() + ": "), 0u);
    return message.substr(std::min(message.size(), file.path().size() + 2));
  };
  const auto table = load("facetwise-slopes 1 3 2 -1 1 -2 2\n0 1 0\n0 2 0.5e0\n");
  ASSERT_TRUE(table.ok()) << table.status();
  const double values[] = {0, 1, 0, 0, 2, 0.5};
  EXPECT_EQ((*table)->id(), (*SlopeTable::from_grid(values, 3, 2, {-1, 1}, {-2, 2}, options))->id());

  EXPECT_EQ(refused("facetwise-slopes 2 3 2 -1 1 -2 2\n"),
            "the first line is not \"facetwise-slopes 1 nx ny x_min x_max y_min y_max\"");
  EXPECT_EQ(refused("facetwise-slopes 1 3 2 -1 1 -2\n"),
            "the first line needs \"nx ny x_min x_max y_min y_max\" after the version");
  EXPECT_EQ(refused("facetwise-slopes 1 3 2 -1 1 -2 2\n1 2 3 4 5 x"), "value 6 of 6 is not a number");
  EXPECT_EQ(refused("facetwise-slopes 1 2 2 -1 1 -2 2\n1 2 3 4 5"), "more than 4 values");
  EXPECT_EQ(refused("facetwise-slopes 1 2000000000 2000000000 -1 1 -2 2\n1 2 3 4 5"),
            "the first line announces 2000000000 times 2000000000 values, more than there are");
  EXPECT_EQ(refused("facetwise-slopes 1 2 2 -1 1 -2 2\n1 2 3 nan"),
            "values[3]: nan; densities are finite and not negative");
  EXPECT_EQ(refused("m_x m_y"), "neither a saved table nor text that begins with \"facetwise-slopes\"");
}

}  // namespace
}  // namespace facetwise::test
