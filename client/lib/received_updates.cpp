// SPDX-License-Identifier: Apache-2.0
#include "client/lib/received_updates.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace brainshift::client {

Status check_mesh(const UpdateMessage& message, int mesh_nodes) {
  const Update& update = message.update;
  if (mesh_nodes == 0 || message.error) return {};
  const auto columns = static_cast<int>(update.estimate.displacement.cols());
  const int stated = update.part ? update.part->mesh_nodes : columns;
  if (stated == mesh_nodes || (stated == 0 && !update.usable())) return {};
  return fail(ErrorCode::kProtocol, "update.displacement: of a mesh of " + std::to_string(stated) +
                                        " nodes, the model has " + std::to_string(mesh_nodes));
}

void UpdateQueue::push(Result<UpdateMessage> update) {
  updates_.push_back(std::move(update));
  if (updates_.size() <= capacity_) return;
  const auto iterate = std::find_if(updates_.begin(), updates_.end(), [](const auto& entry) {
    return entry && !entry->error && !entry->update.final;
  });
  if (iterate != updates_.end()) updates_.erase(iterate);
}

void UpdateQueue::drop_older_than(const SessionState& state) {
  std::erase_if(updates_, [&](const Result<UpdateMessage>& entry) {
    if (!entry) return false;
    if (entry->key() != state.session) return true;
    const bool usable = !entry->error && entry->update.usable();
    return entry->update.sequence < (usable ? state.newest_usable : state.newest_update);
  });
}

std::optional<Result<UpdateMessage>> UpdateQueue::pop() {
  if (updates_.empty()) return std::nullopt;
  std::optional<Result<UpdateMessage>> front(std::move(updates_.front()));
  updates_.pop_front();
  return front;
}

void FieldAssembly::begin(const FieldChoice& choice) {
  holds_ = choice.tolerance_mm > 0.0;
  waiting_ = false;
  held_.reset();
}

void FieldAssembly::forget() {
  held_.reset();
  waiting_ = true;
}

FieldAssembly::Outcome FieldAssembly::complete(UpdateMessage& message) {
  Update& update = message.update;
  if (update.part && update.part->base_sequence != 0) {
    if (!apply(message)) {
      const bool asked = waiting_;
      forget();
      return asked ? Outcome::kDropped : Outcome::kLost;
    }
    held_->sequence = update.sequence;
    update.part = held_->part;
    update.estimate.displacement = held_->displacement;
    update.estimate.sd_mm = held_->sd_mm;
    update.estimate.known = held_->known;
    return Outcome::kWhole;
  }
  if (holds_ && !message.error && update.usable()) {
    held_ =
        Held{message.key(),         update.sequence,      update.part, update.estimate.displacement,
             update.estimate.sd_mm, update.estimate.known};
    waiting_ = false;
  }
  return Outcome::kWhole;
}

bool FieldAssembly::apply(const UpdateMessage& message) {
  const Estimate& changes = message.update.estimate;
  const FieldPart& part = *message.update.part;
  if (!held_ || held_->session != message.key() || held_->sequence != part.base_sequence) {
    return false;
  }
  const int mesh_nodes =
      held_->part ? held_->part->mesh_nodes : static_cast<int>(held_->displacement.cols());
  const bool has_sd = changes.sd_mm.size() > 0, has_known = changes.known.size() > 0;
  if (part.mesh_nodes != mesh_nodes) return false;
  if (!part.nodes.empty() &&
      (has_sd != (held_->sd_mm.size() > 0) || has_known != (held_->known.size() > 0))) {
    return false;
  }
  std::vector<Eigen::Index> columns;
  columns.reserve(part.nodes.size());
  for (const NodeIndex node : part.nodes) {
    if (!held_->part) {
      columns.push_back(node);
      continue;
    }
    const auto& chosen = held_->part->nodes;
    const auto at = std::lower_bound(chosen.begin(), chosen.end(), node);
    if (at == chosen.end() || *at != node) return false;
    columns.push_back(at - chosen.begin());
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto from = static_cast<Eigen::Index>(i);
    held_->displacement.col(columns[i]) = changes.displacement.col(from);
    if (has_sd) held_->sd_mm[columns[i]] = changes.sd_mm[from];
    if (has_known) held_->known[columns[i]] = changes.known[from];
  }
  return true;
}

void LatestUsable::begin(const SessionKey& session) {
  session_ = session;
  latest_.reset();
}

void LatestUsable::follow(const SessionKey& session) {
  if (session != session_) begin(session);
}

bool LatestUsable::belongs(const SessionKey& session) const {
  if (session_ == SessionKey{} || session == session_) return true;
  return session.boot_id == session_.boot_id && session.session_id > session_.session_id;
}

void LatestUsable::take(const UpdateMessage& message) {
  if (!belongs(message.key())) return;
  follow(message.key());
  if (message.error || !message.update.usable()) return;
  latest_ = message;
}

}  // namespace brainshift::client
