// SPDX-License-Identifier: Apache-2.0
// Quality: whether the field of an estimate may be used, in a form that a program can branch on.
//
// EstimateStatus speaks of the algorithm only: an inversion can converge to a field that no brain
// can take. The verdict speaks of the field:
//
//   good      no flag is set
//   caution   the field may be shown together with the flags of the lower half
//   unusable  a flag of the upper half is set: the field is no deformation of a brain. It is
//             reported with its reasons and replaces no usable field, neither in the daemon nor in
//             the client library nor in a score.
//
// inversion/contract/estimate_check.hpp sets the flags. Their bounds stand here, so that a client
// can name them; docs/decisions/0019-what-makes-a-field-unusable.md has reasons and sources.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace brainshift {

enum class Quality {
  kNotJudged,  // an iterate, no estimate, or an update of a daemon that gives no verdicts
  kGood,
  kCaution,
  kUnusable,
};
std::string_view to_string(Quality quality);  // "not_judged", "good", "caution", "unusable"

// One bit each. Caution: bits 0 to 15; unusable: bits 16 to 31. The bits are those of the wire
// (QualityFlag of brainshift.proto is the number of the bit, from 1): they must not change.
enum class QualityFlag : std::uint32_t {
  kMisfitUnexplained = 1u << 0,    // misfit_ratio above kUnexplainedMisfit
  kStrengthAtBound = 1u << 1,      // a part of the prior has the greatest strength allowed
  kSourcesContradict = 1u << 2,    // a source has a p_value below kInconsistent
  kDataOutsideRegion = 1u << 3,    // some data lie outside the region that was prepared
  kDeadline = 1u << 4,             // the best iterate when the time ran out
  kContactNotCertified = 1u << 5,  // decrement or violation of contact above its bound
  kIterationLimit = 1u << 6,       // the stop rule did not hold
  kMostlyPrior = 1u << 7,          // the data know less than kLeastKnown of the region of surgery
  kInvertedElements = 1u << 16,    // elements with det F <= 0
  kVolumeLost = 1u << 17,          // a nodal volume ratio is below kMinVolumeRatio
  kBeyondSkull = 1u << 18,         // a node moves, or a slave penetrates, farther than a skull lets
  kNotFinite = 1u << 19,           // a number of the estimate is not finite
};
inline constexpr std::array kAllQualityFlags = {
    QualityFlag::kMisfitUnexplained, QualityFlag::kStrengthAtBound,
    QualityFlag::kSourcesContradict, QualityFlag::kDataOutsideRegion,
    QualityFlag::kDeadline,          QualityFlag::kContactNotCertified,
    QualityFlag::kIterationLimit,    QualityFlag::kMostlyPrior,
    QualityFlag::kInvertedElements,  QualityFlag::kVolumeLost,
    QualityFlag::kBeyondSkull,       QualityFlag::kNotFinite};
std::string_view to_string(QualityFlag flag);  // "misfit_unexplained", ..., for programs
std::string_view sentence(QualityFlag flag);   // the same for people, in words without figures

// Root mean square of the whitened residuals. 600 independent residuals never exceed it by chance.
inline constexpr double kUnexplainedMisfit = 1.5;
// Of the prior variance about the tumour and under the opening, so much must have been taken away
// by the data.
inline constexpr double kLeastKnown = 0.5;
// Contact is certified up to these: a thousandth of the loads' posterior standard deviation, and a
// hundredth of the 1 mm gap, from which on a slave counts as penetrating.
inline constexpr double kMaxContactDecrement = 1e-3;
inline constexpr double kMaxContactViolation_mm = 0.01;
// Twice the volume of fluid that can leave tissue, a fifth extracellular and about a twentieth
// blood. (Shrinking by 18 % along every direction, which damages tissue, leaves 0.55.)
inline constexpr double kMinVolumeRatio = 0.5;
// More than twice the largest mean shift of a published surgery (21.3 mm).
inline constexpr double kMaxMotion_mm = 50.0;
// Three voxels of a head MRI: no error of the skull's surface explains a slave deeper in it.
inline constexpr double kDeepestInSkull_mm = 3.0;

class QualityFlags {
 public:
  void set(QualityFlag flag) { bits_ |= static_cast<std::uint32_t>(flag); }
  bool has(QualityFlag flag) const { return (bits_ & static_cast<std::uint32_t>(flag)) != 0; }
  bool empty() const { return bits_ == 0; }
  // kGood without flags, kUnusable with one of the upper half, else kCaution.
  Quality quality() const;
  bool operator==(const QualityFlags&) const = default;

 private:
  std::uint32_t bits_ = 0;
};

struct QualityVerdict {
  Quality quality = Quality::kNotJudged;  // kNotJudged, or flags.quality()
  QualityFlags flags;
  std::string reason;  // for people: a clause per flag, with its figures; empty without flags

  // Whether the field may be shown. A field that nobody has judged may not.
  bool usable() const { return quality == Quality::kGood || quality == Quality::kCaution; }
};

}  // namespace brainshift
