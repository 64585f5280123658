// SPDX-License-Identifier: GPL-3.0-or-later
// A daemon's report as a page of text (docs/operations.md explains each line). What needs attention
// stands in words, so that the page can be read without colour; `alarm` marks the same lines.
// And the report as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/wire/report.hpp"

namespace brainshift::client {

struct Line {
  std::string text;
  bool alarm = false;
};

// Two reports, some time apart, for rates.
struct Reports {
  wire::DaemonReport now;
  std::optional<wire::DaemonReport> before;  // of the same daemon process, else of no use
};

// Why the daemon does not do now what surgery asks of it, in one sentence; empty when a session
// tracks or is ready, and is recorded if there is a journal.
std::optional<std::string> complaint(const wire::DaemonReport& report);

// The page. With a report from before, rates stand beside the counts.
std::vector<Line> page(const Reports& reports, const std::string& endpoint);

// The same in one line, for a pipe: phase, age of the field, rate, latency, journal.
std::string summary(const Reports& reports);

// "0.2 s", "12 min 3 s", "3 h 12 min".
std::string duration_text(double seconds);

// A daemon's report as JSON: the keys are the fields of brainshift.v1.DaemonReport, with
// "well" and "complaint" in front.
std::string report_json(const wire::DaemonReport& report);

}  // namespace brainshift::client
