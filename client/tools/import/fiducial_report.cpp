// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/fiducial_report.hpp"

#include <fmt/format.h>

namespace brainshift::client {
namespace {

// Below this, a rotation about the line is known five times worse than one across it.
constexpr double kThin = 0.2;

}  // namespace

FiducialReport describe(const registration::FiducialRegistration& fit, bool matched,
                        const Vec3& target) {
  FiducialReport report;
  report.count = static_cast<int>(fit.residuals_mm.size());
  report.matched = matched;
  report.fre_mm = fit.fre_mm;
  report.worst_mm = fit.residuals_mm.maxCoeff(&report.worst);
  report.tre_mm = registration::expected_tre_mm(fit.image, fit.fle_mm, target);
  report.thinness = registration::thinness(fit.image);
  return report;
}

std::vector<std::string> fiducial_lines(const FiducialReport& report,
                                        const std::vector<std::string>& names,
                                        const std::string& target) {
  const auto worst = static_cast<std::size_t>(report.worst);
  const std::string name =
      worst < names.size() && !names[worst].empty() ? " (" + names[worst] + ")" : "";
  std::vector<std::string> lines = {fmt::format(
      "fiducials: {}{}, registration error {:.2f} mm rms, {:.2f} mm at worst{}; expected error at "
      "{} {:.2f} mm rms",
      report.count, report.matched ? ", order found" : "", report.fre_mm, report.worst_mm, name,
      target, report.tre_mm)};
  if (report.thinness < kThin) {
    lines.push_back(fmt::format(
        "note: the fiducials lie nearly on a line: a rotation about it is known {:.0f} times worse "
        "than one across it; touch another one beside the line",
        1.0 / report.thinness));
  }
  if (report.count == 3) {
    lines.emplace_back(
        "note: three fiducials leave little to estimate these errors from; touch more");
  }
  return lines;
}

}  // namespace brainshift::client
