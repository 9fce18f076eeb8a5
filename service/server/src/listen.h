// The addresses that a server listens on.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace facetwise {

// A Unix socket's path, held by a lock beside it: gRPC would let a second server on the same path take the
// first one's place without a word.
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
// "HOST:PORT" with another port.
std::string with_port(const std::string& address, int port);

}  // namespace facetwise
