// SPDX-License-Identifier: Apache-2.0
// render: the command's pictures.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>

#include "facetwise/render.h"
#include "tests/app/command.h"

namespace facetwise::test {
namespace {

TEST(RenderVerb, TheSameHereAndOnAServer) {
  const Directory directory;
  const Server server(directory);
  const auto picture = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"render", "glass",         "--width", "48",       "--samples",
                                          "3",      "--environment", "city",    "--output", directory.path(name)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = facetwise(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_NE(result.out.find("Embree"), std::string::npos) << result.out;
    return read_file(directory.path(name));
  };
  const std::string here = picture("here.exr", {});
  EXPECT_EQ(here, picture("there.exr", {"--remote", server.address()}));
  EXPECT_NE(here, picture("other.exr", {"--seed", "2"}));
}

TEST(RenderVerb, ResumesWhatIsThere) {
  const Directory directory;
  const auto run = [&](const std::string& name, const std::string& samples) {
    const auto result = facetwise({"render", "orb", "--width", "32", "--samples", samples, "--resume", "--output",
                                   directory.path(name), "--png", directory.path(name + ".png")});
    EXPECT_EQ(result.code, 0) << result.err;
  };
  run("whole.exr", "8");
  run("parts.exr", "3");
  run("parts.exr", "8");
  EXPECT_EQ(read_file(directory.path("whole.exr")), read_file(directory.path("parts.exr")));
  EXPECT_EQ(read_file(directory.path("whole.exr.png")), read_file(directory.path("parts.exr.png")));
}

TEST(RenderVerb, StoppedItWritesWhatIsDone) {
  const Directory directory;
  const std::string output = directory.path("stopped.exr");
  // More than an hour of work.
  const std::string command = "timeout --preserve-status --signal=INT 2 " FACETWISE_COMMAND
                              " render orbs --width 256 --samples 1000000 --output " +
                              output + " > /dev/null 2>&1";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const auto picture = render::load_exr(output);
  ASSERT_TRUE(picture.ok()) << picture.status();
  EXPECT_GT(picture->samples(), 0u);
  EXPECT_LT(picture->samples(), 1000000u);
}

TEST(RenderVerb, SaysWhatIsWrong) {
  const Directory directory;
  const std::string output = directory.path("picture.exr"), missing = directory.path("no.glb");
  struct {
    std::vector<std::string> arguments;
    int code;
    std::string says;
  } const cases[] = {
      {{"render", "orb"}, 1, "--output"},
      {{"render", "teapot", "--output", output}, 1, "orbs"},
      {{"render", missing, "--output", output}, 1, missing},
      {{"render", "--environment", "moonrise", "--output", output}, 1, "forest"},
      {{"render", "--alpha", "rough", "--output", output}, 1, "--alpha"},
      {{"render", "--sampler", "best", "--output", output}, 2, "exact"},
      {{"render", "--depth", "0", "--output", output}, 1, "depth"},
      {{"render", "--distribution", "phong", "--masking", "vcavity", "--sampler", "cap", "--output", output},
       1,
       "sampler"},
      {{"render", "orb", "--width", "8", "--samples", "1", "--output", directory.path("no/such/picture.exr")},
       1,
       "no/such/picture.exr"},
  };
  for (const auto& [arguments, code, says] : cases) {
    const auto result = facetwise(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_NE(result.err.find(says), std::string::npos) << result.err;
  }
  EXPECT_TRUE(directory.files().empty());
}

}  // namespace
}  // namespace facetwise::test
