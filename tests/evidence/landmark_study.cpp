// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/landmark_study.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <utility>

#include "common/inversion/inverter.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/registration/fiducials.hpp"
#include "tests/surgeries/interval_scores.hpp"

namespace brainshift::evidence {
namespace {

// [x_i^T 1]
Eigen::MatrixXd affine_columns(const Points& places) {
  Eigen::MatrixXd columns(places.cols(), 4);
  columns << places.transpose(), VecX::Ones(places.cols());
  return columns;
}

Status check_pairs(const Points& before, const Points& during) {
  if (before.cols() != during.cols() || before.cols() < 4) {
    return invalid("landmarks: " + std::to_string(before.cols()) + " before and " +
                   std::to_string(during.cols()) + " during surgery; at least 4 pairs are needed");
  }
  if (Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(affine_columns(before)).rank() < 4) {
    return invalid("landmarks: all lie in one plane");
  }
  return {};
}

constexpr Eigen::Index kMinPairs = 5;

struct Pairs {
  Points before, during;  // 3 x n, mm
};

Pairs without(const Pairs& all, Eigen::Index one) {
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < all.before.cols(); ++i) {
    if (i != one) others.push_back(i);
  }
  return {all.before(Eigen::all, others), all.during(Eigen::all, others)};
}

class Predictor {
 public:
  static Result<Predictor> build(const bench::Head& head, double sd_mm) {
    CaseConfig config = head.config;
    config.sensing.landmark_pose_sd_mm = kLeftPose_mm;
    config.sensing.landmark_pose_sd_deg = kLeftPose_deg;
    auto inverter = inversion::condensed_inverter(head.operators, head.locator, config);
    if (!inverter) return tl::unexpected(inverter.error());
    auto pipeline = pipeline::Pipeline::build(*head.model, config, Method::kCondensed,
                                              Boundary::kContact, std::move(*inverter));
    if (!pipeline) return tl::unexpected(pipeline.error());
    return Predictor(head, sd_mm, std::move(*pipeline));
  }

  // Where the estimate from `others` has the landmark, and what it says of itself: all of `out`
  // but for the distances and what is inside.
  Result<Vec3> predict(const Pairs& others, const Vec3& before, LeftOutLandmark& out) {
    const auto first = registration::register_fiducials(others.before, others.during);
    if (!first) return tl::unexpected(first.error());
    Observation observation;
    observation.case_id = head_->model->case_id;
    observation.source = "landmarks";
    observation.sequence = 1;
    observation.body =
        LandmarkPairs{others.before, first->T_image_measured.inverse() * others.during, sd_mm_};
    pipeline_.reset();
    const auto update = pipeline_.run(observation);
    if (!update) return tl::unexpected(update.error());
    const auto moved = [&](const Vec3& x) -> Vec3 {
      return x + geometry::value_at(head_->locator->locate(x), update->estimate.displacement);
    };
    Points places = others.before;
    for (auto place : places.colwise()) place = moved(place);
    const auto pose = registration::register_fiducials(places, others.during);
    if (!pose) return tl::unexpected(pose.error());
    out.motion_mm = (moved(before) - before).norm();
    const double sd = geometry::value_at(head_->locator->locate(before), update->estimate.sd_mm);
    const Vec3 place = pose->T_image_measured * moved(before);
    const double tre = registration::expected_tre_mm(others.during, std::sqrt(3.0) * sd_mm_, place);
    out.sd_mm = std::sqrt(sd * sd + tre * tre / 3.0 + sd_mm_ * sd_mm_);
    out.quality = std::string(to_string(update->estimate.quality.quality));
    return place;
  }

 private:
  Predictor(const bench::Head& head, double sd_mm, pipeline::Pipeline pipeline)
      : head_(&head), sd_mm_(sd_mm), pipeline_(std::move(pipeline)) {}

  const bench::Head* head_;
  double sd_mm_;
  pipeline::Pipeline pipeline_;
};

}  // namespace

std::vector<HeadPose> head_poses(const CaseConfig& config) {
  return {{"uppermost", config.gravity_direction}, {"supine", Vec3(0, -1, 0)}};
}

Result<PointMap> rigid_map(const Points& before, const Points& during) {
  const auto fit = registration::register_fiducials(before, during);
  if (!fit) return tl::unexpected(fit.error());
  const RigidTransform T = fit->T_image_measured;
  return [T](const Vec3& x) -> Vec3 { return T * x; };
}

Result<PointMap> affine_map(const Points& before, const Points& during) {
  if (Status ok = check_pairs(before, during); !ok) return tl::unexpected(ok.error());
  const Eigen::Matrix<double, 4, 3> map =
      affine_columns(before).colPivHouseholderQr().solve(during.transpose());
  return [map](const Vec3& x) -> Vec3 { return map.transpose() * x.homogeneous(); };
}

Result<PointMap> thin_plate_map(const Points& before, const Points& during) {
  if (Status ok = check_pairs(before, during); !ok) return tl::unexpected(ok.error());
  const Eigen::Index n = before.cols();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 4, n + 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      system(i, j) = (before.col(i) - before.col(j)).norm();
      if (i != j && system(i, j) == 0.0) {
        return invalid("landmarks: two lie at one place before surgery");
      }
    }
  }
  system.topRightCorner(n, 4) = affine_columns(before);
  system.bottomLeftCorner(4, n) = affine_columns(before).transpose();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 4, 3);
  right.topRows(n) = during.transpose();
  const Eigen::MatrixXd weights = system.fullPivLu().solve(right);
  return [before, weights, n](const Vec3& x) -> Vec3 {
    VecX kernel(n + 4);
    kernel << (before.colwise() - x).colwise().norm().transpose(), x, 1.0;
    return weights.transpose() * kernel;
  };
}

Result<std::vector<LeftOutLandmark>> leave_one_out(const bench::Head& head,
                                                   const io::NamedPairs& pairs, double sd_mm) {
  const Pairs all{columns_of(pairs.first), columns_of(pairs.second)};
  const Eigen::Index count = all.before.cols();
  if (count < kMinPairs) {
    return invalid("landmarks: " + std::to_string(count) +
                   " pairs; at least 5 are needed to leave one out");
  }
  auto predictor = Predictor::build(head, sd_mm);
  if (!predictor) return tl::unexpected(predictor.error());
  std::vector<LeftOutLandmark> result;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vec3 before = all.before.col(i), during = all.during.col(i);
    const Pairs others = without(all, i);
    LeftOutLandmark& out = result.emplace_back();
    out.name = pairs.names[static_cast<std::size_t>(i)];
    if (out.name.empty()) out.name = std::to_string(i + 1);
    const auto failed = [&](const Error& error) {
      return fail(error.code, "landmark " + out.name + ": " + error.message);
    };
    out.none = (during - before).norm();
    for (const auto& [make, distance] : {std::pair{&rigid_map, &LeftOutLandmark::rigid},
                                         {&affine_map, &LeftOutLandmark::affine},
                                         {&thin_plate_map, &LeftOutLandmark::thin_plate}}) {
      const auto map = make(others.before, others.during);
      if (!map) return failed(map.error());
      out.*distance = ((*map)(before)-during).norm();
    }
    const auto predicted = predictor->predict(others, before, out);
    if (!predicted) return failed(predicted.error());
    const Vec3 error = *predicted - during;
    out.estimate = error.norm();
    out.inside =
        static_cast<int>((error.array().abs() <= surgeries::kNormalQuantile95 * out.sd_mm).count());
  }
  return result;
}

}  // namespace brainshift::evidence
