// SPDX-License-Identifier: GPL-3.0-or-later
// Submitting to a daemon: tests/integration/test_bridge.py.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <future>
#include <random>
#include <set>
#include <thread>

#include "client/tools/bridge/inbound_worker.hpp"
#include "client/tools/bridge/inbox.hpp"
#include "common/geometry/surface.hpp"
#include "common/igtl/poly_data.hpp"
#include "tests/support/results.hpp"
#include "tests/support/study_record.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using test_support::VirtualSweep;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const Inbox::TimePoint kInboxBegin{std::chrono::hours(1)};

// The wall clock of these tests, since 1970: 5 s at kInboxBegin.
std::chrono::nanoseconds inbox_wall(Inbox::TimePoint at) {
  return at - kInboxBegin + std::chrono::seconds(5);
}

igtl::Message inbox_message(const std::string& device, igtl::Content content) {
  igtl::Message made;
  made.envelope.device = device;
  made.content = std::move(content);
  return made;
}

TriangleSurface ball() { return geometry::ellipsoid_surface(Vec3(1, 2, 3), Vec3(8, 7, 6), 3.0); }

igtl::PointList points(const std::vector<std::pair<std::string, Vec3>>& named) {
  igtl::PointList list;
  for (const auto& [name, at] : named) {
    igtl::NamedPoint point;
    point.name = name;
    point.position = at.cast<float>();
    list.points.push_back(point);
  }
  return list;
}

TEST(Inbox, ANamedModelIsTheTumoursBoundary) {
  Inbox inbox = Inbox::open({.tumour_device = "TumourNow", .sd_mm = 0.7}).value();
  EXPECT_THAT(inbox.take(inbox_message("Other", igtl::from_surface(ball())), kInboxBegin).found,
              IsEmpty());
  const Taken taken =
      inbox.take(inbox_message("TumourNow", igtl::from_surface(ball())), kInboxBegin);
  ASSERT_THAT(taken.found, SizeIs(1));
  EXPECT_THAT(taken.notes, IsEmpty());
  const auto& boundary = std::get<TumourBoundary>(taken.found[0].body);
  EXPECT_EQ(taken.found[0].source, "TumourNow");
  EXPECT_EQ(boundary.sd_mm, 0.7);
  EXPECT_TRUE(boundary.points.isApprox(ball().vertices, 1e-6));
  EXPECT_EQ(taken.found[0].acquired, kInboxBegin);
}

TEST(Inbox, ANamedModelIsTheCortexWithItsTriangles) {
  Inbox inbox = Inbox::open({.surface_device = "Cortex"}).value();
  const Taken taken = inbox.take(inbox_message("Cortex", igtl::from_surface(ball())), kInboxBegin);
  ASSERT_THAT(taken.found, SizeIs(1));
  const auto& cortex = std::get<CorticalSurface>(taken.found[0].body);
  EXPECT_EQ(cortex.surface.num_triangles(), ball().num_triangles());
  const Taken bare =
      inbox.take(inbox_message("Cortex", points({{"a", Vec3(1, 2, 3)}})), kInboxBegin);
  ASSERT_THAT(bare.found, SizeIs(1));
  EXPECT_EQ(std::get<CorticalSurface>(bare.found[0].body).surface.num_triangles(), 0);
}

TEST(Inbox, PointsAreTheTumoursBoundaryToo) {
  Inbox inbox = Inbox::open({.tumour_device = "F"}).value();
  const Taken taken = inbox.take(
      inbox_message("F", points({{"F-1", Vec3(1, 2, 3)}, {"F-2", Vec3(4, 5, 6)}})), kInboxBegin);
  ASSERT_THAT(taken.found, SizeIs(1));
  EXPECT_EQ(std::get<TumourBoundary>(taken.found[0].body).points.col(1), Vec3(4, 5, 6));
  EXPECT_THAT(inbox.take(inbox_message("F", igtl::PointList{}), kInboxBegin).notes,
              ElementsAre("F: it has no point"));
}

