// SPDX-License-Identifier: GPL-3.0-or-later
// Records what a study measured, for the tables and plots of `make verify` and `make sensing`.
//
// When $BRAINSHIFT_STUDY_DIR is set, rows are appended to points.csv, checks.csv and left_out.csv
// in it. Otherwise nothing is written; the tests assert all the same. Texts hold no commas,
// quotes or line breaks. The files have no headings:
//   points.csv    study,series,x_name,y_name,x,y
//   checks.csv    study,name,value,bound,pass,source      pass: 1, 0, or empty without a bound
//   left_out.csv  study,reason
#pragma once

#include <string>

namespace brainshift::test_support {

// One point of a curve. study: name fit for a file ("terzaghi"). series: legend ("P1, dt 0.01
// s"). x_name and y_name: axis titles with unit ("element size mm", "L2 error mm").
struct StudyPoint {
  std::string study, series, x_name, y_name;
  double x = 0.0, y = 0.0;
};
void record(const StudyPoint& point);

// A figure that a study asserts. Returns `pass`, for EXPECT_TRUE(record_check(...)).
//   name: the figure, with unit; bound: "<= 1 %", "1.75 to 2.25"; source: equation or citation of
//   the reference.
bool record_check(const std::string& study, const std::string& name, double value,
                  const std::string& bound, bool pass, const std::string& source);

// A figure that a study shows without a bound, so that it neither passes nor fails. `note` stands
// in the bound's column: "shown", with further figures if need be.
void record_figure(const std::string& study, const std::string& name, double value,
                   const std::string& note, const std::string& source);

// A part of a study that could not run here, e.g. for want of data; the summary lists it.
void record_left_out(const std::string& study, const std::string& reason);

}  // namespace brainshift::test_support
