// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift bridge` between the real daemon and OpenIGTLink clients on the loopback interface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "common/igtl/surface.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/igtl_peer.hpp"

namespace brainshift::integration {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using test_support::IgtlPeer;
using test_support::Received;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

constexpr std::string_view kBridgeListening = "listening on ";
constexpr milliseconds kLong{60000};

std::string after(const std::string& line, std::string_view start) {
  EXPECT_THAT(line, StartsWith(std::string(start)));
  return line.substr(std::min(start.size(), line.size()));
}

const std::vector<float>& voxels_of(const Received& image) {
  return std::get<std::vector<float>>(std::get<igtl::Image>(image.message.content).voxels);
}
bool is_zero(const Received& image) {
  const auto& voxels = voxels_of(image);
  return std::all_of(voxels.begin(), voxels.end(), [](float value) { return value == 0.0F; });
}
// The next volume of displacements that is not blank.
std::optional<Received> next_field(IgtlPeer& viewer) {
  while (auto image = viewer.receive_from("brainshift_u", kLong)) {
    if (!is_zero(*image)) return image;
  }
  return std::nullopt;
}
std::string metadata(const Received& received, std::string_view key) {
  const std::string* value = igtl::find(received.message.envelope.metadata, key);
  return value == nullptr ? "(none)" : *value;
}

// Trilinear, from the message alone.
Vec3 shown_at(const igtl::Image& image, const Vec3& x) {
  const Vec3 place = image.geometry.T_ras_voxel().inverse() * x;
  const auto& voxels = std::get<std::vector<float>>(image.voxels);
  const auto& dims = image.geometry.dims;
  Vec3 sum = Vec3::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::size_t index = 0, stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = std::floor(place[axis]);
      const bool high = ((corner >> axis) & 1) != 0;
      weight *= high ? place[axis] - low : low + 1.0 - place[axis];
      index += stride * static_cast<std::size_t>(low + (high ? 1.0 : 0.0));
      stride *= static_cast<std::size_t>(dims[static_cast<std::size_t>(axis)]);
    }
    sum += weight * Vec3(voxels[3 * index], voxels[3 * index + 1], voxels[3 * index + 2]);
  }
  return sum;
}

class BridgeBesideADaemon : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(head_is_installed()) << "Debian's mricron-data is not installed";
    const auto prepared =
        run({brainshiftd(), "prepare", "--case", coarse_case(), "--out", files.path("model.h5")});
    ASSERT_EQ(prepared.exit_status, 0) << prepared.err;
    const auto simulated = run({brainshift(), "simulate", "--case", coarse_case(), "--scenario",
                                "paper", "--seed", "1", "--out", files.path("paper.surgery")});
    ASSERT_EQ(simulated.exit_status, 0) << simulated.err;
    daemon = std::make_unique<Background>(
        std::vector<std::string>{brainshiftd(), "serve", "--config",
                                 files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n"),
                                 "--model", files.path("model.h5")},
        files.path("daemon.log"));
    endpoint = after(daemon->first_line(), kBridgeListening);
    console.emplace(client::Client::connect(endpoint).value());
    ASSERT_TRUE(console->start_session({.case_id = "colin27-coarse"}));
    model = console->model().value();
    ASSERT_TRUE(console->subscribe(16));
    const auto surgery = io::SurgeryFile::open(files.path("paper.surgery"));
    const auto records = surgery->records(io::RecordKind::kObservation).value();
    observation = wire::decode_observation(records.front().payload).value();
  }

  void bridge_with(std::vector<std::string> more = {}) {
    std::vector<std::string> command = {brainshift(), "bridge",   "--endpoint",
                                        endpoint,     "--listen", "127.0.0.1:0"};
    command.insert(command.end(), more.begin(), more.end());
    bridge = std::make_unique<Background>(command, files.path("bridge.log"));
    const std::string address = after(bridge->first_line(), kBridgeListening);
    port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  }
  IgtlPeer viewer(int receive_buffer = 0) { return IgtlPeer::connect(port, receive_buffer); }
  // A client of version 2, as 3D Slicer is.
  IgtlPeer slicer(int receive_buffer = 0) {
    IgtlPeer peer = viewer(receive_buffer);
    igtl::Envelope envelope;
    envelope.version = 2;
    peer.send(envelope, igtl::StatusRequest{});
    return peer;
  }

  // The update that answers the recorded observation, sent once more.
  Update submit() {
    ++observation.sequence;
    observation.acquired_ns += 1'000'000;
    observation.session = {};
    const auto receipt = console->submit(observation);
    EXPECT_TRUE(receipt) << receipt.error().message;
    return next_final();
  }
  Update next_final() {
    while (true) {
      const auto message = console->next_update(kLong);
      if (!message) {
        ADD_FAILURE() << message.error().message;
        return {};
      }
      EXPECT_FALSE(message->error);
      if (message->update.final) return message->update;
    }
  }

  Workspace files;
  std::unique_ptr<Background> daemon, bridge;
  std::string endpoint;
  std::uint16_t port = 0;
  std::optional<client::Client> console;
  BrainModel model;
  Observation observation;
};

