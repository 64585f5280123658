// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/feed.hpp"

#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/faults/settings.hpp"

namespace brainshift::faults {
namespace {

using std::chrono::milliseconds;
constexpr std::int64_t kStep_ns = 10'000'000;

void shift(Observation& observation, double by_mm) {
  std::visit(
      [&](auto& body) {
        using Body = std::decay_t<decltype(body)>;
        if constexpr (std::is_same_v<Body, TumourBoundary>) {
          body.points.array() += by_mm;
        } else if constexpr (std::is_same_v<Body, CorticalSurface>) {
          body.surface.vertices.array() += by_mm;
        } else if constexpr (std::is_same_v<Body, LandmarkPairs>) {
          body.deformed.array() += by_mm;
        }
      },
      observation.body);
}

template <typename Matrix>
bool same_bytes(const Matrix& one, const Matrix& other) {
  return one.rows() == other.rows() && one.cols() == other.cols() &&
         std::memcmp(one.data(), other.data(),
                     static_cast<std::size_t>(one.size()) * sizeof(*one.data())) == 0;
}

}  // namespace

std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

Feed::Feed(const std::filesystem::path& surgery, std::size_t split)
    : surgery_(surgery), split_(split) {
  const auto file = need(io::SurgeryFile::open(surgery), "surgery");
  case_id_ = file.meta().case_id;
  for (const auto& record : need(file.records(io::RecordKind::kObservation), surgery.string())) {
    observations_.push_back(need(wire::decode_observation(record.payload), surgery.string()));
  }
  if (observations_.empty()) throw std::runtime_error(surgery.string() + ": no observation");
}

Observation Feed::recorded(std::size_t i) const {
  Observation observation = observations_[i % observations_.size()];
  shift(observation, 0.002 * static_cast<double>(i % 200));
  if (split_ > 1) {
    observation.source += '-';
    observation.source += std::to_string(1 + i / observations_.size() % split_);
  }
  observation.sequence = i + 1;
  observation.acquired_ns = static_cast<std::int64_t>(i + 1) * kStep_ns;
  return observation;
}

Observation Feed::live(std::size_t i) const {
  Observation observation = recorded(i);
  observation.acquired_ns = observation.sent_ns = monotonic_ns();
  return observation;
}

void Feed::write(const std::filesystem::path& path, std::size_t count) const {
  auto meta = need(io::SurgeryFile::open(surgery_), "surgery").meta();
  meta.scenario = "faults";
  auto file = need(io::SurgeryFile::create(path, meta), "surgery");
  std::vector<io::SurgeryRecord> records;
  for (std::size_t i = 0; i < count; ++i) {
    const Observation observation = recorded(i);
    records.push_back({io::RecordKind::kObservation, observation.sequence, observation.acquired_ns,
                       wire::encode(observation)});
  }
  need(file.append(records), path.string());
  need(file.close(), path.string());
}

Opened open_session(const std::string& endpoint, const Feed& feed, bool recorded_clock,
                    const std::optional<client::ClientKeys>& keys) {
  client::ClientOptions options;
  options.keys = keys;
  auto client = need(client::Client::connect(endpoint, options), "connect");
  SessionRequest request;
  request.case_id = feed.case_id();
  request.recorded_clock = recorded_clock;
  request.takeover = true;
  auto info = need(client.start_session(request), "start a session");
  return {std::move(client), std::move(info)};
}

UpdateMessage answer_to(client::Client& client, const Observation& observation) {
  need(client.submit(observation), "submit");
  while (true) {
    auto message = need(client.next_update(milliseconds(60000)), "next update");
    if (message.update.final && message.update.observation_sequence == observation.sequence) {
      return message;
    }
  }
}

bool same_bits(const Update& one, const Update& other) {
  return one.estimate.displacement.size() > 0 &&
         same_bytes(one.estimate.displacement, other.estimate.displacement) &&
         same_bytes(one.estimate.sd_mm, other.estimate.sd_mm) &&
         same_bytes(one.estimate.known, other.estimate.known);
}

int differing(const std::vector<Update>& updates, const std::vector<Update>& expected) {
  int count = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    count += same_bits(updates[i], expected[i]) ? 0 : 1;
  }
  return count;
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

double answered_within_s(const std::string& endpoint) {
  const auto begin = std::chrono::steady_clock::now();
  client::ClientOptions options;
  options.request_timeout = milliseconds(30000);
  auto client = need(client::Client::connect(endpoint, options), "connect");
  while (!client.status() && std::chrono::steady_clock::now() - begin < std::chrono::seconds(30)) {
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace brainshift::faults
