// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/follower.hpp"

#include <gmock/gmock.h>

#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>

#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using wire::MessageType;

TEST(Follower, ShowsACurrentFieldOnceAndBlanksEverythingElseOnce) {
  const auto status = [](Currency currency) { return FieldStatus{currency, "why", 0.0}; };
  EXPECT_EQ(change_of(status(Currency::kCurrent), 5, 0, Currency::kNone), Change::kShow);
  EXPECT_EQ(change_of(status(Currency::kCurrent), 5, 4, Currency::kCurrent), Change::kShow);
  EXPECT_EQ(change_of(status(Currency::kCurrent), 5, 5, Currency::kCurrent), Change::kNone);
  EXPECT_EQ(change_of(status(Currency::kSuperseded), 5, 5, Currency::kCurrent), Change::kNone);
  EXPECT_EQ(change_of(status(Currency::kAged), 5, 5, Currency::kCurrent), Change::kNone);
  EXPECT_EQ(change_of(status(Currency::kAged), 5, 0, Currency::kNone), Change::kShow);
  for (const Currency bad :
       {Currency::kNone, Currency::kDegraded, Currency::kStale, Currency::kExpired}) {
    EXPECT_EQ(change_of(status(bad), 5, 5, Currency::kCurrent), Change::kBlank);
    EXPECT_EQ(change_of(status(bad), 5, 0, bad), Change::kNone) << "it is blank, for that reason";
    EXPECT_EQ(change_of(status(Currency::kCurrent), 5, 0, bad), Change::kShow) << "the same again";
  }
  EXPECT_EQ(change_of(status(Currency::kStale), 5, 0, Currency::kDegraded), Change::kBlank)
      << "another reason is told";
}

// A daemon of the toy patient. What it says of its session, and what it sends, can be changed while
// it runs.
class FollowedDaemon : public testing::Test {
 protected:
  void SetUp() override {
    model.model_id = "toy";
    state.session = {7, 1, "toy"};
    state.phase = SessionPhase::kTracking;
    state.newest_update = state.newest_usable = 1;
    state.age_ms = 250.0;
    state.valid_ms = 300;
    newest = update(1, Quality::kGood);
    daemon = std::make_unique<FakeDaemon>(
        [this](const wire::Frame& request) { return answer(request); });
    start();
  }
  void TearDown() override {
    thread = {};
    daemon->stop();
  }

  UpdateMessage update(std::uint64_t sequence, Quality quality) const {
    UpdateMessage message;
    message.session_id = 1;
    message.boot_id = 7;
    message.update.model_id = model.model_id;
    message.update.case_id = "toy";
    message.update.sequence = sequence;
    message.update.estimate.quality.quality = quality;
    // On the wire the quality is what its flags say.
    if (quality == Quality::kCaution) {
      message.update.estimate.quality.flags.set(QualityFlag::kDeadline);
      message.update.estimate.quality.reason = "the time ran out";
    }
    if (quality == Quality::kUnusable) {
      message.update.estimate.quality.flags.set(QualityFlag::kBeyondSkull);
      message.update.estimate.quality.reason = "a node lies beyond the skull";
    }
    message.update.estimate.displacement =
        Points::Constant(3, model.mesh.nodes.cols(), static_cast<double>(sequence));
    return message;
  }

  FakeDaemon::Answers answer(const wire::Frame& request) {
    const std::lock_guard lock(mutex);
    if (silent) return {};
    if (request.type == MessageType::kModelRequest) {
      return {
          wire::encode_frame(MessageType::kModelReply, request.request_id, wire::encode(model))};
    }
    if (request.type != MessageType::kSubscribeRequest) return {};
    FakeDaemon::Answers answers = {
        wire::encode_frame(MessageType::kSessionState, request.request_id, wire::encode(state))};
    // With every answer: one that is on its way to a client that goes cannot take it from the next.
    answers.push_back(wire::encode_frame(MessageType::kUpdate, 0, wire::encode(newest)));
    return answers;
  }

