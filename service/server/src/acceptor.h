// SPDX-License-Identifier: Apache-2.0
// Accepts a server's connections.
#pragma once

#include <sys/types.h>

#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "grpcpp/server_builder.h"
#include "src/listen.h"
#include "src/log.h"

namespace facetwise {

// The connections that a server has. gRPC closes a socket and tells nobody, so each is known by its inode: its number may be
// another's.
class Connections {
 public:
  explicit Connections(int most);
  // Of them as wanted, as far as this process may open files.
  std::size_t most() const { return most_; }
  void add(int file);
  // Looks at them all only where it must.
  bool has_room() const;
  std::size_t count() const;

 private:
  void forget_closed() const;
  struct Accepted {
    int file;
    ino_t inode;
  };
  const std::size_t most_;
  mutable std::mutex mutex_;
  mutable std::vector<Accepted> accepted_;
};

// gRPC's own listener stops for good at the limit of open files, and takes any number of connections. This one takes so many,
// and leaves the next in the system's queue until there is room.
class Acceptor {
 public:
  using ToGrpc = grpc::experimental::ExternalConnectionAcceptor;
  struct Place {
    Socket socket;
    ToGrpc* to;
  };

  // Begins. Keeps what the places refer to. With `users`, only these users' processes may connect to Unix sockets.
  Acceptor(std::vector<Place> places, std::unique_ptr<ToGrpc> to_unix, std::unique_ptr<ToGrpc> to_tcp,
           std::vector<unsigned> users, Connections& connections, Log& log);
  ~Acceptor();  // listens no more; connections stay
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

 private:
  void accept_all();
  // False: none can be taken now.
  bool accept_one(const Place& place);
  // Whether the process at the other end is one of the users'.
  bool is_welcome(int file) const;

  const std::vector<Place> places_;
  const std::unique_ptr<ToGrpc> to_unix_, to_tcp_;
  const std::vector<unsigned> users_;
  Connections& connections_;
  Log& log_;
  const Socket ends_;  // readable: at the end
  std::thread thread_;
};

}  // namespace facetwise
