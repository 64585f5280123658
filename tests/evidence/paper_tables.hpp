// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's five patients in numbers: Ji, Roberts, Hartov, Paulsen (2009), Tables 3 to 6.
#pragma once

#include <array>

namespace brainshift::evidence::paper {

inline constexpr int kPatients = 5;
// Of patient i + 1. A negative number: the paper has none.
using Figures = std::array<double, kPatients>;

// Table 3: initial misfit at the tumour, mm, and what of it was recovered, %.
inline constexpr Figures kMisfit_mm = {4.8, 5.9, 6.1, 4.0, 3.6};
inline constexpr Figures kContactRecovered = {92, 72, 75, 88, 96};
inline constexpr Figures kFixedRecovered = {85, 72, 75, 85, 96};
inline constexpr Figures kContactError_mm = {0.4, 1.7, 1.5, 0.5, 0.13};  // epsilon_cross
inline constexpr Figures kFixedError_mm = {0.72, 1.7, 1.5, 0.6, 0.12};
// Table 4: closest point distance at the craniotomy, mm: before, and after an update from the
// tumour alone. Patient 5: before alone, from the footnote.
inline constexpr Figures kInitialCppd_mm = {4.7, 5.0, 0.74, 2.1, 0.57};
inline constexpr Figures kContactCppd_mm = {1.1, 1.1, 1.2, 1.9, -1};
inline constexpr Figures kFixedCppd_mm = {7.8, 2.3, 1.1, 2.3, -1};
// Table 5: iterations to approximate convergence, and their time, s.
inline constexpr Figures kContactIterations = {19, 13, 10, 17, 12};
inline constexpr Figures kFixedIterations = {23, 19, 75, 36, 16};
inline constexpr Figures kContactTime_s = {265, 142, 289, 215, 250};
inline constexpr Figures kFixedTime_s = {252, 73, 255, 107, 91};
// Table 6: angle between gravity and the estimate's principal direction, degrees.
inline constexpr Figures kDirection_deg = {10, 140, 105, 93, 141};
inline constexpr Figures kFixedDirection_deg = {6, 164, 117, 88, 168};
// Means as the text gives them (abstract, section 5).
inline constexpr double kMeanContactRecovered = 85, kMeanFixedRecovered = 83;
inline constexpr double kMeanContactCppd_mm = 1.6, kMeanFixedCppd_mm = 3.4;

}  // namespace brainshift::evidence::paper