  void start() {
    FollowerOptions options;
    options.endpoint = daemon->endpoint();
    options.stream.spacing_mm = 5.0;
    FollowerCalls calls;
    calls.show = [this](PicturePtr picture) { note(std::move(picture), pictures); };
    calls.show_state = [this](PicturePtr picture) { note(std::move(picture), states); };
    calls.followed = [this](const Followed& followed) {
      const std::lock_guard lock(mutex);
      followed_ = followed;
    };
    calls.tell = [](const std::string&) {};
    calls.shown = [](const Picture&, const FieldStream&, double) {};
    follower = std::make_unique<Follower>(options, calls);
    thread = std::jthread([this](const std::stop_token& stop) {
      const Status status = follower->run(stop);
      EXPECT_TRUE(status) << status.error().message;
    });
  }

  void note(PicturePtr picture, std::vector<PicturePtr>& list) {
    const std::lock_guard lock(mutex);
    list.push_back(std::move(picture));
    news.notify_all();
  }
  // The first picture that fits, of those that came and come.
  template <typename Fits>
  PicturePtr wait_for(const std::vector<PicturePtr>& list, const Fits& fits) {
    std::unique_lock lock(mutex);
    PicturePtr found;
    EXPECT_TRUE(news.wait_for(lock, std::chrono::seconds(10), [&] {
      for (const PicturePtr& picture : list) {
        if (fits(*picture)) found = picture;
      }
      return found != nullptr;
    })) << "it never came";
    return found ? found : std::make_shared<Picture>();
  }
  PicturePtr shown(std::uint64_t sequence) {
    return wait_for(pictures, [&](const Picture& each) { return each.state.sequence == sequence; });
  }
  PicturePtr blank(Currency currency) {
    return wait_for(pictures, [&](const Picture& each) {
      return each.state.blank && each.state.currency == currency && each.rest != nullptr;
    });
  }
  template <typename Change>
  void change(const Change& what) {
    const std::lock_guard lock(mutex);
    what();
  }

  BrainModel model = test_support::toy_patient(5);
  std::mutex mutex;
  std::condition_variable news;
  bool silent = false;
  SessionState state;
  UpdateMessage newest;
  std::vector<PicturePtr> pictures, states;
  Followed followed_;
  std::unique_ptr<FakeDaemon> daemon;
  std::unique_ptr<Follower> follower;
  std::jthread thread;
};

TEST_F(FollowedDaemon, ShowsTheFieldWithItsAgeAndSession) {
  const PicturePtr picture = shown(1);
  EXPECT_EQ(picture->state.currency, Currency::kCurrent);
  EXPECT_EQ(picture->state.quality, "good");
  EXPECT_GE(picture->state.age_ms, 250.0);
  EXPECT_LT(picture->state.age_ms, 10000.0);
  EXPECT_TRUE(picture->state.usable());
  // A sign of life says how old the field is by then.
  change([&] { state.age_ms = 20000.0; });
  const PicturePtr sign =
      wait_for(states, [](const Picture& said) { return said.state.age_ms >= 20000.0; });
  ASSERT_TRUE(sign);
  EXPECT_EQ(sign->state.sequence, 1u);
  const std::lock_guard lock(mutex);
  EXPECT_EQ(followed_.case_id, "toy");
  EXPECT_EQ(followed_.session, (SessionKey{7, 1, "toy"}));
  EXPECT_LT((followed_.tumour_centroid - Vec3(30, 30, 40)).norm(), 0.5);
}

TEST_F(FollowedDaemon, BlanksWhenTheDaemonFallsSilentAndShowsAgainWhenItComesBack) {
  shown(1);
  change([&] { silent = true; });
  const auto before = std::chrono::steady_clock::now();
  const PicturePtr stale = blank(Currency::kStale);
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::milliseconds(300 + 700))
      << "within the lease and a look";
  EXPECT_THAT(stale->state.reason, HasSubstr("no word from"));
  EXPECT_EQ(stale->state.quality, "none");
  change([&] {
    silent = false;
    pictures.clear();
  });
  EXPECT_FALSE(shown(1)->state.blank);
}

