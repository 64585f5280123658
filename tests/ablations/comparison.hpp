// SPDX-License-Identifier: GPL-3.0-or-later
// What a part buys: the estimate without it against the default, on the same surgeries. For a part
// that the default leaves out it is the estimate with it.
//
// Four measures, of an update from the tumour alone and of the last one of a surgery:
//   tumour, craniotomy   mean error of the tumour's points, closest point distance (mm)
//   brain                mean error over all nodes (mm)
//   interval             | coverage of the 90 % interval - 0.9 |
// Errors of different truths differ by decades: those in mm are compared by their logarithms, and
// their means are geometric ones. A difference counts when a paired t test has p < kSignificant
// and the mean changes by more than kLeastChange of the default's, or by kLeastCoverage. A part is
// held against 80 combinations of measure, group and data: at p < 0.05 four of them would count by
// chance.
#pragma once

#include <string>
#include <vector>

#include "tests/ablations/parts.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::ablations {

inline constexpr double kSignificant = 0.001;
inline constexpr double kLeastChange = 0.02;
inline constexpr double kLeastCoverage = 0.01;

struct Difference {
  std::string measure, unit;  // "tumour", "mm"
  std::string group;          // of group_names()
  std::string data;           // "tumour alone", "all data"
  int pairs = 0;
  double of_default = 0.0, of_variant = 0.0;  // means over the pairs
  double p = 1.0;
  bool counts = false;
  // The variant is the worse one.
  bool worse() const { return of_variant > of_default; }
  // Of the default's mean; for the interval the difference itself. Both are positive where worse().
  double change() const;
};

// "craniotomy, joint-mixed, all data: 0.21 -> 0.83 mm"
std::string text_of(const Difference& difference);

// Every measure, group and data that has two pairs or more. rows: of all variants; a surgery that
// either of them was refused in is no pair. The data "all data" are the last update of each.
std::vector<Difference> differences(const surgeries::Rows& rows, const Part& part);

// Time of an update over that of the default's update of the same data, the median over all of
// them; NaN without any. What else the machine did is in it.
double median_time_ratio(const surgeries::Rows& rows, const Part& part);

// Those that count, largest change first: with the part better than without it, and the reverse.
struct Balance {
  std::vector<Difference> buys, costs;
};
Balance balance(const std::vector<Difference>& differences, const Part& part);

}  // namespace brainshift::ablations
