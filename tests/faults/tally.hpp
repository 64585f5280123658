// SPDX-License-Identifier: GPL-3.0-or-later
// What a topic found: checks with their bounds, figures without, raw rows, and progress.
#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <string>
#include <vector>

namespace brainshift::faults {

// Prints every entry and records it (tests/support/study_record.hpp). Names hold no commas.
class Tally {
 public:
  // command: how to get these figures again. brief: of a short form, beside which other work may
  // run; it shows ratios and times instead of checking them.
  Tally(std::string topic, std::string command, bool brief);

  void at_most(const std::string& name, double value, double limit);
  void at_least(const std::string& name, double value, double limit);
  // Of a time, or of a ratio of times.
  void time_at_most(const std::string& name, double value, double limit);
  // Of memory or processor time. A sanitizer spends its own: under one it is shown, not checked.
  void cost_at_most(const std::string& name, double value, double limit);
  void equals(const std::string& name, double value, double expected);
  // Without a bound.
  void shown(const std::string& name, double value);
  // A part that cannot run here.
  void left_out(const std::string& reason);
  bool all_hold() const { return all_hold_; }

 private:
  void check(const std::string& name, double value, const std::string& bound, bool pass);

  std::string topic_;
  std::string command_;
  bool brief_;
  bool all_hold_ = true;
};

// A CSV file of raw figures.
class Rows {
 public:
  Rows(const std::filesystem::path& file, const std::string& heading);
  void add(std::initializer_list<double> cells);

 private:
  std::ofstream stream_;
};

// "  kills 120 of 300", at most once in ten seconds.
void show_progress(const std::string& topic, double done, double all);

// Linear interpolation between order statistics; share in [0, 1]; NaN without values.
double quantile(std::vector<double> values, double share);
// Of the straight line through the points, least squares; 0 for fewer than two.
double slope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace brainshift::faults
