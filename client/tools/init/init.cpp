// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/init/init.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>

#include "client/tools/init/given_tumour.hpp"
#include "client/tools/init/position.hpp"
#include "common/anatomy/brain_labels.hpp"
#include "common/anatomy/given_inputs.hpp"
#include "common/core/text.hpp"
#include "common/geometry/mask.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/dicom/dicom_series.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/output_path.hpp"
#include "common/io/geometry/label_names.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

constexpr double kMm3PerCc = 1000.0, kLargestTumour = 0.5;  // of the brain
constexpr double kLowest_mm = 8.0;
constexpr double kStemHalfWidth_mm = 15.0;
constexpr double kStemRadius_mm = 14.0;
constexpr double kDown = -0.3;  // sine of the elevation
constexpr double kCap_mm = 3.0;
// An opening is wider than the tumour's ball.
constexpr double kOpeningMargin_mm = 20.0, kSmallOpening_mm = 40.0, kLargeOpening_mm = 80.0;

// Calls take(place) for every voxel > 0.
template <typename Take>
void for_each_of(const VoxelImage& mask, const Take& take) {
  geometry::for_each_voxel(
      mask, [](float value) { return value > 0.0F; },
      [&take](std::size_t, const Vec3& x) { take(x); });
}

Status check_options(const InitOptions& options) {
  std::string missing;
  const auto need = [&](bool given, const char* what) {
    if (!given) missing += (missing.empty() ? "" : ", ") + std::string(what);
  };
  need(!options.mri.empty(), "--mri");
  need(!options.brain.empty() || !options.labels.empty(), "--brain or --labels");
  need(!options.tumour.empty(), "--tumour");
  need(!options.position.empty(), "--position");
  need(!options.out.empty(), "--out");
  if (!missing.empty()) return invalid("missing: " + missing);
  if (fs::exists(options.out)) {
    return invalid("--out: " + options.out.string() + ": exists; a case is never replaced");
  }
  return io::check_output_file("--out", options.out);
}

// ---- the case as text ----

std::string list_text(const Vec3& x, int digits) {
  return fmt::format("[{:.{}f}, {:.{}f}, {:.{}f}]", x[0], digits, x[1], digits, x[2], digits);
}

fs::path whole_path(const fs::path& path) { return fs::absolute(path).lexically_normal(); }

std::string file_text(const fs::path& path) { return io::yaml_text(whole_path(path).string()); }

// Lines of comment, broken before column 100. A file's name in it may hold a line break.
std::string comment(const std::string& words, std::size_t indent) {
  const std::string sentence = one_line(words);
  const std::string begin = std::string(indent, ' ') + "#";
  std::string text, line = begin;
  for (std::size_t at = 0; at < sentence.size();) {
    const std::size_t end = std::min(sentence.find(' ', at), sentence.size());
    if (line.size() > begin.size() && line.size() + 1 + end - at > 99) {
      text += line + "\n";
      line = begin;
    }
    line += " " + sentence.substr(at, end - at);
    at = end + 1;
  }
  return text + line + "\n";
}

struct Draft {
  InitOptions options;
  fs::path mri, brain, tumour_file;
  std::vector<int> labels;                // the tumour's
  std::optional<io::DicomSeries> series;  // of a DICOM MRI
  VoxelImage mri_image;
  std::optional<VoxelImage> segments;  // of a DICOM segmentation or structure set
  std::string about_mri, about_brain, about_tumour, about_opening, about_stem, about_gravity;
  std::string doubt_of_labels;
  double opening_mm = 0.0;
  OpeningGuess opening;
  Vec3 stem = Vec3::Zero(), gravity = Vec3::Zero();
};

