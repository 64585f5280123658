// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/ticks.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>

namespace brainshift::client {

double axis_fraction(double value, double min, double max, bool log) {
  assert(min < max && (!log || min > 0.0));
  return log ? std::log(value / min) / std::log(max / min) : (value - min) / (max - min);
}

std::vector<double> nice_ticks(double min, double max, int target) {
  assert(min < max && target >= 1);
  const double rough = (max - min) / target;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  const auto first = static_cast<long>(std::ceil(min / step - 1e-9));
  const auto last = static_cast<long>(std::floor(max / step + 1e-9));
  for (long k = first; k <= last; ++k) ticks.push_back(static_cast<double>(k) * step);
  return ticks;
}

std::vector<double> log_ticks(double min, double max) {
  assert(0.0 < min && min < max);
  const auto within = [&](const std::vector<double>& factors) {
    std::vector<double> ticks;
    const int first = static_cast<int>(std::floor(std::log10(min)));
    const int last = static_cast<int>(std::ceil(std::log10(max)));
    for (int exponent = first; exponent <= last; ++exponent) {
      for (const double factor : factors) {
        // By its text, so that 0.001 is the nearest number to 0.001.
        const double tick =
            std::stod(std::to_string(static_cast<int>(factor)) + "e" + std::to_string(exponent));
        if (tick >= min * (1.0 - 1e-12) && tick <= max * (1.0 + 1e-12)) ticks.push_back(tick);
      }
    }
    return ticks;
  };
  std::vector<double> ticks = within({1.0});
  if (ticks.size() < 4) ticks = within({1.0, 2.0, 5.0});
  if (ticks.size() < 3) ticks = nice_ticks(min, max);
  return ticks;
}

std::string fixed_decimals(double value, int decimals) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, value);
  return buffer;
}

std::string tick_label(double value, double step) {
  const int decimals =
      step > 0.0 ? std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6) : 0;
  return fixed_decimals(std::abs(value) < 1e-9 * std::abs(step) ? 0.0 : value, decimals);
}

std::string log_tick_label(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  const std::string text = buffer;
  const bool exponent = text.find('e') != std::string::npos;
  return exponent && value >= 1.0 && value < 1e6 ? fixed_decimals(value, 0) : text;
}

}  // namespace brainshift::client
