// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sequence_file.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::io {
namespace {

using test_support::meta_text;
using test_support::nrrd_text;
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

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

// What reading says of a text; empty when it is accepted.
std::string refusal(const std::string& text, const std::string& name = "bad.igs.mha",
                    const SequenceOptions& options = {}) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, text);
  const auto recording = read_sequence(path, options);
  if (recording) return {};
  EXPECT_EQ(recording.error().code, ErrorCode::kUnreadable);
  EXPECT_THAT(recording.error().message, testing::StartsWith(path.string() + ": "));
  return recording.error().message;
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
    const auto recording = read_sequence(folder.write(name, text));
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->width, 12);
    EXPECT_EQ(recording->height, 9);
    EXPECT_EQ(recording->pixels, content.pixels);
    ASSERT_EQ(recording->num_frames(), 4);
    EXPECT_NEAR(recording->time_s[3], 1000.3, 1e-9);
    EXPECT_TRUE(recording->defects.empty());
    const auto* probe = find_link(*recording, "ProbeToTracker");
    const auto* reference = find_link(*recording, "ReferenceToTracker");
    const auto* stylus = find_link(*recording, "StylusToTracker");
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
    const auto recording = read_sequence(folder.write("a.mha", meta_text(content, true)));
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->pixels, mf) << name;
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
  const auto a = read_sequence(folder.write("a.mha", meta_text(content, true)));
  content.pixels = big;
  const auto b = read_sequence(folder.write(
      "b.mha", replaced(meta_text(content, true), "OrderMSB = False", "OrderMSB = True")));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->pixels, b->pixels);
  EXPECT_EQ(a->frame_values(1)(0, 11),
            9 * 12 * 70 - 9000);  // mirrored: the first pixel is the last
}

TEST(SequenceFile, AMatrixThatIsNoRigidMotionMakesThatLinkInvalidAndIsListed) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.frames[2]["ProbeToTrackerTransform"] = "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1";
  content.frames[3]["ReferenceToTrackerTransform"] = "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
  const auto recording = read_sequence(folder.write("a.mha", meta_text(content, true)));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(find_link(*recording, "ProbeToTracker")->samples[2].status, LinkStatus::kInvalid);
  EXPECT_EQ(find_link(*recording, "ReferenceToTracker")->samples[3].status, LinkStatus::kInvalid);
  ASSERT_EQ(recording->defects.size(), 2U);
  EXPECT_EQ(recording->defects[0].frame, 2);
  EXPECT_EQ(recording->defects[0].field, "Seq_Frame0002_ProbeToTrackerTransform");
  EXPECT_THAT(recording->defects[0].what, HasSubstr("no rigid motion"));
  EXPECT_THAT(recording->defects[1].what, HasSubstr("finite"));
}

TEST(SequenceFile, ImageLinksMayScale) {
  const TemporaryFolder folder;
  SequenceContent content = small_sweep().content();
  content.frames[0]["ImageToProbeTransform"] = "0.1 0 0 4 0 0.1 0 0 0 0 0.1 0 0 0 0 1";
  content.frames[0]["ImageToProbeTransformStatus"] = "OK";
  const auto recording = read_sequence(folder.write("a.mha", meta_text(content, true)));
  ASSERT_TRUE(recording);
  const auto* image = find_link(*recording, "ImageToProbe");
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
  const auto recording = read_sequence(folder.write("a.mha", meta_text(content, true)));
  ASSERT_TRUE(recording);
  EXPECT_FALSE(recording->image_ok[0]);
  EXPECT_TRUE(recording->image_ok[1]);
  const auto& samples = find_link(*recording, "ProbeToTracker")->samples;
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
    const auto recording = read_sequence(folder.write(name, text), options);
    ASSERT_TRUE(recording) << recording.error().message;
    EXPECT_EQ(recording->width, 0);
    EXPECT_EQ(recording->height, 0);
    EXPECT_EQ(recording->pixels, "");
    ASSERT_EQ(recording->num_frames(), 4);
    EXPECT_NEAR(recording->time_s[3], 1000.3, 1e-9);
    EXPECT_EQ(find_link(*recording, "ProbeToTracker")->samples[2].status, LinkStatus::kOk);
    for (const char ok : recording->image_ok) EXPECT_TRUE(ok);
  }
}

// ---------- refusals: a row is what is done to good content and what the sentence says ----------