TEST(Inbox, LandmarksArePairedByName) {
  Inbox inbox = Inbox::open({.landmarks_before = "Before", .landmarks_after = "After"}).value();
  const auto after = inbox_message("After", points({{"b", Vec3(2, 2, 3)}, {"c", Vec3(9, 9, 9)}}));
  EXPECT_THAT(inbox.take(after, kInboxBegin).notes, Contains(HasSubstr("no point has the name")));
  inbox.take(inbox_message("Before", points({{"a", Vec3(0, 0, 0)}, {"b", Vec3(1, 2, 3)}})),
             kInboxBegin);
  const Taken taken = inbox.take(after, kInboxBegin);
  ASSERT_THAT(taken.found, SizeIs(1));
  const auto& pairs = std::get<LandmarkPairs>(taken.found[0].body);
  ASSERT_EQ(pairs.deformed.cols(), 1);
  EXPECT_EQ(pairs.undeformed.col(0), Vec3(1, 2, 3));
  EXPECT_EQ(pairs.deformed.col(0), Vec3(2, 2, 3));
}

TEST(Inbox, ModelsOfAnotherFrameFollowTheNewestTransforms) {
  const test_support::TemporaryFolder folder;
  const auto registration = folder.path() / "T.txt";
  std::ofstream(registration) << "1 0 0 100\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  Inbox inbox =
      Inbox::open({.tumour_device = "F", .model_frame = "Stylus", .registration = registration})
          .value();
  const auto touched = inbox_message("F", points({{"F-1", Vec3(1, 2, 3)}}));
  EXPECT_THAT(inbox.take(touched, kInboxBegin).notes, Contains(HasSubstr("Stylus")));
  igtl::Matrix34f matrix = igtl::Matrix34f::Identity();
  matrix(1, 3) = 10.0F;
  inbox.take(inbox_message("StylusToReference", igtl::Transform{matrix}), kInboxBegin);
  const Taken taken = inbox.take(touched, kInboxBegin);
  ASSERT_THAT(taken.found, SizeIs(1));
  EXPECT_EQ(std::get<TumourBoundary>(taken.found[0].body).points.col(0), Vec3(101, 12, 3));
  auto lost = inbox_message("StylusToReference", igtl::Transform{matrix});
  lost.envelope.metadata.push_back({"TransformStatus", "OUT_OF_VIEW"});
  inbox.take(lost, kInboxBegin);
  EXPECT_THAT(inbox.take(touched, kInboxBegin).found, IsEmpty())
      << "the pose is not known any more";
}

// A model that was made an hour ago, or that says so, is not the brain's now.
TEST(Inbox, WhatIsOldByItsOwnTimeIsRefusedOnceAndTheRestHasThatTime) {
  Inbox inbox = Inbox::open({.tumour_device = "T", .wall_at = inbox_wall}).value();
  auto model = inbox_message("T", points({{"a", Vec3(1, 2, 3)}}));
  const auto at = kInboxBegin + std::chrono::hours(1);
  model.envelope.timestamp = igtl::to_timestamp(std::chrono::seconds(5));
  EXPECT_THAT(inbox.take(model, at).notes,
              ElementsAre(HasSubstr("T: its time is 3600.0 s behind this computer's clock")));
  EXPECT_THAT(inbox.take(model, at).notes, IsEmpty()) << "told once";
  model.envelope.timestamp = igtl::to_timestamp(inbox_wall(at) + std::chrono::seconds(5));
  EXPECT_THAT(inbox.take(model, at).found, IsEmpty()) << "ahead";
  model.envelope.timestamp = igtl::to_timestamp(inbox_wall(at) - milliseconds(1500));
  const Taken taken = inbox.take(model, at);
  ASSERT_THAT(taken.found, SizeIs(1));
  EXPECT_EQ(taken.found[0].acquired, at - milliseconds(1500));
  Inbox relative =
      Inbox::open({.tumour_device = "T", .relative_times = true, .wall_at = inbox_wall}).value();
  model.envelope.timestamp = igtl::to_timestamp(std::chrono::seconds(5));
  EXPECT_THAT(relative.take(model, at).found, SizeIs(1)) << "a recording that is played";
}

