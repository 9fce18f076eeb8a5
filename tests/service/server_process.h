// SPDX-License-Identifier: Apache-2.0
// A facetwise server in a process of its own, for as long as the object lives.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace facetwise::testing {

// A directory that is removed, with what is in it, at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string path(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

class ServerProcess {
 public:
  // Starts the test server and waits until it is ready, or has ended.
  // With `errors_file`, stderr goes there.
  explicit ServerProcess(const std::vector<std::string>& arguments, const std::string& errors_file = "");
  ~ServerProcess();  // kills it if it still runs
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  bool ready() const { return ready_; }
  const std::vector<std::string>& addresses() const { return addresses_; }
  void signal(int number) const;
  // Of the process now, from /proc/PID/status: "VmRSS" (in KiB), "Threads".
  long status(const std::string& field) const;
  // Waits until it ends: the exit code, or minus the signal.
  int wait();
  // What it wrote to stderr. After wait().
  const std::string& errors() const { return errors_; }

 private:
  pid_t process_ = -1;
  int errors_pipe_ = -1;
  bool ready_ = false;
  std::vector<std::string> addresses_;
  std::string errors_;
};

}  // namespace facetwise::testing
