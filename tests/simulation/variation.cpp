// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/simulation/variation.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::client {
namespace {

// So that a surgery played with the same seed does not repeat these draws as noise.
constexpr std::uint64_t kStream = 0x7661727921ULL;

double between(double least, double most, Random& random) {
  return least + (most - least) * random.uniform();
}

constexpr int kDraws = 1000;
constexpr double kPoseRadiansPerDegree = std::numbers::pi / 180.0;
// Of points that are tested for the margin; the sagitta between two of them is below 0.1 mm.
constexpr double kTestEdge_mm = 3.0;
constexpr std::uint64_t kPlaceSeeds = std::uint64_t{1} << 53;

// A unit vector at up to `most_deg` from `axis`, the angle uniform.
Vec3 beside(const Vec3& axis, double most_deg, Random& random) {
  const Vec3 across = axis.cross(random.direction()).normalized();
  return Eigen::AngleAxisd(most_deg * kPoseRadiansPerDegree * random.uniform(), across) * axis;
}

class Head {
 public:
  static Result<Head> build(const TetMesh& mesh) {
    auto brain = anatomy::brain_surface_of(mesh);
    auto index = geometry::ClosestPointIndex::build(brain.surface);
    if (!index) return tl::unexpected(index.error());
    return Head(std::move(brain), std::move(*index));
  }

  const anatomy::BrainSurface& brain() const { return brain_; }

  // An opening's centre and the outward normal there; nothing when no craniotomy reaches it.
  struct Place {
    Vec3 centre, normal;
  };
  std::optional<Place> draw_opening(Random& random) const {
    Place place;
    place.centre = geometry::sample_surface(brain_.surface, 1, random.index(kPlaceSeeds)).col(0);
    place.normal = index_.triangle_normal(index_.closest(place.centre).triangle);
    const bool high = place.centre[2] >= low_[2] + kSkullBase * (high_[2] - low_[2]);
    const bool lateral = std::abs(place.centre[0] - 0.5 * (low_[0] + high_[0])) >= kFromMidline_mm;
    const Vec3 outside = place.centre + kFreeWay_mm * place.normal;
    const bool free =
        !index_.contains(outside) && index_.closest(outside).distance_mm >= 0.9 * kFreeWay_mm;
    if (!high || !lateral || !free) return std::nullopt;
    return place;
  }

  bool holds(const TriangleSurface& tumour) const {
    for (int v = 0; v < tumour.num_vertices(); ++v) {
      const Vec3 x = tumour.vertices.col(v);
      if (index_.closest(x).distance_mm < kMargin_mm || !index_.contains(x)) return false;
    }
    return true;
  }

 private:
  Head(anatomy::BrainSurface brain, geometry::ClosestPointIndex index)
      : brain_(std::move(brain)),
        index_(std::move(index)),
        low_(brain_.surface.vertices.rowwise().minCoeff()),
        high_(brain_.surface.vertices.rowwise().maxCoeff()) {}

  anatomy::BrainSurface brain_;
  geometry::ClosestPointIndex index_;
  Vec3 low_, high_;  // extent
};

// One draw; nothing when it does not fit.
std::optional<CaseConfig> draw(const CaseConfig& config, const Head& head, Random& random) {
  const auto place = head.draw_opening(random);
  if (!place) return std::nullopt;
  CaseConfig patient = config;
  TumourEllipsoid tumour;
  for (double& axis : tumour.semi_axes_mm) axis = between(kMinHalfAxis_mm, kMaxHalfAxis_mm, random);
  const double depth = between(kMinDepth_mm, kMaxDepth_mm, random);
  tumour.centre_mm = place->centre + depth * beside(-place->normal, kApproach_deg, random);
  patient.tumour = tumour;

  Craniotomy& opening = patient.craniotomy;
  opening.centre_mm = place->centre;
  opening.long_axis_mm = between(kMinLongAxis_mm, kMaxLongAxis_mm, random);
  opening.short_axis_mm = between(kMinShortAxis_mm, kMaxShortAxis_mm, random);
  opening.long_axis_direction = place->normal.cross(random.direction()).normalized();

  patient.gravity_direction = beside(-place->normal, kUppermost_deg, random);
  if (patient.gravity_direction[2] > std::sin(kHeadDown_deg * kPoseRadiansPerDegree))
    return std::nullopt;
  if (!head.holds(
          geometry::ellipsoid_surface(tumour.centre_mm, tumour.semi_axes_mm, kTestEdge_mm))) {
    return std::nullopt;
  }
  if (!anatomy::select_node_sets(head.brain(), patient)) return std::nullopt;
  return patient;
}

}  // namespace