TEST(Inbox, AModelFollowsNoPoseThatIsOlderThanAllowed) {
  const test_support::TemporaryFolder folder;
  const auto registration = folder.path() / "T.txt";
  std::ofstream(registration) << "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  Inbox inbox =
      Inbox::open({.tumour_device = "F", .model_frame = "Stylus", .registration = registration})
          .value();
  inbox.take(inbox_message("StylusToReference", igtl::Transform{igtl::Matrix34f::Identity()}),
             kInboxBegin);
  const auto touched = inbox_message("F", points({{"F-1", Vec3(1, 2, 3)}}));
  EXPECT_THAT(inbox.take(touched, kInboxBegin + milliseconds(900)).found, SizeIs(1));
  const Taken late = inbox.take(touched, kInboxBegin + milliseconds(1100));
  EXPECT_THAT(late.found, IsEmpty());
  EXPECT_THAT(late.notes, ElementsAre(HasSubstr("StylusToReference was seen 1.1 s before it")));
}

// PlusServer and Slicer cut names at 20 bytes.
TEST(Inbox, LongNamesAreKnownByTheirMetadataOrTheirBeginning) {
  const std::string name = "UltrasoundTumourBoundaryNow";
  Inbox inbox = Inbox::open({.tumour_device = name}).value();
  auto cut = inbox_message(name.substr(0, 20), points({{"a", Vec3(1, 2, 3)}}));
  EXPECT_THAT(inbox.take(cut, kInboxBegin).found, SizeIs(1)) << "version 1";
  cut.envelope.metadata = {{"IGTL_DEVICE_NAME", name}};
  EXPECT_THAT(inbox.take(cut, kInboxBegin).found, SizeIs(1));
  cut.envelope.metadata = {{"IGTL_DEVICE_NAME", "UltrasoundTumourBoundaryThen"}};
  EXPECT_THAT(inbox.take(cut, kInboxBegin).found, IsEmpty());
}

TEST(Inbox, KeepsNoMoreThanItUses) {
  const Inbox none = Inbox::open({}).value();
  EXPECT_FALSE(none.from_peers().is_wanted("POLYDATA"));
  EXPECT_FALSE(none.from_upstream().is_wanted("IMAGE"));
  EXPECT_TRUE(none.from_peers().is_wanted("GET_STATUS"));
  const Inbox models = Inbox::open({.tumour_device = "F"}).value();
  EXPECT_TRUE(models.from_peers().is_wanted("POLYDATA"));
  EXPECT_TRUE(models.from_upstream().is_wanted("POINT"));
  EXPECT_FALSE(models.from_upstream().is_wanted("IMAGE"));
  EXPECT_FALSE(models.from_peers().is_wanted("STRING"));
  EXPECT_FALSE(models.uses(inbox_message("Image", igtl::Image{})));
}

