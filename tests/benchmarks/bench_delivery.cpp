// SPDX-License-Identifier: GPL-3.0-or-later
// What viewers' choices cost on the default head: bytes and time of each, and the time from
// publishing an update to a viewer having it, for one viewer and for sixteen.
//   build/release/bin/bench_delivery [case.yaml]
//
// The field is made up: a sag that grows by 0.05 mm an update to 10 mm, with 0.02 mm of noise, both
// fading over 40 mm from the tumour. Daemon and viewers are threads of one process on the loopback
// interface, so that clocks agree. Measured twice: with viewers that decode, whose work competes
// with the daemon's, and with viewers that only take the bytes.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "client/lib/client.hpp"
#include "common/patient/read_patient.hpp"
#include "common/wire/convert.hpp"
#include "server/delivery/parcels.hpp"
#include "server/delivery/selections.hpp"
#include "tests/benchmarks/made_up_daemon.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

using bench::MadeUpDaemon;
using bench::SaggingHead;
using bench::value_or_exit;
using Clock = std::chrono::steady_clock;
using server::Bytes;

constexpr int kUpdates = 200;
constexpr int kWarmUp = 10;
constexpr std::chrono::milliseconds kBetweenUpdates{15};

struct Case {
  const char* name;
  FieldChoice choice;
};
const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"full", {}},
      {"full, no sd", {.with_sd = false}},
      {"region 40 mm", {.region = TumourRegion{40.0}}},
      {"spacing 10 mm", {.spacing_mm = 10.0}},
      {"region 40 mm, spacing 10 mm", {.region = TumourRegion{40.0}, .spacing_mm = 10.0}},
      {"tolerance 0.1 mm", {.tolerance_mm = 0.1}},
      {"region 40 mm, tolerance 0.1 mm, no sd",
       {.region = TumourRegion{40.0}, .tolerance_mm = 0.1, .with_sd = false}}};
  return all;
}

void print_costs(const std::shared_ptr<const BrainModel>& model, const std::vector<Bytes>& frames) {
  server::Selections selections(model);
  const double distances_ms = bench::median_ms(
      [&] { (void)server::Selections(model).resolve({.region = TumourRegion{1.0}}); }, 3, 1);
  std::printf("%ld nodes; distances from the tumour, once per model: %.1f ms\n",
              static_cast<long>(model->mesh.nodes.cols()), distances_ms);
  std::printf("%-38s %7s %9s %8s %8s %9s\n", "choice", "nodes", "kB p50", "% full", "cut ms",
              "choose ms");
  for (const Case& each : cases()) {
    const double choose_ms =
        bench::median_ms([&] { value_or_exit(selections.resolve(each.choice)); }, 5, 1);
    const SelectionPtr selection = value_or_exit(selections.resolve(each.choice));
    server::Parcels parcels;
    server::Held held;
    std::vector<double> bytes, ms;
    for (const Bytes& whole : frames) {
      parcels.begin_turn();
      const auto began = Clock::now();
      const auto parcel = parcels.make(whole, selection, held);
      ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - began).count());
      bytes.push_back(static_cast<double>(parcel->bytes->size()));
      if (parcel->held) held = parcel->held;
    }
    const auto median = [](std::vector<double> values) {
      std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
      return values[values.size() / 2];
    };
    std::printf(
        "%-38s %7zu %9.1f %8.1f %8.3f %9.2f\n", each.name,
        selection ? selection->nodes.size() : static_cast<std::size_t>(model->mesh.nodes.cols()),
        1e-3 * median(bytes), 100.0 * median(bytes) / static_cast<double>(frames.front()->size()),
        median(ms), choose_ms);
  }
}

// When each update was published, and how long each viewer waited for it.
class Latencies {
 public:
  explicit Latencies(int viewers) : viewers_(viewers) {}

  void published(std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    published_[sequence] = Clock::now();
  }
  void received(std::uint64_t sequence) {
    const auto now = Clock::now();
    const std::lock_guard lock(mutex_);
    if (sequence > kWarmUp) {
      ms_.push_back(
          std::chrono::duration<double, std::milli>(now - published_.at(sequence)).count());
    }
    if (++arrived_[sequence] == viewers_) all_.notify_all();
  }
  void wait_for_all(std::uint64_t sequence) {
    std::unique_lock lock(mutex_);
    if (!all_.wait_for(lock, std::chrono::seconds(10),
                       [&] { return arrived_[sequence] == viewers_; })) {
      std::fprintf(stderr, "update %llu did not reach every viewer\n",
                   static_cast<unsigned long long>(sequence));
      std::exit(1);
    }
  }
  double percentile(double share) {
    std::sort(ms_.begin(), ms_.end());
    return ms_[static_cast<std::size_t>(share * static_cast<double>(ms_.size() - 1))];
  }

 private:
  int viewers_;
  std::mutex mutex_;
  std::condition_variable all_;
  std::map<std::uint64_t, Clock::time_point> published_;
  std::map<std::uint64_t, int> arrived_;
  std::vector<double> ms_;
};

