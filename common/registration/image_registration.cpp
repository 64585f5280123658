// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/image_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/geometry/mask.hpp"
#include "common/registration/image_similarity.hpp"

namespace brainshift::registration {
namespace {

constexpr double kArmijo = 1e-4;
constexpr int kMaxHalvings = 12;

// Updates the inverse Hessian of -f: s the step taken, y the change of the gradient of -f.
void bfgs_update(Mat6& H, const Vec6& s, const Vec6& y, bool first) {
  const double sy = s.dot(y);
  if (!(sy > 1e-10 * s.norm() * y.norm())) return;  // f is not concave along the step
  if (first) H = (sy / y.squaredNorm()) * Mat6::Identity();
  const Mat6 left = Mat6::Identity() - s * y.transpose() / sy;
  H = (left * H * left.transpose() + s * s.transpose() / sy).eval();
}

}  // namespace

PoseAscent ascend(const PoseFunction& function, const RigidTransform& T_initial, const Vec3& centre,
                  double radius_mm, const PoseAscentOptions& options) {
  Vec6 scale;  // xi = scale * z
  scale << Vec3::Constant(1.0 / radius_mm), Vec3::Ones();
  PoseAscent result;
  result.T = T_initial;
  PoseValue here = function(result.T, result.T * centre);
  result.evaluations = 1;
  result.valid = here.valid;
  result.value = here.value;
  if (!here.valid) return result;

  Vec6 g = scale.cwiseProduct(here.gradient);
  bool fresh = true;  // H holds no curvature yet
  Mat6 H = Mat6::Identity();
  for (; result.iterations < options.max_iterations && !result.converged; ++result.iterations) {
    if (!(g.norm() > 0.0)) {
      result.converged = true;
      break;
    }
    if (fresh) H = options.first_step_mm / g.norm() * Mat6::Identity();
    Vec6 step = H * g;
    step *= std::min(1.0, options.largest_step_mm / step.norm());
    PoseValue next;
    RigidTransform T_next;
    bool uphill = false;
    for (int halving = 0; halving < kMaxHalvings && !uphill; ++halving) {
      if (halving > 0) step *= 0.5;
      T_next = rigid_increment(scale.cwiseProduct(step), result.T * centre) * result.T;
      next = function(T_next, T_next * centre);
      ++result.evaluations;
      uphill = next.valid && next.value >= result.value + kArmijo * g.dot(step);
      if (step.norm() < options.tolerance_mm) break;
    }
    if (!uphill) {
      result.converged = fresh;  // not even along the gradient
      fresh = true;
      continue;
    }
    const Vec6 g_next = scale.cwiseProduct(next.gradient);
    bfgs_update(H, step, g - g_next, fresh);
    fresh = false;
    result.T = T_next;
    result.value = next.value;
    g = g_next;
    result.converged = step.norm() < options.tolerance_mm;
  }
  return result;
}

namespace {

constexpr Eigen::Index kMinSamples = 500;  // some thirty in each of half the bins

Status check_registrar(const ImageRegistrationOptions& options) {
  if (options.levels.empty()) return invalid("image registration: levels: none given");
  for (const ImageLevel& level : options.levels)
    if (!(level.smoothing_mm >= 0.0 && level.smoothing_mm <= 20.0) || level.samples < kMinSamples)
      return invalid(
          fmt::format("image registration: level of smoothing_mm = {:g} and samples = {}: must be "
                      "0 to 20 and at least {}",
                      level.smoothing_mm, level.samples, kMinSamples));
  if (options.bins < 8 || options.bins > 256)
    return invalid(fmt::format("image registration: bins = {}: must be 8 to 256", options.bins));
  if (!(options.low_quantile >= 0.0 && options.low_quantile < options.high_quantile &&
        options.high_quantile <= 1.0))
    return invalid(
        fmt::format("image registration: quantiles {:g} and {:g}: must be 0 <= low < high <= 1",
                    options.low_quantile, options.high_quantile));
  struct Bound {
    const char* name;
    double value, low, high;
  };
  for (const Bound& bound : {Bound{"start_offset_mm", options.start_offset_mm, 0.0, 50.0},
                             Bound{"max_iterations", 1.0 * options.max_iterations, 1.0, 1e4},
                             Bound{"max_translation_mm", options.max_translation_mm, 0.1, 200.0},
                             Bound{"max_rotation_deg", options.max_rotation_deg, 0.1, 90.0},
                             Bound{"min_overlap", options.min_overlap, 0.05, 1.0},
                             Bound{"same_pose_mm", options.same_pose_mm, 1e-3, 50.0}})
    if (!(bound.value >= bound.low && bound.value <= bound.high))
      return invalid(fmt::format("image registration: {} = {:g}: must be {:g} to {:g}", bound.name,
                                 bound.value, bound.low, bound.high));
  return {};
}

// what: "MRI" or "region", for the sentence.
Status check_image(const char* what, const VoxelImage& image) {
  for (int length : image.dims)
    if (length < 2)
      return invalid(fmt::format(
          "image registration: {} of {} x {} x {} voxels: at least 2 needed along each axis", what,
          image.dims[0], image.dims[1], image.dims[2]));
  if (image.values.size() != image.num_voxels())
    return invalid(fmt::format("image registration: {} holds {} values for {} voxels", what,
                               image.values.size(), image.num_voxels()));
  const double volume = image.T_ras_voxel.linear().determinant();
  if (!image.T_ras_voxel.matrix().allFinite() || !(std::abs(volume) > 1e-9))
    return invalid(fmt::format("image registration: {} with voxels of {:g} mm3: no usable affine",
                               what, volume));
  for (std::size_t i = 0; i < image.values.size(); ++i)
    if (!std::isfinite(image.values[i]))
      return fail(ErrorCode::kNotFinite,
                  fmt::format("image registration: {} voxel {} is not finite", what, i));
  return {};
}

Status check_samples(const IntensitySamples& samples) {
  const Eigen::Index count = samples.positions.cols();
  if (samples.intensities.size() != count)
    return invalid(fmt::format("image registration: {} positions and {} intensities", count,
                               samples.intensities.size()));
  if (count < kMinSamples)
    return invalid(
        fmt::format("image registration: {} samples: at least {} needed", count, kMinSamples));
  for (Eigen::Index i = 0; i < count; ++i)
    if (!samples.positions.col(i).allFinite() || !std::isfinite(samples.intensities[i]))
      return fail(ErrorCode::kNotFinite,
                  fmt::format("image registration: sample {} is not finite", i));
  return {};
}

constexpr double kPerDegree = std::numbers::pi / 180.0;
// A pose beyond this fraction of the search's reach lies at its edge.
constexpr double kEdge = 0.98;
// Hills of mutual information are millimetres wide; steps of 3 mm jumped off them now and then.
constexpr double kLargestStep_mm = 1.0;
// Of same_pose_mm: two searches nearer than this go on as one.
constexpr double kMet = 0.25;

// The samples, how they lie, and the intensity scales, which no pose changes.
struct Task {
  const IntensitySamples& samples;
  const ImageRegistrationOptions& options;
  Vec3 centre = Vec3::Zero();
  double radius_mm = 0.0;
  BinScale sample_scale;

