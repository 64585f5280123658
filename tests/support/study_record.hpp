// SPDX-License-Identifier: GPL-3.0-or-later
// What a study measured, for the tables and plots of `make verify` and `make sensing`.
//
// Rows are appended to $BRAINSHIFT_STUDY_DIR/points.csv, checks.csv and left_out.csv when that variable is set; otherwise nothing
// is written, and the tests assert all the same. Texts hold no commas, quotes or line breaks.
// points.csv: study,series,x_name,y_name,x,y      checks.csv: study,name,value,bound,pass,source   (no headings)
// left_out.csv: study,reason
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

// A part of a study that could not run here, e.g. for want of data; the summary lists it.
void record_left_out(const std::string& study, const std::string& reason);

}  // namespace brainshift::test_support
