// SPDX-License-Identifier: GPL-3.0-or-later
// The files of `brainshift register --ultrasound`, simulated, and what it made of them.
//
//   sensing_register write HEAD FOLDER FIRST COUNT   a head's MRI; for every seed a tracked
//                                                    recording and a first registration
//   sensing_register judge HEAD FOLDER FIRST COUNT   the errors at the tumour, as checks
//   sensing_register head LABELS FOLDER              T1 and a tumour in a label map (FreeSurfer's
//                                                    numbers), for `brainshift init`
//
// HEAD: a case file. For every seed: new speckle, and a first registration that is off by a turn of
// up to 5 degrees about the tumour's centroid and a shift of up to 5 mm, both uniform and in random
// directions. Each frame's pose is wrong by 0.3 mm and 0.3 degrees per axis about its middle. The
// second device file has the depth of all images too long by 1.5 % besides (speed of sound).
// Another first registration is off by 8 to 15 mm and up to 10 degrees: farther than fiducials err,
// so that some of them must be refused.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "common/anatomy/brain_labels.hpp"
#include "common/anatomy/brain_mesh.hpp"
#include "common/core/random.hpp"
#include "common/core/rigid_motion.hpp"
#include "common/geometry/mask.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/registration/pose_information.hpp"
#include "tests/simulation/ultrasound.hpp"
#include "tests/support/study_record.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::sensing {
namespace {

namespace fs = std::filesystem;
using test_support::record_check;
using test_support::record_figure;

constexpr double kPerDegree = std::numbers::pi / 180.0;
constexpr double kShift_mm = 5.0, kTurn_deg = 5.0;
constexpr double kFarFrom_mm = 8.0, kFarTo_mm = 15.0, kFarTurn_deg = 10.0;
constexpr double kTracker_mm = 0.3, kTracker_deg = 0.3;
constexpr double kFound_mm = 1.0;

RigidTransform motion(const Vec3& axis, double angle, const Vec3& translation) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

const RigidTransform kRasReference = motion(Vec3(1, 2, -1), 0.8, Vec3(12, -35, 50));
const RigidTransform kProbeCorner = motion(Vec3(-1, 1, 3), 1.1, Vec3(4, -6, 9));

struct HeadFiles {
  VoxelImage mri, brain;
  TriangleSurface tumour;
  CaseConfig config;
};

Result<HeadFiles> load(const fs::path& case_file) {
  HeadFiles head;
  auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  head.config = std::move(*config);
  auto inputs = io::load_case_inputs(head.config);
  if (!inputs) return tl::unexpected(inputs.error());
  auto mri = io::read_volume(head.config.mri);
  if (!mri) return tl::unexpected(mri.error());
  auto tumour = anatomy::make_tumour_surface(*inputs);
  if (!tumour) return tl::unexpected(tumour.error());
  head.mri = std::move(*mri);
  head.brain = std::move(*inputs->brain);
  head.tumour = std::move(*tumour);
  return head;
}

Vec3 drawn(Random& random, double sd) {
  return sd * Vec3(random.normal(), random.normal(), random.normal());
}

// The recording as a tracker and PLUS write it: the head's reference moves a little.
test_support::SequenceContent tracked(const tracking::Recording& recording, Random& random) {
  test_support::SequenceContent content;
  content.width = recording.width, content.height = recording.height;
  content.pixels = recording.pixels;
  const auto& samples = recording.links[0].samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const AffineTransform& T_ras_image = samples[i].T_to_from;
    RigidTransform T_ras_corner = RigidTransform::Identity();  // of the image, without its scale
    for (int k = 0; k < 3; ++k)
      T_ras_corner.linear().col(k) = T_ras_image.linear().col(k).normalized();
    T_ras_corner.translation() = T_ras_image.translation();
    Vec6 xi;
    xi << drawn(random, kTracker_deg * kPerDegree), drawn(random, kTracker_mm);
    const Vec3 middle = T_ras_image * Vec3(0.5 * content.width, 0.5 * content.height, 0.0);
    T_ras_corner = registration::rigid_increment(xi, middle) * T_ras_corner;
    const double part = static_cast<double>(i) / static_cast<double>(samples.size());
    const RigidTransform T_tracker_reference =
        motion(Vec3(1, 0, 1), 0.5 + 0.2 * part, Vec3(-200 + 20 * part, 90, -1500));
    const RigidTransform T_tracker_probe =
        T_tracker_reference * kRasReference.inverse() * T_ras_corner * kProbeCorner.inverse();
    content.frames.push_back(
        {{"Timestamp", fmt::format("{:.6f}", 1000.0 + recording.time_s[i])},
         {"ImageStatus", "OK"},
         {"ProbeToTrackerTransform", test_support::matrix_text(T_tracker_probe.matrix())},
         {"ProbeToTrackerTransformStatus", "OK"},
         {"ReferenceToTrackerTransform", test_support::matrix_text(T_tracker_reference.matrix())},
         {"ReferenceToTrackerTransformStatus", "OK"}});
  }
  return content;
}

