// SPDX-License-Identifier: GPL-3.0-or-later
// A network that swallows everything without closing: the viewer's field stops being current within
// a second, and becomes current again when the network does. The same for a cut connection.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"
#include "tests/support/zmtp_peer.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using client::Currency;
using std::chrono::milliseconds;
using test_support::port_of;

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Bytes on their way in one direction, each chunk with the time from which it may go on.
struct DelayedLane {
  static constexpr std::size_t kMaxChunks = 64;
  struct Chunk {
    Clock::time_point due;
    std::string bytes;
  };
  std::deque<Chunk> chunks;

  // False when the sender has closed.
  bool take(int from, std::chrono::milliseconds delay) {
    std::array<char, 65536> buffer;
    while (chunks.size() < kMaxChunks) {
      const ssize_t count = recv(from, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (count == 0) return false;
      if (count < 0) return errno == EAGAIN || errno == EINTR;
      chunks.push_back(
          {Clock::now() + delay, std::string(buffer.data(), static_cast<std::size_t>(count))});
    }
    return true;
  }
  bool give(int to) {
    while (!chunks.empty() && chunks.front().due <= Clock::now()) {
      std::string& bytes = chunks.front().bytes;
      const ssize_t count = send(to, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (count < 0) return errno == EAGAIN || errno == EINTR;
      bytes.erase(0, static_cast<std::size_t>(count));
      if (bytes.empty()) chunks.pop_front();
    }
    return true;
  }
};

// A network that fails: forwards TCP connections to a daemon, until told to do otherwise.
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
  struct Pair {
    int client = -1, daemon = -1;
    DelayedLane up, down;

    ~Pair() {
      close(client);
      close(daemon);
    }
    bool forward(std::chrono::milliseconds delay) {
      return up.take(client, delay) && down.take(daemon, delay) && up.give(daemon) &&
             down.give(client);
    }
  };

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

TcpProxy::TcpProxy(std::uint16_t target)
    : target_(target), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  auto* bytes = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, bytes, size) != 0 || listen(listener_, 128) != 0 ||
      getsockname(listener_, bytes, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "proxy");
  }
  endpoint_ = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

TcpProxy::~TcpProxy() {
  thread_.request_stop();
  thread_.join();
  close(listener_);
}

void TcpProxy::stall(bool stalled) {
  stalled_ = stalled;
  passes_.wait(stalled);
}

void TcpProxy::accept_one() {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  auto pair = std::make_unique<Pair>();
  pair->client = client;
  pair->daemon = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(target_);
  if (connect(pair->daemon, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    pairs_.push_back(std::move(pair));
  }
}

void TcpProxy::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<pollfd> watched = {{listener_, POLLIN, 0}};
    const bool passes = !stalled_;
    passes_ = passes;
    passes_.notify_all();
    for (const auto& pair : pairs_) {
      if (!passes) break;
      watched.push_back({pair->client, POLLIN, 0});
      watched.push_back({pair->daemon, POLLIN, 0});
    }
    // Chunks that wait for their time, or for room, are looked at every millisecond.
    poll(watched.data(), watched.size(), 1);
    if (cut_.exchange(false)) pairs_.clear();
    if ((watched[0].revents & POLLIN) != 0) accept_one();
    if (!passes) continue;
    const std::chrono::milliseconds delay(delay_ms_.load());
    std::erase_if(pairs_, [&](const auto& pair) { return !pair->forward(delay); });
  }
}

// s until the field is current; `most_s` when it never is.
double seconds_until_current(client::Client& viewer, double most_s) {
  const auto begin = Clock::now();
  const auto passed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  while (viewer.field_status().currency != Currency::kCurrent && passed() < most_s) {
    const auto asked = Clock::now();
    static_cast<void>(viewer.next_update(milliseconds(10)));
    // After a loss the call returns at once.
    std::this_thread::sleep_until(asked + milliseconds(5));
  }
  return passed();
}

// s after which the field was still called current, at the last.
double seconds_still_current(client::Client& viewer) {
  const auto begin = Clock::now();
  double last_s = 0.0;
  while (last_s < 10.0) {
    const auto looked = Clock::now();
    if (viewer.field_status().currency != Currency::kCurrent) break;
    last_s = std::chrono::duration<double>(looked - begin).count();
    static_cast<void>(viewer.next_update(milliseconds(1)));
  }
  return last_s;
}

// s of the next `over_s` in which the field is not current.
double seconds_not_current(client::Client& viewer, double over_s) {
  const auto end = Clock::now() + std::chrono::duration<double>(over_s);
  double sum_s = 0.0;
  while (Clock::now() < end) {
    const auto asked = Clock::now();
    static_cast<void>(viewer.next_update(milliseconds(10)));
    std::this_thread::sleep_until(asked + milliseconds(5));
    if (viewer.field_status().currency == Currency::kCurrent) continue;
    sum_s += std::chrono::duration<double>(Clock::now() - asked).count();
  }
  return sum_s;
}

}  // namespace

void run_half_open(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  // Nothing is observed after the first: its field does not grow too old meanwhile.
  const DaemonProcess daemon({.model = settings.model,
                              .folder = settings.work,
                              .more = "age: {aged_after_s: 3600, expired_after_s: 3600}\n"});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(), "subscribe");
  answer_to(opened.client, feed.live(0));

  TcpProxy proxy(port_of(daemon.endpoint()));
  auto viewer = need(client::Client::connect(proxy.endpoint()), "connect");
  need(viewer.subscribe(), "subscribe");
  double noticed_s = 0.0, healed_s = 0.0, cut_s = 0.0, delayed_s = 0.0;
  int unreasoned = 0;
  Rows rows(settings.work / "half-open.csv",
            "run,still_current_s,healed_s,not_current_after_cut_s");
  if (seconds_until_current(viewer, 10.0) >= 10.0) throw std::runtime_error("no current field");
  for (int run = 0; run < settings.count; ++run) {
    // Not at the same phase of the renewals each time.
    std::this_thread::sleep_for(milliseconds(37 * run % 250));
    proxy.stall(true);
    const double noticed = seconds_still_current(viewer);
    unreasoned += viewer.field_status().reason.empty() ? 1 : 0;
    proxy.stall(false);
    const double healed = seconds_until_current(viewer, 30.0);
    proxy.cut();
    const double after_cut = seconds_not_current(viewer, 2.0);
    rows.add({double(run), noticed, healed, after_cut});
    noticed_s = std::max(noticed_s, noticed);
    healed_s = std::max(healed_s, healed);
    cut_s = std::max(cut_s, after_cut);
    show_progress("half-open", run + 1, settings.count);
  }
  proxy.delay(milliseconds(100));
  delayed_s = seconds_not_current(viewer, 3.0);
  tally.shown("half-open connections", settings.count);
  tally.at_most("longest called current after the connection went half-open s", noticed_s, 1.0);
  tally.equals("without a reason to show", unreasoned, 0);
  tally.at_most("slowest return to current after it s", healed_s, 5.0);
  tally.shown("longest time not current after a cut s", cut_s);
  tally.shown("time not current in 3 s with a delay of 100 ms each way s", delayed_s);
}

}  // namespace brainshift::faults