// Every draw is made for every scenario, so that one of them does not depend on the others' parts.
Scenario vary(const Scenario& scenario, std::uint64_t seed) {
  Random random(seed ^ kStream);
  Scenario varied = scenario;
  varied.contact_free = false;
  const double level = between(-kFluidLevel_mm, kFluidLevel_mm, random);
  for (double& each : varied.fluid_levels_mm) each += level;
  const Vec3 axis = random.direction();
  varied.gravity_turn_deg = kGravityTurn_deg * random.uniform() * axis;
  varied.stiffness_sd = kStiffnessSd;
  varied.stiffness_length_mm = kStiffnessLength_mm;

  const double strength = between(kMinSwelling, kMaxSwelling, random);
  const Vec3 towards = random.direction();
  const Vec3 offset = kSwellingOffset_mm * std::cbrt(random.uniform()) * towards;
  if (scenario.swelling.volume_strain != 0.0) {
    varied.swelling.volume_strain *= strength;
    varied.swelling.offset_mm += offset;
  }
  const double shrinkage = scenario.largest_shrinkage * random.uniform();
  const bool one_hemisphere = random.uniform() < 0.5;
  if (shrinkage > 0.0) varied.volume = {-shrinkage, one_hemisphere};
  const double fraction = between(kMinResected, kMaxResected, random);
  if (varied.resection) varied.resection->volume_fraction = fraction;

  const double press = between(kMinPress, kMaxPress, random);
  const double angle_deg = kMaxAside_deg * random.uniform();
  const Vec3 aside = random.direction();
  const Vec3 outwards = random.direction();
  const Vec3 middle = kSpatulaOffset_mm * std::cbrt(random.uniform()) * outwards;
  if (varied.retraction) {
    varied.retraction->pressure_pa *= press;
    varied.retraction->angle_deg = angle_deg;
    varied.retraction->aside = aside;
    varied.retraction->offset_mm = middle;
  }
  return varied;
}

Result<SimulatedSurgery> play_scenario(const BrainModel& model, const CaseConfig& config,
                                       const contact::ForwardModel& forward,
                                       const Scenario& scenario, std::uint64_t seed) {
  const Adversity& adverse = scenario.adverse;
  const bool keeps_the_brain = scenario.stiffness_sd == 0.0 && !scenario.resection &&
                               !adverse.other_mesh && !adverse.gap_seed && !adverse.tissue_seed &&
                               adverse.penalty_factor == 1.0 && adverse.segmentation_sd_mm == 0.0;
  if (!keeps_the_brain) return play_scenario(model, config, scenario, seed);
  const auto brain = truth_brain(model, config, scenario, seed);
  if (!brain) return tl::unexpected(brain.error());
  TruthSolver solver(forward);
  return play_scenario(*brain, solver, scenario, seed);
}

Result<CaseConfig> vary_patient(const CaseConfig& config, const TetMesh& brain,
                                std::uint64_t seed) {
  const auto head = Head::build(brain);
  if (!head) return tl::unexpected(head.error());
  Random random(seed);
  for (int i = 0; i < kDraws; ++i) {
    auto patient = draw(config, *head, random);
    if (!patient) continue;
    patient->case_id = fmt::format("{}-{}", config.case_id, seed);
    return std::move(*patient);
  }
  return fail(
      ErrorCode::kNotConverged,
      fmt::format("case {}: none of {} draws of a patient fits this head", config.case_id, kDraws));
}

}  // namespace brainshift::client
