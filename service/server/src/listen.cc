// SPDX-License-Identifier: Apache-2.0
#include "src/listen.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <memory>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "wire/unix_socket.h"

namespace facetwise {
namespace {

constexpr const char* kUnix = "unix:";
constexpr int kFlags = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, kBacklog = 1024;

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
    if (path.empty()) return invalid("has no path: write unix:PATH");
    if (path.size() > wire::kLongestUnixPath)
      return invalid(absl::StrCat("is too long a path: ", wire::kLongestUnixPath, " bytes at most"));
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

Socket::~Socket() {
  if (file_ >= 0) close(file_);
}

Socket::Socket(Socket&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

Socket& Socket::operator=(Socket&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

absl::StatusOr<Listening> listen_on(const std::string& address, unsigned unix_mode) {
  const auto unavailable = [&](const char* why) {
    return absl::UnavailableError(absl::StrCat(address, ": cannot listen there: ", why));
  };
  Listening listening{.sockets = {}, .address = address};
  if (const std::string path = unix_path(address); !path.empty()) {
    const sockaddr_un where = wire::unix_address(path);
    Socket socket(::socket(AF_UNIX, kFlags, 0));
    if (socket.file() < 0 || bind(socket.file(), reinterpret_cast<const sockaddr*>(&where), sizeof where) != 0 ||
        chmod(path.c_str(), unix_mode) != 0 || listen(socket.file(), kBacklog) != 0)
      return unavailable(std::strerror(errno));
    listening.sockets.push_back(std::move(socket));
    return listening;
  }

  const auto colon = address.rfind(':');
  std::string host = address.substr(0, colon), port = address.substr(colon + 1);
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  addrinfo wanted = {};
  wanted.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); error != 0)
    return unavailable(gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, freeaddrinfo);
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    sockaddr_storage where = {};
    std::memcpy(&where, one->ai_addr, one->ai_addrlen);
    // Each of a host's addresses has the same port.
    in_port_t& its_port = where.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(where).sin6_port
                                                      : reinterpret_cast<sockaddr_in&>(where).sin_port;
    its_port = htons(static_cast<in_port_t>(std::stoi(port)));
    Socket socket(::socket(where.ss_family, kFlags, 0));
    const int on = 1, off = 0;
    setsockopt(socket.file(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (where.ss_family == AF_INET6) setsockopt(socket.file(), IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
    socklen_t size = one->ai_addrlen;
    if (socket.file() < 0 || bind(socket.file(), reinterpret_cast<const sockaddr*>(&where), size) != 0 ||
        listen(socket.file(), kBacklog) != 0 ||
        getsockname(socket.file(), reinterpret_cast<sockaddr*>(&where), &size) != 0) {
      // "localhost" names an IPv6 address where there may be none.
      if (one->ai_next == nullptr && listening.sockets.empty()) return unavailable(std::strerror(errno));
      if (errno == EADDRNOTAVAIL || errno == EAFNOSUPPORT) continue;
      return unavailable(std::strerror(errno));
    }
    port = absl::StrCat(ntohs(its_port));
    listening.sockets.push_back(std::move(socket));
  }
  if (listening.sockets.empty()) return unavailable("not an address of this machine");
  listening.address = absl::StrCat(address.substr(0, colon + 1), port);
  return listening;
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
