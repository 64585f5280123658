// SPDX-License-Identifier: GPL-3.0-or-later
// Recorded tracked ultrasound, read and used: every frame of two phantom sweeps; volumes
// compounded from them, beside those that PLUS made; poses between samples, beside samples that
// were withheld.
//
// Needs the folder tracked_ultrasound_plus of BRAINSHIFT_EXTERNAL_DATA (PlusLibData, BSD-3).
// Without it the study is left out.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "common/core/mesh.hpp"
#include "common/io/config/plus_config.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/packed_values.hpp"
#include "common/io/recording/sequence_file.hpp"
#include "common/io/recording/sequence_header.hpp"
#include "common/tracking/chain.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/compound.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift {
namespace {

namespace fs = std::filesystem;
using test_support::CompoundedVolume;
using test_support::record;
using test_support::record_check;
using test_support::record_left_out;
using test_support::VolumeGrid;

constexpr const char* kStudy = "ultrasound";

// A volume that PLUS compounded, for comparison with ours.

// MetaImage of unsigned char whose Offset and ElementSpacing are in the Reference frame, mm.
struct AnswerVolume {
  VolumeGrid grid;
  std::vector<float> values;
};

// PLUS's volume holds no weights: empty voxels are 0, as are black ones.
enum class Voxels {
  kWeFilled,    // our weight is positive
  kPlusFilled,  // PLUS's value is positive; ours is 0 where we have no pixel
};

// Agreement over some voxels, our volume moved against PLUS's by whole voxels.
struct Agreement {
  double correlation = 0.0;
  double mean_difference = 0.0;  // absolute, grey values, where PLUS's is not 0
  long voxels = 0;
};

Vec3 three_numbers(const io::SequenceHeader& header, const char* key) {
  Vec3 value = Vec3::Zero();
  const std::string& text = header.fields.at(key);
  char* rest = nullptr;
  const char* at = text.c_str();
  for (int axis = 0; axis < 3; ++axis, at = rest) value[axis] = std::strtod(at, &rest);
  return value;
}

Result<AnswerVolume> read_answer(const std::filesystem::path& path) {
  const auto content = io::read_file(path);
  if (!content) return tl::unexpected(content.error());
  const auto header = io::parse_meta_sequence(*content);
  if (!header) return io::file_error(header.error().code, path, header.error().message);
  const auto bytes = io::unpack(*header, 1);
  if (!bytes) return io::file_error(bytes.error().code, path, bytes.error().message);
  AnswerVolume volume;
  volume.grid.origin_mm = three_numbers(*header, "Offset");
  volume.grid.spacing_mm = three_numbers(*header, "ElementSpacing");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    volume.grid.dims[axis] = static_cast<int>(header->sizes[axis]);
  }
  for (const char byte : *bytes) {
    volume.values.push_back(static_cast<float>(static_cast<unsigned char>(byte)));
  }
  return volume;
}

Agreement compare(const CompoundedVolume& ours, const AnswerVolume& answer,
                  const std::array<int, 3>& shift = {0, 0, 0}, Voxels voxels = Voxels::kWeFilled) {
  const std::array<int, 3>& dims = answer.grid.dims;
  double n = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0, difference = 0, bright = 0;
  for (std::size_t i = 0; i < answer.values.size(); ++i) {
    if (voxels == Voxels::kWeFilled && ours.weight[i] <= 0.0F) continue;
    const int at = static_cast<int>(i);
    const std::array<int, 3> moved{at % dims[0] + shift[0], at / dims[0] % dims[1] + shift[1],
                                   at / dims[0] / dims[1] + shift[2]};
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inside = inside && moved[axis] >= 0 && moved[axis] < dims[axis];
    }
    if (!inside) continue;
    const double x = ours.image.values[i];
    const double y =
        answer
            .values[static_cast<std::size_t>(moved[0] + dims[0] * (moved[1] + dims[1] * moved[2]))];
    if (voxels == Voxels::kPlusFilled && y <= 0.0) continue;
    n += 1, sx += x, sy += y, sxx += x * x, syy += y * y, sxy += x * y;
    if (y > 0.0) difference += std::abs(x - y), bright += 1;
  }
  Agreement result;
  const double vx = sxx / n - sx * sx / n / n, vy = syy / n - sy * sy / n / n;
  result.correlation = (sxy / n - sx * sy / n / n) / std::sqrt(std::max(1e-300, vx * vy));
  result.mean_difference = difference / std::max(1.0, bright);
  result.voxels = std::lround(n);
  return result;
}

