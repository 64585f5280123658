// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/fiducials.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <string>

#include "common/core/random.hpp"
#include "common/registration/pose_information.hpp"
#include "tests/support/results.hpp"

namespace brainshift::registration {
namespace {

using testing::HasSubstr;

// Markers on a head, none of whose distances repeats.
Points markers() {
  Points points(3, 6);
  points << 70, -68, 10, 45, -40, 5,  //
      20, 25, 95, -60, -75, -88,      //
      30, 22, 40, 85, 60, -10;
  return points;
}

RigidTransform some_motion(Random& random) {
  Vec6 xi;
  xi << 1.5 * random.direction(), 80.0 * random.direction();
  return rigid_increment(xi, Vec3(10, -20, 5));
}

// Noise of the given rms length per point.
Points localised(const Points& points, double fle_mm, Random& random) {
  Points noisy = points;
  for (double& value : noisy.reshaped()) value += fle_mm / std::numbers::sqrt3 * random.normal();
  return noisy;
}

Points moved(const RigidTransform& T, const Points& points) {
  return (T.linear() * points).colwise() + Vec3(T.translation());
}

TEST(Fiducials, RecoverAKnownMotion) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const RigidTransform T_image_measured = some_motion(random);
    const Points image = markers().leftCols(3 + static_cast<Eigen::Index>(seed % 4));
    const auto result =
        value_or_fail(register_fiducials(moved(T_image_measured.inverse(), image), image));
    EXPECT_TRUE(result.T_image_measured.isApprox(T_image_measured, 1e-10));
    EXPECT_LT(result.fre_mm, 1e-10);
    EXPECT_EQ(result.residuals_mm.size(), image.cols());
  }
}

// Three fiducials lie in a plane; so do these four. A mirror image is no motion.
TEST(Fiducials, NeverReflect) {
  Points image = markers().leftCols(4);
  image.row(2).setZero();
  Points measured = image;
  measured.row(0) *= -1.0;  // within the plane: a half turn about y does it
  const auto flat = value_or_fail(register_fiducials(measured, image));
  EXPECT_NEAR(flat.T_image_measured.linear().determinant(), 1.0, 1e-12);
  EXPECT_LT(flat.fre_mm, 1e-9);
  measured = markers();
  measured.row(0) *= -1.0;
  const auto mirrored = value_or_fail(register_fiducials(measured, markers()));
  EXPECT_NEAR(mirrored.T_image_measured.linear().determinant(), 1.0, 1e-12);
  EXPECT_GT(mirrored.fre_mm, 10.0);
}

TEST(Fiducials, LeastSquaresIsAMinimum) {
  Random random(3);
  const Points image = markers();
  const Points measured = localised(image, 3.0, random);
  const auto result = value_or_fail(register_fiducials(measured, image));
  const auto sum = [&](const RigidTransform& T) {
    return (moved(T, measured) - image).squaredNorm();
  };
  const double least = sum(result.T_image_measured);
  EXPECT_NEAR(std::sqrt(least / 6.0), result.fre_mm, 1e-12);
  for (int k = 0; k < 6; ++k)
    for (const double step : {-1e-3, 1e-3})
      EXPECT_GT(sum(rigid_increment(step * Vec6::Unit(k), Vec3::Zero()) * result.T_image_measured),
                least);
}

// Fitzpatrick, West & Maurer (1998) against repeated registrations; FLE is recovered from FRE.
TEST(Fiducials, ExpectedTargetErrorIsThatOfManyRegistrations) {
  const double fle = 1.2;
  const int runs = 4000;
  for (const Eigen::Index count : {3, 4, 6}) {
    const Points image = markers().leftCols(count);
    Random random(10 + static_cast<std::uint64_t>(count));
    const RigidTransform T_measured_image = some_motion(random);
    const Points exact = moved(T_measured_image, image);
    const Vec3 targets[] = {Vec3(0, 0, 20), Vec3(46, -47, 9), Vec3(-60, 10, -40)};
    double squared[3] = {0, 0, 0}, fle_squared = 0.0;
    for (int run = 0; run < runs; ++run) {
      const auto result = value_or_fail(register_fiducials(localised(exact, fle, random), image));
      fle_squared += result.fle_mm * result.fle_mm / runs;
      for (int t = 0; t < 3; ++t)
        squared[t] +=
            (result.T_image_measured * (T_measured_image * targets[t]) - targets[t]).squaredNorm() /
            runs;
    }
    EXPECT_NEAR(std::sqrt(fle_squared), fle, 0.03 * fle) << count;
    for (int t = 0; t < 3; ++t) {
      const double expected = expected_tre_mm(image, fle, targets[t]);
      EXPECT_NEAR(std::sqrt(squared[t]) / expected, 1.0, 0.03) << count << ' ' << t;
    }
  }
}

