// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>

#include "common/registration/image_registration.hpp"
#include "common/registration/pose_information.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/registration/blob_image.hpp"

namespace brainshift::registration {
namespace {

// - sum |T p_i - q_i|^2, whose maximum is known.
struct Correspondence {
  Points from, to;

  PoseValue operator()(const RigidTransform& T, const Vec3& centre) const {
    PoseValue value;
    value.valid = true;
    for (Eigen::Index i = 0; i < from.cols(); ++i) {
      const Vec3 x = T * from.col(i);
      const Vec3 off = x - to.col(i);
      value.value -= off.squaredNorm();
      value.gradient -= 2.0 * direction_gradient(x, off, centre);
    }
    return value;
  }
};

Correspondence known_motion(const RigidTransform& T) {
  Random random(1);
  Points points(3, 30);
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    points.col(i) = Vec3(20, 10, 5).cwiseProduct(random.direction());
  return {points, test::moved(T, points)};
}

TEST(PoseAscent, FindsAKnownMotion) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Vec6 xi;
    xi << 0.4 * random.direction(), 12.0 * random.direction();
    const RigidTransform T = rigid_increment(xi, Vec3::Zero());
    PoseAscentOptions options;
    options.max_iterations = 200;
    options.tolerance_mm = 1e-6;
    const PoseAscent result =
        ascend(known_motion(T), RigidTransform::Identity(), Vec3::Zero(), 12.0, options);
    EXPECT_TRUE(result.converged);
    EXPECT_TRUE(result.T.isApprox(T, 1e-5)) << "seed " << seed;
    EXPECT_LT(result.iterations, 60);
    EXPECT_GE(result.evaluations, result.iterations);
  }
}

TEST(PoseAscent, StaysWhereItIsAtTheTop) {
  const RigidTransform T = RigidTransform::Identity();
  const PoseAscent result = ascend(known_motion(T), T, Vec3::Zero(), 12.0);
  EXPECT_TRUE(result.converged);
  EXPECT_TRUE(result.T.isApprox(T, 1e-12));
}

TEST(PoseAscent, SaysThatItRanOutOfIterations) {
  PoseAscentOptions options;
  options.max_iterations = 2;
  const PoseAscent result = ascend(known_motion(RigidTransform(Eigen::Translation3d(30, 0, 0))),
                                   RigidTransform::Identity(), Vec3::Zero(), 12.0, options);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_LE(result.T.translation().norm(), 2.0 * options.largest_step_mm + 1e-9);
}

TEST(PoseAscent, NeverTakesAPoseOutsideOfTheFunction) {
  const Correspondence motion = known_motion(RigidTransform(Eigen::Translation3d(8, 0, 0)));
  const auto fenced = [&](const RigidTransform& T, const Vec3& centre) {
    PoseValue value = motion(T, centre);
    value.valid = T.translation().norm() <= 5.0;
    return value;
  };
  const PoseAscent result = ascend(fenced, RigidTransform::Identity(), Vec3::Zero(), 12.0);
  EXPECT_TRUE(result.valid);
  EXPECT_LE(result.T.translation().norm(), 5.0);
  EXPECT_GT(result.T.translation().norm(), 4.5);
  const auto nowhere = [](const RigidTransform&, const Vec3&) { return PoseValue{}; };
  EXPECT_FALSE(ascend(nowhere, RigidTransform::Identity(), Vec3::Zero(), 12.0).valid);
}

using testing::HasSubstr;

const test::Blobs& blobs() {
  static const test::Blobs all(11);
  return all;
}
const VoxelImage& mri() {
  static const VoxelImage image = test::image_of(blobs());
  return image;
}
IntensitySamples samples() { return test::samples_of(blobs(), 12000, 12); }

RigidTransform known_error() {
  Vec6 xi;
  xi << 0.08, -0.05, 0.06, 3.0, -2.0, 3.5;
  return rigid_increment(xi, Vec3(2, 1, -3));
}

