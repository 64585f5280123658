// SPDX-License-Identifier: GPL-3.0-or-later
// One point of a stability sweep: what was asked, what the product answered, what is right, and the verdict.
//
//   green   answered, within the bound of its sweep
//   yellow  answered with a warning, in status or reason
//   grey    refused, with a reason
//   red     wrong without saying so: outside the bound, or a warning that had to be there is not, or no reason
//
// The bounds are derived in docs/stability.md before anything is measured.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/core/random.hpp"
#include "common/core/types.hpp"

namespace brainshift::stability {

enum class Verdict { kGreen, kYellow, kGrey, kRed };
inline constexpr Verdict kVerdicts[] = {Verdict::kGreen, Verdict::kYellow, Verdict::kGrey,
                                        Verdict::kRed};
std::string to_string(Verdict verdict);

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
  std::string unit;  // "relative" or "mm"
  bool seeded = false;
};

Verdict judge(const Point& point);

// Cuts what the product says apart: refusal, warning or answer.
void set_refused(const Error& error, Point& point);
void set_answered(const Estimate& estimate, Point& point);

// Changes answers behind the product's back, at random points: the suite must notice.
class FaultSeeder {
 public:
  explicit FaultSeeder(bool on) : on_(on), random_(20260101) {}
  // One node of the field by a thousandth of its largest value.
  void field(Points& displacement, Point& point);
  // As field(); or, where there is contact, one contact force by a tenth of the largest.
  void estimate(Estimate& estimate, Point& point);

 private:
  bool strikes();
  bool on_;
  Random random_;
};

struct Options {
  bool coarse = false;  // the grid of the CTest subset
  FaultSeeder* faults = nullptr;
  std::function<void(const Point&)> record;
};

// Every k-th of a full grid, both ends kept.
std::vector<double> thinned(const std::vector<double>& grid, bool coarse);
// 10^from ... 10^to, one per decade.
std::vector<double> decades(int from, int to);

// One source file each: sweep_<name>.cpp.
void sweep_penalty(const Options& options);
void sweep_material(const Options& options);
void sweep_mesh(const Options& options);
void sweep_load(const Options& options);
void sweep_data(const Options& options);
void sweep_contact(const Options& options);
void sweep_elements(const Options& options);
void sweep_consolidation(const Options& options);

}  // namespace brainshift::stability