TEST(Fiducials, ThinnessIsTheRatioOfTheExtents) {
  Points cross(3, 4);  // arms of 10 and 2 mm
  cross.transpose() << 10, 0, 5, -10, 0, 5, 0, 2, 5, 0, -2, 5;
  EXPECT_NEAR(thinness(cross), 0.2, 1e-12);
  Points line(3, 3);
  line.transpose() << 0, 0, 0, 1, 1, 1, 3, 3, 3;
  EXPECT_NEAR(thinness(line), 0.0, 1e-7);
  Points square(3, 4);
  square.transpose() << 1, 1, 0, 1, -1, 0, -1, 1, 0, -1, -1, 0;
  EXPECT_NEAR(thinness(square), 1.0, 1e-12);
}

TEST(Fiducials, AreMatchedWithoutKnowingTheirOrder) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Points image = markers();
    const auto count = static_cast<Eigen::Index>(4 + seed % 3);
    const std::vector<int> order = random.choose(static_cast<int>(count), 6);
    const RigidTransform T_image_measured = some_motion(random);
    const Points measured =
        localised(moved(T_image_measured.inverse(), image(Eigen::all, order)), 0.5, random);
    const auto result = value_or_fail(match_fiducials(measured, image));
    EXPECT_EQ(result.of_image, order);
    EXPECT_EQ(result.image, Points(image(Eigen::all, order)));
    EXPECT_LT(result.fre_mm, 1.5);
    EXPECT_LT((result.T_image_measured * measured.col(0) - image.col(order[0])).norm(), 2.0);
  }
}

TEST(Fiducials, TenOfSixteenAreMatchedInTime) {
  Random random(5);
  Points image(3, 16);
  for (auto x : image.colwise()) x = 90.0 * random.direction();
  const std::vector<int> order = random.choose(10, 16);
  const auto result = value_or_fail(match_fiducials(
      moved(some_motion(random), localised(image(Eigen::all, order), 0.5, random)), image));
  EXPECT_EQ(result.of_image, order);
}

TEST(Fiducials, AmbiguousOrNoCorrespondenceIsRefused) {
  Points square(3, 4);
  square << 0, 100, 100, 0, 0, 0, 100, 100, 0, 0, 0, 0;
  EXPECT_THAT(refusal_of(match_fiducials(square, square), ErrorCode::kInvalidArgument),
              HasSubstr("two correspondences fit nearly alike"));
  // A nearly isosceles triangle, told apart by less than a pointer's error.
  Points triangle(3, 3);
  triangle << 0, 100, 50, 0, 0, 90, 0, 0, 0;
  Points other = triangle;
  other(0, 2) = 50.4;
  EXPECT_FALSE(match_fiducials(triangle, other));
  other(0, 2) = 30.0;
  EXPECT_TRUE(match_fiducials(other, other).has_value());
  Points stretched = markers();
  stretched.col(2) += Vec3(0, 30, 0);
  EXPECT_THAT(refusal_of(match_fiducials(stretched, markers()), ErrorCode::kNotConverged),
              HasSubstr("no correspondence of 6 measured to 6"));
}

void expect_fiducials_refused(const Points& measured, const Points& image, ErrorCode code,
                              const std::string& naming) {
  EXPECT_THAT(refusal_of(register_fiducials(measured, image), code),
              testing::AllOf(HasSubstr(naming), testing::Not(testing::HasSubstr("\n"))));
}

TEST(Fiducials, RefuseWhatFixesNoPose) {
  const Points image = markers();
  const auto code = ErrorCode::kInvalidArgument;
  expect_fiducials_refused(image.leftCols(5), image, code, "5 measured but 6 in the image");
  expect_fiducials_refused(image.leftCols(2), image.leftCols(2), code, "2 measured: at least 3");
  Points line(3, 4);
  for (int i = 0; i < 4; ++i) line.col(i) = Vec3(1, 2, 3) + 30.0 * i * Vec3(0.3, 0.5, -0.2);
  expect_fiducials_refused(line, image.leftCols(4), code, "all 4 measured ones lie on one line");
  expect_fiducials_refused(image.leftCols(4), line, code, "all 4 image ones lie on one line");
  Points twice = image;
  twice.col(4) = twice.col(1);
  expect_fiducials_refused(twice, image, code, "measured ones 1 and 4 are at the same place");
  Points bad = image;
  bad(2, 3) = std::nan("");
  expect_fiducials_refused(bad, image, ErrorCode::kNotFinite, "measured one 3 is not finite");
  expect_fiducials_refused(image, bad, ErrorCode::kNotFinite, "image one 3 is not finite");
}