// A sweep over an ellipsoid at a known place, sent as PlusServer sends it.
class InboxSweep : public testing::Test {
 protected:
  void SetUp() override {
    options.device = folder.path() / "device.xml";
    std::ofstream(options.device) << sweep.device_text();
    options.registration = folder.path() / "T.txt";
    options.wall_at = inbox_wall;
    std::ofstream(options.registration)
        << test_support::matrix_text(sweep.T_ras_reference().matrix());
  }
  void write_contours() {
    options.contours = folder.path() / "contours.csv";
    std::ofstream stream(options.contours);
    stream.precision(12);
    stream << "time_s,u_px,v_px\n";
    for (int frame = 0; frame < sweep.frames; ++frame) {
      const auto contour = sweep.section(frame, 90);
      for (Eigen::Index i = 0; i < contour.points_px.cols(); ++i) {
        stream << time_s(frame) << ',' << contour.points_px(0, i) << ',' << contour.points_px(1, i)
               << '\n';
      }
    }
  }
  static double time_s(int frame) { return 5.0 + 0.1 * frame; }
  void write_seed() {
    options.seeds = folder.path() / "seeds.csv";
    const int middle = sweep.frames / 2;
    const Eigen::Vector2d centre = sweep.section(middle).points_px.rowwise().mean();
    std::ofstream(options.seeds) << "time_s,u_px,v_px\n"
                                 << time_s(middle) << ',' << centre[0] << ',' << centre[1] << '\n';
  }
  static igtl::Matrix34f matrix_of(const std::string& numbers) {
    Eigen::Matrix4d matrix;
    std::istringstream stream(numbers);
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) stream >> matrix(row, column);
    return matrix.topRows<3>().cast<float>();
  }
  // What goes wrong on the way, by frame.
  struct Stream {
    std::set<int> lost = {};      // the image does not come
    std::set<int> coloured = {};  // it has three components
    std::set<int> twice = {};     // it comes twice
    std::set<int> behind = {};    // it comes behind the next frame's transforms
    int end = 1 << 30;            // the sender stops in front of this frame
    milliseconds since{0};        // when its first frame comes, after kInboxBegin
  };
  // The messages of all frames; the last one's time.
  Inbox::TimePoint play(Inbox& inbox) { return play(inbox, Stream{}); }
  Inbox::TimePoint play(Inbox& inbox, const Stream& stream) {
    const auto content = sweep.content();
    const std::size_t bytes = static_cast<std::size_t>(sweep.width * sweep.height);
    Inbox::TimePoint now = kInboxBegin;
    std::vector<igtl::Message> late;
    for (std::size_t frame = 0; frame < content.frames.size(); ++frame) {
      const int number = static_cast<int>(frame);
      if (number >= stream.end) break;
      now = kInboxBegin + stream.since + milliseconds(100 * number);
      const auto time = igtl::to_timestamp(milliseconds(5000 + 100 * number));
      const auto send = [&](igtl::Message made) {
        if (made.envelope.timestamp == 0) made.envelope.timestamp = time;
        const Taken taken = inbox.take(made, now);
        EXPECT_THAT(taken.found, IsEmpty()) << "a sweep ends with a gap";
        EXPECT_THAT(taken.notes, IsEmpty());
      };
      igtl::Image image;
      image.geometry.dims = image.part = {sweep.width, sweep.height, 1};
      const auto* pixels =
          reinterpret_cast<const std::uint8_t*>(content.pixels.data()) + frame * bytes;
      image.voxels = std::vector<std::uint8_t>(pixels, pixels + bytes);
      if (stream.coloured.contains(number)) {
        image.components = 3;
        image.voxels = std::vector<std::uint8_t>(3 * bytes, 7);
      }
      std::vector<igtl::Message> images;
      if (!stream.lost.contains(number)) {
        images.assign(stream.twice.contains(number) ? 2 : 1,
                      inbox_message("Image_Reference", image));
      }
      if (stream.behind.contains(number)) {
        for (igtl::Message& made : images) made.envelope.timestamp = time;
        late.insert(late.end(), images.begin(), images.end());
        images.clear();
      }
      for (const igtl::Message& made : images) send(made);
      for (const auto& [name, value] : content.frames[frame]) {
        constexpr std::string_view kEnd = "Transform";
        if (!name.ends_with(kEnd)) continue;
        auto transform = inbox_message(name.substr(0, name.size() - kEnd.size()),
                                       igtl::Transform{matrix_of(value)});
        transform.envelope.metadata.push_back(
            {"TransformStatus", content.frames[frame].at(name + "Status")});
        send(transform);
      }
      if (stream.behind.contains(number)) continue;
      for (const igtl::Message& made : std::exchange(late, {})) send(made);
    }
    return now;
  }

  test_support::TemporaryFolder folder;
  VirtualSweep sweep;
  InboxOptions options;
};