TEST(SequenceFile, NamesFrameAndFieldOfBadTimes) {
  SequenceContent content = small_sweep().content();
  content.frames[2].erase("Timestamp");
  EXPECT_THAT(refusal(meta_text(content, true)),
              HasSubstr("frame 2: Seq_Frame0002_Timestamp is missing"));
  EXPECT_THAT(refusal(nrrd_text(content, true), "bad.nrrd"),
              HasSubstr("frame 2: Seq_Frame0002_Timestamp is missing"));
  content.frames[2]["Timestamp"] = "999.5";
  EXPECT_THAT(
      refusal(meta_text(content, true)),
      AllOf(HasSubstr("frame 2: Seq_Frame0002_Timestamp = 999.5 s: the clock runs backwards"),
            HasSubstr("1000.1 s")));
  for (const char* text : {"soon", "nan", "inf", "1 2", ""}) {
    content.frames[2]["Timestamp"] = text;
    EXPECT_THAT(refusal(meta_text(content, true)),
                HasSubstr("Seq_Frame0002_Timestamp = " + std::string(text)));
  }
}

TEST(SequenceFile, NamesFrameAndFieldOfBadMatrices) {
  SequenceContent content = small_sweep().content();
  for (const char* text :
       {"1 0 0", "one 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "", "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"}) {
    content.frames[1]["ProbeToTrackerTransform"] = text;
    EXPECT_THAT(refusal(meta_text(content, true)),
                HasSubstr("frame 1: Seq_Frame0001_ProbeToTrackerTransform is not 16 numbers"));
  }
  content = small_sweep().content();
  content.frames[1]["probeTransform"] = test_support::matrix_text(Eigen::Matrix4d::Identity());
  EXPECT_THAT(refusal(meta_text(content, true)), HasSubstr("Seq_Frame0001_probeTransform"));
}

TEST(SequenceFile, RefusesHeadersThatDisagree) {
  const std::string good = meta_text(small_sweep().content(), true);
  const auto bad = [&](const char* what, const char* with) {
    return refusal(replaced(good, what, with));
  };
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 9 3"), HasSubstr("Seq_Frame0003"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 9 5"),
              HasSubstr("frame 4: Seq_Frame0004_Timestamp"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 8 4"), HasSubstr("more than its sizes say"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 10 4"),
              HasSubstr("truncated: 432 of 480 bytes"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 0 4"), HasSubstr("images of 12 x 0 pixels"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 9 0"), HasSubstr("0 of them"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 -9 4"), HasSubstr("every size must be"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 nine 4"), HasSubstr("DimSize = 12 nine 4"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 9"), HasSubstr("NDims"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 20000 9 4"), HasSubstr("20000 x 9 pixels"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12 9 99999999"), HasSubstr("every size must be"));
  EXPECT_THAT(bad("DimSize = 12 9 4", "DimSize = 12000 16000 4"),
              HasSubstr("compressed ones are too few"));
  EXPECT_THAT(bad("MET_UCHAR", "MET_FLOAT"), HasSubstr("pixel type float"));
  EXPECT_THAT(bad("ElementDataFile = LOCAL", "ElementDataFile = other.raw"),
              HasSubstr("other.raw"));
  EXPECT_THAT(bad("BinaryData = True", "BinaryData = False"), HasSubstr("BinaryData = False"));
  EXPECT_THAT(bad("CompressedData = True", "CompressedData = Yes"),
              HasSubstr("CompressedData = Yes"));
  EXPECT_THAT(bad("ObjectType = Image", "ElementNumberOfChannels = 3"),
              HasSubstr("ElementNumberOfChannels = 3"));
  EXPECT_THAT(bad("ObjectType = Image", "UltrasoundImageType = RF_REAL"), HasSubstr("RF_REAL"));
  EXPECT_THAT(bad("ObjectType = Image", "NDims = 3"), HasSubstr("field NDims is given twice"));
  EXPECT_THAT(bad("Seq_Frame0001_", "Seq_FrameX_"), HasSubstr("Seq_FrameX_"));
  EXPECT_THAT(bad("Seq_Frame0001_", "Seq_Frame999999999999_"), HasSubstr("Seq_Frame999999999999_"));
  EXPECT_THAT(bad("Seq_Frame0001_ImageStatus", "Seq_Frame0000_ImageStatus"),
              HasSubstr("given twice"));
}

TEST(SequenceFile, RefusesATrackerAloneWhereImagesAreWanted) {
  EXPECT_THAT(refusal(meta_text(tracker_alone(), false)),
              HasSubstr("holds 4 poses of a tracker and no images"));
}

TEST(SequenceFile, RefusesATrackerAloneWithBadTimesOrMatrices) {
  SequenceOptions options;
  options.tracking_only = true;
  SequenceContent content = tracker_alone();
  content.frames[2].erase("Timestamp");
  EXPECT_THAT(refusal(meta_text(content, false), "bad.mha", options),
              HasSubstr("frame 2: Seq_Frame0002_Timestamp is missing"));
  content = tracker_alone();
  content.frames[1]["ProbeToTrackerTransform"] = "1 2 3";
  EXPECT_THAT(refusal(meta_text(content, false), "bad.mha", options), HasSubstr("frame 1"));
}

TEST(SequenceFile, RefusesOrientationsThatAreNotSaidOrNotFlat) {
  SequenceContent content = small_sweep().content();
  for (const char* text : {"FU", "AMF", "XX", "M", "MFX"}) {
    content.fields["UltrasoundImageOrientation"] = text;
    EXPECT_THAT(refusal(meta_text(content, true)),
                HasSubstr("UltrasoundImageOrientation = " + std::string(text)));
  }
  content.fields.clear();
  EXPECT_THAT(refusal(meta_text(content, true)),
              HasSubstr("UltrasoundImageOrientation is missing"));
  EXPECT_EQ(refusal(meta_text(content, true), "good.mha", {"MF"}), "");
}

TEST(SequenceFile, RefusesPixelsThatAreDamaged) {
  const SequenceContent content = small_sweep().content();
  const std::string raw = meta_text(content, false), packed = meta_text(content, true);
  EXPECT_THAT(refusal(raw.substr(0, raw.size() - 1)),
              HasSubstr("holds 431 bytes of pixels, its sizes say 432"));
  EXPECT_THAT(refusal(raw + "x"), HasSubstr("holds 433 bytes"));
  EXPECT_THAT(refusal(packed.substr(0, packed.size() - 8)), HasSubstr("compressed pixels are"));
  std::string damaged = packed;
  damaged[damaged.size() - 2] = static_cast<char>(damaged[damaged.size() - 2] ^ 0x55);
  EXPECT_THAT(refusal(damaged), HasSubstr("damaged"));
}

TEST(SequenceFile, RefusesWhatIsNoSequence) {
  EXPECT_THAT(refusal(""), HasSubstr("no ElementDataFile"));
  EXPECT_THAT(refusal("not a header at all"), HasSubstr("no ElementDataFile"));
  EXPECT_THAT(refusal("NRRD0004\ntype: uint8\n", "a.nrrd"), HasSubstr("header has no end"));
  EXPECT_THAT(refusal("PNG", "a.nrrd"), HasSubstr("no NRRD file"));
  EXPECT_THAT(refusal("x", "a.mhd"), HasSubstr("must be a sequence file"));
  const TemporaryFolder folder;
  const auto none = read_sequence(folder / "none.mha");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

TEST(SequenceFile, RefusesNrrdHeadersThatDisagree) {
  const std::string good = nrrd_text(small_sweep().content(), true);
  const auto bad = [&](const char* what, const char* with) {
    return refusal(replaced(good, what, with), "bad.seq.nrrd");
  };
  EXPECT_THAT(bad("encoding: gzip", "encoding: bzip2"), HasSubstr("encoding = bzip2"));
  EXPECT_THAT(bad("endian: little", "endian: middle"), HasSubstr("endian = middle"));
  EXPECT_THAT(bad("dimension: 3", "dimension: 4"), HasSubstr("dimension = \"4\""));
  EXPECT_THAT(bad("sizes: 12 9 4", "sizes: 12 9 5"), HasSubstr("frame 4"));
  EXPECT_THAT(bad("type: uint8", "type: double"), HasSubstr("pixel type double"));
  EXPECT_THAT(bad("kinds: domain domain list", "kinds: list domain domain"),
              HasSubstr("kinds = list"));
  EXPECT_THAT(bad("# written by a test", "data file: other.raw"),
              HasSubstr("data file = other.raw"));
  EXPECT_THAT(bad("# written by a test", "a line without a colon"), HasSubstr("has no value"));
}

}  // namespace
}  // namespace brainshift::io