TEST(Fiducials, MixedUpUnitsAreNamed) {
  const Points image = markers();
  const auto code = ErrorCode::kInvalidArgument;
  expect_fiducials_refused(0.001 * image, image, code,
                           "the measured ones span 0.19 and the image's 190 mm: metres?");
  expect_fiducials_refused(0.1 * image, image, code,
                           "span 19 and the image's 190 mm: centimetres?");
  expect_fiducials_refused(image, 0.001 * image, code, ": image in metres?");
  expect_fiducials_refused(image, 0.1 * image, code, ": image in centimetres?");
  expect_fiducials_refused(image, 2.0 * image, code, ": not the same arrangement");
  EXPECT_THAT(sentence_of(match_fiducials(0.001 * image, image)), HasSubstr("metres?"));
}

std::string head_refusal(const Points& measured, const Points& image) {
  const auto fit = value_or_fail(register_fiducials(measured, image));
  const Status head = check_head_fit(measured, fit);
  return head ? "" : head.error().message;
}

TEST(Fiducials, WhoseNamesContradictTheirPlacesAreRefused) {
  Points image(3, 4);
  image << 0, -75, 75, 0, 95, 0, 0, -110, 0, -40, -40, 10;
  std::vector<std::string> names = {"Nasion", "left ear", "RIGHT ear", "inion"};
  const auto refused = [&](const Points& places) {
    const auto fit = value_or_fail(register_fiducials(places, places));
    const Status head = check_head_fit(places, fit, names);
    return head ? "" : head.error().message;
  };
  EXPECT_EQ(refused(image), "");
  // "bright", and places near the midline, say nothing.
  names = {"Nasion", "bright", "left, cleft", "inion"};
  EXPECT_EQ(refused(image), "");
  names = {"right of nasion", "left ear", "right ear", "left of nasion"};
  Points close = image;
  close.col(3) = Vec3(6, 80, 5);
  EXPECT_EQ(refused(close), "");
  names = {"Nasion", "left ear", "RIGHT ear", "inion"};
  Points lps = image;
  lps.topRows(2) *= -1.0;
  EXPECT_EQ(refused(lps),
            "fiducials: in the image \"RIGHT ear\" (R -75 mm) lies left of \"left ear\" (R 75 mm): "
            "coordinates in LPS? (a heading name,l,p,s says so)");
  lps.row(0) *= -1.0;
  EXPECT_THAT(refused(lps), HasSubstr("\"Nasion\" (A -95 mm) lies behind \"inion\" (A 110 mm)"));
}

TEST(Fiducials, OfNoHeadAreRefusedByTheirLikelyMistake) {
  const Points image = markers();
  EXPECT_THAT(head_refusal(0.001 * image, 0.001 * image),
              HasSubstr("the image's span 0.19 mm: must span 30 to 500 mm; in metres"));
  EXPECT_THAT(head_refusal(0.1 * image, 0.1 * image), HasSubstr("; in centimetres"));
  EXPECT_THAT(sentence_of(match_fiducials(0.001 * image, 0.001 * image)), HasSubstr("in metres"));
  Points flat = image;  // a mirror image of it fits nearly as well
  flat.row(1) *= 0.03;
  Points mirrored = flat;
  mirrored.row(1) *= -1.0;
  EXPECT_THAT(
      head_refusal(mirrored, flat),
      testing::AllOf(HasSubstr("the best fit leaves 3.9 mm"), HasSubstr("without a mistake; "),
                     HasSubstr("with left and right exchanged?")));
  mirrored = image;
  mirrored.row(0) *= -1.0;
  EXPECT_THAT(sentence_of(match_fiducials(mirrored, image)), HasSubstr("left and right exchanged"));
  Random random(2);
  EXPECT_EQ(head_refusal(localised(image, 6.0, random), image), "");
}

TEST(Fiducials, MatchingRefusesNumbersAndOptionsOutOfRange) {
  const auto refused = [](const Points& measured, const Points& image, const MatchOptions& options,
                          const std::string& naming) {
    EXPECT_THAT(refusal_of(match_fiducials(measured, image, options), ErrorCode::kInvalidArgument),
                HasSubstr(naming));
  };
  refused(markers(), markers().leftCols(5), {}, "6 measured and 5 in the image");
  refused(Points::Random(3, 11), Points::Random(3, 12), {}, "11 measured and 12 in the image");
  MatchOptions options;
  options.tolerance_mm = 0.0;
  refused(markers(), markers(), options, "tolerance_mm = 0");
  options = {};
  options.ambiguity_factor = 0.5;
  refused(markers(), markers(), options, "ambiguity_factor = 0.5");
  options = {};
  options.ambiguity_mm = std::nan("");
  refused(markers(), markers(), options, "ambiguity_mm = nan");
}

}  // namespace
}  // namespace brainshift::registration
