// SPDX-License-Identifier: GPL-3.0-or-later
// The transport of a daemon with made-up fields, without a session behind it: what bench_delivery
// and bench_bridge measure from publishing on. It subscribes whoever asks, hands out the model, and
// says that the newest update is current.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/core/random.hpp"
#include "common/values/brain_model.hpp"
#include "server/delivery/selections.hpp"
#include "server/transport/router.hpp"

namespace brainshift::bench {

// Encoded updates: a sag along gravity that grows by 0.05 mm an update to 10 mm and begins anew,
// with 0.02 mm of noise, both fading over 40 mm from the tumour. The same model gives the same
// frames.
class SaggingHead {
 public:
  explicit SaggingHead(std::shared_ptr<const BrainModel> model);
  // sequence counts from 1.
  server::Bytes frame(std::uint64_t sequence);

 private:
  std::shared_ptr<const BrainModel> model_;
  std::vector<double> fade_;
  Random random_{1};
};

// A thread until it is destroyed, on a port of the loopback interface that the system chooses.
class MadeUpDaemon {
 public:
  explicit MadeUpDaemon(const std::shared_ptr<const BrainModel>& model);
  MadeUpDaemon(const MadeUpDaemon&) = delete;
  MadeUpDaemon& operator=(const MadeUpDaemon&) = delete;
  ~MadeUpDaemon();

  const std::string& endpoint() const { return router_.endpoint(); }
  void publish(std::uint64_t sequence, const server::Bytes& frame);

 private:
  class Handler final : public server::RequestHandler {
   public:
    explicit Handler(const std::shared_ptr<const BrainModel>& model);
    std::optional<server::Reply> handle(const std::string& peer, const wire::Frame& frame) override;
    void left(const std::string&) override {}
    std::atomic<std::uint64_t> newest{0};

   private:
    server::Selections selections_;
    std::string model_;  // encoded
    std::string model_id_;
  };

  server::Router router_;
  server::Outbox outbox_;
  Handler handler_;
  int stop_fd_;
  std::thread thread_;
};

}  // namespace brainshift::bench
