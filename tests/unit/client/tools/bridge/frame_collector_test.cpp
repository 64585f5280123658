// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/frame_collector.hpp"

#include <gmock/gmock.h>

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using tracking::LinkStatus;

const FrameCollector::TimePoint kBegin{std::chrono::hours(1)};

igtl::Message message(const std::string& device, std::int64_t time_ms, igtl::Content content) {
  igtl::Message made;
  made.envelope.device = device;
  made.envelope.timestamp = igtl::to_timestamp(milliseconds(time_ms));
  made.content = std::move(content);
  return made;
}
igtl::Message image(std::int64_t time_ms, std::uint8_t grey = 7, int width = 3, int height = 2) {
  igtl::Image made;
  made.geometry.dims = made.part = {width, height, 1};
  made.voxels = std::vector<std::uint8_t>(static_cast<std::size_t>(width * height), grey);
  return message("Image_Reference", time_ms, made);
}
igtl::Matrix34f moved(float x) {
  igtl::Matrix34f matrix = igtl::Matrix34f::Identity();
  matrix(0, 3) = x;
  return matrix;
}
igtl::Message transform(const std::string& name, std::int64_t time_ms, float x,
                        const char* status = nullptr) {
  auto made = message(name, time_ms, igtl::Transform{moved(x)});
  if (status != nullptr) made.envelope.metadata.push_back({"TransformStatus", status});
  return made;
}
const tracking::LinkSeries& link(const tracking::Recording& recording, const std::string& name) {
  for (const auto& series : recording.links) {
    if (series.frames.name() == name) return series;
  }
  throw std::runtime_error("no link " + name);
}

TEST(FrameCollector, MessagesOfOneTimeAreOneFrameWhateverTheirOrder) {
  FrameCollector collector({.keep_pixels = true});
  collector.take(image(1000, 1), kBegin);
  collector.take(transform("ProbeToTracker", 1000, 1.0F, "OK"), kBegin);
  collector.take(transform("ProbeToTracker", 1100, 2.0F, "OK"), kBegin + milliseconds(100));
  collector.take(transform("ReferenceToTracker", 1100, 5.0F, "OK"), kBegin + milliseconds(100));
  collector.take(image(1100, 2), kBegin + milliseconds(101));
  EXPECT_EQ(collector.images(), 2);
  const CollectedSweep sweep = collector.finish();
  EXPECT_EQ(sweep.moments.num_frames(), 2);
  EXPECT_EQ(sweep.moment_of_image, (std::vector<int>{0, 1}));
  EXPECT_NEAR(sweep.moments.time_s[1], 0.1, 1e-9);
  const auto& probe = link(sweep.moments, "ProbeToTracker");
  EXPECT_EQ(probe.samples[0].T_to_from.translation()[0], 1.0);
  EXPECT_EQ(probe.samples[1].T_to_from.translation()[0], 2.0);
  EXPECT_EQ(link(sweep.moments, "ReferenceToTracker").samples[0].status, LinkStatus::kMissing);
  EXPECT_EQ(sweep.images.num_frames(), 2);
  EXPECT_EQ(sweep.images.frame_bytes(1), std::string(6, '\2'));
  EXPECT_EQ(sweep.images.width, 3);
  EXPECT_EQ(sweep.images.height, 2);
  EXPECT_EQ(sweep.last_image, kBegin + milliseconds(101));
  EXPECT_TRUE(sweep.notes.empty());
  EXPECT_EQ(collector.images(), 0) << "the next sweep has begun";
}

TEST(FrameCollector, TransformsBetweenImagesAreMomentsWithoutAnImage) {
  FrameCollector collector({});
  for (int ms = 0; ms <= 100; ms += 10) {
    collector.take(transform("ProbeToTracker", 1000 + ms, static_cast<float>(ms)), kBegin);
  }
  collector.take(image(1045), kBegin);
  const CollectedSweep sweep = collector.finish();
  EXPECT_EQ(sweep.moments.num_frames(), 12);
  EXPECT_EQ(sweep.moment_of_image, (std::vector<int>{5}));
  EXPECT_EQ(sweep.moments.image_ok[5], 1);
  EXPECT_EQ(sweep.moments.image_ok[4], 0);
  EXPECT_EQ(sweep.images.num_frames(), 1);
  EXPECT_TRUE(sweep.images.pixels.empty()) << "nobody wanted them";
}

