// Ends calls that wait too long for their client, and work that nobody waits for any more.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <thread>

#include "grpcpp/server_context.h"

namespace facetwise {

// gRPC's synchronous calls block in reading, and do not say while they compute that the client has gone: one thread looks
// after all of them. It sleeps, and looks each second, or each few milliseconds while a long call computes.
class Watch {
 public:
  Watch();
  ~Watch();

  struct Reader {
    grpc::ServerContext* context;
    std::chrono::steady_clock::time_point until;
  };

  // Cancels the call if it is still reading after `limit`.
  class Reading {
   public:
    Reading(Watch& watch, grpc::ServerContext& context, std::chrono::milliseconds limit);
    ~Reading();
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

   private:
    Watch& watch_;
    std::list<Reader>::iterator entry_;
  };
  // stop() becomes true when the call is cancelled: its client has gone, or its deadline has passed.
  class Computing {
   public:
    Computing(Watch& watch, grpc::ServerContext& context);
    ~Computing();
    Computing(const Computing&) = delete;
    Computing& operator=(const Computing&) = delete;
    const std::atomic<bool>& stop() const { return stop_; }

   private:
    friend Watch;
    Watch& watch_;
    grpc::ServerContext& context_;
    std::atomic<bool> stop_{false};
    std::list<Computing*>::iterator entry_;
  };

 private:
  void look();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ends_ = false;
  std::list<Reader> reading_;
  std::list<Computing*> computing_;
  std::thread thread_;
};

}  // namespace facetwise
