// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/tally.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

#include "tests/support/study_record.hpp"

namespace brainshift::faults {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace

Tally::Tally(std::string topic, std::string command, bool brief)
    : topic_(std::move(topic)), command_(std::move(command)), brief_(brief) {}

void Tally::check(const std::string& name, double value, const std::string& bound, bool pass) {
  const char* verdict = "ok";
  if (!pass) verdict = "FAILS";
  std::printf("  %-6s %s: %s   %s\n", verdict, name.c_str(), number(value).c_str(), bound.c_str());
  std::fflush(stdout);
  all_hold_ = test_support::record_check(topic_, name, value, bound, pass, command_) && all_hold_;
}

void Tally::at_most(const std::string& name, double value, double limit) {
  check(name, value, "<= " + number(limit), value <= limit);
}

void Tally::time_at_most(const std::string& name, double value, double limit) {
  if (brief_) {
    shown(name, value);
  } else {
    at_most(name, value, limit);
  }
}

void Tally::cost_at_most(const std::string& name, double value, double limit) {
#ifdef BRAINSHIFT_SANITIZED
  static_cast<void>(limit);
  shown(name, value);
#else
  at_most(name, value, limit);
#endif
}

void Tally::at_least(const std::string& name, double value, double limit) {
  check(name, value, ">= " + number(limit), value >= limit);
}

void Tally::equals(const std::string& name, double value, double expected) {
  check(name, value, "= " + number(expected), value == expected);
}

void Tally::shown(const std::string& name, double value) {
  std::printf("  %-6s %s: %s\n", "-", name.c_str(), number(value).c_str());
  std::fflush(stdout);
  test_support::record_figure(topic_, name, value, "shown", command_);
}

void Tally::left_out(const std::string& reason) {
  std::printf("  left   %s\n", reason.c_str());
  test_support::record_left_out(topic_, reason);
}

Rows::Rows(const std::filesystem::path& file, const std::string& heading) : stream_(file) {
  if (!(stream_ << heading << '\n')) throw std::runtime_error("cannot write " + file.string());
}

void Rows::add(std::initializer_list<double> cells) {
  const char* before = "";
  for (const double cell : cells) {
    stream_ << before << number(cell);
    before = ",";
  }
  stream_ << std::endl;
}

void show_progress(const std::string& topic, double done, double all) {
  using Clock = std::chrono::steady_clock;
  static auto last = Clock::now();
  if (Clock::now() - last < std::chrono::seconds(10)) return;
  last = Clock::now();
  std::printf("  %s: %s of %s\n", topic.c_str(), number(done).c_str(), number(all).c_str());
  std::fflush(stdout);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

double slope(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sx += x[i];
    sy += y[i];
    sxx += x[i] * x[i];
    sxy += x[i] * y[i];
  }
  const double determinant = n * sxx - sx * sx;
  return determinant > 0.0 ? (n * sxy - sx * sy) / determinant : 0.0;
}

}  // namespace brainshift::faults