template <typename T>
T value_or_exit(Result<T> result) {
  if (!result) {
    fmt::print(stderr, "sensing_ultrasound: {}\n", result.error().message);
    std::exit(1);
  }
  return std::move(*result);
}

bool check(const std::string& name, double value, const std::string& bound, bool pass,
           const std::string& source) {
  fmt::print("{}  {} = {:.6g} ({})\n", pass ? "ok  " : "FAIL", name, value, bound);
  return record_check(kStudy, name, value, bound, pass, source);
}

// Records the correlation for moves along x. Returns the length of the best of the 27 moves by at
// most one voxel along each axis.
double best_move(const std::string& series, const CompoundedVolume& ours,
                 const AnswerVolume& answer) {
  for (int move = -3; move <= 3; ++move) {
    record({kStudy, series, "move along x in voxels", "correlation with PLUS", double(move),
            compare(ours, answer, {move, 0, 0}).correlation});
  }
  double best = -1.0, length = 0.0;
  for (int code = 0; code < 27; ++code) {
    const std::array<int, 3> move{code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
    const double correlation = compare(ours, answer, move).correlation;
    if (correlation <= best) continue;
    best = correlation;
    length = std::sqrt(double(move[0] * move[0] + move[1] * move[1] + move[2] * move[2]));
  }
  return length;
}

struct Sweep {
  tracking::Recording recording;
  tracking::Chain chain;
};

Sweep read_sweep(const fs::path& recording, const fs::path& config,
                 const std::string& image_frame) {
  Sweep sweep{value_or_exit(io::read_sequence(recording)), {}};
  const auto constants = value_or_exit(io::read_plus_config(config));
  sweep.chain =
      value_or_exit(tracking::evaluate_chain(sweep.recording, constants, image_frame, "Reference"));
  std::string links;
  for (const std::string& link : sweep.chain.links) links += " " + link;
  fmt::print("{}: {} frames of {} x {} px, {} used, chain{}\n", recording.filename().string(),
             sweep.recording.num_frames(), sweep.recording.width, sweep.recording.height,
             sweep.chain.used, links);
  return sweep;
}

void check_counts(const std::string& name, const Sweep& sweep, int frames) {
  const int read = sweep.recording.num_frames();
  check(name + " frames read", read, fmt::format("= {}", frames), read == frames,
        "DimSize of the recording");
  check(name + " frames with a valid chain", sweep.chain.used, fmt::format("= {}", frames),
        sweep.chain.used == frames, "status fields of the recording");
}

// Index k of the slice with the most voxels of positive weight.
int fullest_slice(const std::vector<float>& weight, const std::array<int, 3>& dims) {
  std::vector<long> filled(static_cast<std::size_t>(dims[2]), 0);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        if (weight[grid_index(dims, i, j, k)] > 0.0F) ++filled[static_cast<std::size_t>(k)];
      }
    }
  }
  return static_cast<int>(std::max_element(filled.begin(), filled.end()) - filled.begin());
}

// A row per voxel of one slice of both volumes: slice_NAME.csv, which tests/studies/sensing.py
// draws.
void write_slices(const std::string& name, const CompoundedVolume& ours,
                  const AnswerVolume& answer) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) return;
  const VolumeGrid& grid = answer.grid;
  const int k = fullest_slice(ours.weight, grid.dims);
  auto file = value_or_exit(bench::CsvWriter::create(fs::path(folder) / ("slice_" + name + ".csv"),
                                                     "x_mm,y_mm,brainshift,PLUS"));
  for (int j = 0; j < grid.dims[1]; ++j) {
    for (int i = 0; i < grid.dims[0]; ++i) {
      const std::size_t voxel = grid_index(grid.dims, i, j, k);
      std::vector<std::string> cells;
      for (const double value : {i * grid.spacing_mm[0], j * grid.spacing_mm[1],
                                 double(ours.image.values[voxel]), double(answer.values[voxel])}) {
        cells.push_back(bench::csv_number(value));
      }
      if (const Status ok = file.row(cells); !ok) {
        fmt::print(stderr, "sensing_ultrasound: {}\n", ok.error().message);
        std::exit(1);
      }
    }
  }
}