std::string case_text(const Draft& draft) {
  const bool segment = !draft.options.tumour_segment.empty();
  std::string labels;
  for (const int label : draft.labels) {
    labels += fmt::format("{}{}", labels.empty() ? "" : ", ", label);
  }
  const Vec3 axis = std::abs(draft.opening.outward.y()) > 0.8 ? Vec3::UnitZ() : Vec3::UnitY();
  std::string text = comment(
      "A first case by brainshift init. What is marked GUESS is one: look at the pictures of "
      "brainshift preview and correct it. Places are patient RAS in mm: +x right, +y anterior, "
      "+z superior. config/cases/colin27.yaml documents every key.",
      0);
  text += "case_id: " + io::yaml_text(draft.options.out.stem().string()) + "\n\nimages:\n";
  if (!draft.about_mri.empty()) text += comment(draft.about_mri, 2);
  text += "  mri: " + file_text(draft.mri) + "\n" + comment(draft.about_brain, 2);
  text += "  brain: " + file_text(draft.brain) + "\n\ntumour:\n  label_volume:\n";
  text += comment(draft.about_tumour, 4) + "    file: " + file_text(draft.tumour_file) + "\n";
  text += segment ? "    segment: " + io::yaml_text(draft.options.tumour_segment) + "\n"
                  : "    label: [" + labels + "]\n";
  text += "\ncraniotomy:\n" + comment(draft.about_opening, 2);
  text += "  centre_mm: " + list_text(draft.opening.centre, 1) + "\n";
  text += fmt::format("  long_axis_mm: {:.0f}\n  short_axis_mm: {:.0f}\n", draft.opening_mm,
                      draft.opening_mm);
  text += "  long_axis_direction: " + list_text(axis, 0) + "\n";
  text += "\nbrainstem:\n" + comment(draft.about_stem, 2);
  text += "  centre_mm: " + list_text(draft.stem, 1) + "\n";
  text += fmt::format("  radius_mm: {:.0f}\n", kStemRadius_mm);
  text += "\ngravity:\n" + comment(draft.about_gravity, 2);
  text += "  direction: " + list_text(draft.gravity, 4) + "\n";
  if (draft.options.labels.empty()) return text;
  text += "\n" + comment(
                     "Tissues, falx, tentorium and ventricles from the label map "
                     "(docs/your-patient.md): without the comment signs the model has them.",
                     0);
  return text + "# anatomy:\n#   labels: " + file_text(draft.options.labels) + "\n";
}

// Other readers of YAML, and messages that carry a case_id, need UTF-8.
Status check_names(const Draft& draft, const CaseConfig& read) {
  const auto& tumour = std::get<TumourLabel>(read.tumour);
  const std::string case_id = draft.options.out.stem().string();
  const std::string& segment = draft.options.tumour_segment;
  const std::tuple<const char*, std::string, bool> names[] = {
      {"--out", case_id, read.case_id == case_id},
      {"--mri", draft.mri.string(), read.mri == whole_path(draft.mri)},
      {"--brain", draft.brain.string(), read.brain == whole_path(draft.brain)},
      {"--tumour", draft.tumour_file.string(), tumour.path == whole_path(draft.tumour_file)},
      {"--tumour-segment", segment, tumour.segment.value_or("") == segment}};
  for (const auto& [option, name, same] : names) {
    if (same && is_utf8(name)) continue;
    return invalid(fmt::format("{}: {}: a case file cannot name this: it must be UTF-8", option,
                               in_quotes(name)));
  }
  return {};
}

// ---- what is guessed ----

fs::path beside(const fs::path& out, const std::string& what) {
  return out.parent_path() / (out.stem().string() + what);
}

Result<VoxelImage> read_labels(const fs::path& path) {
  auto map = io::read_volume(path);
  if (!map) return map;
  const auto names = io::label_names_beside(path);
  if (!names) return tl::unexpected(names.error());
  const Status good = anatomy::check_label_map(*map, "--labels: " + path.string());
  if (!good) return tl::unexpected(good.error());
  if (names->empty()) return map;
  auto renamed = anatomy::with_freesurfer_numbers(*map, *names);
  if (!renamed) return io::file_error(path, renamed.error());
  return renamed;
}

std::optional<Vec3> stem_from_labels(VoxelImage labels) {
  bool found = false;
  for (float& v : labels.values) {
    const bool stem = std::isfinite(v) && anatomy::structure_of(static_cast<int>(std::lround(v))) ==
                                              anatomy::Structure::kBrainstem;
    v = stem ? 1.0F : 0.0F;
    found = found || stem;
  }
  if (!found) return std::nullopt;
  return lowest_part(labels, std::numeric_limits<double>::infinity());
}

std::string about_series(const io::DicomSeries& series) {
  std::string text = fmt::format("From the DICOM series {}, {} images",
                                 in_quotes(series.description), series.image.dims[2]);
  if (series.other_files > 0) {
    text += fmt::format("; {} files of the folder are no images", series.other_files);
  }
  if (!series.patient_position.empty()) {
    text += fmt::format("; scanned {}, which need not be the position in surgery",
                        one_line(series.patient_position));
  }
  return text + ".";
}

Points voxels_of(const std::vector<anatomy::Focus>& foci) {
  std::vector<Vec3> all;
  for (const anatomy::Focus& focus : foci) {
    for_each_of(focus.mask, [&all](const Vec3& x) { all.push_back(x); });
  }
  Points voxels(3, static_cast<Eigen::Index>(all.size()));
  for (Eigen::Index i = 0; i < voxels.cols(); ++i) voxels.col(i) = all[static_cast<std::size_t>(i)];
  return voxels;
}