TEST_F(BridgeBesideADaemon, NodesLandWhereTheDaemonSaysWithinTheStatedError) {
  bridge_with();
  IgtlPeer peer = slicer();
  const Update update = submit();
  const auto image = next_field(peer);
  ASSERT_TRUE(image);
  EXPECT_EQ(metadata(*image, "sequence"), std::to_string(update.sequence));
  EXPECT_EQ(metadata(*image, "model_id"), model.model_id);
  EXPECT_EQ(metadata(*image, "currency"), "current");
  EXPECT_EQ(metadata(*image, "direction"), "modeling");
  const double error_mm = std::stod(metadata(*image, "grid_error_mm"));
  EXPECT_GT(error_mm, 0.0);
  EXPECT_LT(error_mm, 1.0);
  const auto& volume = std::get<igtl::Image>(image->message.content);
  // Exact from here inwards.
  const double inner_mm =
      std::stod(metadata(*image, "fade_mm")) + 2.0 * std::stod(metadata(*image, "spacing_mm"));
  const AffineTransform T = volume.geometry.T_ras_voxel();
  const Vec3 low = T * Vec3::Zero() + Vec3::Constant(inner_mm);
  const Vec3 high = T * Vec3(volume.geometry.dims[0] - 1, volume.geometry.dims[1] - 1,
                             volume.geometry.dims[2] - 1) -
                    Vec3::Constant(inner_mm);
  int inside = 0;
  double moved_mm = 0.0;
  for (NodeIndex node = 0; node < model.mesh.num_nodes(); ++node) {
    const Vec3 x = model.mesh.nodes.col(node);
    if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) continue;
    const Vec3 u = update.estimate.displacement.col(node);
    EXPECT_LT((x + shown_at(volume, x) - (x + u)).norm(), error_mm + 1e-4);
    moved_mm = std::max(moved_mm, u.norm());
    ++inside;
  }
  EXPECT_GT(inside, 100);
  EXPECT_GT(moved_mm, 3.0) << "otherwise zeros would do";

  const auto sd = peer.receive_from("brainshift_sd");
  ASSERT_TRUE(sd);
  EXPECT_GT(*std::max_element(voxels_of(*sd).begin(), voxels_of(*sd).end()), 0.1F);
  const auto tumour = peer.receive_from("brainshift_tumour");
  ASSERT_TRUE(tumour);
  const auto& surface = std::get<igtl::PolyData>(tumour->message.content);
  EXPECT_EQ(surface.points.cols(), model.tumour.vertices.cols());
  EXPECT_GT((surface.points - model.tumour.vertices.cast<float>()).colwise().norm().maxCoeff(),
            1.0F);
}

TEST_F(BridgeBesideADaemon, AClientOfVersionOneNeverReceivesVersionTwo) {
  bridge_with({"--json"});
  IgtlPeer old = viewer();
  IgtlPeer modern = slicer();
  submit();
  igtl::Envelope envelope;
  old.send(envelope, igtl::StatusRequest{});
  ASSERT_TRUE(next_field(modern));
  submit();
  bool field = false;
  while (const auto received = old.receive(milliseconds(3000))) {
    EXPECT_EQ(received->header.version, 1) << received->header.type;
    field = field || (received->header.device == "brainshift_u" && !is_zero(*received));
    if (received->header.device == "brainshift_cortex" && field) break;
  }
  EXPECT_TRUE(field);
}

TEST_F(BridgeBesideADaemon, GoesBlankWithinTheLeaseWhenTheDaemonIsKilled) {
  bridge_with();
  IgtlPeer peer = slicer();
  submit();
  ASSERT_TRUE(next_field(peer));
  ASSERT_TRUE(peer.receive_from("brainshift_cortex"));
  daemon->end(SIGKILL);
  const auto killed = std::chrono::steady_clock::now();
  std::string reason;
  while (const auto status = peer.receive_from("brainshift")) {
    const auto& report = std::get<igtl::StatusReport>(status->message.content);
    if (report.code == igtl::kStatusOk) continue;
    EXPECT_EQ(report.code, igtl::kStatusNotReady);
    reason = report.text;
    break;
  }
  EXPECT_THAT(reason, HasSubstr("no word from " + endpoint));
  const auto image = peer.receive_from("brainshift_u");
  ASSERT_TRUE(image);
  // The lease is a second; a look at it comes every 50 ms.
  EXPECT_LT(std::chrono::steady_clock::now() - killed, milliseconds(2000));
  EXPECT_TRUE(is_zero(*image));
  EXPECT_EQ(metadata(*image, "currency"), "stale");
  EXPECT_EQ(metadata(*image, "blank"), "true");
  const auto sd = peer.receive_from("brainshift_sd");
  ASSERT_TRUE(sd);
  EXPECT_TRUE(is_zero(*sd));
  const auto tumour = peer.receive_from("brainshift_tumour");
  ASSERT_TRUE(tumour);
  EXPECT_TRUE(std::get<igtl::PolyData>(tumour->message.content)
                  .points.isApprox(model.tumour.vertices.cast<float>()));
}

