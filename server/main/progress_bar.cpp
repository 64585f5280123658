// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/progress_bar.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace brainshift::server {

void ProgressBar::show(std::string_view prefix, std::string_view stage, double fraction) {
  std::string name(prefix);
  if (!name.empty()) name += ": ";
  name += stage;
  const int percent = static_cast<int>(std::lround(100.0 * std::clamp(fraction, 0.0, 1.0)));
  const bool new_stage = name != stage_;
  if (!new_stage && percent == percent_) return;
  stage_ = name;
  percent_ = percent;
  if (style_ == Style::kLines && new_stage) {
    std::printf("%s\n", name.c_str());
    std::fflush(stdout);
  }
  if (style_ != Style::kBar) return;
  constexpr int kWidth = 30;
  const auto filled = static_cast<std::size_t>(percent * kWidth / 100);
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r\033[K[%s] %3d %%  %s", bar.c_str(), percent, name.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  drawn_ = false;
}

Progress ProgressBar::progress(std::string prefix) {
  return [this, prefix = std::move(prefix)](std::string_view stage, double fraction) {
    show(prefix, stage, fraction);
  };
}

}  // namespace brainshift::server