TEST_F(FollowedDaemon, BlanksAtAnUnusableFieldSaysWhyAndShowsTheNextUsableOne) {
  shown(1);
  change([&] {
    state.newest_update = 2;
    state.phase = SessionPhase::kDegraded;
    state.reason = "a node lies beyond the skull";
    newest = update(2, Quality::kUnusable);
  });
  EXPECT_EQ(blank(Currency::kDegraded)->state.reason, "a node lies beyond the skull");
  change([&] {
    pictures.clear();
    state.newest_update = state.newest_usable = 3;
    state.phase = SessionPhase::kTracking;
    newest = update(3, Quality::kCaution);
  });
  EXPECT_EQ(shown(3)->state.quality, "caution");
}

TEST_F(FollowedDaemon, SaysThatAFieldIsAgedAndBlanksItWhenItHasExpired) {
  shown(1);
  change([&] {
    state.aged_after_ms = 30'000;
    state.expired_after_ms = 60'000;
    state.age_ms = 35'000.0;
  });
  const PicturePtr aged =
      wait_for(states, [](const Picture& said) { return said.state.currency == Currency::kAged; });
  EXPECT_THAT(aged->state.reason, HasSubstr("s old: 30 s at most"));
  EXPECT_FALSE(aged->state.usable());
  EXPECT_FALSE(aged->state.blank);
  change([&] { state.age_ms = 61'000.0; });
  EXPECT_THAT(blank(Currency::kExpired)->state.reason, HasSubstr("s old: 60 s at most"));
}

TEST_F(FollowedDaemon, ARecordingIsNeverUsableAndSaysWhatItIs) {
  change([&] {
    state.recorded = true;
    state.method = "condensed";
    state.boundary = "fixed";
    state.session.session_id = 2;
    newest.session_id = 2;
  });
  const PicturePtr picture = wait_for(pictures, [](const Picture& each) {
    return each.state.recorded && each.state.sequence == 1;
  });
  EXPECT_EQ(picture->state.boundary, "fixed");
  EXPECT_FALSE(picture->state.usable());
  EXPECT_THAT(to_status(picture->state).text, HasSubstr("RECORDED"));
}

TEST_F(FollowedDaemon, BlanksWhenTheSessionEnds) {
  shown(1);
  change([&] {
    pictures.clear();
    state.session.session_id = 2;
    state.newest_update = state.newest_usable = 0;
    state.phase = SessionPhase::kReady;
  });
  const PicturePtr none = blank(Currency::kNone);
  EXPECT_THAT(none->state.reason, HasSubstr("no usable field of the running session"));
  EXPECT_EQ(none->state.session_id, 2u);
}

TEST_F(FollowedDaemon, BlanksForAnotherModelAndLoadsIt) {
  shown(1);
  change([&] {
    pictures.clear();
    model = test_support::toy_patient(6);
    model.model_id = "other";
    state.session = {7, 2, "other"};
    newest = update(1, Quality::kGood);
    newest.session_id = 2;
  });
  blank(Currency::kNone);
  const PicturePtr field = shown(1);
  EXPECT_EQ(field->state.model_id, "other");
}

TEST(FollowerAlone, SaysThatThereIsNoDaemonAndEndsWhenToldTo) {
  std::promise<PicturePtr> first;
  bool told = false;
  FollowerCalls calls;
  calls.show = [&](PicturePtr picture) {
    if (!std::exchange(told, true)) first.set_value(std::move(picture));
  };
  calls.tell = [](const std::string&) {};
  Follower follower({.endpoint = "tcp://127.0.0.1:1"}, calls);
  std::jthread thread([&](const std::stop_token& stop) { EXPECT_TRUE(follower.run(stop)); });
  const PicturePtr picture = first.get_future().get();
  EXPECT_TRUE(picture->state.blank);
  EXPECT_EQ(picture->state.currency, Currency::kStale);
  EXPECT_EQ(picture->rest, nullptr);
  EXPECT_FALSE(picture->state.reason.empty());
}

TEST(FollowerAlone, EndsWithAnErrorWhenTheOptionsCanNeverBeMet) {
  FollowerCalls calls;
  calls.show = [](PicturePtr) {};
  calls.tell = [](const std::string&) {};
  Follower follower({.endpoint = "nonsense"}, calls);
  refusal_of(follower.run({}), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace brainshift::client
