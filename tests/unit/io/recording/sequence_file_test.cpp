// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_file.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::meta_text;
using test_support::nrrd_text;
using test_support::replaced;
using test_support::SequenceContent;
using test_support::TemporaryFolder;
using test_support::VirtualSweep;
using testing::AllOf;
using testing::HasSubstr;
using tracking::LinkStatus;
using tracking::Recording;

// Small: 12 x 9 pixels, 4 frames.
VirtualSweep small_sweep() {
  VirtualSweep sweep;
  sweep.width = 12, sweep.height = 9, sweep.frames = 4;
  sweep.pixel_u_mm = sweep.pixel_v_mm = 2.0;
  return sweep;
}

const tracking::LinkSeries* find_link(const Recording& recording, const std::string& name) {
  for (const auto& series : recording.links) {
    if (series.frames.name() == name) return &series;
  }
  return nullptr;
}

// read_sequence of a file of this name; an error begins with its path.
auto reading_sequence(const std::string& name = "bad.igs.mha",
                      const SequenceOptions& options = {}) {
  return [name, options](const std::string& text) {
    const TemporaryFolder folder;
    const auto path = folder.write(name, text);
    auto recording = read_sequence(path, options);
    if (!recording) {
      EXPECT_THAT(recording.error().message, testing::StartsWith(path.string() + ": "));
    }
    return recording;
  };
}

// What reading it says of bad content.
std::string refusal(const SequenceContent& content) {
  return refusal_of(reading_sequence()(meta_text(content, true)));
}

TEST(SequenceFile, SaysTheSameInEveryFormat) {
  const TemporaryFolder folder;
  const VirtualSweep sweep = small_sweep();
  const SequenceContent content = sweep.content();
  for (const auto& [name, text] : {std::pair{"a.igs.mha", meta_text(content, false)},
                                   std::pair{"b.mha", meta_text(content, true)},
                                   std::pair{"c.seq.nrrd", nrrd_text(content, false)},
                                   std::pair{"d.nrrd", nrrd_text(content, true)}}) {
    SCOPED_TRACE(name);
    const auto recording = value_or_fail(read_sequence(folder.write(name, text)));
    EXPECT_EQ(recording.width, 12);
    EXPECT_EQ(recording.height, 9);
    EXPECT_EQ(recording.pixels, content.pixels);
    ASSERT_EQ(recording.num_frames(), 4);
    EXPECT_NEAR(recording.time_s[3], 1000.3, 1e-9);
    EXPECT_TRUE(recording.defects.empty());
    const auto* probe = find_link(recording, "ProbeToTracker");
    const auto* reference = find_link(recording, "ReferenceToTracker");
    const auto* stylus = find_link(recording, "StylusToTracker");
    ASSERT_TRUE(probe && reference && stylus);
    for (int i = 0; i < 4; ++i) {
      const auto frame = static_cast<std::size_t>(i);
      ASSERT_EQ(probe->samples[frame].status, LinkStatus::kOk);
      EXPECT_EQ(stylus->samples[frame].status, LinkStatus::kInvalid);
      const AffineTransform T = sweep.T_ras_reference() *
                                reference->samples[frame].T_to_from.inverse() *
                                probe->samples[frame].T_to_from * sweep.T_probe_image();
      EXPECT_LT((T.matrix() - sweep.T_ras_image(i).matrix()).cwiseAbs().maxCoeff(), 1e-8);
    }
  }
}

TEST(SequenceFile, TurnsEveryOrientationIntoMF) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  // What the same scene looks like when an axis points the other way.
  const std::string mf = content.pixels;
  const auto mirrored = [&](bool u, bool v) {
    std::string pixels(mf.size(), '\0');
    for (std::size_t f = 0; f < 4; ++f) {
      for (std::size_t y = 0; y < 9; ++y) {
        for (std::size_t x = 0; x < 12; ++x) {
          pixels[(f * 9 + (v ? 8 - y : y)) * 12 + (u ? 11 - x : x)] = mf[(f * 9 + y) * 12 + x];
        }
      }
    }
    return pixels;
  };
  for (const auto& [name, u, v] : {std::tuple{"MF", false, false}, std::tuple{"MFA", false, false},
                                   std::tuple{"UF", true, false}, std::tuple{"MN", false, true},
                                   std::tuple{"UND", true, true}}) {
    content.fields["UltrasoundImageOrientation"] = name;
    content.pixels = mirrored(u, v);
    const auto recording =
        value_or_fail(read_sequence(folder.write("a.mha", meta_text(content, true))));
    EXPECT_EQ(recording.pixels, mf) << name;
  }
}

