// SPDX-License-Identifier: GPL-3.0-or-later
// The largest observations that the daemon takes, of every body, back to back: what they cost the
// other sources, memory, and the end of the daemon.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include "server/session/sources.hpp"
#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using std::chrono::milliseconds;

constexpr Seconds kOtherPeriod{0.1};  // of the other source

// A surface cut into ever more triangles, up to what an observation may have.
TriangleSurface refined(TriangleSurface surface) {
  while (surface.triangles.cols() + 2 <= server::kMaxObservedTriangles &&
         surface.vertices.cols() + 1 <= server::kMaxObservedPoints) {
    // Each triangle of this round becomes three about its centre.
    const Eigen::Index all = std::min<Eigen::Index>(
        {surface.triangles.cols(), (server::kMaxObservedTriangles - surface.triangles.cols()) / 2,
         server::kMaxObservedPoints - surface.vertices.cols()});
    const Eigen::Index points = surface.vertices.cols(), triangles = surface.triangles.cols();
    surface.vertices.conservativeResize(3, points + all);
    surface.triangles.conservativeResize(3, triangles + 2 * all);
    for (Eigen::Index t = 0; t < all; ++t) {
      const auto corners = surface.triangles.col(t).eval();
      const auto centre = static_cast<int>(points + t);
      surface.vertices.col(centre) =
          (surface.vertices.col(corners[0]) + surface.vertices.col(corners[1]) +
           surface.vertices.col(corners[2])) /
          3.0;
      surface.triangles.col(t) << corners[0], corners[1], centre;
      surface.triangles.col(triangles + 2 * t) << corners[1], corners[2], centre;
      surface.triangles.col(triangles + 2 * t + 1) << corners[2], corners[0], centre;
    }
  }
  return surface;
}

// Points between those of a cloud, as many as an observation may have; `which`: beside which each
// lies.
Points filled(const Points& cloud, int count, std::mt19937& random,
              std::vector<int>* which = nullptr) {
  Points points(3, count);
  for (int i = 0; i < count; ++i) {
    const auto beside = static_cast<Eigen::Index>(random() % cloud.cols());
    if (which != nullptr) which->push_back(static_cast<int>(beside));
    points.col(i) = cloud.col(beside);
    for (int axis = 0; axis < 3; ++axis)
      points(axis, i) += 1e-3 * static_cast<double>(random() % 1000) - 0.5;
  }
  return points;
}

// Pairs between those of a recording, each moved as the one that it lies beside.
LandmarkPairs filled(const LandmarkPairs& pairs, int count, std::mt19937& random) {
  std::vector<int> beside;
  const Points undeformed = filled(pairs.undeformed, count, random, &beside);
  const Points moved = pairs.deformed - pairs.undeformed;
  return {undeformed, undeformed + moved(Eigen::all, beside), pairs.sd_mm};
}

// The largest of each body, every one of a source of its own. Points are those of the recording and
// between them, so that nothing but their number is unusual; triangles are the brain's, cut up.
std::vector<Observation> largest(const Feed& feed, const BrainModel& model, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Observation> made;
  const auto add = [&](const char* source, auto body) {
    Observation observation;
    observation.case_id = feed.case_id();
    observation.source = source;
    observation.body = std::move(body);
    made.push_back(std::move(observation));
  };
  for (std::size_t i = 0; i < feed.sources(); ++i) {
    const Observation seen = feed.recorded(i);
    if (const auto* body = std::get_if<TumourBoundary>(&seen.body)) {
      add("large-boundary",
          TumourBoundary{filled(body->points, server::kMaxObservedPoints, random), body->sd_mm});
    } else if (const auto* cortex = std::get_if<CorticalSurface>(&seen.body)) {
      const Points points = filled(cortex->surface.vertices, server::kMaxObservedPoints, random);
      add("large-surface", CorticalSurface{{points, {}}, cortex->sd_mm});
    } else if (const auto* pairs = std::get_if<LandmarkPairs>(&seen.body)) {
      add("large-landmarks", filled(*pairs, server::kMaxLandmarkPairs, random));
    }
  }
  add("large-triangles",
      CorticalSurface{refined({model.mesh.nodes, model.boundary_triangles}), 1.0});
  return made;
}

struct Flood {
  std::atomic<long> accepted{0}, refused{0};
  std::jthread thread;
};

