#include "src/listen.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace facetwise {
namespace {

constexpr const char* kUnix = "unix:";

absl::Status system_error(const std::string& path, const char* what) {
  return absl::UnavailableError(absl::StrCat("unix:", path, ": ", what, ": ", std::strerror(errno)));
}

std::string lock_path(const std::string& path) { return path + ".lock"; }

}  // namespace

std::string unix_path(const std::string& address) {
  return address.starts_with(kUnix) ? address.substr(std::strlen(kUnix)) : "";
}

absl::Status check_address(const std::string& address, bool anywhere) {
  const auto invalid = [&](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("listen: \"", address, "\" ", what));
  };
  if (address.starts_with(kUnix)) {
    const std::string path = unix_path(address);
    constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
    if (path.empty()) return invalid("has no path: write unix:PATH");
    if (path.size() > kLongest) return invalid(absl::StrCat("is too long a path: ", kLongest, " bytes at most"));
    return absl::OkStatus();
  }
  const auto colon = address.rfind(':');
  int port = -1;
  if (colon == std::string::npos || colon == 0 || !absl::SimpleAtoi(address.substr(colon + 1), &port) || port < 0 ||
      port > 65535)
    return invalid("is neither unix:PATH nor HOST:PORT");
  const std::string host = address.substr(0, colon);
  const bool bracketed = host.starts_with('[') && host.ends_with(']');
  const std::string_view inside =
      bracketed ? std::string_view(host).substr(1, host.size() - 2) : std::string_view(host);
  const char* letters =
      bracketed ? "0123456789abcdefABCDEF:." : "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-.";
  // gRPC reads "unix-abstract:1" and the like as something else than a host.
  static constexpr std::string_view kSchemes[] = {"unix-abstract", "dns", "ipv4",       "ipv6",
                                                  "vsock",         "xds", "passthrough"};
  if (inside.empty() || inside.find_first_not_of(letters) != std::string_view::npos ||
      std::find(std::begin(kSchemes), std::end(kSchemes), inside) != std::end(kSchemes))
    return invalid("is neither unix:PATH nor HOST:PORT");
  const bool loopback = host.starts_with("127.") || host == "localhost" || host == "[::1]";
  if (!loopback && !anywhere)
    return invalid(
        "is open to the network: give a certificate (--tls-certificate, --tls-key), or say that nothing protects it "
        "(--insecure), or listen on 127.0.0.1 or a Unix socket");
  return absl::OkStatus();
}

std::string with_port(const std::string& address, int port) {
  return absl::StrCat(address.substr(0, address.rfind(':') + 1), port);
}

SocketLock::~SocketLock() {
  if (file_ < 0) return;
  unlink(path_.c_str());
  unlink(lock_path(path_).c_str());
  close(file_);  // unlocks; only now, so that nobody can lock the file that was removed and believe it
}

SocketLock::SocketLock(SocketLock&& other) noexcept
    : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}

SocketLock& SocketLock::operator=(SocketLock&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(file_, other.file_);
  return *this;
}

absl::StatusOr<SocketLock> SocketLock::take(const std::string& path) {
  const std::string name = lock_path(path);
  SocketLock lock;
  for (;;) {
    const int file = open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file < 0) return system_error(path, "cannot make its lock file");
    if (flock(file, LOCK_EX | LOCK_NB) != 0) {
      const absl::Status status = errno == EWOULDBLOCK
                                      ? absl::UnavailableError(absl::StrCat(
                                            "unix:", path, ": another server listens there (it holds ", name, ")"))
                                      : system_error(path, "cannot lock its lock file");
      close(file);
      return status;
    }
    // A server that ended in between has removed the file that was locked here: then once more.
    struct stat locked, there;
    if (fstat(file, &locked) == 0 && stat(name.c_str(), &there) == 0 && locked.st_ino == there.st_ino &&
        locked.st_dev == there.st_dev) {
      lock.file_ = file;
      break;
    }
    close(file);
  }
  struct stat there;
  if (lstat(path.c_str(), &there) == 0) {
    if (!S_ISSOCK(there.st_mode)) {
      // Not ours to remove, so the lock goes without it.
      unlink(name.c_str());
      close(std::exchange(lock.file_, -1));
      return absl::UnavailableError(absl::StrCat("unix:", path, ": a file of that name is not a socket"));
    }
    unlink(path.c_str());
  }
  lock.path_ = path;
  return lock;
}

}  // namespace facetwise
