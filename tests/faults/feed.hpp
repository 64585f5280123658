// SPDX-License-Identifier: GPL-3.0-or-later
// Observations without end, from a recorded surgery: what the topics send.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "common/values/observation.hpp"

namespace brainshift::faults {

// The recording in cycles. No two observations are alike: the points of each are shifted by
// 0.002 mm more than those of the one before (anew after 200): a field tells what it answers.
class Feed {
 public:
  // split: the recording as seen by so many sources in turns, SOURCE-1, SOURCE-2, ...; 1: as it is.
  explicit Feed(const std::filesystem::path& surgery, std::size_t split = 1);

  // The i-th, from 0, with sequence i + 1 and times 10 ms apart, as a recording has them.
  Observation recorded(std::size_t i) const;
  // The same as acquired and handed over now, by this computer's clock.
  Observation live(std::size_t i) const;

  const std::string& case_id() const { return case_id_; }
  // Observations until every source has had its turn.
  std::size_t sources() const { return observations_.size() * split_; }

  // The first `count` as a surgery file of the same case and model.
  void write(const std::filesystem::path& file, std::size_t count) const;

 private:
  std::filesystem::path surgery_;
  std::string case_id_;
  std::vector<Observation> observations_;
  std::size_t split_;
};

std::int64_t monotonic_ns();

// A client with its own session, method condensed, boundary contact.
struct Opened {
  client::Client client;
  SessionInfo info;
};
Opened open_session(const std::string& endpoint, const Feed& feed, bool recorded_clock,
                    const std::optional<client::ClientKeys>& keys = std::nullopt);

// Sends an observation and waits for the update that answers it; the client must have subscribed.
UpdateMessage answer_to(client::Client& client, const Observation& observation);

// Whether the fields have the same bits, standard deviations too.
bool same_bits(const Update& one, const Update& other);

// Of as many as are expected, those with other bits.
int differing(const std::vector<Update>& updates, const std::vector<Update>& expected);

// The bytes of a file; empty when it cannot be read.
std::string content_of(const std::filesystem::path& file);

// Whether a daemon answers a new client within the limit; s.
double answered_within_s(const std::string& endpoint);

}  // namespace brainshift::faults
