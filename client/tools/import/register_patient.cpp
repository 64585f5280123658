// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/register_patient.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "common/io/files/file_access.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "common/io/recording/fiducial_file.hpp"
#include "common/io/recording/sequence_file.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

Status check_register(const RegisterOptions& options) {
  if (options.recording.empty() == options.fiducials.empty()) {
    return invalid(fmt::format("exactly one of --recording and --fiducials is required, {} given",
                               options.recording.empty() ? "none" : "both"));
  }
  if (options.ras.empty() && !options.recording.empty()) {
    return invalid("--ras is required: where the fiducials lie in the image");
  }
  if (options.out.empty()) return invalid("--out is required");
  Status place = check_error_place(options.case_file, options.model, options.target);
  if (!place) return place;
  if (options.recording.empty() && !options.holds.empty()) {
    return invalid("--holds is for a --recording");
  }
  for (const auto& [name, value, most] : {std::tuple{"--still-mm", options.hold.radius_mm, 100.0},
                                          std::tuple{"--still-s", options.hold.least_s, 3600.0}}) {
    if (Status ok = check_option(name, value, 0.01, most); !ok) return ok;
  }
  return check_new(options.out);
}

// Path of the stylus's tip in the reference frame, where the tracker vouches for it.
Result<std::vector<TipSample>> tip_path(const RegisterOptions& options, RegisterReport& report) {
  io::SequenceOptions how;
  how.tracking_only = true;
  const auto recording = io::read_sequence(options.recording, how);
  if (!recording) return tl::unexpected(recording.error());
  if (recording->num_frames() > 1 && recording->time_s.front() == recording->time_s.back()) {
    return io::unreadable(
        options.recording,
        fmt::format("all {} poses have the time {} s: how long the stylus was held "
                    "still cannot be known",
                    recording->num_frames(), recording->time_s.front()));
  }
  const auto constants = device_links(options.device);
  if (!constants) return tl::unexpected(constants.error());
  const auto chain =
      tracking::evaluate_chain(*recording, *constants, options.tip_frame, options.reference_frame);
  if (!chain) return io::file_error(options.recording, chain.error());
  std::vector<TipSample> path;
  for (int frame = 0; frame < recording->num_frames(); ++frame) {
    const auto i = static_cast<std::size_t>(frame);
    const auto& T_reference_tip = chain->T_target_source[i];
    if (!T_reference_tip) continue;
    path.push_back(
        {recording->time_s[i] - recording->time_s.front(), T_reference_tip->translation()});
  }
  report.poses = recording->num_frames();
  report.poses_used = chain->used;
  report.links = chain->links;
  report.dropped = chain->dropped;
  return path;
}

std::string list_of(const std::vector<HeldPoint>& held) {
  std::string text;
  for (std::size_t i = 0; i < held.size(); ++i) {
    const Vec3& at = held[i].tip;
    text += fmt::format("{}{} at {:.1f} s ({:.0f}, {:.0f}, {:.0f})", i == 0 ? "" : "; ", i + 1,
                        held[i].from_s, at.x(), at.y(), at.z());
  }
  return text;
}

Status choose_holds(const RegisterOptions& options, RegisterReport& report) {
  const auto count = static_cast<int>(report.held.size());
  std::set<int> seen;
  for (const int hold : options.holds) {
    if (hold < 1 || hold > count || !seen.insert(hold).second) {
      return invalid(fmt::format(
          "--holds {}: must be numbers from 1 to {}, each once: the stylus was held still {}", hold,
          count, list_of(report.held)));
    }
    report.chosen.push_back(hold - 1);
  }
  for (int i = 0; options.holds.empty() && i < count; ++i) report.chosen.push_back(i);
  return {};
}

// What was touched, in the reference frame.
Result<io::NamedPoints> touched_points(const RegisterOptions& options, RegisterReport& report) {
  if (options.recording.empty()) return io::read_points(options.fiducials);
  const auto path = tip_path(options, report);
  if (!path) return tl::unexpected(path.error());
  auto held = find_holds(*path, options.hold);
  if (!held) return io::file_error(options.recording, held.error());
  report.held = std::move(*held);
  if (report.held.empty()) {
    std::string reasons;
    for (const auto& dropped : report.dropped) {
      reasons += fmt::format("; {} ({} poses)", dropped.reason, dropped.count);
    }
    return io::file_error(ErrorCode::kEmptySet, options.recording,
                          fmt::format("the tip of the stylus never stays within {} mm for {} s; {} "
                                      "of {} poses have a valid chain{}",
                                      options.hold.radius_mm, options.hold.least_s,
                                      report.poses_used, report.poses, reasons));
  }
  if (Status ok = choose_holds(options, report); !ok) return tl::unexpected(ok.error());
  io::NamedPoints points;
  for (const int i : report.chosen) points.add("", report.held[static_cast<std::size_t>(i)].tip);
  return points;
}

struct Fit {
  registration::FiducialRegistration fit;
  bool matched = false;
};

