// SPDX-License-Identifier: GPL-3.0-or-later
// t_solve: the time of one full solve K x = b on this machine, the unit of every speed figure.
#pragma once

#include "common/contact/forward_model.hpp"

namespace brainshift::contact {

// Median of 9 single solves after one that warms up, ms. Takes 10 solves of time: a third of a
// second on the default head.
double measure_full_solve_ms(const ForwardModel& forward);

}  // namespace brainshift::contact
