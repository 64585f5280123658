// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/made_up_daemon.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <utility>

#include "common/wire/convert.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift::bench {

SaggingHead::SaggingHead(std::shared_ptr<const BrainModel> model) : model_(std::move(model)) {
  const Vec3 tumour = model_->tumour.vertices.rowwise().mean();
  for (const auto& node : model_->mesh.nodes.colwise()) {
    fade_.push_back(std::exp(-0.5 * (node - tumour).squaredNorm() / (40.0 * 40.0)));
  }
}

server::Bytes SaggingHead::frame(std::uint64_t sequence) {
  UpdateMessage message;
  message.session_id = 1;
  message.boot_id = 7;
  Update& update = message.update;
  update.case_id = model_->case_id;
  update.model_id = model_->model_id;
  update.sequence = sequence;
  Estimate& estimate = update.estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.quality.quality = Quality::kGood;
  estimate.displacement.resize(3, model_->mesh.nodes.cols());
  estimate.sd_mm.resize(model_->mesh.nodes.cols());
  const double sag_mm = 0.05 * static_cast<double>((sequence - 1) % 200 + 1);
  for (std::size_t i = 0; i < fade_.size(); ++i) {
    const auto node = static_cast<Eigen::Index>(i);
    const Vec3 noise(random_.normal(), random_.normal(), random_.normal());
    estimate.displacement.col(node) =
        fade_[i] * (sag_mm * model_->gravity_direction + 0.02 * noise);
    estimate.sd_mm[node] = 0.3 + 0.5 * (1.0 - fade_[i]);
  }
  return std::make_shared<const std::string>(
      wire::encode_frame(wire::MessageType::kUpdate, 0, wire::encode(message)));
}

MadeUpDaemon::Handler::Handler(const std::shared_ptr<const BrainModel>& model)
    : selections_(model), model_(wire::encode(*model)), model_id_(model->model_id) {}

std::optional<server::Reply> MadeUpDaemon::Handler::handle(const std::string&,
                                                           const wire::Frame& frame) {
  if (frame.type == wire::MessageType::kModelRequest) {
    return server::Reply{wire::MessageType::kModelReply, model_};
  }
  const auto wanted = value_or_exit(wire::decode_subscription(frame.payload));
  SessionState state;
  state.session = {7, 1, model_id_};
  state.phase = SessionPhase::kTracking;
  state.newest_update = state.newest_usable = newest;
  state.valid_ms = 1000;
  return server::Reply{wire::MessageType::kSessionState, wire::encode(state), wanted, 1,
                       value_or_exit(selections_.resolve(wanted.choice))};
}

MadeUpDaemon::MadeUpDaemon(const std::shared_ptr<const BrainModel>& model)
    : router_(value_or_exit(server::Router::bind({}))),
      handler_(model),
      stop_fd_(eventfd(0, EFD_CLOEXEC)),
      thread_([this] { (void)router_.run(handler_, outbox_, stop_fd_); }) {}

MadeUpDaemon::~MadeUpDaemon() {
  const std::uint64_t one = 1;
  if (write(stop_fd_, &one, sizeof one) != sizeof one) std::exit(1);
  thread_.join();
  close(stop_fd_);
}

void MadeUpDaemon::publish(std::uint64_t sequence, const server::Bytes& frame) {
  handler_.newest = sequence;
  outbox_.post({server::Delivery::kFinal, {}, frame, 1});
}

}  // namespace brainshift::bench