TEST_F(InboxSweep, ContoursOfASweepAreTheBoundaryInRas) {
  write_contours();
  Inbox inbox = Inbox::open(options).value();
  const auto last = play(inbox);
  EXPECT_THAT(inbox.tick(last + milliseconds(1900)).found, IsEmpty());
  const Taken taken = inbox.tick(last + milliseconds(2100));
  ASSERT_THAT(taken.found, SizeIs(1)) << testing::PrintToString(taken.notes);
  EXPECT_EQ(taken.found[0].source, "ius");
  EXPECT_EQ(taken.found[0].acquired, last);
  EXPECT_THAT(taken.found[0].told, HasSubstr("sweep of 21 images"));
  const Points& boundary = std::get<TumourBoundary>(taken.found[0].body).points;
  EXPECT_GT(boundary.cols(), 1000);
  for (Eigen::Index i = 0; i < boundary.cols(); ++i) {
    EXPECT_LT(std::abs(sweep.distance_mm(boundary.col(i))), 0.02);
  }
  EXPECT_THAT(inbox.tick(last + milliseconds(9000)).found, IsEmpty()) << "once";
}

TEST_F(InboxSweep, TheNextSweepEndsTheOneBeforeAndCountsItsOwnImages) {
  write_contours();
  Inbox inbox = Inbox::open(options).value();
  play(inbox);
  const Taken taken = inbox.take(inbox_message("ProbeToTracker", igtl::Transform{}),
                                 kInboxBegin + std::chrono::seconds(60));
  EXPECT_THAT(taken.found, SizeIs(1));
}

// Images are skipped, in colour, twice or late; the bridge connects late; the sender stops and
// begins anew: no contour comes to lie on another image.
TEST_F(InboxSweep, In200RandomStreamsEveryContourIsOnItsOwnImage) {
  write_contours();
  constexpr std::uint32_t kStreams = 200;
  int wrong = 0, contours = 0;
  const auto look = [&](const Taken& taken) {
    for (const Found& found : taken.found) {
      const Points& boundary = std::get<TumourBoundary>(found.body).points;
      contours += static_cast<int>(boundary.cols()) / 90;
      for (Eigen::Index i = 0; i < boundary.cols(); ++i) {
        wrong += std::abs(sweep.distance_mm(boundary.col(i))) < 0.02 ? 0 : 1;
      }
    }
  };
  for (std::uint32_t seed = 0; seed < kStreams; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](int connected_at) {
      Stream stream;
      for (int frame = 0; frame < sweep.frames; ++frame) {
        if (frame < connected_at || random() % 5 == 0) stream.lost.insert(frame);
        if (random() % 8 == 0) stream.coloured.insert(frame);
        if (random() % 8 == 0) stream.twice.insert(frame);
        if (random() % 8 == 0) stream.behind.insert(frame);
      }
      return stream;
    };
    Inbox inbox = Inbox::open(options).value();
    Stream stream = draw(static_cast<int>(random() % 8));
    if (seed % 4 == 0) {
      stream.end = 8 + static_cast<int>(random() % 10);
      const auto stopped = play(inbox, stream);
      look(inbox.tick(stopped + milliseconds(2100)));
      stream = draw(0);
      stream.since =
          std::chrono::duration_cast<milliseconds>(stopped - kInboxBegin) + milliseconds(2500);
    }
    look(inbox.tick(play(inbox, stream) + milliseconds(2100)));
  }
  EXPECT_GT(contours, 8 * static_cast<int>(kStreams));
  EXPECT_TRUE(test_support::record_check("streams", "streams", kStreams, "= 200", true,
                                         "unit_tools_bridge --gtest_filter=InboxSweep.In200*"));
  test_support::record_figure("streams", "contours that were used", contours, "shown",
                              "unit_tools_bridge --gtest_filter=InboxSweep.In200*");
  EXPECT_TRUE(test_support::record_check("streams", "boundary points on another image", wrong,
                                         "= 0", wrong == 0,
                                         "unit_tools_bridge --gtest_filter=InboxSweep.In200*"));
}

