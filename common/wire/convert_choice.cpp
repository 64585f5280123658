// SPDX-License-Identifier: Apache-2.0
#include "common/wire/convert_choice.hpp"

#include <algorithm>
#include <cstdint>
#include <string>

#include "common/wire/convert.hpp"

namespace brainshift::wire {

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

}  // namespace brainshift::wire