ImageRegistrar registrar(const ImageRegistrationOptions& options = {}) {
  auto made = ImageRegistrar::create(mri(), nullptr, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

// Largest distance from its true place of any sample.
double error_mm(const RigidTransform& T_found, const RigidTransform& T_error) {
  const Points truth = samples().positions;
  return (test::moved(T_found * T_error, truth) - truth).colwise().norm().maxCoeff();
}

// Registers the samples, displaced by the known error and with intensities changed by `remap`.
template <typename Remap>
ImageRegistration recover(const Remap& remap) {
  IntensitySamples displaced = samples();
  displaced.positions = test::moved(known_error(), displaced.positions);
  for (double& value : displaced.intensities) value = remap(value);
  const auto result = registrar().align(displaced);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? *result : ImageRegistration{};
}

TEST(ImageRegistration, LeavesWhatIsInPlace) {
  const auto result = value_or_fail(registrar().align(samples()));
  EXPECT_TRUE(result.converged);
  EXPECT_LT(error_mm(result.T_ras_ras, RigidTransform::Identity()), 0.1);
  EXPECT_EQ(result.overlap, 1.0);
  EXPECT_GE(result.nmi_after, result.nmi_before);
}

TEST(ImageRegistration, TakesOutAKnownError) {
  const ImageRegistration result = recover([](double value) { return value; });
  EXPECT_TRUE(result.converged);
  EXPECT_LT(error_mm(result.T_ras_ras, known_error()), 0.1);
  EXPECT_GT(result.nmi_after, result.nmi_before + 0.1);
  EXPECT_GT(result.agreement, 0.8);
  EXPECT_NEAR(result.rotation_deg, Vec3(0.08, -0.05, 0.06).norm() * 180.0 / std::numbers::pi, 0.3);
  EXPECT_GT(result.shift_mm, 4.0);
  EXPECT_GT(result.iterations, 0);
  EXPECT_GT(result.evaluations, result.iterations);
}

// So far away that not all starts come to the same hill.
TEST(ImageRegistration, TakesTheHighestOfSeveralHills) {
  ImageRegistrationOptions options;
  options.max_translation_mm = 40.0;
  options.max_rotation_deg = 30.0;
  options.min_overlap = 0.3;
  const Vec3 error(16.0, 0.0, 0.0);
  IntensitySamples displaced = samples();
  displaced.positions.colwise() += error;
  const RigidTransform T_error(Eigen::Translation3d{error});
  options.start_offset_mm = 12.0;
  const auto several = value_or_fail(registrar(options).align(displaced));
  EXPECT_LT(error_mm(several.T_ras_ras, T_error), 0.1);
  EXPECT_LT(several.agreement, 0.9);
}

TEST(ImageRegistration, DoesNotCareHowIntensitiesGoTogether) {
  const auto increasing = [](double value) { return value * value; };
  const auto inverted = [](double value) { return 100.0 - 7.0 * value; };
  // Bright in the middle of the range, dark at both ends.
  const auto neither = [](double value) { return std::exp(-std::pow((value - 1.2) / 0.5, 2)); };
  EXPECT_LT(error_mm(recover(increasing).T_ras_ras, known_error()), 0.2);
  EXPECT_LT(error_mm(recover(inverted).T_ras_ras, known_error()), 0.1);
  EXPECT_LT(error_mm(recover(neither).T_ras_ras, known_error()), 0.2);
}

TEST(ImageRegistration, BearsSpeckle) {
  Random random(13);
  const ImageRegistration result = recover(
      [&random](double value) { return value * std::hypot(random.normal(), random.normal()); });
  EXPECT_LT(error_mm(result.T_ras_ras, known_error()), 1.0);
}

TEST(ImageRegistration, IsTheSameEveryTime) {
  const auto same = [](double value) { return value; };
  EXPECT_EQ(recover(same).T_ras_ras.matrix(), recover(same).T_ras_ras.matrix());
}

TEST(ImageRegistration, SeesOnlyTheRegion) {
  VoxelImage spoiled = mri();
  VoxelImage region = mri();
  for (int k = 0, voxel = 0; k < 65; ++k)
    for (int j = 0; j < 65; ++j)
      for (int i = 0; i < 65; ++i, ++voxel) {
        const bool inside = (mri().T_ras_voxel * Vec3(i, j, k)).norm() < 35.0;
        region.values[static_cast<std::size_t>(voxel)] = inside ? 1.0f : 0.0f;
        if (!inside) spoiled.values[static_cast<std::size_t>(voxel)] = 0.0f;
      }
  const auto made = value_or_fail(ImageRegistrar::create(spoiled, &region));
  IntensitySamples displaced = samples();
  displaced.positions = test::moved(known_error(), displaced.positions);
  const auto result = value_or_fail(made.align(displaced));
  EXPECT_LT(error_mm(result.T_ras_ras, known_error()), 0.1);
}

// Nothing of the image is in the samples: no pose deserves trust.
TEST(ImageRegistration, LowAgreementTellsUnrelatedImages) {
  const test::Blobs other(99);
  const auto result = registrar().align(test::samples_of(other, 12000, 12));
  if (result) {
    EXPECT_LT(result->agreement, 0.5);
  } else {
    EXPECT_EQ(result.error().code, ErrorCode::kNotConverged);
  }
}

TEST(ImageRegistration, RefiningGoesOnFromAPoseNearby) {
  const RigidTransform T_error(Eigen::Translation3d(0.6, -0.5, 0.4));
  IntensitySamples displaced = samples();
  displaced.positions = test::moved(T_error, displaced.positions);
  const auto result = value_or_fail(registrar().refine(displaced));
  EXPECT_LT(error_mm(result.T_ras_ras, T_error), 0.1);
  EXPECT_EQ(result.agreement, 1.0);
  EXPECT_GT(result.nmi_after, result.nmi_before);
}

// An image that changes along R alone shows neither a turn about R nor motions along A and S.
TEST(ImageRegistration, InformationTellsWhatALayeredImageDoesNotShow) {
  VoxelImage layers = mri();
  layers.T_ras_voxel.linear() = 1.5 * Mat3::Identity();
  layers.T_ras_voxel.translation() = Vec3::Constant(-48.0);
  const auto value = [](const Vec3& x) { return std::sin(0.25 * x[0]) + 0.02 * x[0]; };
  for (int k = 0, voxel = 0; k < 65; ++k)
    for (int j = 0; j < 65; ++j)
      for (int i = 0; i < 65; ++i, ++voxel)
        layers.values[static_cast<std::size_t>(voxel)] =
            static_cast<float>(value(layers.T_ras_voxel * Vec3(i, j, k)));
  IntensitySamples seen = samples();
  for (Eigen::Index i = 0; i < seen.positions.cols(); ++i)
    seen.intensities[i] = value(seen.positions.col(i));
  const auto layered =
      value_or_fail(value_or_fail(ImageRegistrar::create(layers, nullptr)).information(seen));
  const Observability axes = observability(layered, 1e-2);
  EXPECT_FALSE(axes.rotation_shown(0));
  EXPECT_TRUE(axes.rotation_shown(1) && axes.rotation_shown(2));
  EXPECT_GT(std::abs(axes.rotation_axes(0, 0)), 0.99);
  EXPECT_FALSE(axes.translation_shown(0) || axes.translation_shown(1));
  EXPECT_TRUE(axes.translation_shown(2));
  EXPECT_GT(std::abs(axes.translation_axes(0, 2)), 0.99);
  const auto all = value_or_fail(registrar().information(samples()));
  EXPECT_TRUE(not_shown(observability(all, 1e-2)).empty());
  EXPECT_GT(all.hessian(0, 0), 0.0);
}

// Where a pose is the mean of what its parts say, the jackknife is the mean's standard error.
TEST(ImageRegistration, TheJackknifeOfAMeanIsItsStandardError) {
  const std::vector<double> says = {1.0, -2.0, 0.5, 4.0, 1.5};
  double mean = 0.0, squares = 0.0;
  for (const double one : says) mean += one / 5.0;
  for (const double one : says) squares += (one - mean) * (one - mean);
  std::vector<RigidTransform> poses;
  for (const double one : says)
    poses.emplace_back(Eigen::Translation3d(0.0, (5.0 * mean - one) / 4.0, 7.0));
  ASSERT_GT(squares, 1.0);
  EXPECT_NEAR(jackknife_error_mm(poses, Vec3(3, 4, 5)), std::sqrt(squares / 4.0 / 5.0), 1e-12);
}

TEST(ImageRegistration, PosesWithoutPartsTellTheErrorThatSpeckleLeaves) {
  const ImageRegistrar mri_registrar = registrar();
  const Vec3 target(5, -8, 6);
  double squares = 0.0, expected = 0.0;
  constexpr int kTrials = 6;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(100 + trial));
    IntensitySamples speckled = samples();
    for (double& value : speckled.intensities)
      value *= std::hypot(random.normal(), random.normal());
    const auto found = value_or_fail(mri_registrar.refine(speckled));
    squares += (found.T_ras_ras * target - target).squaredNorm() / kTrials;
    speckled.positions = test::moved(found.T_ras_ras, speckled.positions);
    const auto poses = value_or_fail(mri_registrar.poses_without_parts(speckled, 8));
    ASSERT_EQ(poses.size(), 8u);
    expected += jackknife_error_mm(poses, target) / kTrials;
  }
  EXPECT_GT(squares, 0.0);
  EXPECT_LT(std::sqrt(squares), 2.0 * expected);
  EXPECT_GT(std::sqrt(squares), 0.5 * expected);
}

