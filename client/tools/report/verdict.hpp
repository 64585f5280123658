// SPDX-License-Identifier: GPL-3.0-or-later
// How the page opens: what the runs come to in a sentence, and a table that fits the window.
//
// The sentence speaks of the runs with the contact boundary condition and the default method
// (condensed) that moved a tumour; without such runs of those with contact, without these of all.
// It says the motion of the tumour that was recovered (recovery_pct; the least by name), the time
// of an update over one solve (latency_ms.p50 / full_solve_ms), and how many updates were unusable,
// each beside the paper's figure. What no run has measured is left out of it.
#pragma once

#include <string>
#include <vector>

#include "client/tools/report/head.hpp"

namespace brainshift::client {

// Plain text.
std::string verdict(const std::vector<ReportedRun>& runs);

// HTML: a line per run, twelve columns with their units, the paper's figures as the last lines.
std::string summary_table(const std::vector<ReportedRun>& runs);

}  // namespace brainshift::client
