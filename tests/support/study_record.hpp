// SPDX-License-Identifier: GPL-3.0-or-later
// What a verification or stability study measured, for the tables and plots of `make verify` and `make stability`.
//
// Rows are appended to $BRAINSHIFT_STUDY_DIR/points.csv and checks.csv when that variable is set; otherwise nothing
// is written, and the tests assert all the same. Texts hold no commas, quotes or line breaks.
// points.csv: study,series,x_name,y_name,x,y      checks.csv: study,name,value,bound,pass,source   (no headings)
#pragma once

#include <string>

namespace brainshift::test_support {

// One point of a curve. study: file-name-like ("terzaghi"); series: legend ("P1, dt 0.01 s"); x_name and y_name:
// axis titles with unit ("element size mm", "L2 error mm").
struct StudyPoint {
  std::string study, series, x_name, y_name;
  double x = 0.0, y = 0.0;
};
void record(const StudyPoint& point);

// A figure that a study asserts. Returns `pass`, for EXPECT_TRUE(record_check(...)).
//   name: what it is, with unit; bound: e.g. "<= 1 %", "1.75 to 2.25"; source: equation or citation of the reference.
bool record_check(const std::string& study, const std::string& name, double value,
                  const std::string& bound, bool pass, const std::string& source);

}  // namespace brainshift::test_support
