// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/pair_file.hpp"

#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::replaced;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// ---- files ----

constexpr const char* kTag =
    "MNI Tag Point File\nVolumes = 2;\n%a comment\n\nPoints =\n"
    " 1 2 3 1.5 2.5 3.5 \"a\"\n 4 5 6 4 5 -6e0 1 2 3 \"b c\";\n";

void expect_two(const std::string& name, const std::string& content,
                const std::vector<std::string>& names = {"a", "b c"}) {
  SCOPED_TRACE(content);
  const TemporaryFolder folder;
  const auto pairs = value_or_fail(read_pairs(folder.write(name, content)));
  EXPECT_EQ(pairs.names, names);
  EXPECT_THAT(pairs.first, ElementsAre(Vec3(1, 2, 3), Vec3(4, 5, 6)));
  EXPECT_THAT(pairs.second, ElementsAre(Vec3(1.5, 2.5, 3.5), Vec3(4, 5, -6)));
  EXPECT_TRUE(pairs.left_out.empty());
}

// read_pairs of a file of this name; an error begins with its path.
auto reading_pairs(const std::string& name) {
  return [name](const std::string& content) {
    const TemporaryFolder folder;
    const auto path = folder.write(name, content);
    auto read = read_pairs(path);
    if (!read) {
      EXPECT_THAT(read.error().message, testing::StartsWith(path.string() + ": "));
    }
    return read;
  };
}

TEST(PairFile, TagsAndTablesSayTheSame) {
  expect_two("a.tag", kTag);
  expect_two("a.tag", replaced(kTag, "\"b c\";", "\"b c\"\n;"));
  expect_two("a.csv", "a,1,2,3,1.5,2.5,3.5\n# a comment\nb c,4,5,6,4,5,-6\n");
  expect_two("a.csv", "1,2,3,1.5,2.5,3.5\n4,5,6,4,5,-6\n", {"", ""});
}

TEST(PairFile, AHeadingOrdersTheColumns) {
  expect_two("a.csv",
             "row,x_src_mm,y_src_mm,z_src_mm,x_dst_mm,y_dst_mm,z_dst_mm,dist_mm\n"
             "a,1,2,3,1.5,2.5,3.5,0.9\nb c,4,5,6,4,5,-6,12\n");
  expect_two("a.csv",
             "x_during,y_during,z_during,label,note,z_before,y_before,x_before\n"
             "1.5,2.5,3.5,a,,3,2,1\n4,5,-6,b c,\"x, y\",6,5,4\n");
}

TEST(PairFile, AHeadingIsObeyedAndNotSkipped) {
  expect_two("a.csv",
             "name,x_after,y_after,z_after,x_before,y_before,z_before\n"
             "a,1.5,2.5,3.5,1,2,3\nb c,4,5,-6,4,5,6\n");
  expect_two("a.csv",
             "Name,L (before),P (before),S (before),x_Deformed,y_Deformed,z_Deformed,defined\n"
             "a,-1,-2,3,1.5,2.5,3.5,1\nlost,0,0,0,0,0,0,0\nb c,-4,-5,6,4,5,-6,1\n");
  expect_refused(reading_pairs("a.csv"),
                 {{"name,x,y,z,u,v,w\na,1,2,3,4,5,6\n", "line 1: \"name,x,y,z,u,v,w\" must be"},
                  {"x1,y1,z1,x2,y2,z2\n1,2,3,4,5,6\n", "a heading with x_before"}});
}

TEST(PairFile, CommentsStandBehindTags) {
  expect_two("a.tag", replaced(replaced(kTag, "\"a\"", "\"a\" %TimeStamp 2020"), "\"b c\";",
                               "\"b c\" # last;"));
  expect_two("a.tag", replaced(kTag, "\"b c\";", "\"b c\" %x\n; % end"));
}

