// SPDX-License-Identifier: GPL-3.0-or-later
// Stereopsis against three truths:
//   - a pair of photographs with true disparities (aloe, Middlebury 2006 set, Hirschmueller &
//     Scharstein 2007; from Debian's opencv-doc: 1282 x 1110 px, truth in px at this size, 0:
//     unknown);
//   - photographs of a chessboard (13 pairs, opencv-doc): reprojection and epipolar error of the
//     calibration, also with pairs that took no part in it;
//   - a simulated cortical patch: error of the surface at several distances, beside Z^2 / (f b)
//     sd_d.

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/stereo/pictures.hpp"
#include "common/stereo/calibrate.hpp"
#include "common/stereo/disparity.hpp"
#include "common/stereo/reconstruct.hpp"
#include "tests/support/stereo_scene.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift {
namespace {

using test_support::record;
using test_support::record_check;
using test_support::record_left_out;

constexpr const char* kStudy = "stereo";
const std::filesystem::path kPictures = "/usr/share/doc/opencv-doc/examples/data";

bool check(const std::string& name, double value, const std::string& bound, bool pass,
           const std::string& source) {
  std::printf("  %-64s %8.3f  (%s) %s\n", name.c_str(), value, bound.c_str(), pass ? "" : "FAILED");
  return record_check(kStudy, name, value, bound, pass, source);
}

// ---------- photographs with true disparities ----------

struct DisparityScore {
  int known = 0, valid = 0, within_1 = 0, within_2 = 0, within_2_sd = 0;
  double confidence = 0.0, absolute = 0.0;
  // By the sd that a pixel is given, in classes of 0.1 px: number of pixels, and the sum of their
  // squared errors below 3 px.
  std::vector<double> in_class = std::vector<double>(10, 0.0), squared = in_class;
};

DisparityScore score(const stereo::DisparityMap& map, const stereo::GrayImage& truth) {
  DisparityScore s;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    if (truth.pixels[i] == 0) continue;
    ++s.known;
    const auto d = static_cast<double>(map.disparity_px.pixels[i]);
    if (std::isnan(d)) continue;
    const double error = std::abs(d - truth.pixels[i]);
    const auto sd = static_cast<double>(map.sd_px.pixels[i]);
    ++s.valid;
    s.within_1 += error <= 1.0;
    s.within_2 += error <= 2.0;
    // The truth is rounded to whole pixels: 1 / 12 px^2 of its own.
    s.within_2_sd += error <= 2.0 * std::sqrt(sd * sd + 1.0 / 12.0);
    s.confidence += stereo::confidence(sd);
    s.absolute += error;
    const auto c = static_cast<std::size_t>(std::min(9.0, sd / 0.1));
    if (error > 3.0) continue;
    s.in_class[c] += 1.0;
    s.squared[c] += error * error - 1.0 / 12.0;
  }
  return s;
}

void photographs() {
  const auto left = client::read_picture(kPictures / "aloeL.jpg");
  const auto right = client::read_picture(kPictures / "aloeR.jpg");
  const auto truth = client::read_picture(kPictures / "aloeGT.png");
  if (!left || !right || !truth) {
    record_left_out(kStudy, "photographs with true disparities: opencv-doc is not installed");
    return;
  }
  stereo::MatchOptions options;
  options.disparities = 256;
  const auto map = stereo::match({*left, *right, {}, {}}, options);
  if (!map) {
    std::printf("  %s\n", map.error().message.c_str());
    check("aloe: pair matched", 0, "1", false, "opencv-doc");
    return;
  }
  const DisparityScore s = score(*map, *truth);
  const double n = std::max(1, s.valid);
  const std::string source = "Hirschmueller and Scharstein 2007; opencv-doc";
  std::printf("aloe: %d px with known truth; mean absolute error %.3f px\n", s.known,
              s.absolute / n);
  check("aloe: valid pixels within 2 px of the truth %", 100.0 * s.within_2 / n, ">= 90",
        s.within_2 >= 0.9 * n, source);
  check("aloe: valid pixels within 1 px of the truth %", 100.0 * s.within_1 / n, ">= 85",
        s.within_1 >= 0.85 * n, source);
  const double density = static_cast<double>(s.valid) / s.known;
  check("aloe: pixels of known truth that are valid %", 100.0 * density, ">= 60", density >= 0.6,
        source);
  check("aloe: valid pixels within twice their sd %", 100.0 * s.within_2_sd / n, ">= 80",
        s.within_2_sd >= 0.8 * n, source);
  for (std::size_t c = 0; c < s.in_class.size(); ++c) {
    if (s.in_class[c] < 1000.0) continue;
    const double rms = std::sqrt(s.squared[c] / s.in_class[c]);
    const double said = 0.1 * static_cast<double>(c) + 0.05;
    std::printf("  sd %.2f px: %8.0f px with rms error %.3f px\n", said, s.in_class[c], rms);
    record({kStudy, "aloe: rms of errors below 3 px", "sd that a pixel is given px", "error px",
            said, rms});
    record({kStudy, "errors of that sd", "sd that a pixel is given px", "error px", said, said});
  }
  check("aloe: mean confidence less fraction within 1 px", s.confidence / n - s.within_1 / n,
        "-0.15 to 0.15", std::abs(s.confidence / n - s.within_1 / n) <= 0.15, source);
}

