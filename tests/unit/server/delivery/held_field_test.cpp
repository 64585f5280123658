// SPDX-License-Identifier: GPL-3.0-or-later
// The guarantee of a choice with a tolerance, over random surgeries: whatever is skipped, lost or
// refused, a viewer holds at every node of its choice a displacement within the tolerance of the
// newest usable update that it received, and never a mixture of two sessions.
//
// The daemon's Viewer and Parcels on one end, the client's FieldAssembly on the other, and between
// them a queue that loses nothing but what the test damages.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <vector>

#include "client/lib/received_updates.hpp"
#include "common/core/random.hpp"
#include "server/delivery/viewer.hpp"
#include "tests/unit/server/delivery/small_updates.hpp"

namespace brainshift::server {
namespace {

using Outcome = client::FieldAssembly::Outcome;
constexpr int kNodes = 40;

// The surgery: a field that moves a little at a time, failures, unusable fields, sessions.
class Surgery {
 public:
  explicit Surgery(Random& random) : random_(random) { begin(); }

  UpdateMessage next() {
    if (random_.uniform() < 0.05) begin();
    ++sequence_;
    const double what = random_.uniform();
    if (what < 0.1) return in_session(failure(sequence_));
    move();
    UpdateMessage message = in_session(usable(sequence_, kNodes));
    message.update.estimate.displacement = field_;
    message.update.estimate.sd_mm = sd_mm_;
    message.update.estimate.known = known_;
    if (random_.uniform() < 0.05) message.update.estimate.known.resize(0);
    if (random_.uniform() < 0.05) message.update.estimate.sd_mm.resize(0);
    if (what < 0.2) {
      message.update.estimate.displacement.array() += 500.0;
      message.update.estimate.quality.flags.set(QualityFlag::kBeyondSkull);
      message.update.estimate.quality.quality = Quality::kUnusable;
    } else {
      truth_[{message.session_id, sequence_}] = message.update.estimate;
    }
    return message;
  }
  const Estimate& truth(const UpdateMessage& message) const {
    return truth_.at({message.session_id, message.update.sequence});
  }

 private:
  // Each session's field is 100 mm from the one before: a mixture could not be missed.
  void begin() {
    ++session_;
    sequence_ = 0;
    field_ = Points::Constant(3, kNodes, 100.0 * static_cast<double>(session_));
    sd_mm_ = VecX::Constant(kNodes, 0.5);
    known_ = VecX::Constant(kNodes, 0.5);
  }
  void move() {
    const bool jump = random_.uniform() < 0.1;
    for (Eigen::Index node = 0; node < kNodes; ++node) {
      if (!jump && random_.uniform() < 0.5) continue;
      field_.col(node) += (jump ? 5.0 : 0.1) * random_.normal() * random_.direction();
      sd_mm_[node] = std::abs(sd_mm_[node] + 0.02 * random_.normal());
      known_[node] = std::clamp(known_[node] + 0.01 * random_.normal(), 0.0, 1.0);
    }
  }
  UpdateMessage in_session(UpdateMessage message) const {
    message.session_id = session_;
    return message;
  }

  Random& random_;
  std::uint64_t session_ = 0, sequence_ = 0;
  Points field_;
  VecX sd_mm_, known_;
  std::map<std::pair<std::uint64_t, std::uint64_t>, Estimate> truth_;
};

// Of a message on its way: the client notices when it cannot read one, and nothing at all when one
// never comes.
enum class Fate { kArrives, kUnreadable, kUnnoticed };

Fate fate(Random& random) {
  const double drawn = random.uniform();
  if (drawn < 0.02) return Fate::kUnreadable;
  return drawn < 0.04 ? Fate::kUnnoticed : Fate::kArrives;
}

// One viewer of that surgery, and what the daemon knows of it.
class Watched {
 public:
  Watched(SelectionPtr selection, std::uint32_t window)
      : selection_(std::move(selection)), subscription_{1, window, 0, selection_->choice} {
    assembly_.begin(subscription_.choice);
    renew();
  }

