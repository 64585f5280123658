// SPDX-License-Identifier: GPL-3.0-or-later
// What a machine does not have: memory for one allocation of an update, and hardware threads or
// tasks in other numbers. The daemon runs with fault_shim.cpp preloaded.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <new>
#include <regex>
#include <string>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"
#include "tests/faults/shim_control.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

class SharedControl {
 public:
  explicit SharedControl(const std::filesystem::path& file) {
    const int fd = open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const bool sized = ftruncate(fd, sizeof(ShimControl)) == 0;
    map_ = mmap(nullptr, sizeof(ShimControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (!sized || map_ == MAP_FAILED) throw std::runtime_error("cannot map " + file.string());
    new (map_) ShimControl{};
  }
  ~SharedControl() { munmap(map_, sizeof(ShimControl)); }
  SharedControl(const SharedControl&) = delete;
  SharedControl& operator=(const SharedControl&) = delete;
  ShimControl* operator->() const { return static_cast<ShimControl*>(map_); }

 private:
  void* map_ = nullptr;
};

// Two observations of one source in turns, with the numbers and times of a recording.
class TwoInTurns {
 public:
  explicit TwoInTurns(const Feed& feed) : feed_(feed) {}
  Observation next() {
    Observation observation = feed_.recorded(sent_ % 2 * feed_.sources());
    observation.sequence = ++sent_;
    observation.acquired_ns = static_cast<std::int64_t>(sent_) * 10'000'000;
    return observation;
  }

 private:
  const Feed& feed_;
  std::uint64_t sent_ = 0;
};

// The answer to an observation, if it comes: an estimate or the reason why there is none.
std::optional<UpdateMessage> outcome(client::Client& client, std::uint64_t sequence,
                                     milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (Clock::now() < deadline) {
    auto message = client.next_update(milliseconds(50));
    if (message && message->update.final && message->update.observation_sequence == sequence) {
      return *std::move(message);
    }
  }
  return std::nullopt;
}

// Handed over until it is accepted; a connection that the failure cost comes back by itself.
bool submitted(client::Client& client, const Observation& observation) {
  const auto deadline = Clock::now() + std::chrono::seconds(10);
  while (Clock::now() < deadline) {
    if (client.submit(observation)) return true;
  }
  return false;
}

// Beyond these the unit of docker/brainshiftd.service gives no thread.
int tasks_of_the_unit() {
  std::ifstream stream(BRAINSHIFT_SOURCE_DIR "/docker/brainshiftd.service");
  const std::regex key("TasksMax=([0-9]+)");
  std::smatch found;
  for (std::string line; std::getline(stream, line);) {
    if (std::regex_match(line, found, key)) return std::stoi(found[1]);
  }
  throw std::runtime_error("docker/brainshiftd.service: no TasksMax");
}

}  // namespace

void run_allocations(const Settings& settings, Tally& tally) {
#ifdef BRAINSHIFT_SANITIZED
  tally.left_out("allocations that fail: a sanitizer has its own");
#else
  const Feed feed(settings.surgery);
  const SharedControl control(settings.work / "shim");
  DaemonOptions options{.model = settings.model, .folder = settings.work, .journal = true};
  options.environment = {"LD_PRELOAD=" FAULT_SHIM,
                         "FAULT_SHIM_CONTROL=" + (settings.work / "shim").string()};
  DaemonProcess daemon(options);
  client::ClientOptions quick;
  quick.request_timeout = milliseconds(1000);
  SessionRequest request;
  request.case_id = feed.case_id();
  request.recorded_clock = true;
  auto client = need(client::Client::connect(daemon.endpoint(), quick), "connect");
  need(client.start_session(request), "start a session");
  need(client.subscribe(16), "subscribe");

  TwoInTurns observations(feed);
  std::array<Update, 2> expected;
  long points = 0;
  for (int i = 0; i < 12; ++i) {
    const long before = control->counted;
    control->left = 1L << 40;
    expected[i % 2] = answer_to(client, observations.next()).update;
    control->left = 0;
    points = control->counted - before;
  }
  Rows rows(settings.work / "allocations.csv", "allocation,failed,answered");
  int hit = 0, told = 0, same = 0, lost = 0, unanswered = 0, different = 0;
  for (int i = 0; i < settings.count && daemon.runs(); ++i) {
    const long point = 1 + static_cast<long>(i) * points / settings.count;
    const long failed_before = control->failed;
    const Observation first = observations.next(), next = observations.next();
    control->left = point;
    const bool accepted = client.submit(first).has_value();
    const auto answer =
        accepted ? outcome(client, first.sequence, milliseconds(2000)) : std::nullopt;
    control->left = 0;
    hit += control->failed > failed_before ? 1 : 0;
    if (accepted && !answer) {
      ++lost;
    } else if (!accepted || answer->error) {
      ++told;
    } else {
      ++same;
      different += same_bits(answer->update, expected[0]) ? 0 : 1;
    }
    const auto after = submitted(client, next) ? outcome(client, next.sequence, milliseconds(10000))
                                               : std::nullopt;
    if (!after || after->error) {
      ++unanswered;
    } else {
      different += same_bits(after->update, expected[1]) ? 0 : 1;
    }
    rows.add({double(point), double(control->failed - failed_before), double(bool(after))});
    show_progress("allocations", i + 1, settings.count);
  }
  tally.shown("allocations of an update", double(points));
  tally.at_least("allocations that failed", hit, 0.9 * settings.count);
  tally.shown("observations that were answered all the same", same);
  tally.shown("observations that were told to have failed", told);
  tally.shown("observations of which nothing was heard", lost);
  tally.equals("crashes", daemon.runs() ? 0 : 1, 0);
  tally.equals("next observations that were not answered", unanswered, 0);
  tally.equals("fields with other bits than without a failure", different, 0);
#endif
}

void run_hardware_threads(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const int tasks = tasks_of_the_unit();
  tally.shown("TasksMax of the delivered unit", tasks);
  for (const int cpus : {2, 16, 64, 128}) {
    DaemonOptions options{.model = settings.model, .folder = settings.work};
    options.environment = {"LD_PRELOAD=" FAULT_SHIM, "FAULT_SHIM_CPUS=" + std::to_string(cpus),
                           "FAULT_SHIM_TASKS=" + std::to_string(tasks), "OMP_NUM_THREADS=1",
                           "OPENBLAS_NUM_THREADS=1"};
    DaemonProcess daemon(options);
    auto client = need(client::Client::connect(daemon.endpoint()), "connect");
    int answered = 0, kinds = 0, most = 0;
    for (const Method method : {Method::kCondensed, Method::kPaper}) {
      for (const Boundary boundary : {Boundary::kContact, Boundary::kFixed}) {
        if (kinds == settings.count) continue;
        SessionRequest request;
        request.case_id = feed.case_id();
        request.recorded_clock = true;
        request.method = method;
        request.boundary = boundary;
        ++kinds;
        if (auto started = client.start_session(request); !started) {
          std::printf("  %d hardware threads: %s\n", cpus, started.error().message.c_str());
          continue;
        }
        need(client.subscribe(16), "subscribe");
        answered += answer_to(client, feed.recorded(0)).error ? 0 : 1;
        most = std::max(most, daemon.threads());
      }
    }
    const std::string on = std::to_string(cpus) + " hardware threads: ";
    tally.equals(on + "kinds of session that did not answer", kinds - answered, 0);
    tally.at_most(on + "threads at most", most, tasks);
    tally.equals(on + "ends when told to", daemon.end(SIGTERM), 0);
  }
}

}  // namespace brainshift::faults
