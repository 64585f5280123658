// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/follower.hpp"

#include <cmath>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "common/core/stopwatch.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;

// How long a picture waits for the daemon to say how old its field is, and how often.
constexpr milliseconds kForItsAge{1};
constexpr int kAgeLooks = 3;
// A daemon that dies while a model is asked for must not keep the bridge from ending.
constexpr milliseconds kRequestTimeout{3000};

void rest_for(const std::stop_token& stop, milliseconds time) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
}

}  // namespace

Change change_of(const FieldStatus& status, std::uint64_t newest_usable, std::uint64_t shown,
                 Currency shown_currency) {
  switch (status.currency) {
    case Currency::kCurrent:
    case Currency::kAged: return newest_usable == shown ? Change::kNone : Change::kShow;
    // The newer one comes within milliseconds, or the field goes stale.
    case Currency::kSuperseded: return Change::kNone;
    case Currency::kNone:
    case Currency::kDegraded:
    case Currency::kStale:
    case Currency::kExpired: break;
  }
  const bool stands = shown == 0 && shown_currency == status.currency;
  return stands ? Change::kNone : Change::kBlank;
}

Follower::Follower(FollowerOptions options, FollowerCalls calls)
    : options_(std::move(options)), calls_(std::move(calls)) {}

Status Follower::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    Status status = follow(stop);
    if (stop.stop_requested()) break;
    if (!status) {
      const bool may_pass = status.error().code == ErrorCode::kUnavailable ||
                            status.error().code == ErrorCode::kModelNotReady;
      if (!began_ && !may_pass) return status;
      FieldStatus none{Currency::kStale, status.error().message, std::nan("")};
      if (!shown_ || !shown_->state.blank || shown_->state.reason != none.reason) {
        blank(none);
      } else {
        sign_of_life(none);
      }
      if (std::exchange(told_, none.reason) != none.reason) calls_.tell(none.reason);
    }
    rest_for(stop, kRetry);
  }
  return {};
}

Status Follower::follow(const std::stop_token& stop) {
  auto client = Client::connect(options_.endpoint,
                                {.request_timeout = kRequestTimeout, .keys = options_.keys});
  if (!client) return tl::unexpected(client.error());
  client_ = std::move(*client);
  if (auto ok = load_model(); !ok) return ok;
  if (auto ok = client_->subscribe(1, stream_->choice()); !ok) return ok;
  told_.clear();
  while (!stop.stop_requested()) {
    if (auto ok = look(); !ok) return ok;
    const auto& state = client_->session_state();
    const bool other_model =
        state && !state->session.model_id.empty() && state->session.model_id != model_id_;
    if (!other_model) continue;
    const FieldStatus status = client_->field_status();
    blank(status);
    calls_.tell(status.reason);
    return {};  // and begin anew
  }
  return {};
}

Status Follower::load_model() {
  const auto model = client_->model();
  if (!model) return tl::unexpected(model.error());
  if (stream_ && model->model_id == model_id_) return {};
  auto stream = FieldStream::build(*model, options_.stream);
  if (!stream) return tl::unexpected(stream.error());
  stream_ = std::move(*stream);
  model_id_ = model->model_id;
  case_id_ = model->case_id;
  tumour_centroid_ = model->tumour.num_vertices() > 0
                         ? Vec3(model->tumour.vertices.rowwise().mean())
                         : Vec3(model->mesh.nodes.rowwise().mean());
  began_ = true;
  const FieldGrid& grid = stream_->grid();
  calls_.tell("case " + case_id_ + ": grid of " + std::to_string(grid.dims[0]) + " x " +
              std::to_string(grid.dims[1]) + " x " + std::to_string(grid.dims[2]) + " voxels");
  // Clients learn the grid at once, and that nothing stands on it yet.
  blank({Currency::kNone, "no field of this model has come yet", std::nan("")});
  return {};
}

// What the newest final update was, for the reason of a blank picture.
void Follower::note(const UpdateMessage& message) {
  if (!message.update.final) return;
  const QualityVerdict& verdict = message.update.estimate.quality;
  newest_quality_ = message.error ? "none" : to_string(verdict.quality);
  newest_flags_ = message.error ? "" : flag_names(message.update);
  newest_reason_ = message.error ? message.error->message : verdict.reason;
}

// A newer field that is announced comes within milliseconds. When it does not, the one that stands
// is not current any more.
FieldStatus Follower::status_now() {
  FieldStatus status = client_->field_status();
  if (status.currency != Currency::kSuperseded) {
    superseded_since_.reset();
    return status;
  }
  if (!superseded_since_) superseded_since_ = Clock::now();
  if (Clock::now() - *superseded_since_ < kSignOfLife) return status;
  return {Currency::kStale, "a newer field was announced and has not come", status.age_s};
}

