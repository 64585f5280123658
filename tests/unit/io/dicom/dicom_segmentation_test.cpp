// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_segmentation.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/dicom/dicom_bytes.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

class DicomSegmentationOf : public testing::Test {
 protected:
  DicomSegmentation read(const Segmentation& of) {
    return value_or_fail(read_dicom_segmentation(folder.write("a.dcm", of.bytes())));
  }
  std::string refusal(const Segmentation& of) {
    return refusal_of(read_dicom_segmentation(folder.write("a.dcm", of.bytes())));
  }
  TemporaryFolder folder;
};

TEST_F(DicomSegmentationOf, EachFrameIsItsSegmentsSliceWhereItsPlaneSays) {
  const auto seg = read(Segmentation().set(0, 14).set(1, 4).set(2, 4).set(2, 0));
  EXPECT_THAT(seg.names, ElementsAre(Pair(1, "Tumour"), Pair(2, "Oedema")));
  EXPECT_THAT(seg.grid.dims, ElementsAre(3, 5, 3));  // the slice between has no frame
  EXPECT_LT((seg.grid.T_ras_voxel * Vec3(2, 4, 2) - Vec3(4, -11, 14)).norm(), 1e-9);
  const VoxelImage both = label_map(seg, {1, 2}), tumour = label_map(seg, {1});
  EXPECT_EQ(both.at(2, 4, 2), 2.0F);
  EXPECT_EQ(both.at(1, 1, 0), 2.0F);  // in both
  EXPECT_EQ(tumour.at(1, 1, 0), 1.0F);
  EXPECT_EQ(std::count(both.values.begin(), both.values.end(), 0.0F), 42);
  EXPECT_EQ(std::count(tumour.values.begin(), tumour.values.end(), 0.0F), 44);
}

TEST_F(DicomSegmentationOf, FractionsCountFromHalfOn) {
  Segmentation of;
  of.bits = 8;
  const auto seg = read(of.set(1, 3, 50).set(1, 4, 49));
  EXPECT_EQ(std::count(seg.segments.at(1).begin(), seg.segments.at(1).end(), 1), 1);
  EXPECT_EQ(seg.segments.at(1)[3], 1);
}

TEST_F(DicomSegmentationOf, WhatIsWrongIsNamed) {
  Segmentation of;
  of.set(0, 0).frames[1].place = "11.1";
  EXPECT_THAT(refusal(of),
              HasSubstr("frame 2 at (-5, 7, 11.1) lies 1.100 mm from frame 3 at "
                        "(-5, 7, 10): no multiple of SpacingBetweenSlices (0018,0088) or "
                        "SliceThickness (0018,0050), 2.000 mm"));
  of.frames[1] = {3, "10"};
  EXPECT_THAT(refusal(of), HasSubstr("frame 2 is of segment 3, which is not listed"));
  of.frames[1] = {2, "10"};
  EXPECT_THAT(refusal(of), HasSubstr("frame 2 at (-5, 7, 10) and frame 3 at (-5, 7, 10) of segment "
                                     "2 lie at one place"));
  of.frames[1] = {1, "12", "-5\\307"};
  EXPECT_THAT(refusal(of), HasSubstr("frame 2 at (-5, 307, 12) lies 300.00 mm beside the others"));
  of.frames[0].beside = "-5\\9", of.frames[1].beside = "-5\\8";
  EXPECT_THAT(refusal(of), HasSubstr("tilted by 26.6 degrees"));
  of.frames[0].beside = "-5\\7";
  of.frames[1] = {1, "x"};
  EXPECT_THAT(refusal(of), HasSubstr("(0020,0032)"));
  of.frames[1] = {1, "10"};
  of.pixels.resize(4);
  EXPECT_THAT(refusal(of), HasSubstr("has 4 bytes, too few for 3 frames of 3 x 5"));
  of.bits = 16;
  EXPECT_THAT(refusal(of), HasSubstr("16 bits"));
  EXPECT_THAT(refusal_of(read_dicom_segmentation(folder.write("b.dcm", "hello"))),
              HasSubstr("b.dcm"));
}

}  // namespace
}  // namespace brainshift::io
