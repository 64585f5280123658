// SPDX-License-Identifier: GPL-3.0-or-later
// Where the ticks of an axis stand and how they read. Plain numbers; needs no picture.
#pragma once

#include <string>
#include <vector>

namespace brainshift::client {

// Where a value lies on its axis: 0 at min, 1 at max. log: ln(value / min) / ln(max / min).
// Precondition: min < max; on a logarithmic axis all three are positive.
double axis_fraction(double value, double min, double max, bool log);

// Round positions (1, 2 or 5 times a power of ten apart) within [min, max]; about `target` of
// them. Precondition: min < max.
std::vector<double> nice_ticks(double min, double max, int target = 6);

// Positions on a logarithmic axis within [min, max]: powers of ten. Where there would be fewer
// than four, 2 and 5 times these too. Where that is still fewer than three, those of nice_ticks.
// Precondition: 0 < min < max.
std::vector<double> log_ticks(double min, double max);

// `value` with as many decimals as the step between ticks needs, at most 6.
std::string tick_label(double value, double step);

// Shortest text of a logarithmic tick: "0.002", "5", "20000"; "1e-05" and "1e+06" beyond.
std::string log_tick_label(double value);

// `value` with exactly `decimals` digits after the point.
std::string fixed_decimals(double value, int decimals);

}  // namespace brainshift::client