TEST(SequenceFile, ReadsSixteenBitsOfEitherByteOrder) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.element = "int16";
  content.fields["UltrasoundImageOrientation"] = "UF";
  std::string little, big;
  for (int i = 0; i < 4 * 9 * 12; ++i) {
    const auto value = static_cast<std::uint16_t>(i * 70 - 9000);
    little += {static_cast<char>(value & 255), static_cast<char>(value >> 8)};
    big += {static_cast<char>(value >> 8), static_cast<char>(value & 255)};
  }
  content.pixels = little;
  const auto a = value_or_fail(read_sequence(folder.write("a.mha", meta_text(content, true))));
  content.pixels = big;
  const auto b = value_or_fail(read_sequence(folder.write(
      "b.mha", replaced(meta_text(content, true), "OrderMSB = False", "OrderMSB = True"))));
  EXPECT_EQ(a.pixels, b.pixels);
  EXPECT_EQ(a.frame_values(1)(0, 11),
            9 * 12 * 70 - 9000);  // mirrored: the first pixel is the last
  for (const char* flag : {"ElementByteOrderMSB = True", "elementbyteordermsb=1"}) {
    const auto c = value_or_fail(read_sequence(folder.write(
        "C.MHA", replaced(meta_text(content, true), "BinaryDataByteOrderMSB = False", flag))));
    EXPECT_EQ(c.pixels, a.pixels) << flag;
  }
  const auto both = read_sequence(folder.write(
      "d.mha", replaced(meta_text(content, true), "NDims", "ElementByteOrderMSB = True\nNDims")));
  EXPECT_THAT(refusal_of(both), testing::HasSubstr("contradict each other"));
}

TEST(SequenceFile, AMatrixThatIsNoRigidMotionMakesThatLinkInvalidAndIsListed) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.frames[2]["ProbeToTrackerTransform"] = "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1";
  content.frames[3]["ReferenceToTrackerTransform"] = "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  const auto recording =
      value_or_fail(read_sequence(folder.write("a.mha", meta_text(content, true))));
  EXPECT_EQ(find_link(recording, "ProbeToTracker")->samples[2].status, LinkStatus::kInvalid);
  EXPECT_EQ(find_link(recording, "ReferenceToTracker")->samples[3].status, LinkStatus::kInvalid);
  ASSERT_EQ(recording.defects.size(), 2U);
  EXPECT_EQ(recording.defects[0].frame, 2);
  EXPECT_EQ(recording.defects[0].field, "Seq_Frame0002_ProbeToTrackerTransform");
  EXPECT_THAT(recording.defects[0].what, HasSubstr("no rigid motion"));
  EXPECT_THAT(recording.defects[1].what, HasSubstr("finite"));
}

TEST(SequenceFile, ImageLinksMayScale) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.frames[0]["ImageToProbeTransform"] = "0.1 0 0 4 0 0.1 0 0 0 0 0.1 0 0 0 0 1";
  content.frames[0]["ImageToProbeTransformStatus"] = "OK";
  const auto recording =
      value_or_fail(read_sequence(folder.write("a.mha", meta_text(content, true))));
  const auto* image = find_link(recording, "ImageToProbe");
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->samples[0].status, LinkStatus::kOk);
  EXPECT_EQ(image->samples[0].T_to_from(0, 3), 4.0);
  EXPECT_EQ(image->samples[1].status, LinkStatus::kMissing);
}

TEST(SequenceFile, StatusDecides) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.frames[0]["ImageStatus"] = "INVALID";
  content.frames[1].erase("ProbeToTrackerTransformStatus");
  content.frames[2]["ProbeToTrackerTransformStatus"] = "OUT_OF_VIEW";
  content.frames[3].erase("ProbeToTrackerTransform");
  const auto recording =
      value_or_fail(read_sequence(folder.write("a.mha", meta_text(content, true))));
  EXPECT_FALSE(recording.image_ok[0]);
  EXPECT_TRUE(recording.image_ok[1]);
  const auto& samples = find_link(recording, "ProbeToTracker")->samples;
  EXPECT_EQ(samples[0].status, LinkStatus::kOk);
  EXPECT_EQ(samples[1].status, LinkStatus::kWithoutStatus);
  EXPECT_EQ(samples[2].status, LinkStatus::kInvalid);
  EXPECT_EQ(samples[3].status, LinkStatus::kMissing);
}

// As PLUS records a stylus for registration.
SequenceContent tracker_alone() {
  SequenceContent content = small_sweep().content();
  content.width = content.height = 0;
  content.pixels.clear();
  content.fields.clear();
  for (auto& frame : content.frames) frame["ImageStatus"] = "INVALID";
  return content;
}

