// SPDX-License-Identifier: GPL-3.0-or-later
// A stand-in for PlusServer plays recorded sequences; the bridge's sockets and inbox make of them
// the points that `brainshift import` makes of the files.
//
// Needs the folder tracked_ultrasound_plus of BRAINSHIFT_EXTERNAL_DATA (PlusLibData, BSD-3);
// skipped without it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <future>
#include <mutex>
#include <sstream>
#include <thread>

#include "client/tools/bridge/hub.hpp"
#include "client/tools/bridge/inbox.hpp"
#include "client/tools/import/import_boundaries.hpp"
#include "common/io/config/plus_config.hpp"
#include "common/io/recording/contour_file.hpp"
#include "common/io/recording/sequence_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/igtl_peer.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::integration {
namespace {

namespace fs = std::filesystem;
using client::Inbox;
using test_support::IgtlListener;
using test_support::IgtlPeer;

// Where the tumour of config/cases/colin27-coarse.yaml is.
const Vec3 kTumour_mm(46.0, -47.0, 9.0);

struct Played {
  const char* recording;
  const char* device;
  const char* image_frame;
  // A half unit in the last place of a float, at the tracker's distance, in rotation and place of
  // two links: 4 * sqrt(3) * 6e-8 * distance.
  double tolerance_mm;
};

class PlusStandIn : public testing::TestWithParam<Played> {
 protected:
  void SetUp() override {
    const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
    if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
    folder = fs::path(data) / "tracked_ultrasound_plus";
    ASSERT_TRUE(fs::exists(folder / GetParam().recording)) << folder;
    recording = io::read_sequence(folder / GetParam().recording).value();
    options.device = folder / GetParam().device;
    options.image_frame = GetParam().image_frame;
    options.contours = files.write("contours.csv", contours());
    options.registration = files.write("registration.txt", registration());
  }

  // A quadrangle on every image, different on each.
  std::string contours() const {
    std::ostringstream text;
    text << "frame,u_px,v_px\n";
    for (int frame = 0; frame < recording.num_frames(); ++frame) {
      const double size = 30.0 + frame;
      for (const auto& [u, v] :
           {std::pair{0.0, 0.0}, {size, 3.0}, {size + 5.0, size}, {2.0, size}}) {
        text << frame << ',' << 40.25 + u << ',' << 50.5 + v << '\n';
      }
    }
    return text.str();
  }
  // Takes the points to the tumour, so that `brainshift import` accepts them.
  std::string registration() const {
    std::vector<tracking::ConstantLink> links;
    const auto config = io::read_plus_config(options.device).value();
    for (const io::PlusTransform& each : config.transforms) links.push_back(each.link);
    client::BoundaryOptions boundary;
    boundary.image_frame = options.image_frame;
    boundary.ras_frame = "Reference";
    const auto found = client::boundaries_in_ras(
        recording, links, io::read_contours(options.contours, true).value(), boundary);
    EXPECT_TRUE(found) << found.error().message;
    RigidTransform T = RigidTransform::Identity();
    T.linear() = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    T.translation() = kTumour_mm - T.linear() * found->sweeps[0].points.rowwise().mean();
    return test_support::matrix_text(T.matrix());
  }

  Points imported() const {
    const auto finished =
        run({brainshift(), "import", "--recording", (folder / GetParam().recording).string(),
             "--device", options.device.string(), "--image", options.image_frame, "--contours",
             options.contours.string(), "--registration", options.registration.string(), "--case",
             coarse_case(), "--out", files.path("sweep.surgery")});
    EXPECT_EQ(finished.exit_status, 0) << finished.err;
    const auto surgery = io::SurgeryFile::open(files.path("sweep.surgery"));
    const auto records = surgery->records(io::RecordKind::kObservation).value();
    EXPECT_EQ(records.size(), 1u);
    return std::get<TumourBoundary>(wire::decode_observation(records.front().payload)->body).points;
  }

