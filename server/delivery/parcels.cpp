// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/parcels.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace brainshift::server {
namespace {

using wire::PublishedUpdate;

// Above this share of the choice, changes with their node numbers save little over all of it.
constexpr double kMaxOfTheChoice = 0.9;

Bytes frame(const std::string& payload) { return framed(wire::MessageType::kUpdate, 0, payload); }

// The field of the update at the nodes of the choice.
std::shared_ptr<HeldField> all_of(const PublishedUpdate& update, const Selection& selection) {
  auto held = std::make_shared<HeldField>();
  held->session = update.session();
  held->sequence = update.sequence();
  const bool sd = selection.choice.with_sd && !update.sd_mm().empty();
  held->xyz_mm.reserve(3 * selection.nodes.size());
  const bool known = selection.choice.with_sd && !update.known().empty();
  if (sd) held->sd_mm.reserve(selection.nodes.size());
  for (const NodeIndex node : selection.nodes) {
    const auto i = static_cast<std::size_t>(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      held->xyz_mm.push_back(update.xyz_mm()[3 * i + axis]);
    }
    if (sd) held->sd_mm.push_back(update.sd_mm()[i]);
    if (known) held->known.push_back(update.known()[i]);
  }
  return held;
}

bool differs(const HeldField& a, const HeldField& b, std::size_t i, double tolerance_mm) {
  double squared = 0.0;
  for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
    const double step = static_cast<double>(a.xyz_mm[k]) - static_cast<double>(b.xyz_mm[k]);
    squared += step * step;
  }
  if (std::sqrt(squared) > tolerance_mm) return true;
  if (!a.known.empty()) {
    const auto byte = [i](const HeldField& of) { return static_cast<unsigned char>(of.known[i]); };
    if (std::abs(byte(a) - byte(b)) > 255 * Parcels::kKnownTolerance) return true;
  }
  if (a.sd_mm.empty()) return false;
  return std::abs(static_cast<double>(a.sd_mm[i]) - static_cast<double>(b.sd_mm[i])) > tolerance_mm;
}

// Every node of the choice; the frame for everybody where that is the same.
Bytes complete(const Bytes& whole, const PublishedUpdate& update, const Selection& selection) {
  if (selection.every_node()) {
    return selection.choice.with_sd ? whole : frame(update.cut(std::nullopt, false));
  }
  return frame(
      update.cut(FieldPart{selection.mesh_nodes, selection.nodes, 0}, selection.choice.with_sd));
}

Parcel make_parcel(const Bytes& whole, const PublishedUpdate& update, const Selection& selection,
                   const Held& base) {
  const double tolerance_mm = selection.choice.tolerance_mm;
  if (tolerance_mm == 0.0 || !update.usable()) return {complete(whole, update, selection), {}};
  auto now = all_of(update, selection);
  if (!base || base->sd_mm.size() != now->sd_mm.size() || base->known.size() != now->known.size()) {
    return {complete(whole, update, selection), std::move(now)};
  }
  FieldPart changes{selection.mesh_nodes, {}, base->sequence};
  for (std::size_t i = 0; i < selection.nodes.size(); ++i) {
    if (differs(*now, *base, i, tolerance_mm)) {
      changes.nodes.push_back(selection.nodes[i]);
      continue;
    }
    std::copy_n(base->xyz_mm.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                now->xyz_mm.begin() + static_cast<std::ptrdiff_t>(3 * i));
    if (!now->sd_mm.empty()) now->sd_mm[i] = base->sd_mm[i];
    if (!now->known.empty()) now->known[i] = base->known[i];
  }
  const auto most = kMaxOfTheChoice * static_cast<double>(selection.nodes.size());
  if (static_cast<double>(changes.nodes.size()) > most) {
    return {complete(whole, update, selection), all_of(update, selection)};
  }
  return {frame(update.cut(changes, selection.choice.with_sd)), std::move(now)};
}

}  // namespace

Bytes framed(wire::MessageType type, std::uint64_t request_id, std::string_view payload) {
  return std::make_shared<const std::string>(wire::encode_frame(type, request_id, payload));
}

Parcels::Entry& Parcels::entry(const Bytes& whole) {
  const auto known = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.whole == whole; });
  if (known != entries_.end()) return *known;
  if (entries_.size() == kUpdatesKept) entries_.pop_front();
  Entry& added = entries_.emplace_back();
  added.whole = whole;
  auto update = PublishedUpdate::open(std::string_view(*whole).substr(wire::kHeaderBytes));
  if (!update) {
    spdlog::error("an update cannot be cut: {}", update.error().message);
  } else if (update->nodes() > 0) {
    added.update = std::move(*update);
  }
  return added;
}

std::optional<Parcel> Parcels::make(const Bytes& whole, const SelectionPtr& selection,
                                    const Held& held) {
  if (!selection) return Parcel{whole, {}};
  Entry& of = entry(whole);
  if (!of.update || of.update->nodes() != selection->mesh_nodes) return Parcel{whole, {}};
  const bool builds_on = held && of.update->usable() && selection->choice.tolerance_mm > 0.0 &&
                         held->session == of.update->session() &&
                         held->sequence < of.update->sequence();
  const Held base = builds_on ? held : Held{};
  const auto known = std::find_if(of.made.begin(), of.made.end(), [&](const Made& made) {
    return made.selection.lock() == selection && made.base == base;
  });
  if (known != of.made.end()) return known->parcel;
  if (spent()) return std::nullopt;
  ++made_;
  of.made.push_back({selection, base, make_parcel(whole, *of.update, *selection, base)});
  Parcel parcel = of.made.back().parcel;
  for (std::size_t kept = bytes_kept(); kept > kBytesKept;) {
    auto& oldest = *std::find_if(entries_.begin(), entries_.end(),
                                 [](const Entry& entry) { return !entry.made.empty(); });
    kept -= oldest.made.front().bytes();
    oldest.made.pop_front();
  }
  return parcel;
}

std::size_t Parcels::Made::bytes() const {
  const Held& held = parcel.held;
  return parcel.bytes->size() +
         (held ? sizeof(float) * (held->xyz_mm.size() + held->sd_mm.size()) : 0);
}

std::size_t Parcels::bytes_kept() const {
  std::size_t bytes = 0;
  for (const Entry& entry : entries_) {
    for (const Made& made : entry.made) bytes += made.bytes();
  }
  return bytes;
}

void Parcels::begin_turn() {
  made_ = 0;
  for (Entry& entry : entries_) {
    std::erase_if(entry.made, [](const Made& made) { return made.selection.expired(); });
  }
}

}  // namespace brainshift::server
