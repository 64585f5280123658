// SPDX-License-Identifier: GPL-3.0-or-later
// How much later than an update an OpenIGTLink client has it, and whether a long run grows.
//   build/release/bin/bench_bridge [--case CASE.yaml] [--minutes 10]
//
// Daemon (its transport), bridge and client are threads of one process on the loopback interface,
// so that clocks agree and they compete for the same cores. The field is made up, as in
// bench_delivery. Lag: from handing the encoded update to the daemon's transport to the last byte
// of the IMAGE brainshift_u at the client, the client's check of the CRC included. Beside it, the
// time at which a plain client of the library has the decoded update, measured alone.
//
// Bound: the bridge adds at most 0.5 t_solve, where t_solve is the median of solves with the factor
// of the stiffness matrix in this process. --minutes: updates at 10 Hz; memory and lag of the first
// and of the last tenth must not differ.
//
// Exit status: 0 when every bound holds.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/bridge/bridge.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/statistics.hpp"
#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
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
constexpr double kMaxAdded = 0.5;  // of t_solve
// A run that grows by this much, first tenth to last, grows.
constexpr double kMaxGrowth_mib = 8.0;

double milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double resident_mib() {
  std::ifstream file("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

// When each update was published, and when it was received.
class Lags {
 public:
  void published(std::uint64_t sequence) {
    const std::lock_guard lock(mutex_);
    published_[sequence] = Clock::now();
  }
  void received(std::uint64_t sequence) {
    const auto now = Clock::now();
    const std::lock_guard lock(mutex_);
    const auto found = published_.find(sequence);
    if (found == published_.end()) return;
    ms_.push_back(milliseconds(now - found->second));
    published_.erase(published_.begin(), std::next(found));
    newest_ = sequence;
    arrived_.notify_all();
  }
  bool wait_for(std::uint64_t sequence, std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    return arrived_.wait_for(lock, limit, [&] { return newest_ >= sequence; });
  }
  std::vector<double> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(ms_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::uint64_t, Clock::time_point> published_;
  std::vector<double> ms_;
  std::uint64_t newest_ = 0;
};

// An OpenIGTLink client of version 2 that takes what comes.
class Viewer {
 public:
  Viewer(std::uint16_t port, Lags& lags) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      std::perror("bench_bridge: connect");
      std::exit(1);
    }
    igtl::Envelope envelope;
    envelope.version = 2;
    std::string hello;
    if (!igtl::encode(envelope, igtl::StatusRequest{}, hello) ||
        ::send(socket_, hello.data(), hello.size(), 0) < 0) {
      std::exit(1);
    }
    thread_ = std::thread([this, &lags] { read(lags); });
  }
  ~Viewer() {
    ::shutdown(socket_, SHUT_RDWR);
    thread_.join();
    ::close(socket_);
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  std::size_t image_bytes() const { return image_bytes_; }

 private:
  void read(Lags& lags) {
    std::vector<char> buffer(1 << 20);
    igtl::StreamReader reader;
    while (true) {
      const ssize_t count = ::recv(socket_, buffer.data(), buffer.size(), 0);
      if (count <= 0) return;
      std::string_view bytes(buffer.data(), static_cast<std::size_t>(count));
      while (!bytes.empty()) {
        const auto packet = value_or_exit(reader.read(bytes));
        if (packet && packet->header.device == "brainshift_u") take(*packet, lags);
      }
    }
  }
  void take(const igtl::Packet& packet, Lags& lags) {
    const auto body = value_or_exit(igtl::decode_body(packet.header.version, packet.body));
    const std::string* sequence = igtl::find(body.metadata, "sequence");
    if (sequence == nullptr) return;
    image_bytes_ = packet.body.size();
    lags.received(std::stoull(*sequence));
  }

  int socket_;
  std::thread thread_;
  std::atomic<std::size_t> image_bytes_{0};
};

// A bridge in a thread.
class RunningBridge {
 public:
  explicit RunningBridge(const std::string& endpoint)
      : bridge_(value_or_exit(client::Bridge::open(options(endpoint), [](const std::string&) {}))),
        thread_([this] {
          if (!bridge_->run()) std::exit(1);
        }) {}
  ~RunningBridge() {
    bridge_->stop();
    thread_.join();
  }
  RunningBridge(const RunningBridge&) = delete;
  RunningBridge& operator=(const RunningBridge&) = delete;
  std::uint16_t port() const { return bridge_->address().port; }

 private:
  static client::BridgeOptions options(const std::string& endpoint) {
    client::BridgeOptions options;
    options.endpoint = endpoint;
    options.listen.port = 0;
    return options;
  }
  std::unique_ptr<client::Bridge> bridge_;
  std::thread thread_;
};

std::vector<double> without_warm_up(std::vector<double> ms) {
  ms.erase(ms.begin(), ms.begin() + std::min<long>(kWarmUp, static_cast<long>(ms.size())));
  return ms;
}

// Until a client of the library has the decoded update.
std::vector<double> library_lag(const std::shared_ptr<const BrainModel>& model,
                                const std::vector<Bytes>& frames) {
  MadeUpDaemon daemon(model);
  Lags lags;
  std::atomic<bool> ready{false};
  const std::jthread viewer([&] {
    auto client = value_or_exit(client::Client::connect(daemon.endpoint()));
    if (!client.subscribe()) std::exit(1);
    ready = true;
    while (true) {
      const auto update = client.next_update(std::chrono::seconds(10));
      if (!update) std::exit(1);
      lags.received(update->update.sequence);
      if (update->update.sequence == kUpdates) return;
    }
  });
  while (!ready) std::this_thread::yield();
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    lags.published(sequence);
    daemon.publish(sequence, frames[sequence - 1]);
    if (!lags.wait_for(sequence, std::chrono::seconds(10))) std::exit(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(15));
  }
  return without_warm_up(lags.take());
}

// The first update until it has arrived: the bridge is loading the model before.
void begin(MadeUpDaemon& daemon, Lags& lags, const Bytes& first) {
  lags.published(1);
  daemon.publish(1, first);
  if (!lags.wait_for(1, std::chrono::seconds(60))) {
    std::fprintf(stderr, "bench_bridge: the first update did not arrive\n");
    std::exit(1);
  }
}

std::vector<double> bridge_lag(const std::shared_ptr<const BrainModel>& model,
                               const std::vector<Bytes>& frames) {
  MadeUpDaemon daemon(model);
  const RunningBridge bridge(daemon.endpoint());
  Lags lags;
  const Viewer viewer(bridge.port(), lags);
  begin(daemon, lags, frames[0]);
  for (std::uint64_t sequence = 2; sequence <= kUpdates; ++sequence) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    lags.published(sequence);
    daemon.publish(sequence, frames[sequence - 1]);
    if (!lags.wait_for(sequence, std::chrono::seconds(10))) std::exit(1);
  }
  std::printf("IMAGE brainshift_u: %.2f MB\n", 1e-6 * static_cast<double>(viewer.image_bytes()));
  return without_warm_up(lags.take());
}

