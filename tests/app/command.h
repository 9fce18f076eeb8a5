// SPDX-License-Identifier: Apache-2.0
// Running the facetwise command as a process.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace facetwise::test {

struct Result {
  int code = -1;  // exit code; -1 if a signal ended it
  std::string out, err;
};

// Runs `facetwise ARGUMENTS...` with `input` as its standard input, and waits for its end.
Result facetwise(const std::vector<std::string>& arguments, const std::string& input = "");

// A directory of the test's own, removed with everything in it.
class Directory {
 public:
  Directory();
  ~Directory();
  Directory(const Directory&) = delete;
  std::string path(const std::string& name) const { return (path_ / name).string(); }
  std::vector<std::string> files() const;  // sorted names, hidden ones too

 private:
  std::filesystem::path path_;
};

void write_file(const std::string& path, const std::string& bytes);
std::string read_file(const std::string& path);

// `facetwise serve` as a process, listening on a Unix socket when the constructor returns.
class Server {
 public:
  explicit Server(const Directory& directory, const std::string& name = "server.sock",
                  const std::vector<std::string>& options = {});
  ~Server();
  const std::string& address() const { return address_; }
  int stop();  // SIGTERM; the exit code

 private:
  std::string address_;
  pid_t process_ = -1;
};

}  // namespace facetwise::test