Status guess_tumour(Draft& draft, const VoxelImage& brain) {
  const InitOptions& options = draft.options;
  MriIdentity mri;
  if (draft.series) mri = {draft.series->frame_of_reference, draft.series->series};
  auto given = read_tumour({options.tumour, options.tumour_label, options.tumour_segment},
                           draft.mri_image, mri);
  if (!given) return tl::unexpected(given.error());
  draft.labels = given->labels;
  anatomy::Notes notes;
  const auto foci =
      anatomy::tumour_foci(given->map, given->labels, 0.0, options.tumour.string(), &notes);
  if (!foci) return tl::unexpected(foci.error());
  double mm3 = 0.0;
  for (const anatomy::Focus& focus : *foci) mm3 += focus.volume_mm3;
  const double brain_mm3 =
      std::abs(brain.T_ras_voxel.linear().determinant()) *
      static_cast<double>(std::count_if(brain.values.begin(), brain.values.end(),
                                        [](float v) { return v > 0.0F; }));
  if (mm3 > kLargestTumour * brain_mm3) {
    return invalid(
        fmt::format("{}: the tumour has {:.0f} cc ({}) of a brain of {:.0f} cc: is it "
                    "the background, or the brain?",
                    options.tumour.string(), mm3 / kMm3PerCc, given->why, brain_mm3 / kMm3PerCc));
  }
  const auto doubt =
      place_in_brain(voxels_of(*foci), brain, "--tumour: " + options.tumour.string());
  if (!doubt) return tl::unexpected(doubt.error());
  draft.about_tumour = fmt::format("{:.2f} cc ({}).", mm3 / kMm3PerCc, given->why);
  if (!doubt->empty()) draft.about_tumour += " LOOK AGAIN: " + *doubt + ".";
  for (const std::string& note : given->notes) draft.about_tumour += " " + note + ".";
  for (const std::string& note : notes) {
    draft.about_tumour += " " + note.substr(options.tumour.string().size() + 2) + ".";
  }
  if (given->from_dicom) {
    draft.tumour_file = beside(options.out, "-tumour.nii.gz");
    draft.segments = std::move(given->map);
  }
  const Vec3 centre = foci->front().centre;
  const double ball_mm = 2.0 * std::cbrt(0.75 * foci->front().volume_mm3 / std::numbers::pi);
  draft.opening = opening_over(brain, centre);
  draft.opening_mm =
      std::round(std::clamp(ball_mm + kOpeningMargin_mm, kSmallOpening_mm, kLargeOpening_mm));
  draft.about_opening = fmt::format(
      "GUESS: the outermost place of the brain that is nearest to the tumour's centre, {} mm, from "
      "which it is {:.0f} mm away; as wide as a ball of the tumour's volume and {:.0f} mm more, at "
      "least {:.0f} mm.",
      list_text(centre, 0), (draft.opening.centre - centre).norm(), kOpeningMargin_mm,
      kSmallOpening_mm);
  return {};
}

// ---- the steps of a first case ----

// A series is turned into a volume beside the case; a volume is used where it lies.
Status take_mri(Draft& draft) {
  const InitOptions& options = draft.options;
  draft.mri = options.mri;
  if (fs::is_directory(options.mri)) {
    auto read = io::read_dicom_series(options.mri);
    if (!read) return tl::unexpected(read.error());
    draft.mri = beside(options.out, "-mri.nii.gz");
    draft.about_mri = about_series(*read);
    draft.series = std::move(*read);
    draft.mri_image = draft.series->image;
    return {};
  }
  if (io::lower_extension(options.mri) == ".dcm") {
    return invalid("--mri: " + options.mri.string() +
                   ": is one image of a DICOM series: give the folder that holds the series");
  }
  auto mri = io::read_volume(options.mri);
  if (!mri) return tl::unexpected(mri.error());
  draft.mri_image = std::move(*mri);
  return {};
}

