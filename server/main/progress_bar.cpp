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
  const auto now = std::chrono::steady_clock::now();
  if (new_stage) stage_start_ = now;
  if (style_ == Style::kLines && new_stage) {
    std::printf("%s\n", name.c_str());
    std::fflush(stdout);
  }
  if (style_ != Style::kBar) return;
  constexpr int kWidth = 30;
  const auto filled = static_cast<std::size_t>(percent * kWidth / 100);
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r\033[K[%s] %3d %%  %s", bar.c_str(), percent, name.c_str());
  // As if the rest of the stage went on at the same pace; worth saying from two seconds on.
  const double elapsed_s = std::chrono::duration<double>(now - stage_start_).count();
  const double remaining_s = percent > 0 ? elapsed_s * (100 - percent) / percent : 0.0;
  if (remaining_s >= 2.0) std::fprintf(stderr, ", %.0f s to go", remaining_s);
  const double total_s = std::chrono::duration<double>(now - start_).count();
  if (total_s >= 2.0) std::fprintf(stderr, "; %.0f s in all so far", total_s);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::note(const std::string& text) {
  clear();
  if (style_ == Style::kSilent) return;
  std::fprintf(style_ == Style::kBar ? stderr : stdout, "%s\n", text.c_str());
  std::fflush(style_ == Style::kBar ? stderr : stdout);
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
