// SPDX-License-Identifier: GPL-3.0-or-later
// kill -9 at random moments of a replay, flooded and paced in turns. Checked after each: every
// observation that the daemon called recorded is in the journal; the next daemon is ready in time;
// `brainshift replay --resume` goes on to the same final field.
#include <algorithm>
#include <csignal>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "client/tools/replay/play.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/process.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr std::size_t kObservations = 60;
constexpr std::size_t kSources = 3;
constexpr int kFloodedLast_ms = 60;  // the last moment of a kill after a session's start
constexpr int kPacedLast_ms = 300;
constexpr milliseconds kPace{4};

// By source: what the daemon said is on its disk.
struct Claims {
  std::map<std::string, RecordedSource> sources;

  void take(const std::optional<SessionState>& state, std::uint64_t session) {
    if (!state || state->session.session_id != session || !state->recording) return;
    for (const RecordedSource& each : state->recording->sources) {
      RecordedSource& known = sources[each.source];
      if (each.until >= known.until) known = each;
    }
  }
};

// The final field of the whole surgery by the command line: the bytes of the field file.
class Replay {
 public:
  Replay(fs::path surgery, fs::path folder)
      : surgery_(std::move(surgery)), report_(folder / "report.json") {}

  std::string final_field(const std::string& endpoint, const fs::path& resume) const {
    fs::remove(field());
    std::vector<std::string> command = {brainshift(), "replay",  surgery_,   "--endpoint", endpoint,
                                        "--boundary", "contact", "--report", report_};
    if (!resume.empty()) command.insert(command.end(), {"--resume", resume});
    const auto done = run(command);
    if (done.exit_status != 0) throw std::runtime_error("brainshift replay: " + done.err);
    return content_of(field());
  }

 private:
  fs::path field() const { return report_.parent_path() / "report-faults-contact.vtu"; }

  fs::path surgery_;
  fs::path report_;
};

// Plays until the daemon is gone; what it claimed until then. Every answer to subscribe() says what
// is on the disk at that moment.
Claims play_into(client::Client& client, const SessionInfo& info, const Feed& feed, bool paced) {
  Claims claims;
  const auto gone = [&] {
    if (!client.subscribe()) return true;
    claims.take(client.session_state(), info.session_id);
    return false;
  };
  const auto begin = Clock::now();
  for (std::size_t i = 0; i < kObservations; ++i) {
    if (paced) std::this_thread::sleep_until(begin + i * kPace);
    if (!client.submit(feed.recorded(i))) return claims;
    if ((paced || i % 4 == 3) && gone()) return claims;
  }
  while (!gone() && Clock::now() < begin + std::chrono::seconds(5)) {
    static_cast<void>(client.next_update(milliseconds(2)));
  }
  return claims;
}

// Sequences in the valid prefix of the journals, by source.
std::map<std::string, std::set<std::uint64_t>> held_by(const std::vector<fs::path>& journals) {
  std::map<std::string, std::set<std::uint64_t>> held;
  for (const fs::path& journal : journals) {
    const auto file = io::SurgeryFile::open_damaged(journal);
    if (!file) continue;
    static_cast<void>(file->visit([&](const io::SurgeryRecord& record) -> Status {
      if (record.kind != io::RecordKind::kObservation) return {};
      const auto observation = wire::decode_observation(record.payload);
      if (observation) held[observation->source].insert(record.sequence);
      return {};
    }));
  }
  return held;
}

struct Lost {
  int claimed = 0, lost = 0;
};
Lost compare(const Claims& claims, const Feed& feed, const std::vector<fs::path>& journals) {
  auto held = held_by(journals);
  Lost result;
  for (std::size_t i = 0; i < kObservations; ++i) {
    const Observation sent = feed.recorded(i);
    const auto claim = claims.sources.find(sent.source);
    if (claim == claims.sources.end() || sent.sequence > claim->second.until) continue;
    if (sent.sequence <= claim->second.lost_until) continue;
    ++result.claimed;
    result.lost += held[sent.source].contains(sent.sequence) ? 0 : 1;
  }
  return result;
}

