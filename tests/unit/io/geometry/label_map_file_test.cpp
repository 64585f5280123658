// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/label_map_file.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::AllOf;
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

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

Result<VoxelImage> read(const std::string& content, const LabelChoice& choice = {},
                        const std::string& name = "map.seg.nrrd") {
  const TemporaryFolder folder;
  return read_label_map(folder.write(name, content), choice);
}

std::string refusal(const std::string& content, ErrorCode code = ErrorCode::kUnreadable,
                    const LabelChoice& choice = {}) {
  const auto image = read(content, choice);
  if (image) return {};
  EXPECT_EQ(image.error().code, code) << image.error().message;
  EXPECT_THAT(image.error().message, HasSubstr("map.seg.nrrd: "));
  return image.error().message;
}

TEST(LabelMapFile, ReadsEveryTypeEncodingAndByteOrder) {
  const auto expect_counted = [](const std::string& content) {
    const auto image = read(content);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_THAT(image->dims, ElementsAre(2, 3, 2));
    EXPECT_THAT(image->values, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
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

TEST(LabelMapFile, EverySpaceBecomesRas) {
  for (const auto& [name, signs] :
       {std::pair{"left-posterior-superior", Vec3(-1, -1, 1)}, std::pair{"LPS", Vec3(-1, -1, 1)},
        std::pair{"right-anterior-superior", Vec3(1, 1, 1)}, std::pair{"RAS", Vec3(1, 1, 1)},
        std::pair{"left-anterior-superior", Vec3(-1, 1, 1)}, std::pair{"LAS", Vec3(-1, 1, 1)}}) {
    // An oblique grid whose third axis points down.
    const auto image =
        read(nrrd("uchar", counted<std::uint8_t>(),
                  "space: " + std::string(name) +
                      "\nspace directions: (0,2,0) (-3,0,0) (0.5,0,-4)\n"
                      "space origin: (10,20,30)\nspace units: \"mm\" \"mm\" \"mm\"\n"));
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->T_ras_voxel * Vec3(0, 0, 0), signs.cwiseProduct(Vec3(10, 20, 30)));
    EXPECT_EQ(image->T_ras_voxel * Vec3(1, 2, 3),
              signs.cwiseProduct(Vec3(10 - 6 + 1.5, 20 + 2, 30 - 12)));
  }
}

TEST(LabelMapFile, ASegmentIsChosenByName) {
  const auto voxels = [](const char* name, int label) {
    const auto image = read(layered(kThreeSegments), {name, label});
    EXPECT_TRUE(image) << image.error().message;
    return image ? image->values : std::vector<float>{};
  };
  EXPECT_THAT(voxels("Head", 1), ElementsAre(1, 1, 0, 0));
  EXPECT_THAT(voxels("Mass", 7), ElementsAre(0, 7, 7, 7));
  EXPECT_THAT(voxels("Edema, left", 1), ElementsAre(0, 0, 1, 0));
}

TEST(LabelMapFile, TheOnlySegmentNeedsNoName) {
  const std::string keys = "Segment0_ID:=Segment_1\nSegment0_LabelValue:=4\n";
  const auto image = read(nrrd("uchar", counted<std::uint8_t>(), kSpace, keys), {"", 9});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_THAT(image->values, ElementsAre(0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0));
}

TEST(LabelMapFile, OldSegmentationsHaveOneSegmentInEachLayer) {
  const auto image = read(layered("Segment0_Name:=a\nSegment1_Name:=b\n"), {"b", 1});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_THAT(image->values, ElementsAre(0, 1, 1, 1));
}

TEST(LabelMapFile, LayersMayBeTheLastAxis) {
  std::string text = replaced(layered(kThreeSegments), "sizes: 2 2 2 1", "sizes: 2 2 1 2");
  text = replaced(text, "none (1,0,0) (0,1,0) (0,0,1)", "(1,0,0) (0,1,0) (0,0,1) none");
  const auto image = read(text, {"Mass", 1});
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_THAT(image->values, ElementsAre(0, 1, 0, 1));
}

TEST(LabelMapFile, RefusesAChoiceThatIsNone) {
  const ErrorCode code = ErrorCode::kInvalidArgument;
  EXPECT_THAT(refusal(layered(kThreeSegments), code),
              HasSubstr("has 3 segments: name one of \"Head\", \"Mass\", \"Edema, left\""));
  EXPECT_THAT(refusal(layered(kThreeSegments), code, {"mass", 1}),
              AllOf(HasSubstr("no segment called \"mass\""), HasSubstr("\"Mass\"")));
  EXPECT_THAT(refusal(replaced(layered(kThreeSegments), "=Mass", "=Head"), code, {"Head", 1}),
              HasSubstr("2 segments called \"Head\""));
  EXPECT_THAT(refusal(nrrd("uchar", counted<std::uint8_t>()), code, {"Head", 1}),
              HasSubstr("names no segments"));
  const auto nifti = read("x", {"Head", 1}, "map.nii");
  ASSERT_FALSE(nifti);
  EXPECT_EQ(nifti.error().code, code);
  EXPECT_THAT(nifti.error().message, HasSubstr("only a .seg.nrrd file does"));
}

TEST(LabelMapFile, RefusesSegmentsThatAreNotThere) {
  const auto bad = [](const char* what, const char* with) {
    return refusal(replaced(layered(kThreeSegments), what, with), ErrorCode::kUnreadable,
                   {"Mass", 1});
  };
  EXPECT_THAT(bad("Segment1_Layer:=1", "Segment1_Layer:=2"),
              HasSubstr("\"Mass\" is in layer 2: the file has 2"));
  EXPECT_THAT(bad("Segment1_Layer:=1", "Segment1_Layer:=-1"), HasSubstr("Segment1_Layer = -1"));
  EXPECT_THAT(bad("Segment1_LabelValue:=1", "Segment1_LabelValue:=one"),
              HasSubstr("Segment1_LabelValue = one"));
  EXPECT_THAT(refusal(layered("")), HasSubstr("has 2 layers and names no segments"));
}

TEST(LabelMapFile, RefusesAPlaceThatIsUnknown) {
  const std::string good = nrrd("uchar", counted<std::uint8_t>());
  const auto bad = [&](const char* what, const char* with) {
    return refusal(replaced(good, what, with));
  };
  EXPECT_THAT(bad("space: left-posterior-superior\n", ""), HasSubstr("space is missing"));
  EXPECT_THAT(bad("left-posterior-superior", "scanner-xyz"), HasSubstr("space = scanner-xyz"));
  EXPECT_THAT(bad("space origin: (10,20,30)\n", ""), HasSubstr("space origin is missing"));
  EXPECT_THAT(bad("(10,20,30)", "(10,20)"), HasSubstr("space origin = (10,20)"));
  EXPECT_THAT(bad("(10,20,30)", "(10,20,nan)"), HasSubstr("space origin = (10,20,nan)"));
  EXPECT_THAT(bad("(10,20,30)", "none"), HasSubstr("space origin = none"));
  EXPECT_THAT(bad("space directions: (2,0,0) (0,3,0) (0,0,4)\n", ""),
              HasSubstr("space directions is missing"));
  EXPECT_THAT(bad("(0,0,4)", ""), HasSubstr("must be three vectors"));
  EXPECT_THAT(bad("(0,0,4)", "(0,0,4) (1,0,0)"), HasSubstr("does not agree with 3 sizes"));
  EXPECT_THAT(bad("(0,0,4)", "(0,0,inf)"), HasSubstr("space directions ="));
  EXPECT_THAT(bad("(0,0,4)", "(0,0,4"), HasSubstr("must be three vectors"));
  EXPECT_THAT(bad("(0,0,4)", "(0,6,0)"), HasSubstr("linearly dependent"));
  EXPECT_THAT(bad("(0,0,4)", "none"), HasSubstr("does not agree"));
  EXPECT_THAT(bad("(0,3,0) (0,0,4)", "none none"), HasSubstr("must be three vectors"));
  EXPECT_THAT(bad("endian: little", "space units: \"mm\" \"mm\" \"m\""),
              HasSubstr("space units = "));
}

TEST(LabelMapFile, RefusesWhatIsNoVolume) {
  const std::string good = nrrd("uchar", counted<std::uint8_t>());
  const auto bad = [&](const char* what, const char* with) {
    return refusal(replaced(good, what, with));
  };
  EXPECT_THAT(refusal("PNG"), HasSubstr("is no NRRD file"));
  EXPECT_THAT(bad("uchar", "block"), HasSubstr("type = block"));
  EXPECT_THAT(bad("sizes: 2 3 2", "sizes: 2 3 0"), HasSubstr("1 to 32767 voxels"));
  EXPECT_THAT(bad("sizes: 2 3 2", "sizes: 2 3 40000"), HasSubstr("1 to 32767 voxels"));
  EXPECT_THAT(bad("sizes: 2 3 2", "sizes: 2 3 3"), HasSubstr("holds 12 bytes"));
  EXPECT_THAT(bad("dimension: 3\nsizes: 2 3 2", "dimension: 2\nsizes: 2 6"),
              HasSubstr("has 2 axes"));
  EXPECT_THAT(refusal(good.substr(0, good.size() - 1)), HasSubstr("holds 11 bytes"));
  const std::string packed = gzipped_labels(counted<std::uint8_t>());
  EXPECT_THAT(refusal(nrrd("uchar", packed.substr(0, 12), kSpace, "", "gzip")),
              HasSubstr("compressed pixels are"));
  const auto none = read_label_map("nowhere/map.nrrd");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