std::string device_text(double pixel_mm, double depth_percent) {
  const AffineTransform T =
      AffineTransform(kProbeCorner) *
      Eigen::Scaling(pixel_mm, pixel_mm * (1.0 + 0.01 * depth_percent), pixel_mm);
  return "<PlusConfiguration version=\"2.1\">\n <CoordinateDefinitions>\n  <Transform "
         "From=\"Image\" To=\"Probe\" Matrix=\"" +
         test_support::matrix_text(T.matrix()) +
         "\"/>\n </CoordinateDefinitions>\n</PlusConfiguration>\n";
}

// How wrong the file's registration is: mean distance of the tumour's vertices from their places.
Result<double> error_mm(const fs::path& file, const TriangleSurface& tumour) {
  const auto T = io::read_pose(file, "T_ras_reference");
  if (!T) return tl::unexpected(T.error());
  const RigidTransform off = *T * kRasReference.inverse();
  const Points moved = (off.linear() * tumour.vertices).colwise() + Vec3(off.translation());
  return (moved - tumour.vertices).colwise().norm().mean();
}

Status write_seed(const HeadFiles& head, const client::TissueEcho& tissue,
                  const client::ProbeWindow& window, const fs::path& folder, int seed) {
  Random random(static_cast<std::uint64_t>(seed));
  client::UltrasoundSweep sweep;
  sweep.target = head.tumour.vertices.rowwise().mean();
  const auto recording = client::simulate_ultrasound(tissue, window, {}, sweep, random);
  const auto name = [&](const char* what) { return folder / fmt::format("{}-{}", seed, what); };
  Status ok =
      io::write_file(name("us.igs.mha"), test_support::meta_text(tracked(recording, random), true));
  const auto first = [&](double turn_deg, double shift_mm) {
    Vec6 xi;
    xi << turn_deg * kPerDegree * random.direction(), shift_mm * random.direction();
    return registration::rigid_increment(xi, sweep.target) * kRasReference;
  };
  const double turn_deg = kTurn_deg * random.uniform(), shift_mm = kShift_mm * random.uniform();
  if (ok) ok = io::write_pose(name("first.txt"), "T_ras_reference", first(turn_deg, shift_mm));
  const double far_deg = kFarTurn_deg * random.uniform();
  const double far_mm = kFarFrom_mm + (kFarTo_mm - kFarFrom_mm) * random.uniform();
  if (ok) ok = io::write_pose(name("far-first.txt"), "T_ras_reference", first(far_deg, far_mm));
  return ok;
}

Status write(const HeadFiles& head, const fs::path& folder, int first, int count) {
  const auto tissue = client::tissue_echo(head.mri, head.brain, head.tumour);
  if (!tissue) return tl::unexpected(tissue.error());
  const auto window = client::probe_window(head.brain, head.config.craniotomy);
  if (!window) return tl::unexpected(window.error());
  const auto seen = client::mri_with_tumour(head.mri, head.brain, head.tumour);
  if (!seen) return tl::unexpected(seen.error());
  Status ok = io::write_nifti(folder / "mri.nii.gz",
                              {{seen->dims, seen->T_ras_voxel}, seen->values, "simulated"});
  const double pixel_mm = client::UltrasoundProbe().pixel_mm;
  if (ok) ok = io::write_file(folder / "device.xml", device_text(pixel_mm, 0.0));
  if (ok) ok = io::write_file(folder / "device-deep.xml", device_text(pixel_mm, 1.5));
  for (int seed = first; ok && seed < first + count; ++seed)
    ok = write_seed(head, *tissue, *window, folder, seed);
  return ok;
}

