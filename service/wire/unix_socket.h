// SPDX-License-Identifier: Apache-2.0
// Unix sockets by their path.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>

namespace facetwise::wire {

inline constexpr std::size_t kLongestUnixPath = sizeof(sockaddr_un::sun_path) - 1;

// What is longer than kLongestUnixPath is cut off.
inline sockaddr_un unix_address(std::string_view path) {
  sockaddr_un address = {.sun_family = AF_UNIX, .sun_path = {}};
  path.copy(address.sun_path, kLongestUnixPath);
  return address;
}

// A socket connected to what listens there; -1: none, and errno says why.
inline int connect_unix(std::string_view path) {
  const sockaddr_un address = unix_address(path);
  const int connected = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (connected < 0 || connect(connected, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return connected;
  const int error = errno;
  close(connected);
  errno = error;
  return -1;
}

}  // namespace facetwise::wire