TEST(PairFile, APairThatIsThereTwiceWouldCountTwice) {
  expect_refused(reading_pairs("a.csv"), {{"a,1,2,3,4,5,6\nb,1,2,3,4,5,7\nc,1,2,3,4,5,6\n",
                                           "landmarks 1 and 3 are the same pair, \"c\""}});
}

TEST(PairFile, TwoListsOfSlicerArePairedByName) {
  const TemporaryFolder folder;
  const auto before = folder.write("before.fcsv",
                                   "# CoordinateSystem = LPS\n1,-1,-2,3,0,0,0,1,1,1,0,a,,\n"
                                   "2,-4,-5,6,0,0,0,1,1,1,0,b c,,\n3,0,0,0,0,0,0,1,1,1,0,lost,,\n");
  const auto during = folder.write("during.mrk.json",
                                   R"({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
      "controlPoints": [{"label": "b c", "position": [4, 5, -6]},
                        {"label": "a", "position": [1.5, 2.5, 3.5]}]}]})");
  const auto pairs = value_or_fail(read_pairs(before, during));
  EXPECT_THAT(pairs.names, ElementsAre("a", "b c"));
  EXPECT_THAT(pairs.first, ElementsAre(Vec3(1, 2, 3), Vec3(4, 5, 6)));
  EXPECT_THAT(pairs.second, ElementsAre(Vec3(1.5, 2.5, 3.5), Vec3(4, 5, -6)));
  EXPECT_THAT(pairs.left_out, ElementsAre("lost"));
}

TEST(PairFile, RefusesTwoListsThatCannotBePaired) {
  const TemporaryFolder folder;
  const auto one = folder.write("one.csv", "a,1,2,3\n"),
             other = folder.write("other.csv", "b,1,2,3\n");
  EXPECT_THAT(refusal_of(read_pairs(one, other), ErrorCode::kEmptySet),
              AllOf(HasSubstr("one.csv and "), HasSubstr("other.csv: no name is in both")));
  refusal_of(read_pairs(one, folder / "none.csv"), ErrorCode::kNotFound);
  refusal_of(read_pairs(folder / "none.csv", one), ErrorCode::kNotFound);
}

TEST(PairFile, RefusesTagFilesThatAreDamaged) {
  expect_refused(reading_pairs("a.tag"),
                 {{"", "is no MNI tag point file"}, {"1 2 3 4 5 6\n", "is no MNI tag point file"}});
  expect_edits_refused(reading_pairs("a.tag"), kTag,
                       {{"Volumes = 2;", "Volumes = 1;", "\"Volumes = 1;\" must be 2"},
                        {"Volumes = 2;\n", "", "comes before \"Volumes = 2;\""},
                        {"Points =", "Tags =", "line 5: \"Tags =\" is neither"},
                        {"1.5 2.5 3.5", "1.5 2.5", "line 6:"},
                        {"1.5 2.5 3.5", "1.5 2.5 3.5 4", "6 or 9 finite numbers"},
                        {"2.5", "nan", "line 6:"},
                        {"\"a\"", "\"a", "line 6:"},
                        {"\"a\"", "\"a\" 7", "line 6:"},
                        {"\"b c\";", "\"b c\"", "is truncated"}});
  expect_refused(reading_pairs("a.tag"),
                 {{std::string(kTag) + "7 8 9 7 8 9\n", "comes behind the last point"}});
  expect_refused(reading_pairs("a.tag"),
                 {{"MNI Tag Point File\nVolumes = 2;\nPoints =\n;\n", "no landmark"}},
                 ErrorCode::kEmptySet);
}