// ---------- photographs of a chessboard ----------

// The point nearest to two rays.
Vec3 meet(const test_support::Ray& a, const test_support::Ray& b) {
  Eigen::Matrix<double, 3, 2> directions;
  directions << a.direction, -b.direction;
  const Eigen::Vector2d t = directions.colPivHouseholderQr().solve(b.origin - a.origin);
  return 0.5 * (a.origin + t[0] * a.direction + b.origin + t[1] * b.direction);
}

// Length of the squares' sides as the calibrated cameras see them, over the true one: mean and sd.
struct SquareLength {
  double mean = 0.0, sd = 0.0;
};
SquareLength square_length(const StereoCalibration& rig, const stereo::ChessBoard& board,
                           const std::vector<stereo::BoardCorners>& pairs) {
  using test_support::Eye;
  std::vector<double> ratios;
  for (const stereo::BoardCorners& pair : pairs) {
    const auto corner = [&](int i, int j) {
      const Eigen::Index k = j * board.columns + i;
      return meet(test_support::ray_through(rig, Eye::kLeft, pair.left.col(k)),
                  test_support::ray_through(rig, Eye::kRight, pair.right.col(k)));
    };
    for (int j = 0; j < board.rows; ++j)
      for (int i = 0; i + 1 < board.columns; ++i)
        ratios.push_back((corner(i + 1, j) - corner(i, j)).norm() / board.square_mm);
    for (int j = 0; j + 1 < board.rows; ++j)
      for (int i = 0; i < board.columns; ++i)
        ratios.push_back((corner(i, j + 1) - corner(i, j)).norm() / board.square_mm);
  }
  const Eigen::Map<const VecX> r(ratios.data(), static_cast<Eigen::Index>(ratios.size()));
  return {r.mean(), std::sqrt((r.array() - r.mean()).square().mean())};
}

// Corners of every pair in which both pictures show the whole board; the size of the pictures.
struct Boards {
  std::vector<stereo::BoardCorners> pairs;
  int width = 0, height = 0;
};
Boards photographed_boards(const stereo::ChessBoard& board) {
  Boards boards;
  for (int i = 1; i <= 14; ++i) {
    const std::string number = fmt::format("{:02}", i);
    const auto left = client::read_picture(kPictures / ("left" + number + ".jpg"));
    const auto right = client::read_picture(kPictures / ("right" + number + ".jpg"));
    if (!left || !right) continue;  // the set has no tenth pair
    boards.width = left->width;
    boards.height = left->height;
    stereo::BoardCorners pair{number, stereo::find_corners(*left, board),
                              stereo::find_corners(*right, board)};
    if (pair.left.cols() == 0 || pair.right.cols() == 0) {
      std::printf("chessboard %s: board not found\n", number.c_str());
      continue;
    }
    boards.pairs.push_back(std::move(pair));
  }
  return boards;
}