// A map that lies elsewhere than the brain of the MRI: a mask that is made of it cannot tell.
void doubt_labels(Draft& draft, const VoxelImage& labels) {
  constexpr std::size_t kEnough = 500;
  constexpr float kAlike = 0.25F;
  const geometry::Interpolator brightness(draft.mri_image);
  const auto number = [](float value) { return static_cast<int>(std::lround(value)); };
  const auto of = [&](const auto& is) {
    std::vector<float> values;
    geometry::for_each_voxel(labels, is,
                             [&](std::size_t, const Vec3& x) { values.push_back(brightness(x)); });
    return values;
  };
  std::vector<float> fluid = of([&](float value) {
    return anatomy::structure_of(number(value)) == anatomy::Structure::kVentricle;
  });
  std::vector<float> white = of([&](float value) {
    return anatomy::structure_of(number(value)) == anatomy::Structure::kCerebrum &&
           anatomy::matter_of(number(value)) == anatomy::Matter::kWhite;
  });
  if (std::min(fluid.size(), white.size()) < kEnough) return;
  const auto median = [](std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  const float in_fluid = median(fluid), in_white = median(white);
  if (std::abs(in_fluid - in_white) > kAlike * std::abs(in_white)) return;
  draft.doubt_of_labels = fmt::format(
      "LOOK AGAIN: the MRI is as bright in the ventricles of {} as in its white matter (medians "
      "{:.4g} and {:.4g}): does the map lie on this MRI?",
      draft.options.labels.filename().string(), in_fluid, in_white);
}

Result<VoxelImage> given_brain(Draft& draft) {
  const std::string what = "--brain: " + draft.options.brain.string();
  const auto given = io::read_volume(draft.options.brain);
  if (!given) return tl::unexpected(given.error());
  anatomy::Notes notes;
  auto mask = anatomy::brain_mask(*given, what, &notes);
  if (!mask) return mask;
  draft.about_brain =
      fmt::format("Given; {:.0f} cc.", geometry::mask_centre(*mask).volume_mm3 / kMm3PerCc);
  for (const std::string& note : notes) {
    draft.about_brain += " " + note.substr(what.size() + 2) + ".";
  }
  return mask;
}

Result<VoxelImage> guessed_brain(Draft& draft, const VoxelImage& labels) {
  const InitOptions& options = draft.options;
  auto mask = anatomy::brain_from_labels(labels);
  if (!mask) return io::file_error(options.labels, mask.error());
  draft.brain = beside(options.out, "-brain.nii.gz");
  draft.about_brain = fmt::format(
      "GUESS: cerebrum, cerebellum, brainstem and ventricles of {}, with sulci closed; "
      "{:.0f} cc.",
      options.labels.filename().string(), geometry::mask_centre(*mask).volume_mm3 / kMm3PerCc);
  return mask;
}

void guess_stem(Draft& draft, const VoxelImage& brain, const std::optional<VoxelImage>& labels) {
  const auto stem = labels ? stem_from_labels(*labels) : std::nullopt;
  draft.stem = stem ? *stem : lowest_part(brain, kStemHalfWidth_mm);
  draft.about_stem =
      stem ? fmt::format("GUESS: the lowest {:g} mm of the brainstem in {}.", kLowest_mm,
                         draft.options.labels.filename().string())
           : fmt::format(
                 "GUESS: the lowest {:g} mm of the brain within {:g} mm of its middle; "
                 "tonsils of the cerebellum may lie there: move it to where the medulla "
                 "leaves the skull.",
                 kLowest_mm, kStemHalfWidth_mm);
}

Status take_gravity(Draft& draft) {
  const auto gravity = gravity_of_position(draft.options.position);
  if (!gravity) return tl::unexpected(gravity.error());
  draft.gravity = *gravity;
  draft.about_gravity = fmt::format("From --position {}: where things fall, seen from the head.",
                                    draft.options.position);
  return {};
}

// The volumes that the case needs and that are not on the disk, then the case itself.
Result<std::vector<fs::path>> write_files(const Draft& draft, const VoxelImage& brain,
                                          const std::string& text) {
  const InitOptions& options = draft.options;
  struct Volume {
    fs::path path;
    const VoxelImage* image;
    const char* note;
  };
  std::vector<Volume> volumes;
  if (draft.series) volumes.push_back({draft.mri, &draft.series->image, "from DICOM"});
  if (draft.segments) volumes.push_back({draft.tumour_file, &*draft.segments, "from DICOM"});
  if (options.brain.empty()) volumes.push_back({draft.brain, &brain, "brain mask"});
  // A user's file, or one that was corrected by hand since.
  for (const Volume& volume : volumes) {
    std::error_code ignored;
    if (!fs::exists(fs::symlink_status(volume.path, ignored))) continue;
    return invalid("--out: " + volume.path.string() + ": exists; a volume is never replaced");
  }
  std::vector<fs::path> files;
  Status ok;
  for (const auto& [path, image, note] : volumes) {
    files.push_back(path);
    ok = io::write_nifti(path, {{image->dims, image->T_ras_voxel}, image->values, note});
    if (!ok) break;
  }
  if (ok) ok = io::write_file(options.out, text);
  if (!ok) {
    std::error_code ignored;
    for (const fs::path& path : files) fs::remove(path, ignored);
    return tl::unexpected(ok.error());
  }
  files.push_back(options.out);
  return files;
}

std::vector<std::string> guesses_of(const Draft& draft) {
  std::vector<std::string> guesses;
  if (draft.series) guesses.push_back("MRI: " + draft.about_mri);
  if (!draft.doubt_of_labels.empty()) guesses.push_back("labels: " + draft.doubt_of_labels);
  for (std::string line : {"brain: " + draft.about_brain, "tumour: " + draft.about_tumour,
                           "craniotomy: " + draft.about_opening, "brainstem: " + draft.about_stem,
                           "gravity: " + draft.about_gravity}) {
    guesses.push_back(std::move(line));
  }
  return guesses;
}

}  // namespace