// ---- a head of labels ----

constexpr double kTumourRadius_mm = 12.0;

// T1 of tissue relative to white matter (tests/simulation/ultrasound.hpp).
double t1_of(int label) {
  using anatomy::Matter;
  using anatomy::Structure;
  const Structure structure = anatomy::structure_of(label);
  if (structure == Structure::kBrainstem) return 0.95;
  if (structure == Structure::kCerebellum) return label == 7 || label == 46 ? 1.0 : 0.73;
  if (structure != Structure::kCerebrum) return 0.25;
  const Matter matter = anatomy::matter_of(label);
  return matter == Matter::kWhite ? 1.0 : matter == Matter::kNucleus ? 0.85 : 0.73;
}

// The tumour: a ball about the place in the right hemisphere's white matter (41) nearest to 30 mm
// to the right of the brain's middle and 25 mm above it.
Status write_head(const fs::path& file, const fs::path& folder) {
  const auto labels = io::read_nifti(file);
  if (!labels) return tl::unexpected(labels.error());
  VoxelImage t1 = *labels, tumour = *labels;
  Vec3 middle = Vec3::Zero();
  double count = 0.0;
  const auto each = [&](const auto& take) {
    std::size_t v = 0;
    for (int k = 0; k < labels->dims[2]; ++k)
      for (int j = 0; j < labels->dims[1]; ++j)
        for (int i = 0; i < labels->dims[0]; ++i, ++v)
          take(v, static_cast<int>(std::lround(labels->values[v])),
               Vec3(labels->T_ras_voxel * Vec3(i, j, k)));
  };
  each([&](std::size_t v, int label, const Vec3& x) {
    t1.values[v] = static_cast<float>(1000.0 * t1_of(label));
    if (anatomy::structure_of(label) == anatomy::Structure::kCerebrum) middle += x, count += 1.0;
  });
  const Vec3 wanted = middle / count + Vec3(30, 0, 25);
  Vec3 centre = Vec3::Constant(std::numeric_limits<double>::infinity());
  each([&](std::size_t, int label, const Vec3& x) {
    if (label == 41 && (x - wanted).norm() < (centre - wanted).norm()) centre = x;
  });
  each([&](std::size_t v, int, const Vec3& x) {
    tumour.values[v] = (x - centre).norm() < kTumourRadius_mm ? 1.0F : 0.0F;
  });
  t1 = geometry::gaussian_smooth(t1, 0.5);
  Random random(31);
  for (float& value : t1.values) value += static_cast<float>(30.0 * random.normal());
  Status ok =
      io::write_nifti(folder / "t1.nii.gz", {{t1.dims, t1.T_ras_voxel}, t1.values, "labels"});
  if (ok)
    ok = io::write_nifti(folder / "tumour.nii.gz",
                         {{tumour.dims, tumour.T_ras_voxel}, tumour.values, "ball"});
  return ok;
}

// ---- what was made of the files ----

struct Judged {
  int count = 0, answered = 0, found = 0;
  double mean_mm = 0.0, largest_mm = 0.0;
  double square = 0.0, expected_square = 0.0;  // sums of squares of errors, and of those expected
};

// What the file's comment says of it: "# expected error at PLACE NUMBER mm rms".
double expected_mm(const std::string& content) {
  const std::size_t end = content.find(" mm rms");
  const std::size_t begin = content.rfind(' ', end - 1);
  return end == std::string::npos ? 0.0 : std::atof(content.c_str() + begin);
}

