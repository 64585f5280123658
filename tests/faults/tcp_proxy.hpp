// SPDX-License-Identifier: GPL-3.0-or-later
// A network that fails: forwards TCP connections to a daemon, until told to do otherwise.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace brainshift::faults {

class TcpProxy {
 public:
  // Forwards to this port of this computer.
  explicit TcpProxy(std::uint16_t target);
  ~TcpProxy();
  TcpProxy(const TcpProxy&) = delete;
  TcpProxy& operator=(const TcpProxy&) = delete;

  const std::string& endpoint() const { return endpoint_; }

  // Half-open: once this returns nothing passes, and nothing is closed. False: it passes again.
  void stall(bool stalled);
  // Closes every connection there is. New ones are taken.
  void cut() { cut_ = true; }
  // Every byte arrives this much later.
  void delay(std::chrono::milliseconds by) { delay_ms_ = static_cast<int>(by.count()); }

 private:
  struct Pair;
  void run(const std::stop_token& stop);
  void accept_one();

  std::uint16_t target_;
  int listener_ = -1;
  std::string endpoint_;
  std::atomic<bool> stalled_ = false;
  std::atomic<bool> passes_ = true;  // as the thread has taken note of it
  std::atomic<bool> cut_ = false;
  std::atomic<int> delay_ms_ = 0;
  std::vector<std::unique_ptr<Pair>> pairs_;
  std::jthread thread_;
};

}  // namespace brainshift::faults