  void publish(const UpdateMessage& message, const Bytes& whole, Parcels& parcels) {
    if (message.session_id != session_) {
      viewer_.owe_nothing();
      last_usable_.reset();
    }
    session_ = message.session_id;
    const bool shown = !message.error && message.update.usable();
    if (shown) {
      last_usable_ = whole;
      viewer_.owe_usable(whole);
    } else {
      viewer_.owe_failure(whole);
    }
    pay(parcels);
  }
  void renew() {
    if (viewer_.renew(subscription_, selection_) && last_usable_) viewer_.owe_usable(last_usable_);
  }
  void pay(Parcels& parcels) {
    while (const Bytes next = viewer_.next()) {
      parcels.begin_turn();
      const auto parcel = parcels.make(next, viewer_.selection(), viewer_.held());
      ASSERT_TRUE(parcel);
      under_way_.push_back(parcel->bytes);
      viewer_.sent(parcel->held);
    }
  }
  void restart() {  // its connection was lost with all that was under way
    under_way_.clear();
    ask_anew();
    renew();
  }
  void receive_one(const Surgery& surgery, Fate fate) {
    if (under_way_.empty()) return;
    UpdateMessage message = decoded(under_way_.front());
    under_way_.pop_front();
    ++subscription_.received;
    if (fate == Fate::kUnreadable) return ask_anew();
    if (fate == Fate::kUnnoticed) return;
    ++received_;
    changes_ += message.update.part && message.update.part->base_sequence != 0;
    const Outcome outcome = assembly_.complete(message);
    if (outcome == Outcome::kLost) ask_anew();
    if (outcome != Outcome::kWhole || message.error || !message.update.usable()) return;
    ++shown_;
    check(message, surgery.truth(message));
  }

  int received_ = 0, changes_ = 0, shown_ = 0;

 private:
  void ask_anew() {
    ++subscription_.id;
    subscription_.received = 0;
    assembly_.forget();
  }
  void check(const UpdateMessage& message, const Estimate& truth) const {
    const Estimate& held = message.update.estimate;
    std::vector<NodeIndex> nodes = selection_->nodes;
    if (message.update.part) {
      EXPECT_EQ(message.update.part->nodes, nodes);
      EXPECT_EQ(message.update.part->base_sequence, 0u);
    }
    ASSERT_EQ(held.displacement.cols(), static_cast<Eigen::Index>(nodes.size()));
    const bool sd = selection_->choice.with_sd && truth.sd_mm.size() > 0;
    ASSERT_EQ(held.sd_mm.size(), sd ? static_cast<Eigen::Index>(nodes.size()) : 0);
    const bool known = selection_->choice.with_sd && truth.known.size() > 0;
    ASSERT_EQ(held.known.size(), known ? static_cast<Eigen::Index>(nodes.size()) : 0);
    // Floats of some hundred mm are rounded to 2e-5 mm.
    const double within = selection_->choice.tolerance_mm + 1e-4;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      EXPECT_LE((held.displacement.col(column) - truth.displacement.col(nodes[i])).norm(), within);
      if (sd) {
        EXPECT_LE(std::abs(held.sd_mm[column] - truth.sd_mm[nodes[i]]), within);
      }
      if (known) {  // bytes are rounded by half a step
        EXPECT_LE(std::abs(held.known[column] - truth.known[nodes[i]]),
                  Parcels::kKnownTolerance + 0.5 / 255.0 + 1e-9);
      }
    }
  }

  SelectionPtr selection_;
  Subscription subscription_;
  Viewer viewer_;
  client::FieldAssembly assembly_;
  std::deque<Bytes> under_way_;
  Bytes last_usable_;
  std::uint64_t session_ = 0;
};

SelectionPtr random_selection(Random& random) {
  Selection selection;
  selection.mesh_nodes = kNodes;
  selection.choice.tolerance_mm = random.uniform() < 0.5 ? 0.1 : 0.4;
  selection.choice.with_sd = random.uniform() < 0.7;
  selection.nodes = random.choose(random.uniform() < 0.3 ? kNodes : 12, kNodes);
  std::sort(selection.nodes.begin(), selection.nodes.end());
  return std::make_shared<const Selection>(std::move(selection));
}

TEST(HeldField, IsWithinTheToleranceOfTheNewestUpdateReceivedWhateverHappens) {
  int shown = 0, changes = 0, received = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    Surgery surgery(random);
    Parcels parcels;
    const SelectionPtr shared = random_selection(random);
    std::vector<Watched> viewers;
    for (const std::uint32_t window : {1u, 1u, 4u}) viewers.emplace_back(shared, window);
    viewers.emplace_back(random_selection(random), 256u);
    for (int step = 0; step < 120; ++step) {
      const UpdateMessage message = surgery.next();
      const Bytes whole = frame_of(message);
      for (Watched& viewer : viewers) viewer.publish(message, whole, parcels);
      for (Watched& viewer : viewers) {
        if (random.uniform() < 0.02) viewer.restart();
        while (random.uniform() < 0.6) viewer.receive_one(surgery, fate(random));
        if (random.uniform() < 0.7) viewer.renew();
        viewer.pay(parcels);
      }
    }
    for (const Watched& viewer : viewers) {
      shown += viewer.shown_;
      changes += viewer.changes_;
      received += viewer.received_;
    }
  }
  EXPECT_GT(shown, 5000) << "otherwise little was tested";
  EXPECT_GT(changes, shown / 2) << "most travel as changes";
  EXPECT_GT(received, shown);
}

}  // namespace
}  // namespace brainshift::server