Status Follower::look() {
  const auto before = Clock::now();
  auto message = client_->next_update(kLook);
  if (!message) {
    if (message.error().code != ErrorCode::kUnavailable &&
        message.error().code != ErrorCode::kProtocol) {
      return tl::unexpected(message.error());
    }
    // A lost connection is reported at once; looking again at once would only burn time.
    const auto rest = kLook - (Clock::now() - before);
    if (rest > milliseconds(1)) {
      std::stop_token never;
      rest_for(never, std::chrono::duration_cast<milliseconds>(rest));
    }
  } else {
    note(*message);
  }
  tell_session();
  const FieldStatus status = status_now();
  const auto& usable = client_->latest_usable();
  const std::uint64_t newest = usable ? usable->update.sequence : 0;
  const bool same_session = usable && shown_ && shown_->state.session_id == usable->session_id;
  const std::uint64_t shown =
      shown_ && (shown_->state.blank || same_session) ? shown_->state.sequence : ~std::uint64_t{0};
  switch (change_of(status, newest, shown, shown_ ? shown_->state.currency : Currency::kNone)) {
    case Change::kShow: show_newest(); break;
    case Change::kBlank: blank(status); break;
    case Change::kNone: sign_of_life(status); break;
  }
  return {};
}

void Follower::show_newest() {
  // The age comes with the answer to the renewal that this wait sends.
  for (int i = 0; i < kAgeLooks && !std::isfinite(client_->field_status().age_s); ++i) {
    if (const auto newer = client_->next_update(kForItsAge)) note(*newer);
  }
  const FieldStatus status = client_->field_status();
  const bool aged = status.currency == Currency::kAged;
  if (!aged && status.currency != Currency::kCurrent && status.currency != Currency::kSuperseded) {
    return;
  }
  const Stopwatch watch;
  auto picture = stream_->picture(*client_->latest_usable());
  if (!picture) {
    blank({Currency::kNone, picture.error().message, std::nan("")});
    return;
  }
  ShownState& state = (*picture)->state;
  state.currency = aged ? Currency::kAged : Currency::kCurrent;
  if (aged) state.reason = status.reason;
  state.age_ms = 1e3 * status.age_s;
  describe_session(state);
  shown_ = *picture;
  said_ = Clock::now();
  said_currency_ = state.currency;
  calls_.show(shown_);
  calls_.shown(*shown_, *stream_, watch.milliseconds());
}

void Follower::describe_session(ShownState& state) const {
  if (!client_ || !client_->session_state()) return;
  const SessionState& said = *client_->session_state();
  state.session_id = said.session.session_id;
  state.recorded = said.recorded;
  state.method = said.method;
  state.boundary = said.boundary;
}

ShownState Follower::state_without_field(const FieldStatus& status) const {
  ShownState state;
  state.model_id = model_id_;
  state.case_id = case_id_;
  state.currency = status.currency;
  state.reason = status.reason;
  describe_session(state);
  if (stream_) {
    state.spacing_mm = stream_->grid().spacing_mm;
    state.fade_mm = stream_->fade_mm();
  }
  if (status.currency == Currency::kDegraded) {
    state.quality = newest_quality_;
    state.flags = newest_flags_;
    if (state.reason.empty()) state.reason = newest_reason_;
  }
  if (state.reason.empty()) state.reason = "no current field";
  return state;
}

void Follower::blank(const FieldStatus& status) {
  const bool stood = shown_ && !shown_->state.blank;
  shown_ = blank_picture(stream_ ? stream_->rest() : nullptr, state_without_field(status));
  said_ = Clock::now();
  said_currency_ = status.currency;
  calls_.show(shown_);
  if (stood) calls_.tell("blank: " + shown_->state.reason);
}

void Follower::sign_of_life(const FieldStatus& status) {
  if (!shown_ || status.currency == Currency::kSuperseded) return;
  if (Clock::now() - said_ < kSignOfLife && status.currency == said_currency_) return;
  said_ = Clock::now();
  said_currency_ = status.currency;
  auto state = std::make_shared<Picture>();
  if (shown_->state.blank) {
    state->state = state_without_field(status);  // a session may have begun
  } else {
    state->state = shown_->state;
    if (status.currency == Currency::kAged || shown_->state.currency == Currency::kAged) {
      state->state.currency = status.currency;
      state->state.reason = status.reason;
    }
    state->state.age_ms = 1e3 * status.age_s;
  }
  state->time = time_now();
  calls_.show_state(state);
}

void Follower::tell_session() {
  Followed now{case_id_, tumour_centroid_, {}};
  if (const auto& state = client_->session_state()) now.session = state->session;
  if (now == followed_) return;
  followed_ = now;
  calls_.followed(followed_);
}

}  // namespace brainshift::client
