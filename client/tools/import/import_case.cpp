// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/core/text.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/misplacement.hpp"
#include "common/io/config/plus_config.hpp"
#include "common/io/model/model_file.hpp"
#include "common/patient/read_patient.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

ImportCase of(BrainModel model, const fs::path& case_file) {
  return {std::move(model), fs::absolute(case_file).lexically_normal()};
}

// Below this, a rotation about the line is known five times worse than one across it.
constexpr double kThin = 0.2;

}  // namespace

Vec3 ImportCase::tumour_centroid() const { return model.tumour.vertices.rowwise().mean(); }

io::SurgeryMeta ImportCase::meta(const std::string& scenario, const std::string& software) const {
  return {.case_id = model.case_id,
          .model_id = model.model_id,
          .case_file = case_file.string(),
          .scenario = scenario,
          .created_utc = utc_now(),
          .software = software};
}

Status check_one_case(const fs::path& case_file, const fs::path& model) {
  if (case_file.empty() != model.empty()) return {};
  return invalid(fmt::format("exactly one of --case and --model is required, {} given",
                             model.empty() ? "none" : "both"));
}

Status check_option(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return {};
  return invalid(fmt::format("{} {}: must be {} to {}", name, value, least, most));
}

Result<std::vector<tracking::ConstantLink>> device_links(const fs::path& device) {
  if (device.empty()) return std::vector<tracking::ConstantLink>{};
  return io::read_plus_config(device);
}

Status check_new(const fs::path& out) {
  std::error_code ignored;
  if (!fs::exists(out, ignored)) return {};
  return invalid(out.string() + ": exists already");
}

Result<ImportCase> load_import_case(const fs::path& case_file, const fs::path& model,
                                    const Progress& progress) {
  if (!model.empty()) {
    auto file = io::read_model(model, {});
    if (!file) return tl::unexpected(file.error());
    return of(std::move(file->model), file->config.file);
  }
  auto patient = patient::read_patient(case_file, progress);
  if (!patient) return tl::unexpected(patient.error());
  return of(std::move(patient->model), case_file);
}

Status write_surgery(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                     const std::vector<Observation>& observations) {
  auto file =
      io::SurgeryFile::create(path, meta);  // refuses a file that exists, and leaves it alone
  if (!file) return tl::unexpected(file.error());
  Status status;
  for (const Observation& observation : observations) {
    if (!status) break;
    status = file->append({io::RecordKind::kObservation, observation.sequence,
                           observation.acquired_ns, wire::encode(observation)});
  }
  if (status) status = file->close();
  if (!status) io::discard_surgery(path);
  return status;
}

Status check_error_place(const fs::path& case_file, const fs::path& model,
                         const std::optional<Vec3>& target) {
  const int given = int{!case_file.empty()} + int{!model.empty()} + int{target.has_value()};
  if (given != 1) {
    return invalid(
        fmt::format("exactly one of --model, --case and --target is required, {} given", given));
  }
  if (target && !target->allFinite()) return invalid("--target is not finite");
  return {};
}

std::string error_place(const std::optional<Vec3>& target) {
  if (!target) return "the tumour";
  const int digits = target->norm() < 1.0 ? 3 : 1;
  return fmt::format("({0:.{3}f}, {1:.{3}f}, {2:.{3}f})", target->x(), target->y(), target->z(),
                     digits);
}

Status check_reach(const Vec3& target, const std::string& name, const Vec3& middle,
                   const std::string& of) {
  const double away = (target - middle).norm();
  const std::string metres = geometry::metres_for_millimetres(
      target, [&](const Vec3& x) { return (x - middle).norm() <= kLargestReach_mm; });
  if (!metres.empty()) return invalid(name + " " + metres);
  if (away <= kLargestReach_mm) return {};
  return invalid(fmt::format(
      "{} lies {:.0f} mm from the middle of {}, ({:.1f}, {:.1f}, {:.1f}): must lie within {:g} mm; "
      "is it mm RAS, and of this head?",
      name, away, of, middle.x(), middle.y(), middle.z(), kLargestReach_mm));
}

Status check_in_brain(const Vec3& target, const std::string& name, const VoxelImage& mask,
                      const std::string& of) {
  double away = std::numeric_limits<double>::infinity(), in_metres = away;
  geometry::for_each_voxel(
      mask, [](float v) { return v > 0.0F; },
      [&](std::size_t, const Vec3& x) {
        away = std::min(away, (x - target).norm());
        in_metres = std::min(in_metres, (x - 1000.0 * target).norm());
      });
  const std::string metres = geometry::metres_for_millimetres(
      target, [&](const Vec3&) { return in_metres <= kBesideBrain_mm; });
  if (!metres.empty()) return invalid(name + " " + metres);
  if (away <= kBesideBrain_mm) return {};
  const auto [centre, low, high, volume] = geometry::mask_centre(mask);
  return invalid(fmt::format(
      "{} lies {:.0f} mm from {}, which reaches from ({:.0f}, {:.0f}, {:.0f}) to ({:.0f}, {:.0f}, "
      "{:.0f}): must lie within {:g} mm; is it mm RAS, and of this head?",
      name, away, of, low[0], low[1], low[2], high[0], high[1], high[2], kBesideBrain_mm));
}

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
  if (report.fre_mm > registration::kPoorFre_mm) {
    lines.push_back(fmt::format(
        "note: a registration error above {:g} mm rms is poor: touch the fiducials once more",
        registration::kPoorFre_mm));
  }
  if (report.count == 3) {
    lines.emplace_back(
        "note: three fiducials leave little to estimate these errors from; touch more");
  }
  return lines;
}

}  // namespace brainshift::client