TEST(PairFile, RefusesTablesOfAnotherShape) {
  expect_refused(
      reading_pairs("a.csv"),
      {{"1,2,3,4,5\n", "line 1: \"1,2,3,4,5\" must be 6 numbers"},
       {"x_src,y_src,z_src,x_dst,y_dst,k_dst,e,f\n1,2,3,4,5,6,7,8\n", "a heading with x_before"},
       {"x_src,y_src,z_src,x_dst,y_dst,z_dst,x_before,f\n1,2,3,4,5,6,7,8\n",
        "a heading with x_before"},
       {"1,2,3,4,5,6\n1,2,3,4,5\n", "line 2:"},
       {"1,2,3,4,5,6\n1,2,3,4,5,inf\n", "line 2:"}});
  expect_refused(reading_pairs("a.csv"), {{"", "no landmark"}}, ErrorCode::kEmptySet);
  expect_refused(reading_pairs("a.fcsv"), {{"x", "a second file must say"}});
  expect_refused(reading_pairs("a.txt"), {{"x", "must be a .csv or .tag file"}});
  refusal_of(read_pairs(std::filesystem::path("nowhere/a.csv")), ErrorCode::kNotFound);
}

// RESECT, patient 4 (Xiao et al. 2017, doi:10.1002/mp.12268).
TEST(PairFile, RealLandmarksAreTheSameInBothFormats) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const auto folder = std::filesystem::path(data) / "resect_case4";
  const auto table = value_or_fail(read_pairs(folder / "Case4-MRI-beforeUS.csv"));
  const auto tags = value_or_fail(read_pairs(folder / "Case4-MRI-beforeUS.tag"));
  EXPECT_EQ(table.names.size(), 15U);
  EXPECT_EQ(table.names, tags.names);
  EXPECT_EQ(table.first, tags.first);
  EXPECT_EQ(table.second, tags.second);
}

// ---- two lists by name ----

NamedPoints list(std::initializer_list<const char*> names, double shift = 0.0) {
  NamedPoints points;
  for (const char* name : names) {
    points.add(name, Vec3(shift + static_cast<double>(points.points.size()), 0, 0));
  }
  return points;
}

TEST(NamedPoints, PairsAreFoundByNameInWhateverOrder) {
  const auto pairs = value_or_fail(pair_by_name(list({"a", "b", "c"}), list({"d", "c", "a"}, 10)));
  EXPECT_THAT(pairs.names, ElementsAre("a", "c"));
  EXPECT_THAT(pairs.first, ElementsAre(Vec3(0, 0, 0), Vec3(2, 0, 0)));
  EXPECT_THAT(pairs.second, ElementsAre(Vec3(12, 0, 0), Vec3(11, 0, 0)));
  EXPECT_THAT(pairs.left_out, ElementsAre("b", "d"));
}

TEST(NamedPoints, RefusesNamesThatDoNotName) {
  const auto refusal = [](const NamedPoints& first, const NamedPoints& second, ErrorCode code) {
    return refusal_of(pair_by_name(first, second), code);
  };
  const ErrorCode bad = ErrorCode::kInvalidArgument;
  EXPECT_THAT(refusal(list({"a", "b", "a"}), list({"a"}), bad),
              HasSubstr("the first list has two points called \"a\""));
  EXPECT_THAT(refusal(list({"a"}), list({"b", "b"}), bad), HasSubstr("the second list"));
  EXPECT_THAT(refusal(list({"a"}), list({"a", ""}), bad),
              HasSubstr("point 2 of the second list has no name"));
  EXPECT_THAT(refusal(list({"a"}), list({"A"}), ErrorCode::kEmptySet),
              HasSubstr("no name is in both lists of 1 and 1 points"));
  EXPECT_FALSE(list({"a", ""}).all_named());
  EXPECT_TRUE(list({"a", "b"}).all_named());
}

TEST(NamedPoints, ColumnsKeepTheOrder) {
  const Points columns = columns_of({Vec3(1, 2, 3), Vec3(4, 5, 6)});
  ASSERT_EQ(columns.cols(), 2);
  EXPECT_EQ(Vec3(columns.col(1)), Vec3(4, 5, 6));
}

}  // namespace
}  // namespace brainshift::io
