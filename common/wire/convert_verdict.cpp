// SPDX-License-Identifier: Apache-2.0
#include "common/wire/convert_verdict.hpp"

#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "common/wire/names.hpp"
#include "common/wire/text.hpp"

namespace brainshift::wire {
namespace {

pb::Quality number_of(Quality quality) {
  switch (quality) {
    case Quality::kNotJudged: return pb::QUALITY_UNSPECIFIED;
    case Quality::kGood: return pb::QUALITY_GOOD;
    case Quality::kCaution: return pb::QUALITY_CAUTION;
    case Quality::kUnusable: return pb::QUALITY_UNUSABLE;
  }
  return pb::QUALITY_UNSPECIFIED;
}

// The number of the flag's bit, from 1.
pb::QualityFlag number_of(QualityFlag flag) {
  return static_cast<pb::QualityFlag>(std::countr_zero(static_cast<std::uint32_t>(flag)) + 1);
}

// Sums of weights may round to a little more than 1. Values are kept as sent.
constexpr double kProbabilityTolerance = 1e-9;

double probability(double value, std::string_view field, Checked& checked) {
  checked.non_negative(value, field);
  checked.require(value <= 1.0 + kProbabilityTolerance, field,
                  std::to_string(value) + ", must be at most 1");
  return value;
}

// The parts as the peer lists them: all of them once, in any order.
std::vector<std::size_t> listed_parts(const pb::Update& message, Checked& checked) {
  std::vector<std::size_t> parts;
  for (const auto& strength : message.prior_strengths()) {
    const auto part = prior_part_from(strength.part());
    if (!checked.require(part.has_value(), "update.prior_strengths.part",
                         in_quotes(strength.part()) + " is unknown")) {
      return {};
    }
    const auto index = static_cast<std::size_t>(*part);
    if (!checked.require(std::find(parts.begin(), parts.end(), index) == parts.end(),
                         "update.prior_strengths.part",
                         in_quotes(strength.part()) + " occurs more than once")) {
      return {};
    }
    parts.push_back(index);
  }
  checked.require(parts.empty() || parts.size() == kPriorParts, "update.prior_strengths",
                  std::to_string(parts.size()) + " entries, must be 0 or one for each of " +
                      std::to_string(kPriorParts) + " parts");
  return parts;
}

}  // namespace

void set_verdict(const QualityVerdict& verdict, pb::Update& out) {
  out.set_quality(number_of(verdict.quality));
  for (const QualityFlag flag : kAllQualityFlags) {
    if (verdict.flags.has(flag)) out.add_quality_flags(number_of(flag));
  }
  out.set_quality_reason(to_utf8(verdict.reason));
}

QualityVerdict get_verdict(const pb::Update& message, Checked& checked) {
  QualityVerdict verdict;
  verdict.reason = message.quality_reason();
  for (int i = 0; i < message.quality_flags_size(); ++i) {
    const auto* const flag = std::find_if(
        kAllQualityFlags.begin(), kAllQualityFlags.end(),
        [&](QualityFlag candidate) { return number_of(candidate) == message.quality_flags(i); });
    const std::string number = std::to_string(static_cast<int>(message.quality_flags(i)));
    if (!checked.require(flag != kAllQualityFlags.end(), "update.quality_flags",
                         number + " is unknown") ||
        !checked.require(!verdict.flags.has(*flag), "update.quality_flags",
                         number + " occurs more than once")) {
      return verdict;
    }
    verdict.flags.set(*flag);
  }
  // Nothing sent: a daemon that gives no verdicts.
  if (message.quality() != pb::QUALITY_UNSPECIFIED || !verdict.flags.empty()) {
    verdict.quality = verdict.flags.quality();
  }
  checked.require(message.quality() == number_of(verdict.quality), "update.quality",
                  std::to_string(static_cast<int>(message.quality())) +
                      ", must be that of its flags: " +
                      std::to_string(static_cast<int>(number_of(verdict.quality))));
  return verdict;
}

void set_prior(const Estimate& estimate, pb::Update& out) {
  if (estimate.hypotheses.empty() && estimate.prior_scales == kAsInTheCase &&
      estimate.prior_absent == PriorScaleValues{} &&
      estimate.prior_at_bound == std::array<bool, kPriorParts>{}) {
    return;
  }
  for (std::size_t part = 0; part < kPriorParts; ++part) {
    auto* strength = out.add_prior_strengths();
    strength->set_part(std::string(to_string(static_cast<PriorPart>(part))));
    strength->set_mean(estimate.prior_scales[part]);
    strength->set_absent(estimate.prior_absent[part]);
    strength->set_at_bound(estimate.prior_at_bound[part]);
  }
  for (const Hypothesis& hypothesis : estimate.hypotheses) {
    auto* entry = out.add_hypotheses();
    entry->mutable_scales()->Add(hypothesis.scales.begin(), hypothesis.scales.end());
    entry->set_weight(hypothesis.weight);
  }
}

void get_prior(const pb::Update& message, Estimate& estimate, Checked& checked) {
  const std::vector<std::size_t> parts = listed_parts(message, checked);
  if (!checked.require(message.hypotheses_size() <= kMaxHypotheses, "update.hypotheses",
                       std::to_string(message.hypotheses_size()) + " entries, must be at most " +
                           std::to_string(kMaxHypotheses)) ||
      !checked.require(message.hypotheses().empty() || !parts.empty(), "update.hypotheses",
                       "are present without update.prior_strengths")) {
    return;
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto& strength = message.prior_strengths(static_cast<int>(i));
    estimate.prior_scales[parts[i]] =
        checked.non_negative(strength.mean(), "update.prior_strengths.mean");
    estimate.prior_absent[parts[i]] =
        probability(strength.absent(), "update.prior_strengths.absent", checked);
    estimate.prior_at_bound[parts[i]] = strength.at_bound();
  }
  estimate.hypotheses.reserve(static_cast<std::size_t>(message.hypotheses_size()));
  for (const auto& entry : message.hypotheses()) {
    if (!checked.require(
            entry.scales_size() == static_cast<int>(parts.size()), "update.hypotheses.scales",
            std::to_string(entry.scales_size()) + " numbers, must be one for each of " +
                std::to_string(parts.size()) + " strengths")) {
      return;
    }
    Hypothesis hypothesis;
    hypothesis.weight = probability(entry.weight(), "update.hypotheses.weight", checked);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      hypothesis.scales[parts[i]] =
          checked.non_negative(entry.scales(static_cast<int>(i)), "update.hypotheses.scales");
    }
    estimate.hypotheses.push_back(hypothesis);
  }
}

}  // namespace brainshift::wire
