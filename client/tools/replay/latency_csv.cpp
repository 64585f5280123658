// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <charconv>
#include <string>

#include "client/tools/replay/replay.hpp"

namespace brainshift::client {
namespace {

// To a tenth of a microsecond, whatever the locale.
std::string milliseconds_text(double value) {
  std::array<char, 64> text{};
  const auto [end, error] =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 4);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}

void append_answered(const PlayedObservation& observation, std::string& row) {
  row += milliseconds_text(*observation.latency_ms);
  const StageTimings& t = observation.timings;
  for (const double ms : {t.register_ms, t.invert_ms, t.rebuild_ms, t.encode_ms}) {
    row += ',';
    row += milliseconds_text(ms);
  }
  for (const int count : {observation.active, observation.contact_iterations}) {
    row += ',';
    row += std::to_string(count);
  }
  row += ',';
  row += to_string(observation.status);
}

}  // namespace

std::string latency_csv(const PlayedSession& session) {
  std::string text =
      "update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,encode_ms,active,"
      "contact_iterations,status\n";
  std::size_t update = 0;
  for (const PlayedObservation& observation : session.observations) {
    text += std::to_string(++update);
    text += ',';
    text += std::to_string(observation.sequence);
    text += ',';
    if (observation.latency_ms) {
      append_answered(observation, text);
    } else {
      text += ",,,,,,,";
      text += observation.error ? to_string(observation.error->code) : "superseded";
    }
    text += '\n';
  }
  return text;
}

}  // namespace brainshift::client