TEST_F(InboxSweep, BehindAClockThatRanBackNothingIsUsedUpToAPause) {
  write_contours();
  Inbox inbox = Inbox::open(options).value();
  const auto early = [&](int ms) {
    igtl::Image image;
    image.geometry.dims = image.part = {3, 2, 1};
    image.voxels = std::vector<std::uint8_t>(6);
    auto made = inbox_message("Image_Reference", image);
    made.envelope.timestamp = igtl::to_timestamp(milliseconds(5500));
    return inbox.take(made, kInboxBegin + milliseconds(ms));
  };
  play(inbox);
  EXPECT_THAT(early(2100).notes, Contains(HasSubstr("21 left out: the clock ran backwards")));
  EXPECT_THAT(early(3000).notes, IsEmpty()) << "told once";
  const Taken pause = inbox.tick(kInboxBegin + milliseconds(5100));
  EXPECT_THAT(pause.found, IsEmpty());
  EXPECT_THAT(pause.notes, ElementsAre(HasSubstr("1 left out: image before the next pause")));
  const auto last = play(inbox);
  EXPECT_THAT(inbox.tick(last + milliseconds(2100)).found, SizeIs(1));
}

TEST_F(InboxSweep, ContoursOfImagesThatCannotBeToldApartAreLeftOut) {
  write_contours();
  Inbox inbox = Inbox::open(options).value();
  const auto last = play(inbox);
  auto other = inbox_message("ProbeToTracker", igtl::Transform{igtl::Matrix34f::Identity()});
  other.envelope.timestamp = igtl::to_timestamp(milliseconds(6500));
  inbox.take(other, last);
  const Taken taken = inbox.tick(last + milliseconds(2100));
  ASSERT_THAT(taken.found, SizeIs(1)) << testing::PrintToString(taken.notes);
  EXPECT_THAT(taken.notes,
              Contains(HasSubstr("contours left out: 1 because the image is invalid")));
}

TEST_F(InboxSweep, ASeedIsTraced) {
  sweep.speckle = 0.1;
  write_seed();
  Inbox inbox = Inbox::open(options).value();
  const auto last = play(inbox);
  const Taken taken = inbox.tick(last + milliseconds(2100));
  ASSERT_THAT(taken.found, SizeIs(1)) << testing::PrintToString(taken.notes);
  EXPECT_THAT(taken.notes, Contains(HasSubstr("bright lesion traced")));
  const Points& boundary = std::get<TumourBoundary>(taken.found[0].body).points;
  double sum = 0.0;
  for (Eigen::Index i = 0; i < boundary.cols(); ++i) {
    sum += std::abs(sweep.distance_mm(boundary.col(i)));
  }
  EXPECT_LT(sum / static_cast<double>(boundary.cols()), 0.5);
}

TEST_F(InboxSweep, ASweepThatGivesNothingSaysWhy) {
  write_contours();
  std::ofstream(options.contours) << "time_s,u_px,v_px\n999,1,1\n999,2,1\n999,2,2\n";
  Inbox inbox = Inbox::open(options).value();
  const auto last = play(inbox);
  const Taken taken = inbox.tick(last + milliseconds(2100));
  EXPECT_THAT(taken.found, IsEmpty());
  EXPECT_THAT(taken.notes, Contains(HasSubstr("none of 1 is of an image of this sweep")));
  std::ofstream(options.contours) << "frame,u_px,v_px\n9,1,1\n9,2,1\n9,2,2\n";
  play(inbox);
  EXPECT_THAT(inbox.tick(kInboxBegin + std::chrono::seconds(30)).notes,
              Contains(HasSubstr("frames cannot be counted in a live stream")));
  std::filesystem::remove(options.contours);
  play(inbox);
  EXPECT_THAT(inbox.tick(kInboxBegin + std::chrono::seconds(60)).notes,
              Contains(HasSubstr("contours.csv")));
}

