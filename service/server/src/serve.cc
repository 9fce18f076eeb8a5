// SPDX-License-Identifier: Apache-2.0
// A server process: from start to the signal that ends it.
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "facetwise/server.h"

namespace facetwise {
namespace {

int signal_pipe[2] = {-1, -1};

void on_signal(int) {
  const int saved = errno;
  const char byte = 0;
  [[maybe_unused]] const auto written = write(signal_pipe[1], &byte, 1);
  errno = saved;
}

// SIGTERM and SIGINT, each caught once: the second does what it does by default. A pipe, not sigwait: threads
// that were there before would not have the signals blocked.
class Signals {
 public:
  absl::Status install() {
    if (pipe2(signal_pipe, O_CLOEXEC) != 0)
      return absl::InternalError(absl::StrCat("cannot make a pipe: ", std::strerror(errno)));
    struct sigaction action = {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
    sigaction(SIGTERM, &action, &term_);
    sigaction(SIGINT, &action, &int_);
    installed_ = true;
    return absl::OkStatus();
  }
  void wait() const {
    char byte;
    while (read(signal_pipe[0], &byte, 1) < 0 && errno == EINTR) {
    }
  }
  ~Signals() {
    if (!installed_) return;
    sigaction(SIGTERM, &term_, nullptr);
    sigaction(SIGINT, &int_, nullptr);
    for (int& end : signal_pipe) close(std::exchange(end, -1));
  }

 private:
  bool installed_ = false;
  struct sigaction term_ = {}, int_ = {};
};

}  // namespace

absl::Status serve(const ServerOptions& options, const std::function<void(const Server&)>& ready) {
  tune_malloc();
  // As many connections as the system allows.
  if (rlimit files; getrlimit(RLIMIT_NOFILE, &files) == 0 && files.rlim_cur < files.rlim_max) {
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
  }
  Signals signals;
  if (auto status = signals.install(); !status.ok()) return status;
  auto server = Server::start(options);
  if (!server.ok()) return server.status();
  if (ready) ready(**server);
  signals.wait();
  (*server)->drain();
  return absl::OkStatus();
}

}  // namespace facetwise