void expect_image_refused(const Result<ImageRegistration>& result, ErrorCode code,
                          const std::string& text) {
  EXPECT_THAT(refusal_of(result, code), HasSubstr(text));
}

TEST(ImageRegistration, RefusesBadSamples) {
  const ImageRegistrar mri_registrar = registrar();
  EXPECT_THAT(refusal_of(mri_registrar.information({}), ErrorCode::kInvalidArgument),
              HasSubstr("at least 500"));
  EXPECT_THAT(refusal_of(mri_registrar.poses_without_parts(test::samples_of(blobs(), 700, 1), 2),
                         ErrorCode::kInvalidArgument),
              HasSubstr("without part 1 of 2: image registration: 350 samples"));
  expect_image_refused(mri_registrar.align({}), ErrorCode::kInvalidArgument,
                       "0 samples: at least 500");
  expect_image_refused(mri_registrar.align(test::samples_of(blobs(), 499, 1)),
                       ErrorCode::kInvalidArgument, "499 samples");
  IntensitySamples bad = samples();
  bad.intensities.conservativeResize(7);
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kInvalidArgument,
                       "12000 positions and 7 intensities");
  bad = samples();
  bad.intensities[41] = std::numeric_limits<double>::quiet_NaN();
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kNotFinite, "sample 41 is not finite");
  bad = samples();
  bad.positions(1, 17) = std::numeric_limits<double>::infinity();
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kNotFinite, "sample 17 is not finite");
  bad = samples();
  bad.intensities.setConstant(3.0);
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kInvalidArgument,
                       "intensities are all 3");
  bad = samples();
  bad.positions.setConstant(3.0);
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kInvalidArgument, "at one place");
  bad = samples();
  bad.positions.row(0).array() += 500.0;
  expect_image_refused(mri_registrar.align(bad), ErrorCode::kEmptySet, "0 % of the samples");
}