Result<Fit> fit_pairs(const RegisterOptions& options, const io::NamedPoints& touched,
                      const io::NamedPoints& ras, RegisterReport& report) {
  const fs::path& from = options.recording.empty() ? options.fiducials : options.recording;
  const auto failed = [&](const Error& error) {
    return fail(error.code, from.string() + " and " + options.ras.string() + ": " + error.message);
  };
  const auto checked = [&](const Points& measured,
                           Result<registration::FiducialRegistration> fit) -> Result<Fit> {
    if (!fit) return failed(fit.error());
    const Status head = registration::check_head_fit(measured, *fit, report.names);
    if (!head) return failed(head.error());
    return Fit{std::move(*fit), options.pairing == Pairing::kShape};
  };
  const bool named = touched.all_named() && ras.all_named();
  const bool by_name =
      options.pairing == Pairing::kName || (options.pairing == Pairing::kAuto && named);
  if (by_name) {
    const auto pairs = io::pair_by_name(touched, ras);
    if (!pairs) return failed(pairs.error());
    report.names = pairs->names;
    report.left_out = pairs->left_out;
    const Points first = columns_of(pairs->first);
    return checked(first, registration::register_fiducials(first, columns_of(pairs->second)));
  }
  const Points measured = columns_of(touched.points), image = columns_of(ras.points);
  if (options.pairing == Pairing::kShape) {
    auto fit = registration::match_fiducials(measured, image);
    if (!fit) return failed(fit.error());
    for (const int i : fit->of_image) {
      report.names.push_back(ras.names[static_cast<std::size_t>(i)]);
    }
    return checked(measured, std::move(fit));
  }
  if (measured.cols() != image.cols()) {
    const std::string held =
        report.held.empty()
            ? std::string()
            : "; the stylus was held still " + list_of(report.held) + ": choose with --holds";
    return invalid(
        fmt::format("{} fiducials were touched, {} holds {}: in order there must be as many{}",
                    measured.cols(), options.ras.string(), image.cols(), held));
  }
  report.names = ras.names;
  return checked(measured, registration::register_fiducials(measured, image));
}

Result<Fit> fit_fiducials(const RegisterOptions& options, RegisterReport& report) {
  if (options.ras.empty()) {  // a list of pairs
    auto file = io::read_fiducials(options.fiducials);
    if (!file) return tl::unexpected(file.error());
    return Fit{std::move(file->fit), file->matched};
  }
  const auto ras = io::read_points(options.ras);
  if (!ras) return tl::unexpected(ras.error());
  const auto touched = touched_points(options, report);
  if (!touched) return tl::unexpected(touched.error());
  return fit_pairs(options, *touched, *ras, report);
}

Result<Vec3> target_of(const RegisterOptions& options, const Progress& progress,
                       RegisterReport& report) {
  report.target = error_place(options.target);
  if (options.target) return *options.target;
  const auto known = load_import_case(options.case_file, options.model, progress);
  if (!known) return tl::unexpected(known.error());
  return known->tumour_centroid();
}

}  // namespace

Result<RegisterReport> register_patient(const RegisterOptions& options, const Progress& progress) {
  if (Status ok = check_register(options); !ok) return tl::unexpected(ok.error());
  RegisterReport report;
  const auto fit = fit_fiducials(options, report);
  if (!fit) return tl::unexpected(fit.error());
  const auto target = target_of(options, progress, report);
  if (!target) return tl::unexpected(target.error());
  const Status reached = check_reach(*target, (options.target ? "--target " : "") + report.target,
                                     fit->fit.image.rowwise().mean(), "the fiducials in the image");
  if (!reached) return tl::unexpected(reached.error());
  report.fiducials = describe(fit->fit, fit->matched, *target);
  report.T_ras_reference = fit->fit.T_image_measured;
  const VecX& residuals = fit->fit.residuals_mm;
  report.residuals_mm.assign(residuals.data(), residuals.data() + residuals.size());
  const Status written =
      io::write_pose(options.out, "T_ras_reference", report.T_ras_reference,
                     {"brainshift register: x_ras = T_ras_reference x_reference, lengths mm",
                      fiducial_lines(report.fiducials, {}, report.target).front()});
  if (!written) return tl::unexpected(written.error());
  return report;
}

std::vector<std::string> report_lines(const RegisterReport& report) {
  std::vector<std::string> lines;
  if (report.poses > 0) {
    lines.push_back(fmt::format("chain: {}", fmt::join(report.links, ", ")));
    lines.push_back(
        fmt::format("poses: {} of {} with a valid chain", report.poses_used, report.poses));
    for (const tracking::Dropped& entry : report.dropped) {
      lines.push_back(fmt::format("poses left out: {} because {} (first: pose {})", entry.count,
                                  entry.reason, entry.first_frame));
    }
  }
  for (std::size_t i = 0; i < report.held.size(); ++i) {
    const HeldPoint& held = report.held[i];
    const bool chosen =
        std::count(report.chosen.begin(), report.chosen.end(), static_cast<int>(i)) > 0;
    lines.push_back(fmt::format(
        "held still {}: {:.1f} to {:.1f} s, {} poses averaged, spread {:.2f} mm rms{}", i + 1,
        held.from_s, held.to_s, held.poses, held.spread_mm, chosen ? "" : ", not used"));
  }
  std::string residuals;
  for (std::size_t i = 0; i < report.residuals_mm.size(); ++i) {
    const bool named = i < report.names.size() && !report.names[i].empty();
    residuals +=
        fmt::format("{}{} {:.2f}", i == 0 ? "" : ", ",
                    named ? report.names[i] : std::to_string(i + 1), report.residuals_mm[i]);
  }
  lines.push_back("residuals, mm: " + residuals);
  auto told = fiducial_lines(report.fiducials, report.names, report.target);
  if (!report.left_out.empty()) {
    told.front() += fmt::format("; left out, since only one list has it: \"{}\"",
                                fmt::join(report.left_out, "\", \""));
  }
  lines.insert(lines.end(), told.begin(), told.end());
  return lines;
}

}  // namespace brainshift::client
