// SPDX-License-Identifier: GPL-3.0-or-later
// Follower: watches a daemon and says what the OpenIGTLink clients are to be shown.
//
// A field is shown while it is the newest usable one and the daemon has confirmed it within its
// lease (client/lib/field_status.hpp). A blank picture with the reason takes its place
//   - when the newest observation gave no usable field (degraded),
//   - when nothing is heard of the daemon any more (stale), by this computer's own clock,
//   - when its data are older than the daemon's second limit (expired),
//   - when the session has ended, another one runs, or the daemon serves another model.
// An aged field stays, with that word. The state goes out once a second besides, as a sign of
// life. It connects again by itself, and makes grid and surfaces anew for another model.
//
// Runs in a thread of its own; the callbacks are called there.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "client/lib/client.hpp"
#include "client/tools/bridge/field_stream.hpp"
#include "client/tools/bridge/picture.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

struct FollowerOptions {
  std::string endpoint = "tcp://127.0.0.1:5555";
  std::optional<ClientKeys> keys = std::nullopt;
  StreamOptions stream = {};
};

// What is shown is to be changed, if at all. Pure.
enum class Change { kNone, kShow, kBlank };
// status, newest_usable: as the client library says. shown: the number of the update that is shown,
// 0 for a blank picture; shown_currency: with what it was sent.
Change change_of(const FieldStatus& status, std::uint64_t newest_usable, std::uint64_t shown,
                 Currency shown_currency);

// What a session is known by, for who sends observations to it.
struct Followed {
  std::string case_id;
  Vec3 tumour_centroid = Vec3::Zero();
  SessionKey session;

  bool operator==(const Followed&) const = default;
};

struct FollowerCalls {
  std::function<void(PicturePtr)> show;        // a whole picture
  std::function<void(PicturePtr)> show_state;  // once a second, its state alone
  std::function<void(const Followed&)> followed;
  std::function<void(const std::string&)> tell;  // a sentence for people
  std::function<void(const Picture&, const FieldStream&, double made_ms)> shown;  // a field
};

class Follower {
 public:
  static constexpr std::chrono::milliseconds kLook{50};
  static constexpr std::chrono::milliseconds kRetry{500};
  static constexpr std::chrono::milliseconds kSignOfLife{1000};

  Follower(FollowerOptions options, FollowerCalls calls);

  // Until it is told to stop. An error: the options can never be met, e.g. a malformed endpoint, or
  // a region that holds no node of the first model.
  Status run(const std::stop_token& stop);

 private:
  using Clock = std::chrono::steady_clock;

  // From a connection to its end; an error says why there is none.
  Status follow(const std::stop_token& stop);
  Status load_model();
  Status look();
  void note(const UpdateMessage& message);
  FieldStatus status_now();
  void show_newest();
  void blank(const FieldStatus& status);
  void sign_of_life(const FieldStatus& status);
  void tell_session();
  void describe_session(ShownState& state) const;
  ShownState state_without_field(const FieldStatus& status) const;

  FollowerOptions options_;
  FollowerCalls calls_;
  std::optional<Client> client_;
  std::optional<FieldStream> stream_;
  std::string model_id_, case_id_;
  Vec3 tumour_centroid_ = Vec3::Zero();
  bool began_ = false;  // a model was loaded once
  std::string told_;    // why there is no connection, when it was told
  std::string newest_quality_ = "none";
  std::string newest_flags_;
  std::string newest_reason_;
  PicturePtr shown_;
  Clock::time_point said_{};
  Currency said_currency_ = Currency::kNone;
  std::optional<Clock::time_point> superseded_since_;
  Followed followed_;
};

}  // namespace brainshift::client
