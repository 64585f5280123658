// SPDX-License-Identifier: GPL-3.0-or-later
// Variations of a scenario: what differs from one surgery of its kind to the next.
//
// All draws are independent and uniform unless stated. The ranges are guesses of what is plausible,
// made before any estimate was scored on them.
//
//   fluid level       +- kFluidLevel_mm: drainage depends on posture and on cisterns that happen to
//                     be opened; at 55 mm of depth that is a quarter of the lost fluid
//   pose              gravity turned by up to kGravityTurn_deg about any axis: a head clamp whose
//                     pose is read by eye. The scenario's own tilt stays.
//   stiffness         ln G with standard deviation kStiffnessSd over kStiffnessLength_mm: grey and
//                     white matter differ by some 30 %, and gyri are about that wide
//   swelling          strength times kLeastSwelling to kMostSwelling: oedema that is resolving to
//                     somewhat more than the scenario's; its sign stays. Its centre moves by up to
//                     kSwellingOffset_mm, uniform in a ball: oedema lies beside the tumour as often
//                     as beneath it.
//   shrinkage         where the scenario allows it (Scenario::largest_shrinkage): a volume strain
//                     from 0 to that, of the whole brain or of the tumour's half with equal
//                     probability
//   retraction        pressure times kLeastPress to kMostPress; it draws aside in any direction at
//                     an angle up to kMostAside_deg; its middle moves by up to kSpatulaOffset_mm
//   resection         fraction of the tumour's volume from kLeastResected to kMostResected: the
//                     superficial part goes first, and what is left at the ground is being decided
//
// Noise, the points that are measured and the pattern of the stiffness come from the seed of
// play_scenario, which may be the same number.
#pragma once

#include <cstdint>

#include "client/tools/twin/scenario.hpp"

namespace brainshift::client {

inline constexpr double kFluidLevel_mm = 15.0;
inline constexpr double kGravityTurn_deg = 6.0;
inline constexpr double kStiffnessSd = 0.3, kStiffnessLength_mm = 20.0;
inline constexpr double kLeastSwelling = 0.5, kMostSwelling = 1.3;
inline constexpr double kSwellingOffset_mm = 15.0;
inline constexpr double kLeastPress = 0.5, kMostPress = 1.3;
inline constexpr double kMostAside_deg = 60.0, kSpatulaOffset_mm = 8.0;
inline constexpr double kLeastResected = 0.6, kMostResected = 0.8;

// The same seed gives the same variation. It promises no contact-free brain, whatever the scenario
// promised.
Scenario vary(const Scenario& scenario, std::uint64_t seed);

}  // namespace brainshift::client