  double shift_mm(const RigidTransform& T) const { return (T * centre - centre).norm(); }
  double rotation_deg(const RigidTransform& T) const {
    return rotation_vector(T.linear()).norm() / kPerDegree;
  }
  // Rms distance of the samples between two poses; their spread taken as alike in all directions.
  double apart_mm(const RigidTransform& A, const RigidTransform& B) const {
    const double turn = rotation_vector(A.linear() * B.linear().transpose()).norm();
    return std::hypot((A * centre - B * centre).norm(), std::sqrt(2.0 / 3.0) * turn * radius_mm);
  }
  // 1: on the edge of the search.
  double reach(const RigidTransform& T) const {
    return std::max(shift_mm(T) / options.max_translation_mm,
                    rotation_deg(T) / options.max_rotation_deg);
  }
};

Result<Task> make_task(const IntensitySamples& samples, const ImageRegistrationOptions& options) {
  Task task{samples, options, samples.positions.rowwise().mean(), 0.0,
            quantile_scale(samples.intensities, options.low_quantile, options.high_quantile,
                           options.bins)};
  task.radius_mm = std::sqrt((samples.positions.colwise() - task.centre).squaredNorm() /
                             static_cast<double>(samples.positions.cols()));
  if (!(task.radius_mm > 0.0)) return invalid("image registration: all samples at one place");
  if (!(task.sample_scale.high > task.sample_scale.low))
    return invalid(fmt::format("image registration: the samples' intensities are all {:g}",
                               task.sample_scale.low));
  return task;
}

// One level: the smoothed MRI seen through the samples.
class Level {
 public:
  // The intensity scale is that of the MRI around the samples as they are placed now.
  static Result<Level> create(const VoxelImage& image, const VoxelImage* region,
                              const ImageLevel& level, const Task& task) {
    const auto count = static_cast<int>(task.samples.positions.cols());
    const int stride = std::max(1, static_cast<int>(std::lround(1.0 * count / level.samples)));
    const GradientInterpolator interpolator(image);
    std::optional<GradientInterpolator> counts;
    if (region) counts.emplace(*region);
    std::vector<double> seen;
    int asked = 0, inside = 0;
    for (int i = 0; i < count; i += stride, ++asked) {
      const ImageValue value = interpolator(task.samples.positions.col(i));
      if (!value.inside) continue;
      ++inside;
      if (!counts || (*counts)(task.samples.positions.col(i)).value > 0.5) {
        seen.push_back(value.value);
      }
    }
    const double overlap = static_cast<double>(seen.size()) / asked;
    if (overlap < task.options.min_overlap) {
      const double in_image = static_cast<double>(inside) / asked;
      const bool of_region = in_image >= task.options.min_overlap;
      return fail(
          ErrorCode::kEmptySet,
          fmt::format("image registration: {:.0f} % of the samples lie inside {}: at "
                      "least {:.0f} % needed",
                      100.0 * (of_region ? overlap : in_image), of_region ? "the brain" : "the MRI",
                      100.0 * task.options.min_overlap));
    }
    const BinScale scale =
        quantile_scale(Eigen::Map<const VecX>(seen.data(), static_cast<Eigen::Index>(seen.size())),
                       task.options.low_quantile, task.options.high_quantile, task.options.bins);
    if (!(scale.high > scale.low))
      return invalid(fmt::format("image registration: the MRI is {:g} at all samples", scale.low));
    return Level(task,
                 ImageSimilarity(image, region, scale, task.samples, task.sample_scale, stride));
  }