void view(const std::string& endpoint, const FieldChoice& choice, Latencies& latencies,
          std::atomic<int>& ready) {
  auto client = value_or_exit(client::Client::connect(endpoint));
  if (!client.subscribe(1, choice)) std::exit(1);
  ++ready;
  while (true) {
    const auto update = client.next_update(std::chrono::seconds(10));
    if (!update) std::exit(1);
    latencies.received(update->update.sequence);
    if (update->update.sequence == kUpdates) return;
  }
}

using P50AndP99 = std::pair<double, double>;

// Until a viewer has the decoded update: every viewer a thread with the client library.
P50AndP99 until_decoded(const std::shared_ptr<const BrainModel>& model,
                        const std::vector<Bytes>& frames, const FieldChoice& choice, int viewers) {
  MadeUpDaemon daemon(model);
  Latencies latencies(viewers);
  std::atomic<int> ready{0};
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < viewers; ++i) {
      threads.emplace_back([&] { view(daemon.endpoint(), choice, latencies, ready); });
    }
    while (ready < viewers) std::this_thread::yield();
    for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
      std::this_thread::sleep_for(kBetweenUpdates);
      latencies.published(sequence);
      daemon.publish(sequence, frames[sequence - 1]);
      latencies.wait_for_all(sequence);
    }
  }
  return {latencies.percentile(0.5), latencies.percentile(0.99)};
}

// Until the bytes are in the viewer's socket: what the daemon and the way take. One thread reads
// for all viewers and decodes nothing, as if each had a machine of its own.
P50AndP99 until_arrived(const std::shared_ptr<const BrainModel>& model,
                        const std::vector<Bytes>& frames, const FieldChoice& choice, int viewers) {
  MadeUpDaemon daemon(model);
  zmq::context_t context;
  std::vector<zmq::socket_t> sockets;
  const auto renew = [&](zmq::socket_t& socket, std::uint64_t received) {
    const Subscription subscription{1, 1, received, choice};
    socket.send(zmq::buffer(
        wire::encode_frame(wire::MessageType::kSubscribeRequest, 1, wire::encode(subscription))));
  };
  zmq::message_t message;
  for (int i = 0; i < viewers; ++i) {
    zmq::socket_t& socket = sockets.emplace_back(context, zmq::socket_type::dealer);
    socket.set(zmq::sockopt::linger, 0);
    socket.connect(daemon.endpoint());
    renew(socket, 0);
    if (!socket.recv(message)) std::exit(1);
  }
  std::vector<zmq::pollitem_t> items;
  for (zmq::socket_t& socket : sockets) items.push_back({socket.handle(), 0, ZMQ_POLLIN, 0});
  constexpr std::size_t kTypeOffset = 6;  // of the frame's header
  Latencies latencies(viewers);
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    std::this_thread::sleep_for(kBetweenUpdates);
    latencies.published(sequence);
    daemon.publish(sequence, frames[sequence - 1]);
    for (int waiting = viewers; waiting > 0;) {
      zmq_poll(items.data(), static_cast<int>(items.size()), -1);
      for (std::size_t i = 0; i < sockets.size(); ++i) {
        if (items[i].revents == 0 || !sockets[i].recv(message, zmq::recv_flags::dontwait)) continue;
        const auto type = static_cast<wire::MessageType>(message.data<char>()[kTypeOffset]);
        if (type != wire::MessageType::kUpdate) continue;
        latencies.received(sequence);
        renew(sockets[i], sequence);
        --waiting;
      }
    }
  }
  return {latencies.percentile(0.5), latencies.percentile(0.99)};
}

template <typename Measure>
void print_latencies(const char* title, const Measure& measure) {
  std::printf("\n%s, ms; %d updates, %u cores\n", title, kUpdates - kWarmUp,
              std::thread::hardware_concurrency());
  std::printf("%-38s %8s %8s %8s %8s %9s\n", "choice", "1: p50", "p99", "16: p50", "p99",
              "p99 ratio");
  for (const Case& each : cases()) {
    const auto [one_p50, one_p99] = measure(each.choice, 1);
    const auto [all_p50, all_p99] = measure(each.choice, 16);
    std::printf("%-38s %8.2f %8.2f %8.2f %8.2f %9.2f\n", each.name, one_p50, one_p99, all_p50,
                all_p99, all_p99 / one_p99);
  }
}

void run(const std::string& case_file) {
  auto [config, brain] = value_or_exit(patient::read_patient(case_file));
  const auto model = std::make_shared<const BrainModel>(std::move(brain));
  SaggingHead head(model);
  std::vector<Bytes> frames;
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    frames.push_back(head.frame(sequence));
  }
  print_costs(model, frames);
  print_latencies("from publishing to the decoded update", [&](const FieldChoice& choice, int n) {
    return until_decoded(model, frames, choice, n);
  });
  print_latencies("from publishing to the bytes", [&](const FieldChoice& choice, int n) {
    return until_arrived(model, frames, choice, n);
  });
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::run(argc > 1 ? argv[1] : BRAINSHIFT_DEFAULT_CASE);
  return 0;
}
