// SPDX-License-Identifier: Apache-2.0
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <initializer_list>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "facetwise/bsdf.h"

extern char** environ;

namespace facetwise::prove {
namespace {

// Answers requests on descriptor 3: a byte (1: sample, 2: evaluate, at the start 0), the number of lanes in 8, columns of
// floats. What the module prints goes to standard error.
constexpr const char* kHost = R"(
import importlib, importlib.util, os, socket, struct, sys
import numpy as np
os.dup2(2, 1)
sys.dont_write_bytecode = True  # what is beside the module is the user's, and may be of another text of the same second
ask = socket.socket(fileno=3).makefile("rwb")
place = sys.argv[1]
if place.endswith(".py"):
    spec = importlib.util.spec_from_file_location(os.path.basename(place)[:-3], place)
    bsdf = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bsdf)
else:
    sys.path.insert(0, os.getcwd())
    bsdf = importlib.import_module(place)
bsdf.sample, bsdf.evaluate
ask.write(b"\0")
ask.flush()
while header := ask.read(9):
    what, count = struct.unpack("<BQ", header)
    columns = np.frombuffer(ask.read(32 * count), dtype="<f4").reshape(8, count)
    i, alpha, rest = columns[:3].T, columns[3:5].T, columns[5:].T
    with np.errstate(all="ignore"):
        answer = bsdf.sample(i, alpha, rest) if what == 1 else bsdf.evaluate(i, alpha, rest)
    parts = [np.asarray(part, dtype="<f4") for part in answer]
    shapes = [(count, 3), (count,), (count,)] if what == 1 else [(count,), (count,)]
    for part, shape in zip(parts, shapes, strict=True):
        if part.shape != shape:
            raise ValueError(f"{'sample' if what == 1 else 'evaluate'}: an array of shape {part.shape} instead of {shape}")
        ask.write(np.ascontiguousarray(part.T).tobytes())
    ask.flush()
)";

class Python : public Bsdf {
 public:
  Python(std::string module, int socket, pid_t process)
      : module_(std::move(module)), socket_(socket), process_(process) {}
  ~Python() override {
    close(socket_);  // which ends it
    waitpid(process_, nullptr, 0);
  }

  std::string name() const override { return module_; }
  absl::Status start() {
    char ready = 0;
    return receive(&ready, 1) ? absl::OkStatus() : ended("reading the module");
  }
  absl::Status sample(Lanes& lanes) override {
    return call(1, "sample", lanes, {&lanes.u1, &lanes.u2, &lanes.u3},
                {&lanes.ox, &lanes.oy, &lanes.oz, &lanes.pdf, &lanes.weight});
  }
  absl::Status evaluate(Lanes& lanes) override {
    return call(2, "evaluate", lanes, {&lanes.ox, &lanes.oy, &lanes.oz}, {&lanes.pdf, &lanes.value});
  }

 private:
  using Columns = std::initializer_list<std::vector<float>*>;
  absl::Status call(char what, const char* function, Lanes& lanes, Columns in, Columns out) {
    const std::uint64_t count = lanes.count();
    bool good = send_all(&what, 1) && send_all(&count, sizeof count);
    for (const auto* column : {&lanes.ix, &lanes.iy, &lanes.iz, &lanes.alpha_x, &lanes.alpha_y})
      good = good && send_all(column->data(), count * sizeof(float));
    for (const auto* column : in) good = good && send_all(column->data(), count * sizeof(float));
    for (auto* column : out) good = good && receive(column->data(), count * sizeof(float));
    return good ? absl::OkStatus() : ended(absl::StrCat(function, "()"));
  }
  absl::Status ended(const std::string& when) const {
    return absl::UnavailableError(absl::StrCat(module_, ": Python ended in ", when, "; what it said is above"));
  }
  bool send_all(const void* data, std::size_t size) const {
    const char* from = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t sent = send(socket_, from, size, MSG_NOSIGNAL);
      if (sent <= 0) return false;
      from += sent;
      size -= static_cast<std::size_t>(sent);
    }
    return true;
  }
  bool receive(void* data, std::size_t size) const {
    char* to = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t got = recv(socket_, to, size, 0);
      if (got <= 0) return false;
      to += got;
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }

  const std::string module_;
  const int socket_;
  const pid_t process_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Bsdf>> open_python(const std::string& module, const std::string& python) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    return absl::ResourceExhaustedError(absl::StrCat("socketpair: ", std::generic_category().message(errno)));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 3);
  std::string arguments[] = {python, "-c", kHost, module};
  char* argv[] = {arguments[0].data(), arguments[1].data(), arguments[2].data(), arguments[3].data(), nullptr};
  pid_t process = -1;
  const int error = posix_spawnp(&process, python.c_str(), &actions, nullptr, argv, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    close(ends[0]);
    return absl::NotFoundError(absl::StrCat(python, ": ", std::generic_category().message(error)));
  }
  auto bsdf = std::make_unique<Python>(module, ends[0], process);
  if (auto status = bsdf->start(); !status.ok()) return status;
  return bsdf;
}

}  // namespace facetwise::prove
