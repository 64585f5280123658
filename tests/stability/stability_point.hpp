// SPDX-License-Identifier: GPL-3.0-or-later
// One point of a stability sweep: what was asked, what the product answered, and what is right.
// tests/studies/stability.py judges it; docs/stability.md derives the bounds.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::stability {

// One operator of the product is made wrong before it solves; the reference stays right. What
// each sheet makes wrong is said where it is done: toy_problem.hpp, linear_body.hpp,
// sweep_elements.cpp and sweep_consolidation.cpp.
enum class Fault { kNone, kSign, kNormal, kScale };
inline constexpr Fault kFaults[] = {Fault::kSign, Fault::kNormal, Fault::kScale};
std::string to_string(Fault fault);  // "none", "sign", "normal", "scale"

struct Point {
  // Where it stands on the maps.
  std::string sheet;      // picture, file-name-like
  std::string parameter;  // axis title with unit
  double x = 0.0;
  std::string row;  // what was asked: a method, or a second parameter

  bool answered = false;
  bool warned = false;     // by status or reason
  bool must_warn = false;  // where no answer can be trusted
  std::string status;      // "converged", "solved", or the error's code
  std::string reason;
  double backward_error = 0.0;  // NaN: does not apply
  double rcond = 0.0;
  int iterations = 0;
  double min_volume_ratio = 1.0;
  double difference = 0.0;  // to the reference, in `unit`
  double bound = 0.0;
  std::string unit;       // "relative" or "mm"
  std::string objection;  // of the reference, beyond the difference; empty: none
  // Contact set that the difference is taken for: "own", found by the reference alone, or
  // "product's", which the reference confirmed.
  std::string sets = "own";
  // Descent methods: greatest distance at a node from the posterior mean, which they approach and
  // do not promise. NaN: does not apply. Recorded, not judged.
  double from_posterior_mm = std::numeric_limits<double>::quiet_NaN();
  // What the prior's scales leave to gain in ln p. NaN: the method does not estimate them.
  double scales_gain = std::numeric_limits<double>::quiet_NaN();
};

// Cuts what the product reports apart: refusal, warning or answer.
void set_refused(const Error& error, Point& point);
void set_answered(const Estimate& estimate, Point& point);

enum class Grid {
  kFull,
  kCoarse,  // both ends and one in between: the CTest subset
  kMiddle,  // one value per sweep: seeded faults
};

struct Options {
  Grid grid = Grid::kFull;
  Fault fault = Fault::kNone;
  std::function<void(const Point&)> record;

  void record_refused(const Error& error, Point point) const {
    set_refused(error, point);
    record(point);
  }
};

// A point of a sheet, before it is asked.
inline Point point_at(std::string sheet, std::string parameter, double x, std::string row = {}) {
  Point point;
  point.sheet = std::move(sheet);
  point.parameter = std::move(parameter);
  point.x = x;
  point.row = std::move(row);
  return point;
}

std::vector<double> thinned(const std::vector<double>& values, Grid grid);
// 10^from ... 10^to, one per decade.
std::vector<double> decades(int from, int to);

void sweep_penalty(const Options& options);
void sweep_material(const Options& options);
void sweep_mesh(const Options& options);
void sweep_load(const Options& options);
void sweep_data(const Options& options);
void sweep_contact(const Options& options);
void sweep_elements(const Options& options);
void sweep_consolidation(const Options& options);

}  // namespace brainshift::stability