  Similarity similarity(const RigidTransform& T) { return similarity_.at(T, T * task_.centre); }

  PoseAscent climb(const RigidTransform& T_initial) {
    PoseAscentOptions options;
    options.max_iterations = task_.options.max_iterations;
    options.first_step_mm = 0.5;
    options.largest_step_mm = kLargestStep_mm;
    const auto function = [this](const RigidTransform& T, const Vec3& centre) {
      PoseValue value;
      if (task_.reach(T) > 1.0) return value;
      const Similarity found = similarity_.at(T, centre);
      value.valid = found.overlap >= task_.options.min_overlap;
      value.value = found.nmi;
      value.gradient = found.gradient;
      return value;
    };
    return ascend(function, T_initial, task_.centre, task_.radius_mm, options);
  }

 private:
  Level(const Task& task, ImageSimilarity similarity)
      : task_(task), similarity_(std::move(similarity)) {}
  const Task& task_;
  ImageSimilarity similarity_;
};

std::vector<RigidTransform> starting_poses(const ImageRegistrationOptions& options) {
  std::vector<RigidTransform> poses = {RigidTransform::Identity()};
  const double offset = std::min(options.start_offset_mm, 0.9 * kEdge * options.max_translation_mm);
  if (!(offset > 0.0)) return poses;
  for (int axis = 0; axis < 3; ++axis)
    for (double sign : {-1.0, 1.0})
      poses.emplace_back(Eigen::Translation3d(sign * offset * Vec3::Unit(axis)));
  return poses;
}

// A start and where it has come to.
struct Path {
  PoseAscent end;
  int iterations = 0;
  int starts = 1;  // that have come there
};

// Every start up the hills of one level.
void climb_all(Level& level, std::vector<Path>& paths, int& evaluations) {
  for (Path& path : paths) {
    path.end = level.climb(path.end.T);
    path.iterations += path.end.iterations;
    evaluations += path.end.evaluations;
  }
}

// Starts that have met need not be followed one by one.
void merge(const Task& task, std::vector<Path>& paths) {
  std::vector<Path> kept;
  for (const Path& path : paths) {
    const auto met = std::find_if(kept.begin(), kept.end(), [&](const Path& other) {
      return task.apart_mm(path.end.T, other.end.T) < kMet * task.options.same_pose_mm;
    });
    if (met == kept.end())
      kept.push_back(path);
    else
      met->starts += path.starts;
  }
  paths = std::move(kept);
}

// Keeps the path that came highest; returns the fraction of all starts that came to the same pose.
double keep_best(const Task& task, std::vector<Path>& paths) {
  // A path that left the MRI has value 0 and is never the best: the first one began inside.
  const Path best = *std::max_element(paths.begin(), paths.end(), [](const Path& a, const Path& b) {
    return a.end.value < b.end.value;
  });
  int agreeing = 0, all = 0;
  for (const Path& path : paths) {
    all += path.starts;
    if (path.end.valid && task.apart_mm(path.end.T, best.end.T) <= task.options.same_pose_mm)
      agreeing += path.starts;
  }
  paths = {best};
  return static_cast<double>(agreeing) / all;
}

Status check_end(const Task& task, const ImageRegistration& result) {
  if (task.reach(result.T_ras_ras) < kEdge) return {};
  return fail(ErrorCode::kNotConverged,
              fmt::format("image registration: the best pose, {:.1f} mm and {:.1f} deg away, lies "
                          "at the edge of the search ({:g} mm, {:g} deg)",
                          result.shift_mm, result.rotation_deg, task.options.max_translation_mm,
                          task.options.max_rotation_deg));
}

}  // namespace

Result<ImageRegistrar> ImageRegistrar::create(const VoxelImage& mri, const VoxelImage* region,
                                              const ImageRegistrationOptions& options) {
  if (Status ok = check_registrar(options); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_image("MRI", mri); !ok) return tl::unexpected(ok.error());
  if (region)
    if (Status ok = check_image("region", *region); !ok) return tl::unexpected(ok.error());
  ImageRegistrar registrar;
  registrar.options_ = options;
  if (region) registrar.region_ = *region;
  for (const ImageLevel& level : options.levels)
    registrar.levels_.push_back(geometry::gaussian_smooth(mri, level.smoothing_mm));
  return registrar;
}

Result<ImageRegistration> ImageRegistrar::follow(const IntensitySamples& samples,
                                                 const std::vector<RigidTransform>& starts,
                                                 std::size_t first_level) const {
  if (Status ok = check_samples(samples); !ok) return tl::unexpected(ok.error());
  const auto task = make_task(samples, options_);
  if (!task) return tl::unexpected(task.error());

  ImageRegistration result;
  std::vector<Path> paths;
  for (const RigidTransform& start : starts) {
    paths.emplace_back();
    paths.back().end.T = start;
  }
  for (std::size_t i = first_level; i < levels_.size(); ++i) {
    auto level =
        Level::create(levels_[i], region_ ? &*region_ : nullptr, options_.levels[i], *task);
    if (!level) return tl::unexpected(level.error());
    climb_all(*level, paths, result.evaluations);
    merge(*task, paths);
    // The finest level costs most: only the best goes there.
    if (i + 2 == levels_.size() || first_level + 1 == levels_.size())
      result.agreement = keep_best(*task, paths);
    if (i + 1 < levels_.size()) continue;
    const PoseAscent& end = paths.front().end;
    result.T_ras_ras = end.T;
    result.converged = end.converged;
    result.iterations = paths.front().iterations;
    result.nmi_before = level->similarity(RigidTransform::Identity()).nmi;
    const Similarity similarity = level->similarity(end.T);
    result.nmi_after = similarity.nmi;
    result.overlap = similarity.overlap;
  }
  result.shift_mm = task->shift_mm(result.T_ras_ras);
  result.rotation_deg = task->rotation_deg(result.T_ras_ras);
  if (Status ok = check_end(*task, result); !ok) return tl::unexpected(ok.error());
  return result;
}

Result<ImageRegistration> ImageRegistrar::align(const IntensitySamples& samples) const {
  return follow(samples, starting_poses(options_), 0);
}

Result<ImageRegistration> ImageRegistrar::refine(const IntensitySamples& samples) const {
  return follow(samples, {RigidTransform::Identity()}, levels_.size() - 1);
}

Result<PoseInformation> ImageRegistrar::information(const IntensitySamples& samples) const {
  if (Status ok = check_samples(samples); !ok) return tl::unexpected(ok.error());
  const auto task = make_task(samples, options_);
  if (!task) return tl::unexpected(task.error());
  auto level =
      Level::create(levels_.back(), region_ ? &*region_ : nullptr, options_.levels.back(), *task);
  if (!level) return tl::unexpected(level.error());
  PoseInformation information;
  information.centre = task->centre;
  information.radius_mm = task->radius_mm;
  Vec6 scale;  // xi = scale * z
  scale << Vec3::Constant(1.0 / task->radius_mm), Vec3::Ones();
  const auto gradient = [&](const Vec6& z) -> Vec6 {
    const RigidTransform T = rigid_increment(scale.cwiseProduct(z), task->centre);
    return -scale.cwiseProduct(level->similarity(T).gradient);
  };
  information.gradient = gradient(Vec6::Zero());
  Mat6 hessian;
  for (int k = 0; k < 6; ++k) {
    const Vec6 step = kCurvatureStep_mm * Vec6::Unit(k);
    hessian.col(k) = (gradient(step) - gradient(-step)) / (2.0 * kCurvatureStep_mm);
  }
  information.hessian = 0.5 * (hessian + hessian.transpose());
  return information;
}

Result<std::vector<RigidTransform>> ImageRegistrar::poses_without_parts(
    const IntensitySamples& samples, int parts) const {
  if (Status ok = check_samples(samples); !ok) return tl::unexpected(ok.error());
  const Eigen::Index count = samples.positions.cols();
  std::vector<RigidTransform> poses;
  for (int part = 0; part < parts; ++part) {
    const Eigen::Index from = part * count / parts, to = (part + 1) * count / parts;
    const Eigen::Index after = count - to;
    IntensitySamples others;
    others.positions.resize(3, from + after);
    others.intensities.resize(from + after);
    others.positions << samples.positions.leftCols(from), samples.positions.rightCols(after);
    others.intensities << samples.intensities.head(from), samples.intensities.tail(after);
    const auto found = refine(others);
    if (!found)
      return fail(found.error().code,
                  fmt::format("without part {} of {}: {}", part + 1, parts, found.error().message));
    poses.push_back(found->T_ras_ras);
  }
  return poses;
}

double jackknife_error_mm(const std::vector<RigidTransform>& poses, const Vec3& x) {
  const auto count = static_cast<double>(poses.size());
  Vec3 mean = Vec3::Zero();
  for (const RigidTransform& T : poses) mean += T * x / count;
  double sum = 0.0;
  for (const RigidTransform& T : poses) sum += (T * x - mean).squaredNorm();
  return std::sqrt((count - 1.0) / count * sum);
}

}  // namespace brainshift::registration
