// SPDX-License-Identifier: Apache-2.0
#include "server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace facetwise::testing {

TemporaryFolder::TemporaryFolder() {
  std::string name = std::filesystem::temp_directory_path() / "facetwise-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) std::abort();
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() { std::filesystem::remove_all(path_); }

ServerProcess::ServerProcess(const std::vector<std::string>& arguments, const std::string& errors_file) {
  std::vector<std::string> words = {FACETWISE_TEST_SERVER};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) std::abort();
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that crashes leaves no server
    if (getppid() != parent) _exit(127);
    dup2(out[1], STDOUT_FILENO);
    dup2(errors_file.empty() ? err[1] : open(errors_file.c_str(), O_WRONLY), STDERR_FILENO);
    execv(pointers[0], pointers.data());
    _exit(127);
  }
  close(out[1]);
  close(err[1]);
  errors_pipe_ = err[0];
  std::FILE* lines = fdopen(out[0], "r");
  char* line = nullptr;
  std::size_t room = 0;
  for (ssize_t length; (length = getline(&line, &room, lines)) > 0;) {
    const std::string text(line, length - 1);
    if (text == "ready") {
      ready_ = true;
      break;
    }
    addresses_.push_back(text);
  }
  std::free(line);
  std::fclose(lines);
}

ServerProcess::~ServerProcess() {
  if (process_ > 0) {
    signal(SIGKILL);
    wait();
  }
  close(errors_pipe_);
}

void ServerProcess::signal(int number) const {
  if (process_ > 0) kill(process_, number);
}

long ServerProcess::status(const std::string& field) const {
  std::ifstream file("/proc/" + std::to_string(process_) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(field + ":")) return std::stol(line.substr(field.size() + 1));
  return -1;
}

int ServerProcess::wait() {
  if (process_ <= 0) return -1;
  char buffer[4096];
  for (ssize_t length; (length = read(errors_pipe_, buffer, sizeof buffer)) > 0;) errors_.append(buffer, length);
  int status = 0;
  waitpid(process_, &status, 0);
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace facetwise::testing
