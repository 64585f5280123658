// SPDX-License-Identifier: GPL-3.0-or-later
// The report of a daemon that fares well.
#pragma once

#include "common/wire/report.hpp"

namespace brainshift::client {

inline wire::DaemonReport sample_report() {
  wire::DaemonReport report;
  report.version = "1.2.3";
  report.build = "1.2.3 abc";
  report.machine = "a processor";
  report.uptime_ms = 3'723'000;
  report.model_ready = true;
  report.case_id = "colin27";
  report.session.session = {7, 3, "0123456789abcdef"};
  report.session.phase = SessionPhase::kTracking;
  report.session.newest_update = report.session.newest_usable = 812;
  report.session.age_ms = 240.0;
  report.session.aged_after_ms = 30'000;
  report.session.expired_after_ms = 600'000;
  report.session.method = "condensed";
  report.session.boundary = "contact";
  report.owner = "00ab12cd34";
  report.max_age_s = 600.0;
  report.limit_ms = 13'000.0;
  report.usable = 812;
  report.unusable = 1;
  report.late = 6;
  report.failures = 3;
  report.sources = {{"ius", 900, 813, 3, 80, 0, 4, 0, 0, 33.0}, {"", 2, 0, 0, 0, 0, 2, 0, 0, 9e4}};
  report.clients = 2;
  report.viewers = {{"00ff", 1, 800, 799, 1, 0}};
  report.recent_updates = 2048;
  report.bounds_ms = {10.0};
  report.stages = {{"wait", {813, 0.1, 0.2, 0.3, 0.4}, {813, 0.1, 0.2, 0.3, 0.4}, 90.0, {813, 0}},
                   {"total",
                    {813, 31.5, 40.25, 55.0, 90.125},
                    {813, 31.0, 40.0, 54.0, 90.125},
                    25'000.0,
                    {0, 813}}};
  report.journal = wire::JournalFigures{true, "", "/j/colin27-3.surgery", 8u << 20, 2500, 0};
  report.process = {120u << 20, 140u << 20, 31, 1024, 9};
  report.door = {90, 1, 2, 3, 4, 5u << 20, 6, 7, 8, 9, 10};
  return report;
}

}  // namespace brainshift::client