void check_volume(const std::string& what, const CompoundedVolume& ours,
                  const AnswerVolume& answer) {
  const Agreement agreement = compare(ours, answer);
  fmt::print("{}: {} voxels filled, mean |difference| {:.2f} grey values\n", what, agreement.voxels,
             agreement.mean_difference);
  const std::string source = "volume made by PLUS (PlusLibData)";
  check(what + " volume: correlation with PLUS's over filled voxels", agreement.correlation,
        ">= 0.9", agreement.correlation >= 0.9, source);
  // The voxels that PLUS filled and we did not count here too, so the figure depends on the data
  // that each volume was made of.
  const double over_plus = compare(ours, answer, {0, 0, 0}, Voxels::kPlusFilled).correlation;
  fmt::print("-     {} volume: correlation over the voxels that PLUS filled = {:.4f}\n", what,
             over_plus);
  test_support::record_figure(
      kStudy, what + " volume: correlation with PLUS's over the voxels that PLUS filled", over_plus,
      "shown", source);
  const double move = best_move(what, ours, answer);
  check(what + " volume: best of 27 moves by one voxel (length in voxels)", move, "= 0",
        move == 0.0, source);
}

void study_spine(const fs::path& folder) {
  const Sweep sweep =
      read_sweep(folder / "SpinePhantomFreehand.igs.mha",
                 folder / "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml", "Image");
  check_counts("spine", sweep, 21);
  const AnswerVolume answer =
      value_or_exit(read_answer(folder / "SpinePhantomFreehandReconstructed.mha"));
  const ultrasound::PixelWindow window{0, 0, sweep.recording.width, sweep.recording.height};
  const auto grid = value_or_exit(test_support::enclosing_grid(
      sweep.recording, sweep.chain.T_target_source, window, answer.grid.spacing_mm));
  const double origin_mm = (grid.origin_mm - answer.grid.origin_mm).cwiseAbs().maxCoeff();
  check("spine origin of the enclosing grid against PLUS's mm", origin_mm, "<= 0.001",
        origin_mm <= 0.001, "Offset in PLUS's volume (6 digits)");
  const bool same = grid.dims == answer.grid.dims;
  check("spine voxels along each axis as PLUS's", same ? 1 : 0, "= 1", same,
        "DimSize in PLUS's volume");
  for (const auto& [paste, label] : {std::pair{test_support::Paste::kLinear, "linear"},
                                     std::pair{test_support::Paste::kNearest, "nearest"}}) {
    const auto ours = value_or_exit(test_support::compound(
        sweep.recording, sweep.chain.T_target_source, window, answer.grid, paste));
    const std::string what = std::string("spine ") + label;
    check_volume(what, ours, answer);
    if (paste == test_support::Paste::kLinear) write_slices("spine", ours, answer);
  }
}

// PLUS made its volume from the whole recording. Ours are 20 cropped frames of it, so other frames
// have a share in PLUS's voxels, and PLUS filled voxels that we cannot fill.
void study_nwire(const fs::path& folder) {
  const Sweep sweep =
      read_sweep(folder / "NwirePhantomFreehandCropped.igs.mha",
                 folder / "PlusDeviceSet_NwirePhantomFreehand_vtkVolumeReconstructorTest2.xml",
                 "CroppedImage");
  check_counts("nwire", sweep, 20);
  const AnswerVolume answer =
      value_or_exit(read_answer(folder / "NwirePhantomFreehandReconstructed.mha"));
  const ultrasound::PixelWindow window{0, 0, sweep.recording.width, sweep.recording.height};
  const auto ours = value_or_exit(
      test_support::compound(sweep.recording, sweep.chain.T_target_source, window, answer.grid));
  check_volume("nwire", ours, answer);
  write_slices("nwire", ours, answer);
}

struct PoseErrors {
  std::vector<double> translation_mm, rotation_deg;

  void add(const AffineTransform& T, const AffineTransform& truth) {
    translation_mm.push_back((T.translation() - truth.translation()).norm());
    const Mat3 R = T.linear() * truth.linear().transpose();
    rotation_deg.push_back(Eigen::AngleAxisd(R).angle() * 180.0 / std::numbers::pi);
  }
};

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

double percentile(std::vector<double> values, int percent) {
  std::sort(values.begin(), values.end());
  return values[(values.size() - 1) * static_cast<std::size_t>(percent) / 100];
}

