// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/simulation/ultrasound.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/core/rigid_motion.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

constexpr double kBrain_mm = 45.0;
const Vec3 kSweptTumour(22, 0, 0), kVentricle(5, 14, 0);

// A ball of white matter, x to the right, with a fissure (1.5 mm thick, at z = -12), a ventricle
// (a ball of 7 mm) and a tumour (a ball of 8 mm).
struct ToyHead {
  VoxelImage mri, brain;
  TriangleSurface tumour = geometry::ellipsoid_surface(kSweptTumour, Vec3::Constant(8.0), 2.0);
  Craniotomy craniotomy;

  ToyHead() {
    craniotomy.centre_mm = Vec3(47, 1, 0);
    craniotomy.long_axis_mm = 40.0;
    craniotomy.short_axis_mm = 24.0;
    mri.dims = {101, 101, 101};
    mri.T_ras_voxel = Eigen::Translation3d(-50, -50, -50) * AffineTransform::Identity();
    brain = mri;
    for (int k = 0; k < 101; ++k)
      for (int j = 0; j < 101; ++j)
        for (int i = 0; i < 101; ++i) {
          const Vec3 x = mri.T_ras_voxel * Vec3(i, j, k);
          const bool inside = x.norm() < kBrain_mm;
          const bool fluid = std::abs(x.z() + 12.0) < 1.0 || (x - kVentricle).norm() < 7.0;
          brain.values.push_back(inside ? 1.0f : 0.0f);
          mri.values.push_back(!inside ? 5.0f : fluid ? 30.0f : 100.0f);
        }
  }
};
const ToyHead& head() {
  static const ToyHead toy;
  return toy;
}
const TissueEcho& tissue() {
  static const TissueEcho made = *tissue_echo(head().mri, head().brain, head().tumour);
  return made;
}

UltrasoundSweep short_sweep() {
  UltrasoundSweep sweep;
  sweep.target = kSweptTumour;
  sweep.frames_per_sweep = 3;
  return sweep;
}
tracking::Recording frames(std::uint64_t seed, const UltrasoundProbe& probe = {}) {
  Random random(seed);
  return simulate_ultrasound(tissue(), *probe_window(head().brain, head().craniotomy), probe,
                             short_sweep(), random);
}

// Grey value of the pixel of a frame nearest to a place; the place must lie in its plane.
double grey_mean(const tracking::Recording& recording, int frame, const Vec3& x, int reach) {
  const AffineTransform& T = recording.links[0].samples[static_cast<std::size_t>(frame)].T_to_from;
  const Vec3 pixel = T.inverse() * x;
  EXPECT_LT(std::abs(pixel.z()), 4.0);
  const int u = static_cast<int>(std::lround(pixel.x())),
            v = static_cast<int>(std::lround(pixel.y()));
  return recording.frame_values(frame)
      .block(v - reach, u - reach, 2 * reach + 1, 2 * reach + 1)
      .mean();
}

TEST(ProbeWindow, LiesOnTheBrainAndLooksOutwards) {
  const auto window = value_or_fail(probe_window(head().brain, head().craniotomy));
  EXPECT_NEAR(window.centre.norm(), kBrain_mm, 1.0);
  EXPECT_GT(window.outward.dot(Vec3(47, 1, 0).normalized()), 0.99);
  EXPECT_NEAR(window.along.norm(), 1.0, 1e-12);
  EXPECT_NEAR(window.along.dot(window.outward), 0.0, 1e-12);
  EXPECT_EQ(window.half_long_mm, 20.0);
  EXPECT_EQ(window.half_short_mm, 12.0);
  Craniotomy away = head().craniotomy;
  away.centre_mm = Vec3(150, 0, 0);
  EXPECT_THAT(refusal_of(probe_window(head().brain, away), ErrorCode::kEmptySet),
              HasSubstr("craniotomy.centre_mm = [150, 0, 0]"));
}

TEST(TissueEcho, IsNoFunctionOfTheMri) {
  const geometry::Interpolator mri(head().mri), scatter(tissue().scatter);
  const Vec3 fissure(0, -20, -12);
  EXPECT_NEAR(mri(fissure), mri(kVentricle), 1e-3);
  EXPECT_GT(scatter(fissure), 50.0f * scatter(kVentricle));
  EXPECT_GT(scatter(kSweptTumour), 2.0f * scatter(Vec3(0, -20, 10)));
  EXPECT_LT(scatter(Vec3(0, -20, 10)), scatter(fissure));
}

TEST(TissueEcho, RefusesOtherVoxelsAndNoBrain) {
  VoxelImage other = head().brain;
  other.T_ras_voxel.translation().x() += 5.0;
  auto made = tissue_echo(head().mri, other, head().tumour);
  EXPECT_THAT(sentence_of(made), HasSubstr("must be the same ones"));
  VoxelImage empty = head().brain;
  for (float& value : empty.values) value = 0.0f;
  made = tissue_echo(head().mri, empty, head().tumour);
  refusal_of(made, ErrorCode::kEmptySet);
}

TEST(MriWithTumour, ShowsARimAndACore) {
  const auto image = value_or_fail(mri_with_tumour(head().mri, head().brain, head().tumour));
  const geometry::Interpolator at(image);
  EXPECT_NEAR(at(kSweptTumour), 60.0, 10.0);
  EXPECT_NEAR(at(kSweptTumour + Vec3(0, 6, 0)), 140.0, 15.0);
  EXPECT_NEAR(at(Vec3(0, -20, 10)), 100.0, 10.0);
}

