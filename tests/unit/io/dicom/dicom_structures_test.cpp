// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_structures.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/dicom_files.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/dicom/dicom_bytes.hpp"

namespace brainshift::io {
namespace {

using test_support::DrawnContour;
using test_support::DrawnStructure;
using test_support::StructureSet;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class DicomStructuresOf : public testing::Test {
 protected:
  DicomStructuresOf() {
    set.structures = {{7, "GTV", {triangle(4.0), triangle(6.0)}}, {3, "Isocentre", {}}};
  }
  static DrawnContour triangle(double s) {
    return {columns_of({Vec3(1, 2, s), Vec3(11, 2, s), Vec3(1, 12, s)})};
  }
  DicomStructures read() {
    test_support::write_structure_set(folder / "rs.dcm", set);
    return value_or_fail(read_dicom_structures(folder / "rs.dcm"));
  }
  std::string refusal() {
    test_support::write_structure_set(folder / "rs.dcm", set);
    return refusal_of(read_dicom_structures(folder / "rs.dcm"));
  }
  TemporaryFolder folder;
  StructureSet set;
};

TEST_F(DicomStructuresOf, ContoursAreWhereTheFileSaysInRas) {
  const auto read_set = read();
  ASSERT_EQ(read_set.structures.size(), 2u);
  const DicomStructure& gtv = read_set.structures[0];
  EXPECT_EQ(gtv.number, 7);
  EXPECT_EQ(gtv.name, "GTV");
  EXPECT_EQ(gtv.defect, "");
  ASSERT_EQ(gtv.contours.size(), 2u);
  EXPECT_LT((gtv.contours[1] - set.structures[0].contours[1].points).norm(), 1e-9);
  EXPECT_EQ(read_set.structures[1].defect, "has no contour");
  EXPECT_EQ(gtv.frame_of_reference, "1.2.3.4");
  EXPECT_THAT(gtv.series, ElementsAre("1.2.3"));
}

TEST_F(DicomStructuresOf, EachStructureLiesInItsOwnFrameOfReference) {
  set.other_frame = "1.2.3.7";
  set.structures[1].frame_of_reference = "1.2.3.7";
  const auto structures = read().structures;
  EXPECT_EQ(structures[0].frame_of_reference, "1.2.3.4");
  EXPECT_THAT(structures[0].series, ElementsAre("1.2.3"));
  EXPECT_EQ(structures[1].frame_of_reference, "1.2.3.7");
  EXPECT_THAT(structures[1].series, ElementsAre("1.2.88"));
  set.structures[1].frame_of_reference = " ";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("(3006,0024): structure 3 \"Isocentre\" has none"),
                               HasSubstr("names 2 frames of reference")));
}

// DS, their type, has a length of 16 bits in the file: longer ones are written as UN.
TEST_F(DicomStructuresOf, ContoursLongerThan64KiBAreReadWhole) {
  Points& points = set.structures[0].contours[0].points;
  points.resize(3, 4000);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double angle = 0.001 * static_cast<double>(i);
    points.col(i) = Vec3(40.0 * std::cos(angle), 30.0 * std::sin(angle), 4.0);
  }
  const Points read_points = read().structures[0].contours[0];
  EXPECT_THAT(test_support::content_of(folder / "rs.dcm"),
              HasSubstr(std::string("\x06\x30\x50\x00UN", 6)));
  ASSERT_EQ(read_points.cols(), 4000);
  EXPECT_LT((read_points - points).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(DicomStructuresOf, ARepeatedEndIsOnePointAndXorIsAContour) {
  Points& points = set.structures[0].contours[0].points;
  points.conservativeResize(3, 4);
  points.col(3) = points.col(0);
  set.structures[0].contours[1].type = "CLOSEDPLANAR_XOR";
  const DicomStructure gtv = read().structures[0];
  EXPECT_EQ(gtv.contours[0].cols(), 3);
  EXPECT_EQ(gtv.contours.size(), 2u);
}

TEST_F(DicomStructuresOf, WhatEnclosesNothingSaysWhy) {
  set.structures[0].contours[1].type = "OPEN_PLANAR";
  set.structures[1].contours = {{Points::Zero(3, 1), "POINT"}};
  const auto read_set = read();
  EXPECT_EQ(read_set.structures[0].defect, "contour 2 is OPEN_PLANAR");
  EXPECT_EQ(read_set.structures[1].defect, "contour 1 is POINT");
}

TEST_F(DicomStructuresOf, WhatIsWrongIsNamed) {
  const StructureSet good = set;
  set.structures[0].contours[1].points_said = 5;
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("rs.dcm"), HasSubstr("(3006,0050)"),
                    HasSubstr("structure 7 \"GTV\", contour 2: 9 numbers for 5 points")));
  set = good;
  set.structures[0].contours[0].points(1, 2) = 2e6;
  EXPECT_THAT(refusal(),
              HasSubstr("structure 7 \"GTV\", contour 1: \"-2000000.000000\" is no place"));
  set = good;
  set.structures[1].number = 7;
  EXPECT_THAT(refusal(), HasSubstr("7 stands for \"GTV\" and \"Isocentre\""));
  set = good;
  set.structures.clear();
  EXPECT_THAT(refusal(), HasSubstr("holds no structure"));
  const auto seg = folder.write("seg.dcm", Segmentation().set(1, 4).bytes());
  EXPECT_THAT(refusal_of(read_dicom_structures(seg)), HasSubstr("no structure set"));
  EXPECT_FALSE(is_dicom_structures(seg));
  set = good;
  read();
  EXPECT_TRUE(is_dicom_structures(folder / "rs.dcm"));
  const std::string whole = test_support::content_of(folder / "rs.dcm");
  EXPECT_THAT(refusal_of(read_dicom_structures(
                  folder.write("cut.dcm", whole.substr(0, whole.size() - 90)))),
              AllOf(HasSubstr("cut.dcm"), HasSubstr("damaged")));
  EXPECT_FALSE(is_dicom_structures(folder.write("a.nii", "hello")));
  EXPECT_THAT(refusal_of(read_dicom_structures(folder / "none.dcm"), ErrorCode::kNotFound),
              HasSubstr("none.dcm"));
}

}  // namespace
}  // namespace brainshift::io