// Every other sample of a tracked probe is withheld and predicted: by interpolation between its
// neighbours, and by the neighbour before it (what a system without interpolation shows).
void study_interpolation(const fs::path& folder) {
  const auto recording =
      value_or_exit(io::read_sequence(folder / "TransformInterpolationTest.igs.mha"));
  const auto series =
      std::find_if(recording.links.begin(), recording.links.end(),
                   [](const auto& link) { return link.frames.name() == "ProbeToTracker"; });
  if (series == recording.links.end()) {
    check("link ProbeToTracker of the recording", 0, "= 1", false,
          "TransformInterpolationTest.igs.mha");
    return;
  }
  std::vector<tracking::Link> kept = series->samples;
  for (std::size_t i = 1; i < kept.size(); i += 2) kept[i].status = tracking::LinkStatus::kMissing;
  PoseErrors between, before;
  int without = 0;
  for (std::size_t i = 1; i + 1 < kept.size(); i += 2) {
    if (series->samples[i].status != tracking::LinkStatus::kOk) continue;
    const auto pose = tracking::pose_at(recording.time_s, kept, recording.time_s[i]);
    if (pose.outcome != tracking::PoseOutcome::kOk) {
      ++without;
      continue;
    }
    const AffineTransform& truth = series->samples[i].T_to_from;
    between.add(pose.T_to_from, truth);
    before.add(kept[i - 1].T_to_from, truth);
  }
  check("withheld poses that were interpolated", static_cast<double>(between.translation_mm.size()),
        ">= 10", between.translation_mm.size() >= 10, "TransformInterpolationTest.igs.mha");
  if (between.translation_mm.empty()) return;
  for (int percent = 5; percent <= 100; percent += 5) {
    const char* x = "percentile of withheld poses";
    const char* y = "translation error mm";
    record({"ultrasound_poses", "interpolated", x, y, double(percent),
            percentile(between.translation_mm, percent)});
    record({"ultrasound_poses", "sample before", x, y, double(percent),
            percentile(before.translation_mm, percent)});
  }
  fmt::print("medians: {:.4f} mm interpolated; {:.4f} mm the sample before\n",
             percentile(between.translation_mm, 50), percentile(before.translation_mm, 50));
  fmt::print(
      "withheld poses: {} interpolated, {} without a pose; rms {:.4f} mm {:.4f} deg; sample before "
      "{:.4f} "
      "mm {:.4f} deg\n",
      between.translation_mm.size(), without, rms(between.translation_mm),
      rms(between.rotation_deg), rms(before.translation_mm), rms(before.rotation_deg));
  const double ratio = rms(between.translation_mm) / rms(before.translation_mm);
  check("withheld poses: translation error over that of the sample before", ratio, "< 1",
        ratio < 1.0, "TransformInterpolationTest.igs.mha");
  const double turn = rms(between.rotation_deg) / rms(before.rotation_deg);
  check("withheld poses: rotation error over that of the sample before", turn, "< 1", turn < 1.0,
        "TransformInterpolationTest.igs.mha");
  const auto invalid =
      std::count_if(series->samples.begin(), series->samples.end(),
                    [](const auto& link) { return link.status == tracking::LinkStatus::kInvalid; });
  check("invalid samples of the recording", static_cast<double>(invalid), "= 1", invalid == 1,
        "status fields of the recording");
}

void study_refusals(const fs::path& folder) {
  const auto sample = io::read_sequence(folder / "NrrdSample.igs.nrrd");
  const bool named =
      !sample && sample.error().message.find("Seq_Frame0000_Timestamp") != std::string::npos;
  fmt::print("{}\n", sample ? "NrrdSample was accepted" : sample.error().message);
  check("NRRD sample without times refused naming frame and field", named ? 1 : 0, "= 1", named,
        "NrrdSample.igs.nrrd has no Timestamp");
}

}  // namespace
}  // namespace brainshift

int main() {
  using namespace brainshift;
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) {
    fmt::print("BRAINSHIFT_EXTERNAL_DATA is not set: left out\n");
    record_left_out(kStudy, "recorded tracked ultrasound: BRAINSHIFT_EXTERNAL_DATA is not set");
    return 0;
  }
  const std::filesystem::path folder = std::filesystem::path(data) / "tracked_ultrasound_plus";
  study_spine(folder);
  study_nwire(folder);
  study_interpolation(folder);
  study_refusals(folder);
  return 0;
}