  // As PlusServer sends: for every frame the image and then the transforms, all with the frame's
  // time; version 2 once the client has asked in version 2.
  void play(IgtlPeer& client) const {
    const auto greeting = client.receive();
    ASSERT_TRUE(greeting);
    ASSERT_EQ(greeting->header.version, 2);
    igtl::Envelope envelope;
    envelope.version = 2;
    const std::size_t bytes = static_cast<std::size_t>(recording.width * recording.height);
    ASSERT_EQ(recording.pixel_type, tracking::PixelType::kUint8);
    for (int frame = 0; frame < recording.num_frames(); ++frame) {
      const auto at = static_cast<std::size_t>(frame);
      envelope.timestamp =
          igtl::to_timestamp(std::chrono::nanoseconds(std::llround(1e9 * recording.time_s[at])));
      igtl::Image image;
      image.geometry.dims = image.part = {recording.width, recording.height, 1};
      const std::string_view pixels = recording.frame_bytes(frame);
      image.voxels =
          std::vector<std::uint8_t>(pixels.begin(), pixels.begin() + static_cast<long>(bytes));
      envelope.device = "Image_Reference";
      envelope.metadata.clear();
      client.send(envelope, image);
      for (const tracking::LinkSeries& series : recording.links) {
        const tracking::Link& link = series.samples[at];
        if (link.status == tracking::LinkStatus::kMissing) continue;
        envelope.device = series.frames.name();
        const bool ok = link.status == tracking::LinkStatus::kOk;
        envelope.metadata = {{"TransformStatus", ok ? "OK" : "INVALID"}};
        client.send(envelope, igtl::Transform{igtl::from_matrix(link.T_to_from.matrix())});
      }
    }
    envelope.device = "end";
    client.send(envelope, igtl::TrackingData{});
  }

  Points streamed() const {
    Inbox inbox = Inbox::open(options).value();
    IgtlListener plus;
    client::HubOptions hub_options;
    hub_options.listen = {"127.0.0.1", 0};
    hub_options.from = client::Address{"127.0.0.1", plus.port()};
    hub_options.from_upstream = inbox.from_upstream();
    std::promise<void> all;
    const auto hub = client::Hub::open(
        hub_options, [](const std::string&) {},
        [&](igtl::Message&& message) {
          const bool last = message.envelope.device == "end";
          const auto taken = inbox.take(message, Inbox::TimePoint{});
          EXPECT_TRUE(taken.found.empty());
          EXPECT_TRUE(taken.notes.empty()) << taken.notes.front();
          if (last) all.set_value();
        });
    const int stop = eventfd(0, EFD_CLOEXEC);
    std::thread served([&] { EXPECT_TRUE((*hub)->run(stop)); });
    {
      IgtlPeer client = plus.accept();
      play(client);
      EXPECT_EQ(all.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
    }
    const std::uint64_t one = 1;
    EXPECT_EQ(::write(stop, &one, sizeof one), 8);
    served.join();
    ::close(stop);
    const auto taken = inbox.tick(Inbox::TimePoint{} + std::chrono::seconds(3));
    EXPECT_EQ(taken.found.size(), 1u) << testing::PrintToString(taken.notes);
    if (taken.found.empty()) return Points(3, 0);
    return std::get<TumourBoundary>(taken.found[0].body).points;
  }

  Workspace files;
  fs::path folder;
  tracking::Recording recording;
  client::InboxOptions options;
};

TEST_P(PlusStandIn, YieldsThePointsOfImportToSinglePrecision) {
  if (IsSkipped()) return;
  const Points from_file = imported(), from_stream = streamed();
  ASSERT_EQ(from_stream.cols(), from_file.cols());
  EXPECT_GT(from_file.cols(), 1000);
  const double worst_mm = (from_stream - from_file).colwise().norm().maxCoeff();
  RecordProperty("worst_mm", std::to_string(worst_mm));
  EXPECT_LT(worst_mm, GetParam().tolerance_mm);
}

INSTANTIATE_TEST_SUITE_P(
    Recorded, PlusStandIn,
    testing::Values(Played{"SpinePhantomFreehand.igs.mha",
                           "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml", "Image",
                           2e-4},
                    Played{"NwirePhantomFreehandCropped.igs.mha",
                           "PlusDeviceSet_NwirePhantomFreehand_vtkVolumeReconstructorTest2.xml",
                           "CroppedImage", 8e-4}),
    [](const auto& played) { return std::string(played.param.recording).substr(0, 5); });

}  // namespace
}  // namespace brainshift::integration