Vec3 lowest_part(const VoxelImage& mask, double half_width_mm) {
  const double middle = geometry::mask_centre(mask).centre.x();
  const auto counts = [&](const Vec3& x) { return std::abs(x.x() - middle) <= half_width_mm; };
  double lowest = std::numeric_limits<double>::infinity();
  for_each_of(mask, [&](const Vec3& x) { lowest = counts(x) ? std::min(lowest, x.z()) : lowest; });
  Vec3 sum = Vec3::Zero();
  double count = 0.0;
  for_each_of(mask, [&](const Vec3& x) {
    if (counts(x) && x.z() <= lowest + kLowest_mm) sum += x, count += 1.0;
  });
  return sum / count;
}

OpeningGuess opening_over(const VoxelImage& mask, const Vec3& tumour) {
  const Vec3 middle = geometry::mask_centre(mask).centre;
  // The farthest place in each cell of 5 by 5 degrees.
  constexpr double kCells = 72.0 / (2.0 * std::numbers::pi);
  std::map<std::pair<int, int>, Vec3> farthest;
  for_each_of(mask, [&](const Vec3& x) {
    const Vec3 d = x - middle;
    const double height = std::asin(std::clamp(d.z() / std::max(d.norm(), 1e-9), -1.0, 1.0));
    const auto cell = std::pair(static_cast<int>(std::floor(kCells * std::atan2(d.y(), d.x()))),
                                static_cast<int>(std::floor(kCells * height)));
    const auto [place, is_new] = farthest.try_emplace(cell, x);
    if (!is_new && d.norm() > (place->second - middle).norm()) place->second = x;
  });
  OpeningGuess guess{middle, Vec3::UnitZ()};
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [towards, end] : farthest) {
    const Vec3 outward = (end - middle).normalized();
    if (outward.z() < kDown) continue;
    double top = -std::numeric_limits<double>::infinity();
    for (const auto& [cell, x] : farthest) top = std::max(top, outward.dot(x));
    for (const auto& [cell, x] : farthest) {
      if (outward.dot(x) < top - kCap_mm || (x - tumour).norm() >= nearest) continue;
      nearest = (x - tumour).norm();
      guess = {x, outward};
    }
  }
  return guess;
}

Result<InitSummary> write_first_case(const InitOptions& options) {
  if (Status ok = check_options(options); !ok) return tl::unexpected(ok.error());
  Draft draft;
  draft.options = options;
  draft.brain = options.brain, draft.tumour_file = options.tumour;
  if (Status ok = take_gravity(draft); !ok) return tl::unexpected(ok.error());
  if (Status ok = take_mri(draft); !ok) return tl::unexpected(ok.error());
  std::optional<VoxelImage> labels;
  if (!options.labels.empty()) {
    auto map = read_labels(options.labels);
    if (!map) return tl::unexpected(map.error());
    labels = std::move(*map);
    doubt_labels(draft, *labels);
  }
  const auto brain = options.brain.empty() ? guessed_brain(draft, *labels) : given_brain(draft);
  if (!brain) return tl::unexpected(brain.error());
  if (Status ok = guess_tumour(draft, *brain); !ok) return tl::unexpected(ok.error());
  guess_stem(draft, *brain, labels);
  const std::string text = case_text(draft);
  const auto read = io::parse_case_config(text, options.out);
  if (!read) return tl::unexpected(read.error());
  if (Status same = check_names(draft, *read); !same) return tl::unexpected(same.error());
  auto files = write_files(draft, *brain, text);
  if (!files) return tl::unexpected(files.error());
  InitSummary summary;
  summary.files = std::move(*files);
  summary.guesses = guesses_of(draft);
  return summary;
}

}  // namespace brainshift::client