// Every body in turns, one after the other as fast as they are accepted.
void begin_flood(Flood& flood, const std::string& endpoint, std::vector<Observation> bodies) {
  flood.thread = std::jthread([&flood, endpoint, bodies](const std::stop_token& stop) mutable {
    auto client = need(client::Client::connect(endpoint), "connect");
    need(client.subscribe(), "subscribe");
    for (std::size_t i = 0; !stop.stop_requested(); ++i) {
      Observation& body = bodies[i % bodies.size()];
      body.sequence = 1 + i / bodies.size();
      body.acquired_ns = body.sent_ns = monotonic_ns();
      const auto receipt = client.submit(body);
      ++(receipt ? flood.accepted : flood.refused);
      if (!receipt && flood.refused <= 3) std::printf("  %s\n", receipt.error().message.c_str());
    }
  });
}

// Latencies, ms, of a small source that observes every kOtherPeriod; those without an answer within
// kPatience are counted.
struct Timed {
  std::vector<double> latencies_ms;
  int unanswered = 0;
};
Timed time_others(client::Client& client, const Feed& feed, std::size_t& next, double seconds,
                  const DaemonProcess& daemon, double& most_mib) {
  Timed timed;
  const auto begin = Clock::now();
  for (int i = 0; Clock::now() - begin < Seconds(seconds) && daemon.runs(); ++i) {
    std::this_thread::sleep_until(begin +
                                  std::chrono::duration_cast<Clock::duration>(i * kOtherPeriod));
    Observation small = feed.live(next);
    small.sequence = ++next;
    const auto sent = Clock::now();
    bool answered = false;
    if (client.submit(small)) {
      while (!answered && Clock::now() - sent < std::chrono::seconds(10)) {
        const auto message = client.next_update(milliseconds(100));
        // An update answers the newest of every source that it names.
        if (!message || !message->update.final || message->error) continue;
        const auto& used = message->update.estimate.sources;
        answered = std::any_of(used.begin(), used.end(), [&](const SourceSummary& source) {
          return source.source == small.source && source.observation_sequence >= small.sequence;
        });
      }
    }
    if (answered) {
      timed.latencies_ms.push_back(Seconds(Clock::now() - sent).count() * 1e3);
    } else {
      ++timed.unanswered;
    }
    most_mib = std::max(most_mib, daemon.resident_mib());
    show_progress("largest s", Seconds(Clock::now() - begin).count(), seconds);
  }
  return timed;
}

}  // namespace

void run_largest(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  DaemonProcess daemon({.model = settings.model, .folder = settings.work});
  Opened opened = open_session(daemon.endpoint(), feed, false);
  need(opened.client.subscribe(16), "subscribe");
  const auto model = need(opened.client.model(), "model");
  std::size_t next = 0;
  double idle_mib = 0.0, most_mib = 0.0;
  time_others(opened.client, feed, next, std::min(2.0, settings.seconds), daemon, idle_mib);
  const Timed alone =
      time_others(opened.client, feed, next, std::min(20.0, settings.seconds), daemon, idle_mib);
  Flood flood;
  begin_flood(flood, daemon.endpoint(), largest(feed, model, settings.seed));
  const Timed beside = time_others(opened.client, feed, next, settings.seconds, daemon, most_mib);
  const auto asked = Clock::now();
  const int status = daemon.end(SIGTERM);
  const double ended_s = Seconds(Clock::now() - asked).count();
  flood.thread.request_stop();
  flood.thread.join();

  Rows rows(settings.work / "largest.csv", "beside,latency_ms");
  for (const double latency : alone.latencies_ms) rows.add({0.0, latency});
  for (const double latency : beside.latencies_ms) rows.add({1.0, latency});
  const double p99 = quantile(alone.latencies_ms, 0.99),
               loaded = quantile(beside.latencies_ms, 0.99);
  tally.at_least("largest observations that were accepted", double(flood.accepted), 3);
  tally.equals("observations of the others without an answer within 10 s", beside.unanswered, 0);
  tally.shown("others alone p99 ms", p99);
  tally.shown("others beside them p50 ms", quantile(beside.latencies_ms, 0.5));
  tally.shown("others beside them p99 ms", loaded);
  tally.time_at_most("p99 of the others beside over alone", loaded / p99, 2.0);
  tally.shown("resident memory alone MiB", idle_mib);
  tally.cost_at_most("resident memory beside over alone", most_mib / idle_mib, 1.5);
  tally.time_at_most("from SIGTERM to the end s", ended_s, 2.0);
  tally.equals("exit status", status, 0);
}

}  // namespace brainshift::faults
