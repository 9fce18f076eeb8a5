// SPDX-License-Identifier: Apache-2.0
#include "tests/app/command.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

namespace facetwise::test {
namespace {

// Starts the command with files as its standard streams; files, unlike pipes, never fill.
pid_t start(const std::vector<std::string>& arguments, const std::string& in, const std::string& out,
            const std::string& err) {
  std::vector<char*> argv = {const_cast<char*>(FACETWISE_COMMAND)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t process = ::fork();
  if (process != 0) return process;
  const int streams[] = {::open(in.c_str(), O_RDONLY), ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600),
                         ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600)};
  for (int k = 0; k < 3; ++k) ::dup2(streams[k], k);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

int wait_for(pid_t process) {
  int status = 0;
  ::waitpid(process, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Directory::Directory() {
  std::string name = (std::filesystem::temp_directory_path() / "facetwise-test-XXXXXX").string();
  path_ = ::mkdtemp(name.data());
}

Directory::~Directory() { std::filesystem::remove_all(path_); }

std::vector<std::string> Directory::files() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(path_))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

void write_file(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Result facetwise(const std::vector<std::string>& arguments, const std::string& input) {
  const Directory directory;
  write_file(directory.path("in"), input);
  Result result;
  result.code = wait_for(start(arguments, directory.path("in"), directory.path("out"), directory.path("err")));
  result.out = read_file(directory.path("out"));
  result.err = read_file(directory.path("err"));
  return result;
}

Server::Server(const Directory& directory, const std::string& name, const std::vector<std::string>& options)
    : address_("unix:" + directory.path(name)) {
  std::vector<std::string> arguments = {"serve", "--listen", address_};
  arguments.insert(arguments.end(), options.begin(), options.end());
  process_ = start(arguments, "/dev/null", directory.path(name + ".out"), directory.path(name + ".err"));
  // info waits for the server itself; a few tries cover a slow start.
  for (int attempt = 0; attempt < 100; ++attempt) {
    if (facetwise({"info", "--remote", address_}).code == 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ADD_FAILURE() << "the server did not start: " << read_file(directory.path(name + ".err"));
}

Server::~Server() {
  if (process_ > 0) stop();
}

int Server::stop() {
  ::kill(process_, SIGTERM);
  const int code = wait_for(process_);
  process_ = -1;
  return code;
}

}  // namespace facetwise::test