TEST_F(BridgeBesideADaemon, BlanksBeforeItEnds) {
  bridge_with();
  IgtlPeer peer = slicer();
  submit();
  ASSERT_TRUE(next_field(peer));
  auto ended = std::async(std::launch::async, [&] { return bridge->end(SIGTERM); });
  bool blank = false;
  std::string reason;
  while (const auto received = peer.receive(milliseconds(2000))) {
    if (received->header.device == "brainshift_u") blank = is_zero(*received);
    if (const auto* status = std::get_if<igtl::StatusReport>(&received->message.content)) {
      reason = status->text;
    }
  }
  EXPECT_EQ(ended.get(), 0);
  EXPECT_TRUE(blank) << "the last volume that came";
  EXPECT_EQ(reason, "the bridge has ended");
}

TEST_F(BridgeBesideADaemon, AReaderThatStallsGetsTheNewestAndLittleElse) {
  bridge_with({"--spacing", "1.5mm"});
  IgtlPeer stalled = slicer(64 * 1024);
  IgtlPeer quick = slicer();
  constexpr int kUpdates = 25;
  std::uint64_t newest = 0;
  for (int i = 0; i < kUpdates; ++i) {
    newest = submit().sequence;
    while (const auto image = next_field(quick)) {
      if (metadata(*image, "sequence") == std::to_string(newest)) break;
    }
  }
  int volumes = 0;
  std::string last;
  while (const auto image = next_field(stalled)) {
    ++volumes;
    last = metadata(*image, "sequence");
    if (last == std::to_string(newest)) break;
  }
  EXPECT_EQ(last, std::to_string(newest));
  EXPECT_LE(volumes, 4) << "of " << kUpdates;
}

TEST_F(BridgeBesideADaemon, AModelThatSlicerSendsIsTheTumoursBoundary) {
  bridge_with({"--tumour-device", "TumourNow", "--no-surfaces"});
  IgtlPeer peer = slicer();
  ASSERT_TRUE(peer.receive_from("brainshift_u", kLong)) << "the bridge has the model";
  TriangleSurface moved = model.tumour;
  moved.vertices.row(2).array() -= 3.0;
  igtl::Envelope envelope;
  envelope.version = 2;
  envelope.device = "TumourNow";
  peer.send(envelope, igtl::from_surface(moved));
  const Update update = next_final();
  EXPECT_TRUE(update.usable()) << update.estimate.quality.reason;
  const auto image = next_field(peer);
  ASSERT_TRUE(image);
  const Vec3 centre = model.tumour.vertices.rowwise().mean();
  EXPECT_LT(shown_at(std::get<igtl::Image>(image->message.content), centre)[2], -1.0);
}

TEST(BridgeCommand, BadOptionsExitTwoWithOneLine) {
  const auto refused = [](std::vector<std::string> options, const std::string& says) {
    options.insert(options.begin(), {brainshift(), "bridge", "--listen", "127.0.0.1:0"});
    const Finished finished = run(options);
    EXPECT_EQ(finished.exit_status, 2) << says;
    EXPECT_EQ(finished.out, "");
    const auto told = lines(finished.err);
    ASSERT_THAT(told, SizeIs(1)) << finished.err;
    EXPECT_THAT(told[0], StartsWith("brainshift: "));
    EXPECT_THAT(told[0], HasSubstr(says));
  };
  refused({"--region", "nose"}, "--region nose: must be brain");
  refused({"--margin", "10"}, "--margin 10: must be a length");
  refused({"--spacing", "2cm"}, "--spacing 2cm: must be a length");
  refused({"--from", "18944"}, "--from 18944: must be ADDRESS:PORT");
  refused({"--from", "127.0.0.1:18944"}, "say what of it to use");
  refused({"--seeds", "s.csv"}, "--from");
  refused({"--landmarks-after", "F"}, "both or none");
  refused({"--key", "nowhere"}, "--server-key");
}

TEST(BridgeCommand, HelpTeaches) {
  const Finished help = run({brainshift(), "bridge", "--help"});
  EXPECT_EQ(help.exit_status, 0);
  for (const char* part :
       {"Examples:", "brainshift_u", "--tumour-device", "OpenIGTLinkIF", "18945"}) {
    EXPECT_THAT(help.out, HasSubstr(part));
  }
}

}  // namespace
}  // namespace brainshift::integration
