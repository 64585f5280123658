// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_series.hpp"

#include <gmock/gmock.h>

#include <cstdint>
#include <cstdlib>
#include <map>
#include <sstream>
#include <vector>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/dicom/dicom_bytes.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using test_support::put;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

// Sagittal images of 3 columns and 2 rows: rows run from the nose to the back, columns downwards.
struct Image {
  std::map<Tag, std::pair<std::string, std::string>> elements;
  explicit Image(const std::string& place, std::int16_t first = 0) {
    set({0x0008, 0x0016}, "UI", even("1.2.840.10008.5.1.4.1.1.4", '\0'));
    set({0x0008, 0x0018}, "UI", even("1.2.3." + std::to_string(first + 5000), '\0'));
    set({0x0008, 0x103e}, "LO", "T1 sagittal ");
    set({0x0018, 0x5100}, "CS", "HFS ");
    set({0x0020, 0x000e}, "UI", even("1.2.3", '\0'));
    set({0x0020, 0x0032}, "DS", even(place + "\\-100\\50"));
    set({0x0020, 0x0037}, "DS", even("0\\1\\0\\0\\0\\-1"));
    set({0x0028, 0x0002}, "US", us(1));
    set({0x0028, 0x0010}, "US", us(2));
    set({0x0028, 0x0011}, "US", us(3));
    set({0x0028, 0x0030}, "DS", even("2\\0.5"));
    set({0x0028, 0x0100}, "US", us(16));
    set({0x0028, 0x0101}, "US", us(12));
    set({0x0028, 0x0103}, "US", us(0));
    std::string pixels;
    for (std::int16_t i = 0; i < 6; ++i) put(pixels, static_cast<std::int16_t>(first + i));
    set({0x7fe0, 0x0010}, "OW", pixels);
  }
  Image& set(Tag tag, const std::string& type, const std::string& value) {
    elements[tag] = {type, value};
    return *this;
  }
  std::string bytes() const {
    std::string out = file_head();
    for (const auto& [tag, element] : elements)
      put_element(out, tag, element.first, element.second);
    return out;
  }
};

class DicomSeriesOf : public testing::Test {
 protected:
  DicomSeriesOf() {
    add("c.dcm", Image("-20", 10));  // neither name nor order counts
    add("a.dcm", Image("-16", 20));
    add("b.dcm", Image("-24", 0));
  }
  void add(const std::string& name, const Image& image) { folder.write(name, image.bytes()); }
  std::string refusal() { return refusal_of(read_dicom_series(folder.path())); }
  TemporaryFolder folder;
};

TEST_F(DicomSeriesOf, VoxelsLieWhereTheTagsSay) {
  folder.write("readme.txt", "hello");
  const auto series = value_or_fail(read_dicom_series(folder.path()));
  const VoxelImage& image = series.image;
  EXPECT_THAT(image.dims, ElementsAre(3, 2, 3));
  EXPECT_EQ(series.description, "T1 sagittal");
  EXPECT_EQ(series.patient_position, "HFS");
  EXPECT_EQ(series.other_files, 1);
  // r x c = (0, 1, 0) x (0, 0, -1) = (-1, 0, 0) in LPS: from the patient's left to the right.
  EXPECT_LT((image.T_ras_voxel * Vec3(0, 0, 0) - Vec3(16, 100, 50)).norm(), 1e-9);
  EXPECT_LT((image.T_ras_voxel * Vec3(2, 1, 2) - Vec3(24, 99, 48)).norm(), 1e-9);
  EXPECT_EQ(image.at(0, 0, 0), 20.0F);
  EXPECT_EQ(image.at(2, 1, 2), 5.0F);
}

TEST_F(DicomSeriesOf, ValuesAreSignedAndScaledAsTheTagsSay) {
  for (const auto& [name, place] :
       {std::pair{"a.dcm", "-16"}, {"b.dcm", "-24"}, {"c.dcm", "-20"}}) {
    Image image(place, -3);
    image.set({0x0028, 0x0103}, "US", us(1));
    image.set({0x0028, 0x1052}, "DS", even("-1"));
    image.set({0x0028, 0x1053}, "DS", even("0.5"));
    add(name, image);
  }
  const auto series = value_or_fail(read_dicom_series(folder.path()));
  EXPECT_EQ(series.image.at(0, 0, 0), -2.5F);
  EXPECT_EQ(series.image.at(2, 1, 0), 0.0F);
}

TEST_F(DicomSeriesOf, WhatIsNoVolumeIsRefusedByName) {
  add("b.dcm", Image("-24").set({0x0020, 0x000e}, "UI", even("1.2.4", '\0')));
  EXPECT_THAT(refusal(),
              AllOf(HasSubstr("several series"), HasSubstr("\"T1 sagittal\" of 2 images")));
  add("b.dcm", Image("-24").set({0x0020, 0x0052}, "UI", even("1.2.5", '\0')));
  EXPECT_THAT(refusal(),
              HasSubstr("a.dcm and b.dcm differ in FrameOfReferenceUID (0020,0052), \"\" "
                        "and \"1.2.5\""));
  add("b.dcm", Image("-24").set({0x0028, 0x0030}, "DS", even("2\\0.6")));
  EXPECT_THAT(refusal(), HasSubstr("differ in pixel spacing"));
  add("b.dcm", Image("-24").set({0x0020, 0x0037}, "DS", even("1\\0\\0\\0\\1\\0")));
  EXPECT_THAT(refusal(), HasSubstr("differ in direction"));
}