struct Killed {
  Claims claims;
  std::vector<fs::path> journals;
};
Killed kill_during_replay(const DaemonOptions& options, const Feed& feed, bool paced,
                          int after_ms) {
  DaemonProcess daemon(options);
  Opened opened = open_session(daemon.endpoint(), feed, true);
  Killed killed;
  {
    // Only sends the signal: the main thread waits for the end.
    const std::jthread killer([pid = daemon.pid(), after_ms] {
      std::this_thread::sleep_for(milliseconds(after_ms));
      kill(pid, SIGKILL);
    });
    killed.claims = play_into(opened.client, opened.info, feed, paced);
  }
  daemon.end(SIGKILL);
  killed.journals = journals_in(daemon.journal());
  return killed;
}

}  // namespace

void run_kills(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery, kSources);
  const fs::path surgery = settings.work / "kills.surgery";
  fs::remove(surgery);
  feed.write(surgery, kObservations);
  const Replay replay(surgery, settings.work);
  DaemonOptions options;
  options.model = settings.model;
  options.folder = settings.work;
  options.log = false;

  std::string expected;
  double load_s = 0.0;
  for (int i = 0; i < 3; ++i) {
    const DaemonProcess daemon(options);
    load_s = std::max(load_s, daemon.listening_after_s());
    if (i == 0) expected = replay.final_field(daemon.endpoint(), {});
  }
  if (expected.empty()) throw std::runtime_error("the replay wrote no field");

  Rows rows(settings.work / "kills.csv",
            "run,paced,kill_ms,called_recorded,lost,ready_s,same_field");
  std::mt19937 random(settings.seed);
  int claimed = 0, lost = 0, differ = 0, late = 0, with_claims = 0;
  double slowest_s = 0.0;
  options.journal = true;
  for (int run = 0; run < settings.count; ++run) {
    const bool paced = run % 2 == 1;
    const int after_ms =
        static_cast<int>(random() % static_cast<unsigned>(paced ? kPacedLast_ms : kFloodedLast_ms));
    fs::remove_all(settings.work / "journal");
    const Killed killed = kill_during_replay(options, feed, paced, after_ms);
    const Lost found = compare(killed.claims, feed, killed.journals);
    // The journal is set aside: the next daemon keeps its own.
    fs::path resume;
    for (const fs::path& journal : killed.journals) {
      if (client::read_resume_point(journal)) resume = journal;
    }
    const DaemonProcess daemon(options);
    const double ready_s = daemon.listening_after_s() + answered_within_s(daemon.endpoint());
    const bool same = replay.final_field(daemon.endpoint(), resume) == expected;
    claimed += found.claimed;
    with_claims += found.claimed > 0 ? 1 : 0;
    lost += found.lost;
    differ += same ? 0 : 1;
    late += ready_s > load_s + 2.0 ? 1 : 0;
    slowest_s = std::max(slowest_s, ready_s);
    rows.add({double(run), double(paced), double(after_ms), double(found.claimed),
              double(found.lost), ready_s, double(same)});
    show_progress("kills", run + 1, settings.count);
  }
  tally.shown("kills", settings.count);
  tally.shown("load and start without a kill s", load_s);
  // Kills before anything was called recorded show nothing of it; there must be others.
  tally.shown("kills after something was called recorded", with_claims);
  tally.at_least("observations called recorded before a kill", claimed, settings.count);
  tally.equals("observations called recorded and lost", lost, 0);
  tally.at_most("slowest start after a kill beyond the load s", slowest_s - load_s, 2.0);
  tally.equals("starts after a kill that took longer", late, 0);
  tally.equals("resumed replays with another final field", differ, 0);
}

}  // namespace brainshift::faults
