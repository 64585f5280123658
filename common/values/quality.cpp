// SPDX-License-Identifier: Apache-2.0
#include "common/values/quality.hpp"

#include "common/core/types.hpp"

namespace brainshift {
namespace {

constexpr std::uint32_t kUnusableBits = 0xffff0000u;

}  // namespace

std::string_view to_string(Quality quality) {
  static constexpr std::string_view kNames[] = {"not_judged", "good", "caution", "unusable"};
  return enum_name<Quality::kUnusable>(quality, kNames);
}

std::string_view to_string(QualityFlag flag) {
  switch (flag) {
    case QualityFlag::kMisfitUnexplained: return "misfit_unexplained";
    case QualityFlag::kStrengthAtBound: return "strength_at_bound";
    case QualityFlag::kSourcesContradict: return "sources_contradict";
    case QualityFlag::kDataOutsideRegion: return "data_outside_region";
    case QualityFlag::kDeadline: return "deadline";
    case QualityFlag::kContactNotCertified: return "contact_not_certified";
    case QualityFlag::kIterationLimit: return "iteration_limit";
    case QualityFlag::kMostlyPrior: return "mostly_prior";
    case QualityFlag::kInvertedElements: return "inverted_elements";
    case QualityFlag::kVolumeLost: return "volume_lost";
    case QualityFlag::kBeyondSkull: return "beyond_skull";
    case QualityFlag::kNotFinite: return "not_finite";
  }
  return "not_finite";
}

std::string_view sentence(QualityFlag flag) {
  switch (flag) {
    case QualityFlag::kMisfitUnexplained:
      return "the data lie farther off than their errors and the prior allow";
    case QualityFlag::kStrengthAtBound:
      return "a part of the prior has the greatest strength that is allowed";
    case QualityFlag::kSourcesContradict: return "a source contradicts the others";
    case QualityFlag::kDataOutsideRegion: return "data lie outside the region that was prepared";
    case QualityFlag::kDeadline: return "the time ran out before the inversion settled";
    case QualityFlag::kContactNotCertified:
      return "contact holds less well than its certificate asks";
    case QualityFlag::kIterationLimit: return "the inversion ended at its limit of iterations";
    case QualityFlag::kMostlyPrior:
      return "the data say little about the region of surgery: the field there is mostly a guess";
    case QualityFlag::kInvertedElements: return "elements are turned inside out";
    case QualityFlag::kVolumeLost: return "tissue loses more volume than it can";
    case QualityFlag::kBeyondSkull: return "the brain moves farther than a skull allows";
    case QualityFlag::kNotFinite: return "a number of the estimate is not finite";
  }
  return "a number of the estimate is not finite";
}

Quality QualityFlags::quality() const {
  if (bits_ == 0) return Quality::kGood;
  return (bits_ & kUnusableBits) != 0 ? Quality::kUnusable : Quality::kCaution;
}

}  // namespace brainshift