TEST(FrameCollector, ValidityIsWhatTheMetadataSaysAndWithoutThemTheSendersWord) {
  FrameCollector collector({});
  collector.take(image(1000), kBegin);
  collector.take(transform("AToB", 1000, 1.0F), kBegin);
  collector.take(transform("BToC", 1000, 1.0F, "OK"), kBegin);
  collector.take(transform("CToD", 1000, 1.0F, "OUT_OF_VIEW"), kBegin);
  igtl::TrackingData tools;
  tools.tools = {{"Probe", igtl::ToolType::k6d, moved(4.0F)},
                 {"StylusToTracker", igtl::ToolType::k6d, moved(5.0F)}};
  auto tdata = message("Tools", 1000, tools);
  tdata.envelope.metadata = {{"ProbeStatus", "OK"}, {"StylusToTrackerStatus", "INVALID"}};
  collector.take(tdata, kBegin);
  auto cut = transform("UltrasoundProbeToTra", 1000, 6.0F, "OK");
  cut.envelope.metadata.push_back({"IGTL_DEVICE_NAME", "UltrasoundProbeToTracker"});
  collector.take(cut, kBegin);
  const CollectedSweep sweep = collector.finish();
  EXPECT_EQ(link(sweep.moments, "AToB").samples[0].status, LinkStatus::kOk);
  EXPECT_EQ(link(sweep.moments, "BToC").samples[0].status, LinkStatus::kOk);
  EXPECT_EQ(link(sweep.moments, "CToD").samples[0].status, LinkStatus::kInvalid);
  EXPECT_EQ(link(sweep.moments, "ProbeToTracker").samples[0].T_to_from.translation()[0], 4.0);
  EXPECT_EQ(link(sweep.moments, "StylusToTracker").samples[0].status, LinkStatus::kInvalid);
  EXPECT_EQ(link(sweep.moments, "UltrasoundProbeToTracker").samples[0].status, LinkStatus::kOk);
  EXPECT_EQ(sweep.image_ns, std::vector<std::int64_t>{1'000'000'000});
  EXPECT_FALSE(sweep.untimed);
}

TEST(FrameCollector, AMatrixThatIsNoMotionIsInvalidWhateverItsStatus) {
  FrameCollector collector({});
  collector.take(image(1000), kBegin);
  auto scaled = transform("ProbeToTracker", 1000, 1.0F, "OK");
  std::get<igtl::Transform>(scaled.content).matrix(0, 0) = 2.0F;
  collector.take(scaled, kBegin);
  auto pixels = transform("ImageToProbe", 1000, 1.0F, "OK");
  std::get<igtl::Transform>(pixels.content).matrix(0, 0) = 0.2F;
  collector.take(pixels, kBegin);
  const CollectedSweep sweep = collector.finish();
  EXPECT_EQ(link(sweep.moments, "ProbeToTracker").samples[0].status, LinkStatus::kInvalid);
  EXPECT_EQ(sweep.moments.defects.size(), 1u);
  EXPECT_EQ(link(sweep.moments, "ImageToProbe").samples[0].status, LinkStatus::kOk)
      << "pixels scale";
}

TEST(FrameCollector, LeavesOutWhatNoRecordingHoldsAndCountsIt) {
  FrameCollector collector({.image_device = "Image_Reference"});
  collector.take(image(1000), kBegin);
  collector.take(image(1100, 7, 4, 2), kBegin);
  collector.take(image(1000, 8), kBegin);
  auto colour = image(1200);
  std::get<igtl::Image>(colour.content).components = 3;
  collector.take(colour, kBegin);
  auto other = image(1300);
  other.envelope.device = "Endoscope";
  collector.take(other, kBegin);
  collector.take(transform("Nonsense name", 1000, 1.0F), kBegin);
  EXPECT_EQ(collector.images(), 1);
  const CollectedSweep sweep = collector.finish();
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("1 left out: image of another size")));
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("1 left out: a second image at the same time")));
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("1 left out: image that is not one slice")));
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("transform Nonsense name")));
  EXPECT_EQ(sweep.notes.size(), 4u);
}

TEST(FrameCollector, HoldsNoMoreThanItMay) {
  FrameCollector collector({.keep_pixels = true, .max_images = 3});
  for (int i = 0; i < 5; ++i) collector.take(image(1000 + 100 * i), kBegin);
  EXPECT_TRUE(collector.full());
  EXPECT_EQ(collector.images(), 3);
  collector.finish();
  EXPECT_FALSE(collector.full());
  // Hours of transforms without an image.
  for (int i = 0; i < 20000; ++i) {
    collector.take(transform("ProbeToTracker", 10000 + 20 * i, 0.0F), kBegin);
  }
  collector.take(image(10000 + 20 * 20000), kBegin);
  EXPECT_LT(collector.finish().moments.num_frames(), 200);
}

