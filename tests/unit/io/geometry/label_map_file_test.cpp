// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/label_map_file.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::replaced;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kSpace =
    "space: left-posterior-superior\nspace directions: (2,0,0) (0,3,0) (0,0,4)\n"
    "space origin: (10,20,30)\n";

// 2 x 3 x 2 voxels with the values 0 ... 11.
template <typename T>
std::string counted(bool big_endian = false) {
  std::string bytes;
  for (int i = 0; i < 12; ++i) {
    const T value = static_cast<T>(i);
    std::string one(sizeof(T), '\0');
    std::memcpy(one.data(), &value, sizeof(T));
    if (big_endian) std::reverse(one.begin(), one.end());
    bytes += one;
  }
  return bytes;
}

std::string gzipped_labels(const std::string& bytes) {
  std::string packed(bytes.size() + 100, '\0');
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(packed.size() - stream.avail_out);
  deflateEnd(&stream);
  return packed;
}

std::string nrrd(const std::string& type, const std::string& data,
                 const std::string& space = kSpace, const std::string& more = "endian: little\n",
                 const std::string& encoding = "raw") {
  return "NRRD0004\ntype: " + type + "\ndimension: 3\nsizes: 2 3 2\nencoding: " + encoding + "\n" +
         space + more + "\n" + data;
}

// Two layers of 2 x 2 x 1 voxels, the layers along the first axis, as Slicer writes them.
std::string layered(const std::string& segments) {
  return "NRRD0004\ntype: unsigned char\ndimension: 4\nsizes: 2 2 2 1\nencoding: raw\n"
         "kinds: list domain domain domain\nspace: left-posterior-superior\n"
         "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n" +
         segments + "\n" + std::string({1, 0, 1, 1, 2, 1, 0, 1});
}
constexpr const char* kThreeSegments =
    "Segment0_Name:=Head\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
    "Segment1_Name:=Mass\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n"
    "Segment2_Name:=Edema, left\nSegment2_LabelValue:=2\nSegment2_Layer:=0\n";

Result<VoxelImage> read(const std::string& content, const LabelChoice& choice = {},
                        const std::string& name = "map.seg.nrrd") {
  const TemporaryFolder folder;
  return read_label_map(folder.write(name, content), choice);
}

// A reader of this choice; an error names the file.
auto reading(const LabelChoice& choice = {}) {
  return [choice](const std::string& content) {
    auto image = read(content, choice);
    if (!image) {
      EXPECT_THAT(image.error().message, HasSubstr("map.seg.nrrd: "));
    }
    return image;
  };
}