TEST(SequenceFile, ATrackerAloneIsReadWhereNoImagesAreWanted) {
  const TemporaryFolder folder;
  SequenceOptions options;
  options.tracking_only = true;
  for (const auto& [name, text] : {std::pair{"a.mha", meta_text(tracker_alone(), false)},
                                   std::pair{"b.nrrd", nrrd_text(tracker_alone(), false)},
                                   // Images of which nobody says how they lie are no obstacle.
                                   std::pair{"c.mha", meta_text(small_sweep().content(), true)}}) {
    SCOPED_TRACE(name);
    const auto recording = value_or_fail(read_sequence(folder.write(name, text), options));
    EXPECT_EQ(recording.width, 0);
    EXPECT_EQ(recording.height, 0);
    EXPECT_EQ(recording.pixels, "");
    ASSERT_EQ(recording.num_frames(), 4);
    EXPECT_NEAR(recording.time_s[3], 1000.3, 1e-9);
    EXPECT_EQ(find_link(recording, "ProbeToTracker")->samples[2].status, LinkStatus::kOk);
    for (const char ok : recording.image_ok) EXPECT_TRUE(ok);
  }
}

// ---------- refusals: a row is what is done to good content and what the sentence says ----------

TEST(SequenceFile, NamesFrameAndFieldOfBadTimes) {
  SequenceContent content = small_sweep().content();
  content.frames[2].erase("Timestamp");
  EXPECT_THAT(refusal(content), HasSubstr("frame 2: Seq_Frame0002_Timestamp is missing"));
  EXPECT_THAT(refusal_of(reading_sequence("bad.nrrd")(nrrd_text(content, true))),
              HasSubstr("frame 2: Seq_Frame0002_Timestamp is missing"));
  content.frames[2]["Timestamp"] = "999.5";
  EXPECT_THAT(
      refusal(content),
      AllOf(HasSubstr("frame 2: Seq_Frame0002_Timestamp = 999.5 s: the clock runs backwards"),
            HasSubstr("1000.1 s")));
  for (const char* text : {"soon", "nan", "inf", "1 2", ""}) {
    content.frames[2]["Timestamp"] = text;
    EXPECT_THAT(refusal(content), HasSubstr("Seq_Frame0002_Timestamp = " + std::string(text)));
  }
}

