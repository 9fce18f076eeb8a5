// SPDX-License-Identifier: Apache-2.0
// The addresses that a server listens on.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace facetwise {

// A Unix socket's path, held by a lock beside it. A server has to remove the socket that a dead one left, and without the lock
// it would remove a living one's.
class SocketLock {
 public:
  SocketLock() = default;
  ~SocketLock();  // removes the socket and the lock file
  SocketLock(SocketLock&& other) noexcept;
  SocketLock& operator=(SocketLock&& other) noexcept;

  // Locks PATH.lock and removes a socket that a dead server left. Unavailable if a server has the lock.
  static absl::StatusOr<SocketLock> take(const std::string& path);

 private:
  std::string path_;
  int file_ = -1;
};

// "unix:PATH": PATH. Anything else: empty.
std::string unix_path(const std::string& address);
// OK if `address` is "unix:PATH" or "HOST:PORT", the host being this machine's loopback unless `anywhere`.
absl::Status check_address(const std::string& address, bool anywhere);

// A file descriptor that is closed with it.
class Socket {
 public:
  explicit Socket(int file = -1) : file_(file) {}
  ~Socket();
  Socket(Socket&& other) noexcept;
  Socket& operator=(Socket&& other) noexcept;
  int file() const { return file_; }

 private:
  int file_;
};

// What listens on an address: a host may have several. Unavailable, naming the address, where that cannot be.
struct Listening {
  std::vector<Socket> sockets;
  std::string address;  // with the port that was taken, where it said 0
};
// A Unix socket gets `unix_mode`, before anybody can connect; its SocketLock must be held.
absl::StatusOr<Listening> listen_on(const std::string& address, unsigned unix_mode);

}  // namespace facetwise
