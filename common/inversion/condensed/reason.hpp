// SPDX-License-Identifier: GPL-3.0-or-later
// Estimate::reason of an update by the condensed method: how it ended and what a reader should
// doubt, in one line. Written into memory that the text has from earlier updates.
#pragma once

#include <string>

#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// How the search for loads ended; data that the prior does not explain, strengths at their bounds.
// estimate: with contact, misfit_ratio and prior_at_bound of the update.
void set_reason(EstimateStatus outcome, double deadline_ms, Estimate& estimate);
// Outliers of every source, and sources that contradict the others.
void append_sources(Estimate& estimate);
// Of data without named sources.
void append_outliers(int outliers, int data, std::string& reason);

}  // namespace brainshift::inversion