Found boundary_at(const Vec3& centre) {
  Found found;
  found.source = "TumourNow";
  found.acquired = std::chrono::steady_clock::now() - std::chrono::milliseconds(40);
  found.told = "TumourNow: 3 boundary points";
  TumourBoundary boundary{Points(3, 3), 0.5};
  boundary.points << centre, centre + Vec3(1, 0, 0), centre - Vec3(1, 0, 0);
  found.body = boundary;
  return found;
}

const Followed kFollowed{"toy", Vec3(30, 30, 40), {7, 1, "model"}};

TEST(InboundWorker, AnObservationNamesCaseSessionSourceAndTimes) {
  const auto observation = observation_of(boundary_at(Vec3(31, 30, 40)), kFollowed, 12).value();
  EXPECT_EQ(observation.case_id, "toy");
  EXPECT_EQ(observation.session, kFollowed.session);
  EXPECT_EQ(observation.source, "TumourNow");
  EXPECT_EQ(observation.sequence, 12u);
  EXPECT_EQ(observation.frame, "ras");
  EXPECT_GE(observation.sent_ns - observation.acquired_ns, 40'000'000);
  EXPECT_GT(observation.acquired_wall_ns, 1'600'000'000'000'000'000) << "the wall clock";
}

TEST(InboundWorker, ABoundaryFarFromTheTumourIsRefused) {
  const auto far = observation_of(boundary_at(Vec3(-130, 30, 40)), kFollowed, 1);
  EXPECT_THAT(refusal_of(far, ErrorCode::kInvalidArgument),
              HasSubstr("160 mm from the tumour of case toy"));
  EXPECT_TRUE(observation_of(boundary_at(Vec3(-69, 30, 40)), kFollowed, 1));
}

// The daemon was started again with another patient.
TEST(InboundWorker, WhatComesInIsOfTheFirstCaseAlone) {
  for (const char* named : {"", "toy"}) {
    std::promise<std::string> told;
    InboundWorker worker(
        Inbox::open({.tumour_device = "F"}).value(), "tcp://127.0.0.1:1", {},
        [&](const std::string& line) { told.set_value(line); }, named);
    worker.follow(kFollowed);
    worker.follow({"other", Vec3(30, 30, 40), {8, 1, "other model"}});
    auto message = inbox_message("F", points({{"a", Vec3(30, 30, 40)}}));
    worker.post(std::move(message));
    const std::jthread thread([&](const std::stop_token& stop) { worker.run(stop); });
    EXPECT_THAT(told.get_future().get(),
                HasSubstr("not accepted: the daemon serves case other (model other model), what "
                          "comes in is of case toy (model model)"));
  }
}

TEST(InboundWorker, WithoutASessionItSaysSo) {
  std::promise<std::string> told;
  InboundWorker worker(Inbox::open({.tumour_device = "F"}).value(), "tcp://127.0.0.1:1", {},
                       [&](const std::string& line) { told.set_value(line); });
  igtl::Message message;
  message.envelope.device = "F";
  igtl::PointList list;
  list.points.resize(1);
  message.content = list;
  worker.post(std::move(message));
  const std::jthread thread([&](const std::stop_token& stop) { worker.run(stop); });
  auto line = told.get_future();
  EXPECT_EQ(line.wait_for(std::chrono::milliseconds(2500)), std::future_status::timeout)
      << "the model may still be read";
  worker.follow({"toy", Vec3(30, 30, 40), {}});
  EXPECT_THAT(line.get(), HasSubstr("not accepted: no session runs"));
}

}  // namespace
}  // namespace brainshift::client