TEST(SimulatedUltrasound, DependsOnTheSeedAlone) {
  EXPECT_EQ(frames(1).pixels, frames(1).pixels);
  EXPECT_NE(frames(1).pixels, frames(2).pixels);
}

TEST(SimulatedUltrasound, FramesLieWhereTheirPosesSay) {
  const tracking::Recording recording = frames(1);
  ASSERT_EQ(recording.num_frames(), 6);
  ASSERT_EQ(recording.links.size(), 1u);
  EXPECT_EQ(recording.links[0].frames.name(), "ImageToRas");
  for (const tracking::Link& link : recording.links[0].samples) {
    EXPECT_TRUE(check_affine(link.T_to_from.matrix()));
    EXPECT_TRUE(
        check_rigid((link.T_to_from * Eigen::Scaling(1.0 / UltrasoundProbe{}.pixel_mm)).matrix()));
  }
  // The middle planes of both sweeps hold the target and are at right angles.
  const Vec3 one = recording.links[0].samples[1].T_to_from.linear().col(2).normalized();
  const Vec3 two = recording.links[0].samples[4].T_to_from.linear().col(2).normalized();
  EXPECT_NEAR(one.dot(two), 0.0, 1e-9);
  for (std::size_t frame : {1u, 4u})
    EXPECT_NEAR((recording.links[0].samples[frame].T_to_from.inverse() * kSweptTumour).z(), 0.0,
                1e-9);
}

TEST(SimulatedUltrasound, IsBlackOutsideTheSectorAndNowhereElse) {
  const tracking::Recording recording = frames(1);
  const Eigen::MatrixXf first = recording.frame_values(0), last = recording.frame_values(5);
  EXPECT_EQ(first(0, 0), 0.0f);
  EXPECT_EQ(first(recording.height - 1, 0), 0.0f);
  EXPECT_GT(first(recording.height / 2, recording.width / 2), 0.0f);
  EXPECT_TRUE(((first.array() > 0.0f) == (last.array() > 0.0f)).all());
  EXPECT_GT((first.array() > 0.0f).cast<float>().mean(), 0.4f);
}

TEST(SimulatedUltrasound, ShowsTheTumourBrightAndTheVentricleDark) {
  const tracking::Recording recording = frames(3);
  const double tumour = grey_mean(recording, 1, kSweptTumour, 5);
  const double tissue_below = grey_mean(recording, 1, Vec3(0, 0, 0), 5);
  EXPECT_GT(tumour, tissue_below + 20.0);
  // One of the two middle planes holds the y axis.
  const auto& links = recording.links[0].samples;
  const int plane = std::abs((links[1].T_to_from.inverse() * kVentricle).z()) <
                            std::abs((links[4].T_to_from.inverse() * kVentricle).z())
                        ? 1
                        : 4;
  EXPECT_LT(grey_mean(recording, plane, kVentricle, 4), tissue_below - 30.0);
}

// Beams that enter beside the opening meet bone.
TEST(SimulatedUltrasound, IsDarkBehindBone) {
  ToyHead narrow = head();
  narrow.craniotomy.long_axis_mm = 2.0;
  narrow.craniotomy.short_axis_mm = 2.0;
  Random random(4);
  const tracking::Recording shadowed = simulate_ultrasound(
      tissue(), *probe_window(narrow.brain, narrow.craniotomy), {}, short_sweep(), random);
  const tracking::Recording open = frames(4);
  // The middle beam enters through either; one far from it only through the wide opening.
  EXPECT_NEAR(grey_mean(shadowed, 1, kSweptTumour, 2), grey_mean(open, 1, kSweptTumour, 2), 40.0);
  const auto side = [](const tracking::Recording& recording) {
    return recording.frame_values(1)
        .block(recording.height / 2, recording.width / 2 + 40, 9, 9)
        .mean();
  };
  EXPECT_LT(side(shadowed), 40.0);
  EXPECT_GT(side(open), side(shadowed) + 40.0);
}

// Goodman (2007): the envelope of fully developed speckle has mean /
// standard deviation = sqrt(pi / (4 - pi)) = 1.913.
TEST(SimulatedUltrasound, SpeckleHasRayleighStatistics) {
  UltrasoundProbe probe;
  probe.attenuation_db_mm = 0.0;
  // Grains much larger than a pixel, lest the scan conversion even them out.
  probe.range_sd_mm = 1.0;
  probe.lateral_sd_deg = 2.0;
  const tracking::Recording recording = frames(5, probe);
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int frame = 0; frame < recording.num_frames(); ++frame) {
    const AffineTransform& T =
        recording.links[0].samples[static_cast<std::size_t>(frame)].T_to_from;
    const Eigen::MatrixXf values = recording.frame_values(frame);
    for (int v = 0; v < recording.height; ++v)
      for (int u = 0; u < recording.width; ++u) {
        const Vec3 x = T * Vec3(u, v, 0);
        // White matter, far from anything else.
        if (x.norm() > 38.0 || (x - kSweptTumour).norm() < 12.0 || (x - kVentricle).norm() < 14.0 ||
            std::abs(x.z() + 12.0) < 7.0 || values(v, u) < 1.5f)
          continue;
        const double envelope =
            std::pow(10.0, (values(v, u) / 254.0 - 1.0) * probe.dynamic_range_db / 20.0);
        sum += envelope;
        squares += envelope * envelope;
        ++count;
      }
  }
  ASSERT_GT(count, 5000);
  const double mean = sum / count;
  EXPECT_NEAR(mean / std::sqrt(squares / count - mean * mean), 1.913, 0.15);
}

}  // namespace
}  // namespace brainshift::client
