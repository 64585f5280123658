// SPDX-License-Identifier: GPL-3.0-or-later
// Two lidar clouds of parked cars (libpointmatcher's example data; Pomerleau et al. 2013) with
// published poses: alignment of one measured cloud to another, without triangles.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/geometry/oriented_cloud.hpp"
#include "common/registration/icp.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

using test_support::record_check;
using test_support::record_left_out;

constexpr double kMillimetresPerMetre = 1000.0;

// The numbers of each line, separated by commas or spaces. Lines without a number are skipped.
std::vector<std::vector<double>> number_rows(const std::string& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (*end == '\0') row.push_back(value);
    }
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

// The first three columns, mm.
Points cloud_mm(const std::string& file) {
  const auto rows = number_rows(file);
  Points points(3, static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) =
        kMillimetresPerMetre * Vec3(rows[i].at(0), rows[i].at(1), rows[i].at(2));
  return points;
}

// The pose listed for a cloud: the upper three rows of 4 x 4, row by row; translation in metres.
std::optional<RigidTransform> listed_pose(const std::string& file, const std::string& cloud) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(cloud, 0) != 0) continue;
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line.substr(cloud.size()));
    AffineTransform T = AffineTransform::Identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) words >> T.matrix()(i, j);
    if (!words) return std::nullopt;
    // The file has six digits: take the nearest rotation.
    T.linear() = T.rotation();
    T.translation() *= kMillimetresPerMetre;
    return RigidTransform(T.matrix());
  }
  return std::nullopt;
}

double angle_deg(const Mat3& rotation) {
  return Eigen::AngleAxisd(rotation).angle() * 180.0 / std::numbers::pi;
}

// Where the scene is not flat, planes through neighbours are wrong by about the spacing of the
// points.
registration::IcpOptions lidar_options(const geometry::OrientedCloud& cloud) {
  registration::IcpOptions options;
  options.sd_mm = 30.0;                              // range noise of such a scanner
  options.welsch_scale_mm = cloud.reach_mm() / 5.0;  // the median spacing
  options.rotation_sd_deg = 0.0;
  options.max_iterations = 100;
  options.translation_tolerance_mm = 0.1;
  options.rotation_tolerance_deg = 1e-3;
  return options;
}

void study(const std::string& name, const Points& reference, const Points& reading,
           const RigidTransform& truth) {
  const auto cloud = geometry::OrientedCloud::build(reference);
  if (!cloud) return record_left_out("cars", cloud.error().message);
  const Stopwatch watch;
  const auto result =
      registration::align(reading, *cloud, RigidTransform::Identity(), lidar_options(*cloud));
  const double seconds = watch.seconds();
  if (!result) return record_left_out("cars", result.error().message);
  const RigidTransform off = truth.inverse() * result->T_surface_points;
  const double off_m = 1e-3 * off.translation().norm();
  const double off_deg = angle_deg(off.linear());
  std::printf(
      "cars: %s: start %.3f m and %.2f deg off; result %.4f m and %.4f deg; %d iterations, %s, "
      "%.2f s, residual %.1f mm rms, mean weight %.2f\n",
      name.c_str(), 1e-3 * truth.translation().norm(), angle_deg(truth.linear()), off_m, off_deg,
      result->iterations, result->converged ? "settled" : "not settled", seconds, result->rms_mm,
      result->weights.mean());
  const std::string source = "carCloudList.csv of libpointmatcher's examples";
  record_check("cars", name + ": translation error (m)", off_m, "<= 0.05", off_m <= 0.05, source);
  record_check("cars", name + ": rotation error (deg)", off_deg, "<= 0.3", off_deg <= 0.3, source);
}

void study(const std::string& folder) {
  const Points first = cloud_mm(folder + "car_cloud400.csv");
  const Points second = cloud_mm(folder + "car_cloud401.csv");
  const auto T_first_second = listed_pose(folder + "carCloudList.csv", "car_cloud401.csv");
  if (first.cols() == 0 || second.cols() == 0 || !T_first_second)
    return record_left_out("cars", folder + " is not readable");
  std::printf("cars: %td and %td points\n", first.cols(), second.cols());
  study("cloud 401 to 400", first, second, *T_first_second);
  study("cloud 400 to 401", second, first, T_first_second->inverse());
}

}  // namespace
}  // namespace brainshift::sensing

int main() {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) {
    brainshift::test_support::record_left_out("cars", "BRAINSHIFT_EXTERNAL_DATA is not set");
    return 0;
  }
  brainshift::sensing::study(std::string(data) + "/icp_libpointmatcher_cars/");
}