TEST(SequenceFile, NamesFrameAndFieldOfBadMatrices) {
  SequenceContent content = small_sweep().content();
  for (const char* text :
       {"1 0 0", "one 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "", "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"}) {
    content.frames[1]["ProbeToTrackerTransform"] = text;
    EXPECT_THAT(refusal(content),
                HasSubstr("frame 1: Seq_Frame0001_ProbeToTrackerTransform is not 16 numbers"));
  }
  content = small_sweep().content();
  content.frames[1]["probeTransform"] = test_support::matrix_text(Eigen::Matrix4d::Identity());
  EXPECT_THAT(refusal(content), HasSubstr("Seq_Frame0001_probeTransform"));
}

TEST(SequenceFile, RefusesHeadersThatDisagree) {
  const std::string good = meta_text(small_sweep().content(), true);
  expect_edits_refused(
      reading_sequence(), good,
      {{"DimSize = 12 9 4", "DimSize = 12 9 3", "Seq_Frame0003"},
       {"DimSize = 12 9 4", "DimSize = 12 9 5", "frame 4: Seq_Frame0004_Timestamp"},
       {"DimSize = 12 9 4", "DimSize = 12 8 4", "more than its sizes say"},
       {"DimSize = 12 9 4", "DimSize = 12 10 4", "truncated: 432 of 480 bytes"},
       {"DimSize = 12 9 4", "DimSize = 12 0 4", "images of 12 x 0 pixels"},
       {"DimSize = 12 9 4", "DimSize = 12 9 0", "0 of them"},
       {"DimSize = 12 9 4", "DimSize = 12 -9 4", "every size must be"},
       {"DimSize = 12 9 4", "DimSize = 12 nine 4", "DimSize = 12 nine 4"},
       {"DimSize = 12 9 4", "DimSize = 12 9", "NDims"},
       {"DimSize = 12 9 4", "DimSize = 20000 9 4", "20000 x 9 pixels"},
       {"DimSize = 12 9 4", "DimSize = 12 9 99999999", "every size must be"},
       {"DimSize = 12 9 4", "DimSize = 12000 16000 4", "compressed ones are too few"},
       {"MET_UCHAR", "MET_FLOAT", "pixel type float"},
       {"ElementDataFile = LOCAL", "ElementDataFile = other.raw", "other.raw"},
       {"BinaryData = True", "BinaryData = False", "BinaryData = False"},
       {"CompressedData = True", "CompressedData = Yes", "CompressedData = Yes"},
       {"ObjectType = Image", "ElementNumberOfChannels = 3", "ElementNumberOfChannels = 3"},
       {"ObjectType = Image", "UltrasoundImageType = RF_REAL", "RF_REAL"},
       {"ObjectType = Image", "NDims = 3", "field NDims is given twice"},
       {"Seq_Frame0001_", "Seq_FrameX_", "Seq_FrameX_"},
       {"Seq_Frame0001_", "Seq_Frame999999999999_", "Seq_Frame999999999999_"},
       {"Seq_Frame0001_ImageStatus", "Seq_Frame0000_ImageStatus", "given twice"}});
}

TEST(SequenceFile, RefusesATrackerAloneWhereImagesAreWantedOrTimesOrMatricesAreBad) {
  expect_refused(reading_sequence(),
                 {{meta_text(tracker_alone(), false), "holds 4 poses of a tracker and no images"}});
  SequenceOptions options;
  options.tracking_only = true;
  SequenceContent content = tracker_alone();
  content.frames[2].erase("Timestamp");
  const auto read = reading_sequence("bad.mha", options);
  expect_refused(read,
                 {{meta_text(content, false), "frame 2: Seq_Frame0002_Timestamp is missing"}});
  content = tracker_alone();
  content.frames[1]["ProbeToTrackerTransform"] = "1 2 3";
  expect_refused(read, {{meta_text(content, false), "frame 1"}});
}

TEST(SequenceFile, RefusesOrientationsThatAreNotSaidOrNotFlat) {
  SequenceContent content = small_sweep().content();
  for (const char* text : {"FU", "AMF", "XX", "M", "MFX"}) {
    content.fields["UltrasoundImageOrientation"] = text;
    EXPECT_THAT(refusal(content), HasSubstr("UltrasoundImageOrientation = " + std::string(text)));
  }
  content.fields.clear();
  EXPECT_THAT(refusal(content), HasSubstr("UltrasoundImageOrientation is missing"));
  EXPECT_TRUE(reading_sequence("good.mha", {"MF"})(meta_text(content, true)));
}

TEST(SequenceFile, RefusesPixelsThatAreDamaged) {
  const SequenceContent content = small_sweep().content();
  const std::string raw = meta_text(content, false), packed = meta_text(content, true);
  expect_refused(reading_sequence(),
                 {{raw.substr(0, raw.size() - 1), "holds 431 bytes of pixels, its sizes say 432"},
                  {raw + "x", "holds 433 bytes"},
                  {packed.substr(0, packed.size() - 8), "compressed pixels are"}});
  std::string damaged = packed;
  damaged[damaged.size() - 2] = static_cast<char>(damaged[damaged.size() - 2] ^ 0x55);
  expect_refused(reading_sequence(), {{damaged, "damaged"}});
}

TEST(SequenceFile, RefusesWhatIsNoSequence) {
  expect_refused(reading_sequence(),
                 {{"", "no ElementDataFile"}, {"not a header at all", "no ElementDataFile"}});
  expect_refused(reading_sequence("a.nrrd"),
                 {{"NRRD0004\ntype: uint8\n", "header has no end"}, {"PNG", "no NRRD file"}});
  expect_refused(reading_sequence("a.mhd"), {{"x", "must be a sequence file"}});
  refusal_of(read_sequence("/nowhere/none.mha"), ErrorCode::kNotFound);
}

TEST(SequenceFile, RefusesNrrdHeadersThatDisagree) {
  const std::string good = nrrd_text(small_sweep().content(), true);
  expect_edits_refused(reading_sequence("bad.seq.nrrd"), good,
                       {{"encoding: gzip", "encoding: bzip2", "encoding = bzip2"},
                        {"endian: little", "endian: middle", "endian = middle"},
                        {"dimension: 3", "dimension: 4", "dimension = \"4\""},
                        {"sizes: 12 9 4", "sizes: 12 9 5", "frame 4"},
                        {"type: uint8", "type: double", "pixel type double"},
                        {"kinds: domain domain list", "kinds: list domain domain", "kinds = list"},
                        {"# written by a test", "data file: other.raw", "data file = other.raw"},
                        {"# written by a test", "a line without a colon", "has no value"}});
}

}  // namespace
}  // namespace brainshift::io