TEST(FrameCollector, ImagesAndPosesOfOneTimeCannotBeToldApart) {
  FrameCollector collector({.keep_pixels = true});
  for (int i = 0; i < 6; ++i) {
    // Two frames each at 1000 (other poses), 1100 (other images) and 1200 (sent twice).
    const int time = 1000 + 100 * (i / 2);
    collector.take(transform("ProbeToTracker", time, i == 1 ? 9.0F : 0.0F, "OK"), kBegin);
    collector.take(image(time, i == 3 ? 9 : 7), kBegin);
  }
  const CollectedSweep sweep = collector.finish();
  EXPECT_EQ(sweep.moments.image_ok, (std::vector<char>{0, 0, 1}));
  EXPECT_EQ(sweep.images.image_ok, (std::vector<char>{0, 0, 1}));
  EXPECT_EQ(sweep.image_ns.size(), 3u) << "no contour goes to a neighbour";
  const auto& probe = link(sweep.moments, "ProbeToTracker").samples;
  EXPECT_EQ(probe[0].status, LinkStatus::kInvalid);
  EXPECT_EQ(probe[1].status, LinkStatus::kOk);
  EXPECT_EQ(probe[2].status, LinkStatus::kOk);
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("1 left out: another pose ProbeToTracker")));
  EXPECT_THAT(sweep.notes, Contains(HasSubstr("1 left out: a second image")));
}

TEST(FrameCollector, APoseThatIsValidAndInvalidAtOneTimeIsInvalid) {
  for (const char* first : {"OK", "MISSING"}) {
    FrameCollector collector({});
    collector.take(image(1000), kBegin);
    collector.take(transform("ProbeToTracker", 1000, 1.0F, first), kBegin);
    collector.take(transform("ProbeToTracker", 1000, 1.0F, *first == 'O' ? "MISSING" : "OK"),
                   kBegin);
    const CollectedSweep sweep = collector.finish();
    EXPECT_EQ(link(sweep.moments, "ProbeToTracker").samples[0].status, LinkStatus::kInvalid);
    EXPECT_EQ(sweep.images.image_ok, std::vector<char>{0});
  }
}

TEST(FrameCollector, WhenTheClockRunsBackNothingCountsUpToAPause) {
  FrameCollector collector({});
  collector.take(transform("ProbeToTracker", 900000, 1.0F), kBegin);
  collector.take(image(100000), kBegin);
  EXPECT_FALSE(collector.waits_for_a_pause()) << "no image came before";
  collector.take(image(1000), kBegin + milliseconds(10));
  EXPECT_TRUE(collector.waits_for_a_pause());
  EXPECT_THAT(collector.finish(false).notes,
              ElementsAre("1 left out: image before the next pause",
                          "1 left out: the clock ran backwards: images before it",
                          HasSubstr("what comes until a pause is left out")));
  collector.take(transform("ProbeToTracker", 1100, 1.0F), kBegin);
  collector.take(image(1100), kBegin + milliseconds(20));
  EXPECT_EQ(collector.images(), 0);
  EXPECT_EQ(collector.last_image(), kBegin + milliseconds(20)) << "by which a pause is known";
  EXPECT_THAT(collector.finish().notes, ElementsAre("1 left out: image before the next pause"));
  collector.take(image(1200), kBegin);
  EXPECT_EQ(collector.finish().images.num_frames(), 1);
}

TEST(FrameCollector, ImagesThatGotLostAreCounted) {
  FrameCollector collector({});
  collector.lose(0);
  collector.take(image(1000), kBegin);
  collector.lose(3);
  EXPECT_THAT(collector.finish().notes,
              ElementsAre("3 left out: image that came faster than it could be used"));
}

TEST(FrameCollector, TheDeviceIsKnownByItsWholeNameOrItsBeginning) {
  FrameCollector collector({.image_device = "UltrasoundImage_Reference"});
  auto cut = image(1000);
  cut.envelope.device = "UltrasoundImage_Refe";
  collector.take(cut, kBegin);
  EXPECT_EQ(collector.images(), 1);
}

TEST(FrameCollector, WithoutATimestampTheTimeOfArrivalCounts) {
  FrameCollector collector({});
  auto first = image(0), second = image(0);
  collector.take(first, kBegin);
  collector.take(second, kBegin + milliseconds(40));
  const CollectedSweep sweep = collector.finish();
  ASSERT_EQ(sweep.images.num_frames(), 2);
  EXPECT_NEAR(sweep.images.time_s[1], 0.04, 1e-9);
}

}  // namespace
}  // namespace brainshift::client