TEST(LabelMapFile, ReadsEveryTypeEncodingAndByteOrder) {
  const auto expect_counted = [](const std::string& content) {
    const auto image = value_or_fail(read(content));
    EXPECT_THAT(image.dims, ElementsAre(2, 3, 2));
    EXPECT_THAT(image.values, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
  };
  expect_counted(nrrd("unsigned char", counted<std::uint8_t>(), kSpace, ""));
  expect_counted(nrrd("signed char", counted<std::int8_t>(), kSpace, ""));
  for (const bool big : {false, true}) {
    const std::string endian = big ? "endian: big\n" : "endian: little\n";
    expect_counted(nrrd("short", counted<std::int16_t>(big), kSpace, endian));
    expect_counted(nrrd("uint16", counted<std::uint16_t>(big), kSpace, endian));
    expect_counted(nrrd("int", counted<std::int32_t>(big), kSpace, endian));
    expect_counted(nrrd("unsigned int", counted<std::uint32_t>(big), kSpace, endian));
    expect_counted(nrrd("longlong", counted<std::int64_t>(big), kSpace, endian));
    expect_counted(nrrd("uint64_t", counted<std::uint64_t>(big), kSpace, endian));
    expect_counted(nrrd("float", counted<float>(big), kSpace, endian));
    expect_counted(nrrd("double", gzipped_labels(counted<double>(big)), kSpace, endian, "gzip"));
  }
}

TEST(LabelMapFile, NeitherCaseNorBlanksOfFieldsCount) {
  const auto image = value_or_fail(
      read("NRRD0004\nType: Unsigned Char\nDimension: 4\nSizes: 1 2 1 1\nEncoding: RAW\n"
           "Space: Left-Posterior-Superior\nSpaceDirections: None (2,0,0) (0,1,0) (0,0,1)\n"
           "Space Origin: (1,2,3)\nsegment0_labelvalue:=4\n\n\x04\x05",
           {"", 9}, "map.NRRD"));
  EXPECT_THAT(image.values, ElementsAre(9, 0));
  EXPECT_EQ(image.T_ras_voxel * Vec3(1, 0, 0), Vec3(-3, -2, 3));
}

TEST(LabelMapFile, RefusesWhatItWouldHaveToGuess) {
  expect_refused(reading(),
                 {{nrrd("uchar", counted<std::uint8_t>(), kSpace, "data file: map.raw.gz\n"),
                   "its pixels lie elsewhere (a detached header)"},
                  {nrrd("uchar", counted<std::uint8_t>(), kSpace, "spacings: 7 nan 1\n"),
                   "spacings = 7 nan 1: axis 0 has steps of"}});
  std::string half = counted<float>();
  const float fraction = 2.5F;
  std::memcpy(half.data() + 8, &fraction, sizeof fraction);
  expect_refused(reading(), {{nrrd("float", half, kSpace, "Segment0_LabelValue:=4\n"),
                              "a voxel has the value 2.5, which is no label"}});
}

TEST(LabelMapFile, EverySpaceBecomesRas) {
  for (const auto& [name, signs] :
       {std::pair{"left-posterior-superior", Vec3(-1, -1, 1)}, std::pair{"LPS", Vec3(-1, -1, 1)},
        std::pair{"right-anterior-superior", Vec3(1, 1, 1)}, std::pair{"RAS", Vec3(1, 1, 1)},
        std::pair{"left-anterior-superior", Vec3(-1, 1, 1)}, std::pair{"LAS", Vec3(-1, 1, 1)}}) {
    // An oblique grid whose third axis points down.
    const auto image = value_or_fail(
        read(nrrd("uchar", counted<std::uint8_t>(),
                  "space: " + std::string(name) +
                      "\nspace directions: (0,2,0) (-3,0,0) (0.5,0,-4)\n"
                      "space origin: (10,20,30)\nspace units: \"mm\" \"mm\" \"mm\"\n")));
    EXPECT_EQ(image.T_ras_voxel * Vec3(0, 0, 0), signs.cwiseProduct(Vec3(10, 20, 30)));
    EXPECT_EQ(image.T_ras_voxel * Vec3(1, 2, 3),
              signs.cwiseProduct(Vec3(10 - 6 + 1.5, 20 + 2, 30 - 12)));
  }
}

TEST(LabelMapFile, ASegmentIsChosenByName) {
  const auto voxels = [](const char* name, int label) {
    return value_or_fail(read(layered(kThreeSegments), {name, label})).values;
  };
  EXPECT_THAT(voxels("Head", 1), ElementsAre(1, 1, 0, 0));
  EXPECT_THAT(voxels("Mass", 7), ElementsAre(0, 7, 7, 7));
  EXPECT_THAT(voxels("Edema, left", 1), ElementsAre(0, 0, 1, 0));
}

TEST(LabelMapFile, TheOnlySegmentNeedsNoName) {
  const std::string keys = "Segment0_ID:=Segment_1\nSegment0_LabelValue:=4\n";
  const auto image =
      value_or_fail(read(nrrd("uchar", counted<std::uint8_t>(), kSpace, keys), {"", 9}));
  EXPECT_THAT(image.values, ElementsAre(0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0));
}

TEST(LabelMapFile, OldSegmentationsHaveOneSegmentInEachLayer) {
  const auto image = value_or_fail(read(layered("Segment0_Name:=a\nSegment1_Name:=b\n"), {"b", 1}));
  EXPECT_THAT(image.values, ElementsAre(0, 1, 1, 1));
}

TEST(LabelMapFile, LayersMayBeTheLastAxis) {
  std::string text = replaced(layered(kThreeSegments), "sizes: 2 2 2 1", "sizes: 2 2 1 2");
  text = replaced(text, "none (1,0,0) (0,1,0) (0,0,1)", "(1,0,0) (0,1,0) (0,0,1) none");
  const auto image = value_or_fail(read(text, {"Mass", 1}));
  EXPECT_THAT(image.values, ElementsAre(0, 1, 0, 1));
}

TEST(LabelMapFile, RefusesAChoiceThatIsNone) {
  const ErrorCode code = ErrorCode::kInvalidArgument;
  const std::string three = layered(kThreeSegments);
  expect_refused(reading(),
                 {{three, "has 3 segments: name one of \"Head\", \"Mass\", \"Edema, left\""}},
                 code);
  expect_refused(reading({"mass", 1}), {{three, "no segment called \"mass\""}, {three, "\"Mass\""}},
                 code);
  expect_refused(reading({"Head", 1}),
                 {{replaced(three, "=Mass", "=Head"), "2 segments called \"Head\""},
                  {nrrd("uchar", counted<std::uint8_t>()), "names no segments"}},
                 code);
  EXPECT_THAT(refusal_of(read("x", {"Head", 1}, "map.nii"), code),
              HasSubstr("only a .seg.nrrd file does"));
}

TEST(LabelMapFile, RefusesSegmentsThatAreNotThere) {
  expect_edits_refused(
      reading({"Mass", 1}), layered(kThreeSegments),
      {{"Segment1_Layer:=1", "Segment1_Layer:=2", "\"Mass\" is in layer 2: the file has 2"},
       {"Segment1_Layer:=1", "Segment1_Layer:=-1", "Segment1_Layer = -1"},
       {"Segment1_LabelValue:=1", "Segment1_LabelValue:=one", "Segment1_LabelValue = one"}});
  expect_refused(reading(), {{layered(""), "has 2 layers and names no segments"}});
}

TEST(LabelMapFile, RefusesAPlaceThatIsUnknown) {
  const std::string good = nrrd("uchar", counted<std::uint8_t>());
  expect_edits_refused(
      reading(), good,
      {{"space: left-posterior-superior\n", "", "space is missing"},
       {"left-posterior-superior", "scanner-xyz", "space = scanner-xyz"},
       {"space origin: (10,20,30)\n", "", "space origin is missing"},
       {"(10,20,30)", "(10,20)", "space origin = (10,20)"},
       {"(10,20,30)", "(10,20,nan)", "space origin = (10,20,nan)"},
       {"(10,20,30)", "none", "space origin = none"},
       {"space directions: (2,0,0) (0,3,0) (0,0,4)\n", "", "space directions is missing"},
       {"(0,0,4)", "", "must be three vectors"},
       {"(0,0,4)", "(0,0,4) (1,0,0)", "does not agree with 3 sizes"},
       {"(0,0,4)", "(0,0,inf)", "space directions ="},
       {"(0,0,4)", "(0,0,4", "must be three vectors"},
       {"(0,0,4)", "(0,6,0)", "linearly dependent"},
       {"(0,0,4)", "none", "does not agree"},
       {"(0,3,0) (0,0,4)", "none none", "must be three vectors"},
       {"endian: little", "space units: \"mm\" \"mm\" \"m\"", "space units = "}});
}

TEST(LabelMapFile, RefusesWhatIsNoVolume) {
  const std::string good = nrrd("uchar", counted<std::uint8_t>());
  expect_edits_refused(reading(), good,
                       {{"uchar", "block", "type = block"},
                        {"sizes: 2 3 2", "sizes: 2 3 0", "1 to 32767 voxels"},
                        {"sizes: 2 3 2", "sizes: 2 3 40000", "1 to 32767 voxels"},
                        {"sizes: 2 3 2", "sizes: 2 3 3", "holds 12 bytes"},
                        {"dimension: 3\nsizes: 2 3 2", "dimension: 2\nsizes: 2 6", "has 2 axes"}});
  const std::string packed = gzipped_labels(counted<std::uint8_t>());
  expect_refused(reading(), {{"PNG", "is no NRRD file"},
                             {good.substr(0, good.size() - 1), "holds 11 bytes"},
                             {nrrd("uchar", packed.substr(0, 12), kSpace, "", "gzip"),
                              "compressed pixels are"}});
  refusal_of(read_label_map("nowhere/map.nrrd"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
