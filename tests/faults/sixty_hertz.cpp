// SPDX-License-Identifier: GPL-3.0-or-later
// Observations at 60 Hz for a long time: every one is accounted for, no published field is old
// without saying so, and memory does not grow.
#include <algorithm>
#include <chrono>
#include <map>
#include <vector>

#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using std::chrono::milliseconds;

constexpr double kHertz = 60.0;
// Memory is looked at from here on: before, caches fill.
constexpr double kSettled = 0.2;  // share of the time

struct Account {
  std::map<std::uint64_t, Clock::time_point> sent;  // not answered yet, by sequence
  long received = 0, answered = 0, replaced = 0, refused = 0;
  std::vector<double> ages_ms;    // of the fields, when they arrived
  std::vector<bool> marked;       // as late, by the daemon
  std::vector<double> beyond_ms;  // of these ages, what lies outside the daemon's own account

  void take(const UpdateMessage& message) {
    if (!message.update.final) return;
    const auto found = sent.find(message.update.observation_sequence);
    if (found == sent.end()) return;
    ++answered;
    if (!message.error) {
      const AnswerTime& answer = message.update.answer_time;
      ages_ms.push_back(Seconds(Clock::now() - found->second).count() * 1e3);
      marked.push_back(answer.late());
      beyond_ms.push_back(ages_ms.back() - answer.ms);
    }
    sent.erase(found);
  }
  void submit(client::Client& client, const Observation& observation) {
    ++received;
    sent[observation.sequence] = Clock::now();
    const auto receipt = client.submit(observation);
    if (!receipt) {
      ++refused;
      sent.erase(observation.sequence);
    } else if (receipt->replaced_pending) {
      ++replaced;
    }
  }
};

struct Memory {
  std::vector<double> at_s, resident_mib;
};

void receive_until(client::Client& client, Account& account, Clock::time_point until) {
  while (Clock::now() < until) {
    const auto left = std::chrono::floor<milliseconds>(until - Clock::now());
    if (left < milliseconds(1)) return;
    const auto message = client.next_update(left);
    if (message) account.take(*message);
  }
}

int old_and_unmarked(const Account& account, double limit_ms) {
  int count = 0;
  for (std::size_t i = 0; i < account.ages_ms.size(); ++i) {
    count += account.ages_ms[i] > limit_ms && !account.marked[i] ? 1 : 0;
  }
  return count;
}

}  // namespace

void run_sixty_hertz(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work, .journal = true});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(Subscription::kMaxWindow), "subscribe");
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) answer_to(opened.client, feed.live(i));

  Account account;
  Memory memory;
  Rows rows(settings.work / "sixty-hertz.csv",
            "s,resident_mib,received,answered,replaced,refused,age_p50_ms,age_p99_ms,age_max_ms");
  const auto begin = Clock::now();
  const auto all = static_cast<std::size_t>(settings.seconds * kHertz);
  const double sample_s = std::max(0.5, settings.seconds / 120.0);
  for (std::size_t i = 0; i < all; ++i) {
    const double at_s = static_cast<double>(i) / kHertz;
    receive_until(opened.client, account,
                  begin + std::chrono::duration_cast<Clock::duration>(Seconds(at_s)));
    account.submit(opened.client, feed.live(2 * feed.sources() + i));
    if (at_s < sample_s * static_cast<double>(memory.at_s.size())) continue;
    memory.at_s.push_back(at_s);
    memory.resident_mib.push_back(daemon.resident_mib());
    const auto& ages = account.ages_ms;
    rows.add({at_s, memory.resident_mib.back(), double(account.received), double(account.answered),
              double(account.replaced), double(account.refused), quantile(ages, 0.5),
              quantile(ages, 0.99), quantile(ages, 1.0)});
    show_progress("60 Hz s", at_s, settings.seconds);
  }
  const auto patience = Clock::now() + std::chrono::seconds(10);
  while (account.answered + account.replaced + account.refused < account.received &&
         Clock::now() < patience) {
    receive_until(opened.client, account, Clock::now() + milliseconds(50));
  }

  const auto settled = static_cast<std::ptrdiff_t>(kSettled * double(memory.at_s.size()));
  const std::vector<double> x(memory.at_s.begin() + settled, memory.at_s.end());
  const std::vector<double> y(memory.resident_mib.begin() + settled, memory.resident_mib.end());
  const double p50 = quantile(account.ages_ms, 0.5);
  tally.shown("observations sent", double(account.received));
  tally.shown("answered", double(account.answered));
  tally.shown("replaced by newer ones", double(account.replaced));
  tally.shown("refused", double(account.refused));
  tally.equals("observations that nothing accounts for",
               double(account.received - account.answered - account.replaced - account.refused), 0);
  tally.shown("age of a field p50 ms", p50);
  tally.shown("age of a field p99 ms", quantile(account.ages_ms, 0.99));
  tally.shown("age of a field largest ms", quantile(account.ages_ms, 1.0));
  tally.shown("fields marked late",
              double(std::count(account.marked.begin(), account.marked.end(), true)));
  tally.shown("age outside the daemon p50 ms", quantile(account.beyond_ms, 0.5));
  tally.shown("age outside the daemon largest ms", quantile(account.beyond_ms, 1.0));
  tally.time_at_most("fields older than 3 x p50 and not marked late",
                     old_and_unmarked(account, 3.0 * p50), 0.0);
  const double grown_mib = x.size() > 1 ? slope(x, y) * (x.back() - x.front()) : 0.0;
  tally.shown("resident memory at the end MiB", memory.resident_mib.back());
  tally.shown("slope of resident memory MiB per min", 60.0 * slope(x, y));
  // A page cache of SQLite and arenas of malloc come and go; a leak of one field is 0.5 MiB.
  tally.time_at_most("growth of resident memory by its slope MiB", grown_mib, 4.0);
}

}  // namespace brainshift::faults
