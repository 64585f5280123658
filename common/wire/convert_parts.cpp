// SPDX-License-Identifier: Apache-2.0
#include "common/wire/convert_parts.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/text.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/names.hpp"

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

// The parts as the peer lists them: each once, in any order.
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
  return parts;
}

}  // namespace

void set_choice(const FieldChoice& choice, pb::FieldChoice& out) {
  if (const auto* ball = std::get_if<BallRegion>(&choice.region)) {
    set(ball->centre_mm, out.mutable_ball()->mutable_centre_mm());
    out.mutable_ball()->set_radius_mm(ball->radius_mm);
  } else if (const auto* tumour = std::get_if<TumourRegion>(&choice.region)) {
    out.mutable_tumour()->set_margin_mm(tumour->margin_mm);
  }
  out.set_spacing_mm(choice.spacing_mm);
  out.set_tolerance_mm(choice.tolerance_mm);
  out.set_without_sd(!choice.with_sd);
}

Result<FieldChoice> get_choice(const pb::FieldChoice& message) {
  FieldChoice choice;
  if (message.has_ball()) {
    const auto& centre = message.ball().centre_mm();
    if (centre.size() != 3) {
      return fail(ErrorCode::kProtocol, "choice.ball.centre_mm: " + std::to_string(centre.size()) +
                                            " numbers, must be 3");
    }
    choice.region = BallRegion{Vec3(centre[0], centre[1], centre[2]), message.ball().radius_mm()};
  } else if (message.has_tumour()) {
    choice.region = TumourRegion{message.tumour().margin_mm()};
  }
  choice.spacing_mm = message.spacing_mm();
  choice.tolerance_mm = message.tolerance_mm();
  choice.with_sd = !message.without_sd();
  return validate(choice).map([&] { return choice; });
}

void set_part(const FieldPart& part, pb::FieldPart& out) {
  out.set_mesh_nodes(static_cast<std::uint32_t>(part.mesh_nodes));
  out.set_base_sequence(part.base_sequence);
  auto* steps = out.mutable_node_steps();
  steps->Reserve(static_cast<int>(part.nodes.size()));
  NodeIndex previous = 0;
  for (const NodeIndex node : part.nodes) {
    steps->AddAlreadyReserved(static_cast<std::uint32_t>(node - previous));
    previous = node;
  }
}

FieldPart get_part(const pb::Update& message, Checked& checked) {
  const pb::FieldPart& sent = message.part();
  FieldPart part;
  part.base_sequence = sent.base_sequence();
  checked.require(
      sent.mesh_nodes() >= 1 && sent.mesh_nodes() <= kMaxPoints, "update.part.mesh_nodes",
      std::to_string(sent.mesh_nodes()) + ", must be in [1, " + std::to_string(kMaxPoints) + "]");
  checked.require(part.base_sequence == 0 || part.base_sequence < message.sequence(),
                  "update.part.base_sequence", "is not below the update's sequence");
  checked.require(part.base_sequence == 0 || message.final(), "update.part.base_sequence",
                  "is present although the update is not final");
  checked.require(part.base_sequence != 0 || !sent.node_steps().empty(), "update.part.node_steps",
                  "no node, although there is no base either");
  if (!checked.ok()) return part;
  part.mesh_nodes = static_cast<int>(sent.mesh_nodes());
  part.nodes.reserve(static_cast<std::size_t>(std::min(sent.node_steps_size(), part.mesh_nodes)));
  std::uint64_t node = 0;
  for (const std::uint32_t step : sent.node_steps()) {
    if (!checked.require(part.nodes.empty() || step != 0, "update.part.node_steps",
                         "node " + std::to_string(node) + " twice")) {
      return part;
    }
    node += step;
    if (!checked.require(node < sent.mesh_nodes(), "update.part.node_steps",
                         "node " + std::to_string(node) + ", must be in [0, " +
                             std::to_string(part.mesh_nodes) + ")")) {
      return part;
    }
    part.nodes.push_back(static_cast<NodeIndex>(node));
  }
  return part;
}

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
  // Parts that an older prior does not have are absent from it.
  if (!parts.empty()) {
    estimate.prior_scales.fill(0.0);
    estimate.prior_absent.fill(1.0);
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto& strength = message.prior_strengths(static_cast<int>(i));
    estimate.prior_scales[parts[i]] =
        checked.non_negative(strength.mean(), "update.prior_strengths.mean");
    estimate.prior_absent[parts[i]] =
        checked.share(strength.absent(), "update.prior_strengths.absent");
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
    Hypothesis hypothesis{PriorScaleValues{}};
    hypothesis.weight = checked.share(entry.weight(), "update.hypotheses.weight");
    for (std::size_t i = 0; i < parts.size(); ++i) {
      hypothesis.scales[parts[i]] =
          checked.non_negative(entry.scales(static_cast<int>(i)), "update.hypotheses.scales");
    }
    estimate.hypotheses.push_back(hypothesis);
  }
}

}  // namespace brainshift::wire
