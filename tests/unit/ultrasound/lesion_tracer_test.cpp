// SPDX-License-Identifier: GPL-3.0-or-later
// Synthetic images: a lesion of known outline in multiplicative noise, which is smoothed to the
// size of speckle.
#include "common/ultrasound/lesion_tracer.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/random.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::ultrasound {
namespace {

using testing::HasSubstr;
using tracking::Recording;

struct Lesion {
  Eigen::Vector2d centre_px{120, 90};
  double a_px = 50, b_px = 32, angle = 0.5;
  double inside = 140, outside = 70;

  // Radius of the outline seen from its centre.
  double radius(double direction) const {
    const double c = std::cos(direction - angle) / a_px, s = std::sin(direction - angle) / b_px;
    return 1.0 / std::sqrt(c * c + s * s);
  }
};

// Speckle: white noise averaged over 3 x 3 pixels, with the given standard deviation relative to
// the grey value.
Eigen::MatrixXd speckle(int height, int width, double sd, Random& random) {
  Eigen::MatrixXd white(height + 2, width + 2), noise(height, width);
  for (Eigen::Index i = 0; i < white.size(); ++i) white.data()[i] = 3.0 * sd * random.normal();
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) noise(v, u) = white.block<3, 3>(v, u).mean();
  }
  return noise;
}

Recording images(const std::vector<Lesion>& lesions, double noise_sd, std::uint64_t seed) {
  Recording recording;
  recording.width = 240, recording.height = 180;
  Random random(seed);
  for (std::size_t i = 0; i < lesions.size(); ++i) {
    recording.time_s.push_back(0.1 * static_cast<double>(i));
    recording.image_ok.push_back(1);
    const Eigen::MatrixXd noise = speckle(180, 240, noise_sd, random);
    for (int v = 0; v < 180; ++v) {
      for (int u = 0; u < 240; ++u) {
        const Eigen::Vector2d d = Eigen::Vector2d(u, v) - lesions[i].centre_px;
        const bool in = d.norm() < lesions[i].radius(std::atan2(d.y(), d.x()));
        const double grey = (in ? lesions[i].inside : lesions[i].outside) * (1.0 + noise(v, u));
        recording.pixels += static_cast<char>(std::lround(std::clamp(grey, 0.0, 255.0)));
      }
    }
  }
  return recording;
}

// Distances in pixels, along rays from the lesion's centre, of contour and outline.
std::vector<double> radial_errors(const TracedContour& traced, const Lesion& lesion) {
  std::vector<double> errors;
  for (Eigen::Index i = 0; i < traced.contour.points_px.cols(); ++i) {
    const Eigen::Vector2d d = traced.contour.points_px.col(i) - lesion.centre_px;
    errors.push_back(std::abs(d.norm() - lesion.radius(std::atan2(d.y(), d.x()))));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

TEST(TraceLesion, FindsTheOutlineFromAnySeedInside) {
  const Lesion lesion;
  const Recording recording = images({lesion}, 0.3, 1);
  for (const Eigen::Vector2d& shift :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(18, 8), Eigen::Vector2d(-15, 5)}) {
    const auto traced = trace_lesion(recording, {0, lesion.centre_px + shift});
    ASSERT_TRUE(traced) << traced.error().message;
    EXPECT_TRUE(traced->bright);
    const auto errors = radial_errors(*traced, lesion);
    EXPECT_LT(errors[errors.size() / 2], 1.5) << shift.transpose();
    EXPECT_LT(errors[errors.size() * 95 / 100], 4.0) << shift.transpose();
    EXPECT_GE(traced->confidence, 0.9);
  }
}

TEST(TraceLesion, FindsDarkLesionsToo) {
  Lesion lesion;
  std::swap(lesion.inside, lesion.outside);
  const auto traced = trace_lesion(images({lesion}, 0.3, 2), {0, lesion.centre_px});
  ASSERT_TRUE(traced) << traced.error().message;
  EXPECT_FALSE(traced->bright);
  EXPECT_LT(radial_errors(*traced, lesion)[48], 1.5);
}

TEST(TraceLesion, NeverInventsAContourInNoise) {
  Lesion none;
  none.inside = none.outside;
  double greatest = 0.0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const auto traced = trace_lesion(images({none}, 0.3, 100 + seed), {0, none.centre_px});
    ASSERT_FALSE(traced) << "seed " << seed;
    EXPECT_EQ(traced.error().code, ErrorCode::kEmptySet);
    const std::string said = "no boundary found on frame 0: significance ";
    ASSERT_EQ(traced.error().message.rfind(said, 0), 0U) << traced.error().message;
    greatest = std::max(greatest, std::stod(traced.error().message.substr(said.size())));
  }
  RecordProperty("greatest_significance_in_noise", std::to_string(greatest));
  EXPECT_LT(greatest, 6.0);
  EXPECT_GT(greatest, 3.0) << "the best of many paths through noise; else nothing was searched";
}

TEST(TraceLesion, AnImageWithoutAnyGreyIsRefused) {
  Lesion none;
  none.inside = none.outside;
  const auto traced = trace_lesion(images({none}, 0.0, 1), {0, none.centre_px});
  ASSERT_FALSE(traced);
  EXPECT_EQ(traced.error().code, ErrorCode::kEmptySet);
}

TEST(TraceLesion, RefusesBadSeeds) {
  const Recording recording = images({Lesion()}, 0.3, 1);
  const auto message = [&](const Seed& seed) {
    const auto traced = trace_lesion(recording, seed);
    return traced ? std::string() : traced.error().message;
  };
  EXPECT_THAT(message({1, {10, 10}}),
              HasSubstr("seed on frame 1: the recording has frames 0 to 0"));
  EXPECT_THAT(message({0, {240, 10}}), HasSubstr("seed at 240 10 px on frame 0"));
  EXPECT_THAT(message({0, {std::nan(""), 10}}), HasSubstr("seed at nan"));
  Recording invalid = recording;
  invalid.image_ok[0] = 0;
  const auto traced = trace_lesion(invalid, {0, {120, 90}});
  ASSERT_FALSE(traced);
  EXPECT_THAT(traced.error().message, HasSubstr("image is invalid"));
}

TEST(TraceSweep, FollowsALesionThatMovesAndStopsWhereItEnds) {
  std::vector<Lesion> lesions(14);
  for (std::size_t i = 0; i < lesions.size(); ++i) {
    const double part = static_cast<double>(i) / 10.0;
    lesions[i].centre_px += Eigen::Vector2d(12.0 * part, -8.0 * part);
    lesions[i].a_px -= 12.0 * part, lesions[i].b_px -= 6.0 * part;
    if (i >= 11) lesions[i].inside = lesions[i].outside;  // behind the lesion
  }
  const auto sweep = trace_sweep(images(lesions, 0.3, 5), {4, lesions[4].centre_px});
  ASSERT_TRUE(sweep) << sweep.error().message;
  ASSERT_EQ(sweep->contours.size(), 11U);
  ASSERT_EQ(sweep->contours.front().contour.frame, 0);
  ASSERT_EQ(sweep->contours.back().contour.frame, 10);
  EXPECT_EQ(sweep->stopped_before, "");
  EXPECT_THAT(sweep->stopped_after, HasSubstr("no boundary found on frame 11"));
  for (const TracedContour& traced : sweep->contours) {
    const auto errors =
        radial_errors(traced, lesions[static_cast<std::size_t>(traced.contour.frame)]);
    EXPECT_LT(errors[errors.size() / 2], 1.5) << traced.contour.frame;
  }
}

}  // namespace
}  // namespace brainshift::ultrasound
