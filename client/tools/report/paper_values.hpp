// SPDX-License-Identifier: GPL-3.0-or-later
// Published values for comparison: the simulated case (patient 2) of Ji, Roberts, Hartov, Paulsen,
// "Brain-skull contact boundary conditions in an inverse computational deformation model", Medical
// Image Analysis 13 (2009), section 3.1, Fig. 3-4, and section 4 for ICP.
#pragma once

#include "common/core/statistics.hpp"

namespace brainshift::client::paper {

inline constexpr MeanStd kInitial_mm{2.9, 0.67};
inline constexpr MeanStd kContactSparse_mm{0.40, 0.20};
inline constexpr MeanStd kContactCross_mm{0.11, 0.07};
inline constexpr double kContactRecovery_pct = 96.0;
inline constexpr MeanStd kCraniotomyInitial_mm{1.3, 0.82};
inline constexpr MeanStd kContactCraniotomy_mm{0.07, 0.06};
inline constexpr double kContactCraniotomyRecovery_pct = 95.0;
inline constexpr MeanStd kFixedSparse_mm{1.05, 0.73};
inline constexpr MeanStd kFixedCross_mm{0.53, 0.32};
inline constexpr double kContactDirection_deg = 3.1;
inline constexpr double kFixedDirection_deg = 36.2;
inline constexpr MeanStd kIcpCross_mm{0.23, 0.11};
inline constexpr double kIcpRecovery_pct = 92.0;
inline constexpr double kLargestTrue_mm = 6.7;
inline constexpr int kIterations = 14;
inline constexpr int kPenetrating = 8;
inline constexpr double kTime_s = 186.0;

// The paper does not state it; it follows from the paper's own definition.
inline constexpr double kFixedRecovery_pct = 100.0 * (1.0 - 0.53 / 2.9);

// Means of the five patients (abstract, section 5), from data at the tumour alone, with contact.
inline constexpr double kPatientsRecovery_pct = 85.0;
inline constexpr double kPatientsCraniotomy_mm = 1.6;  // closest point distance
inline constexpr double kPatientsTime_s = 3.9 * 60.0;

}  // namespace brainshift::client::paper