bool steady_run(const std::shared_ptr<const BrainModel>& model, const std::vector<Bytes>& frames,
                double minutes) {
  MadeUpDaemon daemon(model);
  const RunningBridge bridge(daemon.endpoint());
  Lags lags;
  const Viewer viewer(bridge.port(), lags);
  begin(daemon, lags, frames[0]);
  lags.take();
  const int tenth = std::max(10, static_cast<int>(minutes * 60.0));  // updates: 10 Hz
  std::printf("%-8s %9s %9s %9s %9s %9s\n", "tenth", "received", "p50 ms", "p99 ms", "max ms",
              "RSS MiB");
  std::vector<double> rss, p50;
  auto next = Clock::now();
  SaggingHead head(model);
  std::uint64_t sequence = 1;
  for (int part = 1; part <= 10; ++part) {
    for (int i = 0; i < tenth; ++i) {
      next += std::chrono::milliseconds(100);
      const Bytes frame = head.frame(++sequence);
      std::this_thread::sleep_until(next);
      lags.published(sequence);
      daemon.publish(sequence, frame);
    }
    if (!lags.wait_for(sequence, std::chrono::seconds(10))) return false;
    const auto ms = lags.take();
    rss.push_back(resident_mib());
    p50.push_back(percentile(ms, 50.0));
    std::printf("%-8d %9zu %9.2f %9.2f %9.2f %9.1f\n", part, ms.size(), p50.back(),
                percentile(ms, 99.0), percentile(ms, 100.0), rss.back());
    std::fflush(stdout);
  }
  const double growth_mib = rss.back() - rss.front();
  const bool ok = growth_mib <= kMaxGrowth_mib && p50.back() <= 1.5 * p50.front() + 2.0;
  std::printf(
      "%s  %.1f minutes at 10 Hz: memory %+.1f MiB (at most %+.0f), lag p50 %.2f to %.2f ms\n",
      ok ? "ok  " : "FAIL", minutes, growth_mib, kMaxGrowth_mib, p50.front(), p50.back());
  return ok;
}

bool run(const std::string& case_file, double minutes) {
  auto [config, brain] = value_or_exit(patient::read_patient(case_file));
  const auto model = std::make_shared<const BrainModel>(std::move(brain));
  const double t_solve_ms = [&, &settings = config] {
    auto prepared =
        value_or_exit(inversion::PreparedModel::prepare(model, settings, Boundary::kContact));
    return contact::measure_full_solve_ms(prepared.forward());
  }();
  std::printf("%s: %d nodes, t_solve %.1f ms, %u cores\n", model->case_id.c_str(),
              model->mesh.num_nodes(), t_solve_ms, std::thread::hardware_concurrency());
  SaggingHead head(model);
  std::vector<Bytes> frames;
  for (std::uint64_t sequence = 1; sequence <= kUpdates; ++sequence) {
    frames.push_back(head.frame(sequence));
  }
  const auto library = library_lag(model, frames);
  const auto bridge = bridge_lag(model, frames);
  std::printf("%-42s %8s %8s %8s\n", "from publishing an update, ms", "p50", "p95", "p99");
  for (const auto& [name, ms] : {std::pair{"to the decoded update (client library)", library},
                                 std::pair{"to the last byte of IMAGE brainshift_u", bridge}}) {
    std::printf("%-42s %8.2f %8.2f %8.2f\n", name, percentile(ms, 50.0), percentile(ms, 95.0),
                percentile(ms, 99.0));
  }
  bool ok = true;
  for (const double share : {50.0, 95.0}) {
    const double lag = percentile(bridge, share) / t_solve_ms;
    const bool holds = lag <= kMaxAdded;
    ok = ok && holds;
    std::printf("%s  lag of the IMAGE after publishing, p%.0f: %.3f t_solve (at most %.1f)\n",
                holds ? "ok  " : "FAIL", share, lag, kMaxAdded);
  }
  if (minutes > 0.0) ok = steady_run(model, frames, minutes) && ok;
  return ok;
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  CLI::App app{"Lag and steadiness of brainshift bridge", "bench_bridge"};
  std::string case_file = BRAINSHIFT_DEFAULT_CASE;
  double minutes = 0.0;
  app.add_option("--case", case_file, "case file")->capture_default_str();
  app.add_option("--minutes", minutes, "length of the run at 10 Hz; 0: none")
      ->check(CLI::Range(0.0, 1440.0))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return brainshift::run(case_file, minutes) ? 0 : 1;
}
