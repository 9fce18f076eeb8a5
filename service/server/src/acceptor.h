// Accepts a server's connections.
#pragma once

#include <sys/types.h>

#include <memory>
#include <thread>
#include <vector>

#include "grpcpp/server_builder.h"
#include "src/listen.h"

namespace facetwise {

// gRPC's own listener stops for good at the limit of open files, and takes any number of connections. This one takes so many,
// and leaves the next in the system's queue until there is room.
class Acceptor {
 public:
  using ToGrpc = grpc::experimental::ExternalConnectionAcceptor;
  struct Place {
    Socket socket;
    ToGrpc* to;
  };

  // Begins. Keeps what the places refer to.
  Acceptor(std::vector<Place> places, std::unique_ptr<ToGrpc> to_unix, std::unique_ptr<ToGrpc> to_tcp,
           int max_connections);
  ~Acceptor();  // listens no more; connections stay
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

 private:
  void accept_all();
  // False: none can be taken now.
  bool accept_one(const Place& place);
  bool has_room();

  // A socket that was accepted. gRPC closes it and tells nobody, so it is known by its inode: the number may be another's.
  struct Accepted {
    int file;
    ino_t inode;
  };

  const std::vector<Place> places_;
  const std::unique_ptr<ToGrpc> to_unix_, to_tcp_;
  const std::size_t most_;
  std::vector<Accepted> accepted_;
  const Socket ends_;  // readable: at the end
  std::thread thread_;
};

}  // namespace facetwise