TEST_F(DicomSeriesOf, PlacesOfNoVolumeAreCalledWhatTheyAre) {
  const auto at = [](const std::string& x, const std::string& y) {
    return Image(x).set({0x0020, 0x0032}, "DS", even(x + "\\" + y + "\\50"));
  };
  add("b.dcm", Image("-324"));
  EXPECT_THAT(refusal(), HasSubstr("a gap of 304.000 mm between c.dcm at (-20, -100, 50) and b.dcm "
                                   "at (-324, -100, 50), where 4.000 mm are usual: is a file "
                                   "missing"));
  add("b.dcm", Image("-25"));
  EXPECT_THAT(refusal(), HasSubstr("not evenly spaced: c.dcm at (-20, -100, 50) and b.dcm at (-25, "
                                   "-100, 50) lie 5.000 mm apart, where 4.000 mm are usual"));
  add("b.dcm", Image("-20"));
  EXPECT_THAT(refusal(), AllOf(HasSubstr("b.dcm at (-20, -100, 50)"), HasSubstr("c.dcm at (-20, "),
                               HasSubstr("lie at one place")));
  add("b.dcm", at("-24", "200"));
  EXPECT_THAT(refusal(), HasSubstr("b.dcm at (-24, 200, 50) lies 300.00 mm beside the others"));
  add("c.dcm", at("-20", "-101")), add("b.dcm", at("-24", "-102"));
  EXPECT_THAT(refusal(), HasSubstr("tilted by 14 degrees"));
}

TEST_F(DicomSeriesOf, AWrongTagIsNamedWithItsFile) {
  const auto with = [&](Tag tag, const std::string& type, const std::string& value) {
    add("b.dcm", Image("-24").set(tag, type, value));
    return refusal();
  };
  EXPECT_THAT(with({0x0020, 0x0032}, "DS", "1\\2 "),
              AllOf(HasSubstr("b.dcm"), HasSubstr("(0020,0032)")));
  EXPECT_THAT(with({0x0020, 0x0037}, "DS", even("0\\2\\0\\0\\0\\-1")), HasSubstr("(0020,0037)"));
  EXPECT_THAT(with({0x0028, 0x0030}, "DS", "0\\1 "), HasSubstr("(0028,0030)"));
  for (const std::string slope : {"0", "nan", "1e999"}) {
    EXPECT_THAT(with({0x0028, 0x1053}, "DS", even(slope)),
                HasSubstr("b.dcm: RescaleSlope (0028,1053): \"" + slope + "\": must be finite"));
  }
  EXPECT_THAT(with({0x0028, 0x1053}, "DS", even("1e300")), HasSubstr("would be too large"));
  EXPECT_THAT(with({0x0028, 0x0008}, "IS", "12"), HasSubstr("enhanced"));
  EXPECT_THAT(with({0x0028, 0x0002}, "US", us(3)), HasSubstr("colour"));
  EXPECT_THAT(with({0x0028, 0x0010}, "US", us(9)), HasSubstr("has 6 pixels"));
  EXPECT_THAT(with({0x0028, 0x0100}, "US", us(12)), HasSubstr("(0028,0100"));
  const std::string whole = Image("-24").bytes();
  folder.write("b.dcm", whole.substr(0, whole.size() - 3));
  EXPECT_THAT(refusal(), HasSubstr("b.dcm: is damaged"));
}

TEST_F(DicomSeriesOf, AFolderWithoutImagesIsRefused) {
  const TemporaryFolder empty;
  EXPECT_THAT(refusal_of(read_dicom_series(empty.path())), HasSubstr("no DICOM image (0 files)"));
  std::filesystem::create_directories(empty / "CT");
  std::filesystem::create_directories(empty / "study/T1");
  EXPECT_THAT(refusal_of(read_dicom_series(empty.path())), EndsWith("no DICOM image (0 files)"));
  empty.write("study/T1/1.dcm", Image("-24").bytes());
  EXPECT_THAT(refusal_of(read_dicom_series(empty.path())),
              EndsWith("no DICOM image (0 files); folders below do, give one of them: \"" +
                       (empty / "study/T1").string() + "\""));
  EXPECT_THAT(refusal_of(read_dicom_series(empty / "nowhere"), ErrorCode::kNotFound),
              HasSubstr("nowhere"));
}

// The numbers of tag (0020,0032) or (0028,0030) in a file in explicit little endian, by its bytes.
std::vector<double> numbers_of(const std::string& bytes, const char* tag) {
  const std::size_t at = bytes.find(std::string(tag, 4) + "DS");
  std::string text = bytes.substr(at + 8, static_cast<unsigned char>(bytes[at + 6]));
  std::replace(text.begin(), text.end(), '\\', ' ');
  std::istringstream in(text);
  std::vector<double> numbers;
  for (double number; in >> number;) numbers.push_back(number);
  return numbers;
}

TEST(RealDicomSeries, EveryImageLiesWhereItsOwnTagsSay) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const fs::path folder = fs::path(data) / "dicom_t1/HFS";
  const auto series = value_or_fail(read_dicom_series(folder));
  EXPECT_EQ(series.image.dims[2], 35);
  EXPECT_EQ(series.patient_position, "HFS");
  int found = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const auto place = numbers_of(test_support::content_of(entry.path()), "\x20\x00\x32\x00");
    ASSERT_EQ(place.size(), 3u);
    const Vec3 ras(-place[0], -place[1], place[2]);
    for (int k = 0; k < 35; ++k) {
      found += (series.image.T_ras_voxel * Vec3(0, 0, k) - ras).norm() < 0.01 ? 1 : 0;
    }
  }
  EXPECT_EQ(found, 35);
}

}  // namespace
}  // namespace brainshift::io
