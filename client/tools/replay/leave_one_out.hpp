// SPDX-License-Identifier: GPL-3.0-or-later
// What is left out and predicted from the rest: the honest score of a surgery without a truth.
//
// Of every source whose newest observation holds points:
//   landmarks (x_i, y_i)   each in turn is taken away; the update from the rest, with the newest
//                          observations of all other sources, predicts u(x_i).
//                          initial |y_i - x_i|, rigid |T_i x_i - y_i| with the rigid fit T_i to the
//                          rest (register_fiducials), error |x_i + u(x_i) - y_i|
//   boundary, surface      an octant about the points' mean in turn is taken away (neighbours would
//                          tell where a single point is): distance of its points from the tumour's
//                          or the brain's surface, undeformed (initial) and as predicted (error)
// coverage_90: share of the components of y_i - x_i inside u(x_i) +- 1.645 sqrt(sd^2 + sd_i^2),
// with the update's sd at x_i and the landmark's own sd_i.
//
// The error holds the measurement's own error, and misregistration that all points share is
// recovered with the rest: it says how well the estimate explains data that it has not seen, not
// how far it is from the brain.
#pragma once

#include <vector>

#include "client/tools/replay/play.hpp"
#include "client/tools/replay/run_report.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

inline constexpr int kLeastLandmarks = 5;  // four of one source remain
inline constexpr int kMostLeftOut = 40;    // landmarks; of more, so many evenly chosen

// options: of a new session, to which nothing was submitted. Sources with too few points or only
// one octant have no score. kUnavailable when an answer fails to come; kProtocol: a field of
// another mesh.
Result<std::vector<LeftOutScore>> leave_one_out(const DaemonLink& link, const PlayOptions& options,
                                                const std::vector<RecordedObservation>& recording,
                                                const BrainModel& model,
                                                const Progress& progress = {});

}  // namespace brainshift::client