TEST(ImageRegistration, RefusesAConstantMri) {
  VoxelImage constant = mri();
  for (float& value : constant.values) value = 42.0f;
  const auto made = value_or_fail(ImageRegistrar::create(constant, nullptr));
  expect_image_refused(made.align(samples()), ErrorCode::kInvalidArgument, "the MRI is 42");
}

TEST(ImageRegistration, RefusesAnOptimumAtTheEdge) {
  ImageRegistrationOptions options;
  options.max_translation_mm = 3.0;
  options.start_offset_mm = 1.0;
  IntensitySamples displaced = samples();
  displaced.positions.row(0).array() += 5.0;
  expect_image_refused(registrar(options).align(displaced), ErrorCode::kNotConverged,
                       "at the edge of the search (3 mm, 15 deg)");
}

void expect_refused_mri(const VoxelImage& image, ErrorCode code, const std::string& text,
                        const ImageRegistrationOptions& options = {}) {
  EXPECT_THAT(refusal_of(ImageRegistrar::create(image, nullptr, options), code), HasSubstr(text));
}

TEST(ImageRegistration, RefusesABadMri) {
  expect_refused_mri({}, ErrorCode::kInvalidArgument, "MRI of 0 x 0 x 0 voxels");
  VoxelImage bad = mri();
  bad.values.pop_back();
  expect_refused_mri(bad, ErrorCode::kInvalidArgument, "274624 values for 274625 voxels");
  bad = mri();
  bad.values[77] = std::numeric_limits<float>::quiet_NaN();
  expect_refused_mri(bad, ErrorCode::kNotFinite, "MRI voxel 77");
  bad = mri();
  bad.T_ras_voxel.linear().col(1).setZero();
  expect_refused_mri(bad, ErrorCode::kInvalidArgument, "no usable affine");
  const VoxelImage region;
  EXPECT_THAT(sentence_of(ImageRegistrar::create(mri(), &region)),
              HasSubstr("region of 0 x 0 x 0 voxels"));
}

TEST(ImageRegistration, RefusesOptionsOutOfRange) {
  const auto refused = [](auto change, const std::string& text) {
    ImageRegistrationOptions options;
    change(options);
    expect_refused_mri(mri(), ErrorCode::kInvalidArgument, text, options);
  };
  refused([](auto& o) { o.levels.clear(); }, "levels: none");
  refused([](auto& o) { o.levels[1].smoothing_mm = -1.0; }, "smoothing_mm = -1");
  refused([](auto& o) { o.levels[1].samples = 10; }, "samples = 10");
  refused([](auto& o) { o.bins = 4; }, "bins = 4: must be 8 to 256");
  refused([](auto& o) { o.low_quantile = 0.999; }, "quantiles 0.999 and 0.995");
  refused([](auto& o) { o.start_offset_mm = -1.0; }, "start_offset_mm = -1");
  refused([](auto& o) { o.max_iterations = 0; }, "max_iterations = 0");
  refused([](auto& o) { o.max_translation_mm = 0.0; }, "max_translation_mm = 0");
  refused([](auto& o) { o.max_rotation_deg = 100.0; }, "max_rotation_deg = 100");
  refused([](auto& o) { o.min_overlap = 1.5; }, "min_overlap = 1.5");
  refused([](auto& o) { o.same_pose_mm = 0.0; }, "same_pose_mm = 0");
}

}  // namespace
}  // namespace brainshift::registration