// Of the files SEED-WHAT.txt; none where the program refused. began: "first" or "far-first".
Result<Judged> judge_files(const HeadFiles& head, const fs::path& folder, int first, int count,
                           const std::string& what, const std::string& began = "first") {
  Judged judged;
  judged.count = count;
  for (int seed = first; seed < first + count; ++seed) {
    const fs::path file = folder / fmt::format("{}-{}.txt", seed, what);
    const auto before = error_mm(folder / fmt::format("{}-{}.txt", seed, began), head.tumour);
    if (!before) return tl::unexpected(before.error());
    if (!fs::exists(file)) {
      fmt::print("seed {} {}: {:.2f} mm before; refused\n", seed, what, *before);
      continue;
    }
    const auto after = error_mm(file, head.tumour);
    if (!after) return tl::unexpected(after.error());
    fmt::print("seed {} {}: {:.2f} mm before, {:.2f} mm after\n", seed, what, *before, *after);
    ++judged.answered;
    judged.found += *after <= kFound_mm ? 1 : 0;
    judged.mean_mm += *after;
    judged.largest_mm = std::max(judged.largest_mm, *after);
    const auto content = io::read_file(file);
    if (!content) return tl::unexpected(content.error());
    const double expected = expected_mm(*content);
    judged.square += *after * *after, judged.expected_square += expected * expected;
  }
  judged.mean_mm /= std::max(1, judged.answered);
  return judged;
}

constexpr const char* kStudy = "register";

Status judge(const HeadFiles& head, const fs::path& folder, int first, int count) {
  const auto own = judge_files(head, folder, first, count, "out");
  if (!own) return tl::unexpected(own.error());
  const std::string source = head.config.case_id + "; seeds from " + std::to_string(first) +
                             "; poses of frames off by 0.3 mm 0.3 deg; paper 2.7";
  const std::string of = " of " + std::to_string(count) + " (" + head.config.case_id + ")";
  record_check(kStudy, "command line: at most 1 mm left at the tumour" + of, own->found,
               fmt::format(">= {}", (19 * count + 19) / 20), 20 * own->found >= 19 * count, source);
  record_check(kStudy, "command line: neither refused nor within 1 mm" + of,
               own->answered - own->found, "= 0", own->answered == own->found, source);
  record_figure(kStudy, "command line: mean error left (mm)" + of, own->mean_mm,
                fmt::format("shown; largest {:.2f}", own->largest_mm), source);
  record_figure(kStudy, "command line: rms error over rms of those expected" + of,
                std::sqrt(own->square / std::max(1e-12, own->expected_square)), "shown", source);
  const auto far = judge_files(head, folder, first, count, "far", "far-first");
  if (!far) return tl::unexpected(far.error());
  record_check(kStudy, "command line: from 8 to 15 mm: neither refused nor within 1 mm" + of,
               far->answered - far->found, "= 0", far->answered == far->found, source);
  record_figure(kStudy, "command line: from 8 to 15 mm: within 1 mm" + of, far->found,
                fmt::format("shown; {} refused", count - far->answered), source);
  const auto deep = judge_files(head, folder, first, count, "deep");
  if (!deep) return tl::unexpected(deep.error());
  record_figure(kStudy, "command line: within 1 mm with depth off by 1.5 % as well" + of,
                deep->found,
                fmt::format("shown; {} refused; mean {:.2f} largest {:.2f} mm",
                            count - deep->answered, deep->mean_mm, deep->largest_mm),
                source);
  return {};
}

}  // namespace
}  // namespace brainshift::sensing

int main(int argc, char** argv) {
  using namespace brainshift;
  const std::string verb = argc > 1 ? argv[1] : "";
  const bool seeds = argc == 6 && (verb == "write" || verb == "judge");
  if (!seeds && !(argc == 4 && verb == "head")) {
    std::fprintf(stderr,
                 "usage: sensing_register write|judge CASE FOLDER FIRST COUNT\n"
                 "       sensing_register head LABELS FOLDER\n");
    return 2;
  }
  Status status;
  if (seeds) {
    const auto head = sensing::load(argv[2]);
    const int first = std::atoi(argv[4]), count = std::atoi(argv[5]);
    if (!head)
      status = tl::unexpected(head.error());
    else
      status = verb == "write" ? sensing::write(*head, argv[3], first, count)
                               : sensing::judge(*head, argv[3], first, count);
  } else {
    status = sensing::write_head(argv[2], argv[3]);
  }
  if (status) return 0;
  std::fprintf(stderr, "sensing_register: %s\n", status.error().message.c_str());
  return 1;
}
