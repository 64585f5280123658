// SPDX-License-Identifier: GPL-3.0-or-later
// Progress of a long command: a bar on stderr that redraws itself with the time its stage still
// needs, or one line per stage on stdout when stderr is no terminal, so that stderr of a script
// holds nothing but errors; or nothing.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "common/core/progress.hpp"

namespace brainshift::server {

class ProgressBar {
 public:
  enum class Style { kBar, kLines, kSilent };

  explicit ProgressBar(Style style) : style_(style) {}
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // fraction in [0, 1]; `prefix` stands before the stage ("contact: factor").
  void show(std::string_view prefix, std::string_view stage, double fraction);
  // A line of its own, where the style has lines.
  void note(const std::string& text);
  // Wipes the bar, so that what is printed next starts on a clean line.
  void clear();
  // A Progress that draws here; must not outlive the bar.
  Progress progress(std::string prefix);

 private:
  Style style_;
  bool drawn_ = false;
  int percent_ = -1;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point stage_start_;
  std::string stage_;
};

}  // namespace brainshift::server
