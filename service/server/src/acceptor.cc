// SPDX-License-Identifier: Apache-2.0
#include "src/acceptor.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <utility>

namespace facetwise {
namespace {

// Open files that are none of the connections: sockets that listen, gRPC's own, certificates, tokens.
constexpr std::size_t kOtherFiles = 40;
// How often it is looked whether a connection has gone, where there was no room.
constexpr int kLookMs = 50;

std::size_t most_connections(int wanted) {
  rlimit files;
  if (getrlimit(RLIMIT_NOFILE, &files) != 0 || files.rlim_cur == RLIM_INFINITY) return wanted;
  const std::size_t allowed = files.rlim_cur > kOtherFiles + 1 ? files.rlim_cur - kOtherFiles : 1;
  return std::min<std::size_t>(wanted, allowed);
}

}  // namespace

Connections::Connections(int most) : most_(most_connections(most)) {}

void Connections::add(int file) {
  struct stat status;
  if (fstat(file, &status) != 0) return;
  const std::lock_guard lock(mutex_);
  accepted_.push_back({file, status.st_ino});
}

bool Connections::has_room() const {
  const std::lock_guard lock(mutex_);
  if (accepted_.size() >= most_) forget_closed();
  return accepted_.size() < most_;
}

std::size_t Connections::count() const {
  const std::lock_guard lock(mutex_);
  forget_closed();
  return accepted_.size();
}

// Under the lock.
void Connections::forget_closed() const {
  std::erase_if(accepted_, [](const Accepted& accepted) {
    struct stat status;
    return fstat(accepted.file, &status) != 0 || status.st_ino != accepted.inode;
  });
}

Acceptor::Acceptor(std::vector<Place> places, std::unique_ptr<ToGrpc> to_unix, std::unique_ptr<ToGrpc> to_tcp,
                   std::vector<unsigned> users, Connections& connections, Log& log)
    : places_(std::move(places)),
      to_unix_(std::move(to_unix)),
      to_tcp_(std::move(to_tcp)),
      users_(std::move(users)),
      connections_(connections),
      log_(log),
      ends_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { accept_all(); }) {}

Acceptor::~Acceptor() {
  eventfd_write(ends_.file(), 1);
  thread_.join();
}

void Acceptor::accept_all() {
  std::vector<pollfd> sockets = {{ends_.file(), POLLIN, 0}};
  for (const Place& place : places_) sockets.push_back({place.socket.file(), POLLIN, 0});
  for (bool room = true;;) {
    poll(sockets.data(), room ? sockets.size() : 1, room ? -1 : kLookMs);
    if (sockets[0].revents != 0) return;
    if (!room) {
      room = connections_.has_room();
      continue;
    }
    for (std::size_t k = 0; k < places_.size() && room; ++k)
      if (sockets[k + 1].revents != 0) room = accept_one(places_[k]);
  }
}

bool Acceptor::accept_one(const Place& place) {
  if (!connections_.has_room()) {
    log_.write_some(LogLevel::warning, "connections wait", {{"connections", connections_.most()}});
    return false;
  }
  const int file = accept4(place.socket.file(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (file < 0) return errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM;
  const int on = 1;
  setsockopt(file, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (place.to == to_unix_.get() && !is_welcome(file)) {
    close(file);
    return true;
  }
  connections_.add(file);
  ToGrpc::NewConnectionParameters connection;
  connection.listener_fd = place.socket.file();
  connection.fd = file;
  place.to->HandleNewConnection(&connection);
  return true;
}

bool Acceptor::is_welcome(int file) const {
  if (users_.empty()) return true;
  ucred peer = {};
  socklen_t size = sizeof peer;
  const bool known = getsockopt(file, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  if (known && std::find(users_.begin(), users_.end(), peer.uid) != users_.end()) return true;
  log_.write_some(LogLevel::warning, "connection refused", {{"user", peer.uid}, {"process", peer.pid}});
  return false;
}

}  // namespace facetwise
