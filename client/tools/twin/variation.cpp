// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/variation.hpp"

#include <cmath>

#include "common/core/random.hpp"

namespace brainshift::client {
namespace {

// So that a surgery played with the same seed does not repeat these draws as noise.
constexpr std::uint64_t kStream = 0x7661727921ULL;

double uniform_between(double least, double most, Random& random) {
  return least + (most - least) * random.uniform();
}

}  // namespace

// Every draw is made for every scenario, so that one of them does not depend on the others' parts.
Scenario vary(const Scenario& scenario, std::uint64_t seed) {
  Random random(seed ^ kStream);
  Scenario varied = scenario;
  varied.contact_free = false;
  const double level = uniform_between(-kFluidLevel_mm, kFluidLevel_mm, random);
  for (double& each : varied.fluid_levels_mm) each += level;
  const Vec3 axis = random.direction();
  varied.gravity_turn_deg = kGravityTurn_deg * random.uniform() * axis;
  varied.stiffness_sd = kStiffnessSd;
  varied.stiffness_length_mm = kStiffnessLength_mm;

  const double strength = uniform_between(kLeastSwelling, kMostSwelling, random);
  const Vec3 towards = random.direction();
  const Vec3 offset = kSwellingOffset_mm * std::cbrt(random.uniform()) * towards;
  if (scenario.swelling.volume_strain != 0.0) {
    varied.swelling.volume_strain *= strength;
    varied.swelling.offset_mm += offset;
  }
  const double shrinkage = scenario.largest_shrinkage * random.uniform();
  const bool one_hemisphere = random.uniform() < 0.5;
  if (shrinkage > 0.0) varied.volume = {-shrinkage, one_hemisphere};
  const double fraction = uniform_between(kLeastResected, kMostResected, random);
  if (varied.resection) varied.resection->volume_fraction = fraction;

  const double press = uniform_between(kLeastPress, kMostPress, random);
  const double angle_deg = kMostAside_deg * random.uniform();
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

}  // namespace brainshift::client