void chessboards() {
  // The size of the board's squares is not known: 25 mm is assumed, and only ratios are checked.
  const stereo::ChessBoard board{9, 6, 25.0};
  const Boards all = photographed_boards(board);
  if (all.pairs.empty()) {
    record_left_out(kStudy, "photographs of a chessboard: opencv-doc is not installed");
    return;
  }
  std::vector<stereo::BoardCorners> fitted, held_out;
  for (std::size_t i = 0; i < all.pairs.size(); ++i)
    (i % 2 == 0 ? fitted : held_out).push_back(all.pairs[i]);
  const std::string source = "opencv-doc; Zhang 2000";
  const auto calibration = stereo::calibrate(all.pairs, board, all.width, all.height);
  const auto half = stereo::calibrate(fitted, board, all.width, all.height);
  if (!calibration || !half) {
    std::printf("  %s\n", (calibration ? half : calibration).error().message.c_str());
    check("chessboards: calibrations made", 0, "2", false, source);
    return;
  }
  std::printf("chessboards: %zu pairs; focal length %.1f px; baseline %.2f mm\n", all.pairs.size(),
              calibration->left.focal_x_px, right_camera_in_left(*calibration).norm());
  double number = 0.0;
  for (const CalibrationPair& pair : calibration->pairs)
    record({kStudy, "chessboards", "pair", "reprojection error px", ++number, pair.rms_px});
  check("chessboards: reprojection error rms px", calibration->rms_px, "<= 0.7",
        calibration->rms_px <= 0.7, source);
  check("chessboards: epipolar error rms px", calibration->epipolar_rms_px, "<= 0.7",
        calibration->epipolar_rms_px <= 0.7, source);
  const double held = stereo::epipolar_rms(*half, held_out);
  check("chessboards: epipolar error of pairs held out px", held, "<= 1", held <= 1.0, source);
  const SquareLength squares = square_length(*half, board, held_out);
  check("chessboards: mean error of squares held out %", 100.0 * (squares.mean - 1.0), "-1 to 1",
        std::abs(squares.mean - 1.0) <= 0.01, source);
  check("chessboards: sd of squares held out %", 100.0 * squares.sd, "<= 3", squares.sd <= 0.03,
        source);
}

// ---------- a simulated patch ----------

// The rms error may be as large as the stated sd, and no smaller than a third of it. It is smaller
// because kFloor_px holds errors of real light, which rendered pictures have not, and because a
// vertex averages a block's pixels. Below a third, the weight 1 / sd^2 of the surface would be ten
// times too small.
constexpr double kMinOverSd = 1.0 / 3.0;

void patch_at(double depth_mm) {
  using test_support::Eye;
  const StereoCalibration rig = test_support::operating_rig(depth_mm);
  test_support::Patch patch;
  patch.depth_mm = depth_mm;
  const auto measured = stereo::measure_disparity(render(rig, Eye::kLeft, patch, 1),
                                                  render(rig, Eye::kRight, patch, 2), rig,
                                                  {0.7 * depth_mm, 1.6 * depth_mm});
  const std::string where = "patch at " + std::to_string(static_cast<int>(depth_mm)) + " mm: ";
  const std::string source = "ray cast; Z^2 / (f b) sd";
  const auto made = measured.and_then([](const stereo::MeasuredDisparity& m) {
    return stereo::reconstruct(m.map, m.geometry, RigidTransform::Identity());
  });
  if (!made) {
    std::printf("  %s\n", made.error().message.c_str());
    check(where + "surface made", 0, "1", false, source);
    return;
  }
  double squared = 0.0, inside = 0.0, expected = 0.0;
  const int n = made->surface.num_vertices();
  for (int i = 0; i < n; ++i) {
    const Vec3 x = made->surface.vertices.col(i);
    const double error = x.z() - patch_depth(patch, x.x(), x.y());
    squared += error * error;
    expected += made->sd_mm[i] * made->sd_mm[i];
    inside += std::abs(error) <= 2.0 * made->sd_mm[i];
  }
  const double rms = std::sqrt(squared / n), said = std::sqrt(expected / n);
  std::printf("%s%d points; %.0f %% of the pixels valid\n", where.c_str(), n,
              100.0 * measured->map.valid_fraction);
  record({kStudy, "rms error in depth", "distance mm", "error mm", depth_mm, rms});
  record({kStudy, "Z^2 / (f b) sd", "distance mm", "error mm", depth_mm, said});
  char bound[40];
  std::snprintf(bound, sizeof bound, "%.3f to %.3f: 1/3 to 1 of its sd", kMinOverSd * said, said);
  check(where + "rms error in depth mm", rms, bound, rms <= said && rms >= kMinOverSd * said,
        source);
  check(where + "points within twice their sd %", 100.0 * inside / n, ">= 95", inside >= 0.95 * n,
        source);
}

void patches() {
  for (const double depth_mm : {150.0, 200.0, 250.0, 300.0, 400.0}) patch_at(depth_mm);
}

}  // namespace
}  // namespace brainshift

int main() {
  using namespace brainshift;
  photographs();
  chessboards();
  patches();
  return 0;
}
