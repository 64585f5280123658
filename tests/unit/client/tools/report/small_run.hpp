// SPDX-License-Identifier: GPL-3.0-or-later
// One run of a report, with every part that the page shows.
#pragma once

#include "client/tools/replay/run_report.hpp"

namespace brainshift::client {

inline RunReport small_run(const char* boundary) {
  RunReport run;
  run.case_id = "box";
  run.scenario = "paper";
  run.method = "paper";
  run.boundary = boundary;
  run.updates = 1;
  run.quality = RunQuality{"good", "good", "", {1, 0, 0, 0}, {}};
  run.error_mm.initial = MeanStd{2.0, 0.5};
  run.error_mm.cross = MeanStd{0.125, 0.06};
  run.recovery_pct = 93.75;
  run.craniotomy_recovery_pct = 91.0;
  run.left_out = {{"pressure", "drained", "0.02 %"}};
  run.trace = {{1, {2.0, 0.5}, MeanStd{1.9, 0.4}, 12, 0.3, 100.0},
               {2, {1.0, 0.5}, std::nullopt, 2, 0.1, 200.0}};
  return run;
}

}  // namespace brainshift::client
