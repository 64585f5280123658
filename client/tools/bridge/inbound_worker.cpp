// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/inbound_worker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace brainshift::client {
namespace {

constexpr double kFarthest_mm = 100.0;
// How often the end of a sweep is looked for.
constexpr std::chrono::milliseconds kLook{100};
// A bridge that has just begun reads the daemon's model first, and learns of the session then.
constexpr std::chrono::seconds kForTheModel{30};
constexpr std::chrono::milliseconds kForASession{2000};
constexpr std::size_t kSmallMessage = 1024;

std::size_t message_bytes(const igtl::Message& message) {
  if (const auto* image = std::get_if<igtl::Image>(&message.content)) {
    return std::visit([](const auto& voxels) { return voxels.size() * sizeof voxels[0]; },
                      image->voxels);
  }
  if (const auto* data = std::get_if<igtl::PolyData>(&message.content)) {
    return sizeof(float) * static_cast<std::size_t>(data->points.size()) +
           sizeof(std::uint32_t) * data->polygons.numbers.size();
  }
  return kSmallMessage;
}

std::int64_t nanoseconds(std::chrono::steady_clock::time_point time) {
  return std::chrono::nanoseconds(time.time_since_epoch()).count();
}

std::int64_t wall_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

Result<Observation> observation_of(const Found& found, const Followed& followed,
                                   std::uint64_t sequence) {
  if (const auto* boundary = std::get_if<TumourBoundary>(&found.body)) {
    const Vec3 centroid = boundary->points.rowwise().mean();
    const double away_mm = (centroid - followed.tumour_centroid).norm();
    if (!(away_mm <= kFarthest_mm)) {
      return invalid(
          fmt::format("{}: it lies {:.0f} mm from the tumour of case {}: must be within "
                      "{:.0f} mm; is it the right frame or registration?",
                      found.told, away_mm, followed.case_id, kFarthest_mm));
    }
  }
  Observation observation;
  observation.case_id = followed.case_id;
  observation.source = found.source;
  observation.sequence = sequence;
  observation.acquired_ns = nanoseconds(found.acquired);
  const std::int64_t now_ns = nanoseconds(std::chrono::steady_clock::now());
  observation.acquired_wall_ns = wall_ns() - (now_ns - observation.acquired_ns);
  observation.sent_ns = now_ns;
  observation.session = followed.session;
  observation.body = found.body;
  return observation;
}

InboundWorker::InboundWorker(Inbox inbox, std::string endpoint, std::optional<ClientKeys> keys,
                             std::function<void(const std::string&)> tell, std::string case_id)
    : inbox_(std::move(inbox)),
      endpoint_(std::move(endpoint)),
      keys_(std::move(keys)),
      tell_(std::move(tell)),
      pinned_case_(std::move(case_id)) {}

void InboundWorker::post(igtl::Message&& message) {
  if (!inbox_.uses(message)) return;
  const std::size_t bytes = message_bytes(message);
  const std::lock_guard lock(mutex_);
  while (!queue_.empty() && queued_bytes_ + bytes > kMaxQueuedBytes) {
    queued_bytes_ -= queue_.front().bytes;
    if (std::holds_alternative<igtl::Image>(queue_.front().message.content)) ++lost_images_;
    queue_.pop_front();
    ++dropped_;
  }
  queue_.push_back({std::move(message), std::chrono::steady_clock::now(), bytes});
  queued_bytes_ += bytes;
  news_.notify_one();
}

void InboundWorker::follow(const Followed& followed) {
  const std::lock_guard lock(mutex_);
  followed_ = followed;
  if (pinned_case_.empty()) pinned_case_ = followed.case_id;
  if (pinned_model_.empty() && followed.case_id == pinned_case_) {
    pinned_model_ = followed.session.model_id;
  }
  news_.notify_one();
}

void InboundWorker::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::deque<Item> items;
    std::uint64_t dropped = 0;
    int lost = 0;
    {
      std::unique_lock lock(mutex_);
      news_.wait_for(lock, stop, kLook, [&] { return !queue_.empty(); });
      items.swap(queue_);
      queued_bytes_ = 0;
      dropped = std::exchange(dropped_, 0);
      lost = std::exchange(lost_images_, 0);
    }
    if (dropped > 0)
      tell_(fmt::format("{} messages dropped: more came than could be used", dropped));
    inbox_.lose(lost);
    for (const Item& item : items) {
      if (stop.stop_requested()) return;
      deal_with(inbox_.take(item.message, item.arrived), stop);
    }
    deal_with(inbox_.tick(std::chrono::steady_clock::now()), stop);
  }
}

void InboundWorker::deal_with(const Taken& taken, const std::stop_token& stop) {
  for (const std::string& note : taken.notes) tell_(note);
  for (const Found& found : taken.found) {
    const Status status = submit(found, stop);
    tell_(found.told + (status ? ": accepted" : ": not accepted: " + status.error().message));
  }
}

std::uint64_t InboundWorker::next_sequence(const std::string& source) {
  const auto now = static_cast<std::uint64_t>(wall_ns() / 1'000'000);
  std::uint64_t& last = sequences_[source];
  last = std::max(last + 1, now);
  return last;
}

Status InboundWorker::submit(const Found& found, const std::stop_token& stop) {
  Followed followed;
  {
    std::unique_lock lock(mutex_);
    news_.wait_until(lock, stop, begun_ + kForTheModel, [&] { return !followed_.case_id.empty(); });
    news_.wait_for(lock, stop, kForASession, [&] { return followed_.session.session_id != 0; });
    followed = followed_;
    const bool ours =
        followed.case_id == pinned_case_ && followed.session.model_id == pinned_model_;
    if (followed.session.session_id != 0 && !ours) {
      return invalid(fmt::format(
          "the daemon serves case {} (model {}), what comes in is of case {} (model {}): start the "
          "bridge again for another patient or model",
          followed.case_id, followed.session.model_id, pinned_case_,
          pinned_model_.empty() ? "none yet" : pinned_model_));
    }
  }
  if (followed.session.session_id == 0) {
    return fail(ErrorCode::kUnavailable, "no session runs in " + endpoint_);
  }
  if (!client_) {
    auto client = Client::connect(endpoint_, {.keys = keys_});
    if (!client) return tl::unexpected(client.error());
    client_ = std::move(*client);
  }
  const auto observation = observation_of(found, followed, next_sequence(found.source));
  if (!observation) return tl::unexpected(observation.error());
  const auto receipt = client_->submit(*observation);
  if (!receipt) return tl::unexpected(receipt.error());
  return {};
}

}  // namespace brainshift::client
