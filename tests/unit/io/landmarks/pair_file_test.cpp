// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/pair_file.hpp"

#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kTag =
    "MNI Tag Point File\nVolumes = 2;\n%a comment\n\nPoints =\n"
    " 1 2 3 1.5 2.5 3.5 \"a\"\n 4 5 6 4 5 -6e0 1 2 3 \"b c\";\n";

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

void expect_two(const std::string& name, const std::string& content,
                const std::vector<std::string>& names = {"a", "b c"}) {
  SCOPED_TRACE(content);
  const TemporaryFolder folder;
  const auto pairs = read_pairs(folder.write(name, content));
  ASSERT_TRUE(pairs) << pairs.error().message;
  EXPECT_EQ(pairs->names, names);
  EXPECT_THAT(pairs->first, ElementsAre(Vec3(1, 2, 3), Vec3(4, 5, 6)));
  EXPECT_THAT(pairs->second, ElementsAre(Vec3(1.5, 2.5, 3.5), Vec3(4, 5, -6)));
  EXPECT_TRUE(pairs->left_out.empty());
}

std::string refusal(const std::string& name, const std::string& content,
                    ErrorCode code = ErrorCode::kUnreadable) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, content);
  const auto pairs = read_pairs(path);
  EXPECT_FALSE(pairs) << content;
  if (pairs) return {};
  EXPECT_EQ(pairs.error().code, code) << pairs.error().message;
  EXPECT_THAT(pairs.error().message, StartsWith(path.string() + ": "));
  return pairs.error().message;
}

TEST(PairFile, TagsAndTablesSayTheSame) {
  expect_two("a.tag", kTag);
  expect_two("a.tag", replaced(kTag, "\"b c\";", "\"b c\"\n;"));
  expect_two("a.csv", "a,1,2,3,1.5,2.5,3.5\n# a comment\nb c,4,5,6,4,5,-6\n");
  expect_two("a.csv", "name,x,y,z,u,v,w\na,1,2,3,1.5,2.5,3.5\nb c,4,5,6,4,5,-6\n");
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

TEST(PairFile, TwoListsOfSlicerArePairedByName) {
  const TemporaryFolder folder;
  const auto before = folder.write("before.fcsv",
                                   "# CoordinateSystem = LPS\n1,-1,-2,3,0,0,0,1,1,1,0,a,,\n"
                                   "2,-4,-5,6,0,0,0,1,1,1,0,b c,,\n3,0,0,0,0,0,0,1,1,1,0,lost,,\n");
  const auto during = folder.write("during.mrk.json",
                                   R"({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
      "controlPoints": [{"label": "b c", "position": [4, 5, -6]},
                        {"label": "a", "position": [1.5, 2.5, 3.5]}]}]})");
  const auto pairs = read_pairs(before, during);
  ASSERT_TRUE(pairs) << pairs.error().message;
  EXPECT_THAT(pairs->names, ElementsAre("a", "b c"));
  EXPECT_THAT(pairs->first, ElementsAre(Vec3(1, 2, 3), Vec3(4, 5, 6)));
  EXPECT_THAT(pairs->second, ElementsAre(Vec3(1.5, 2.5, 3.5), Vec3(4, 5, -6)));
  EXPECT_THAT(pairs->left_out, ElementsAre("lost"));
}

TEST(PairFile, RefusesTwoListsThatCannotBePaired) {
  const TemporaryFolder folder;
  const auto one = folder.write("one.csv", "a,1,2,3\n"),
             other = folder.write("other.csv", "b,1,2,3\n");
  const auto pairs = read_pairs(one, other);
  ASSERT_FALSE(pairs);
  EXPECT_EQ(pairs.error().code, ErrorCode::kEmptySet);
  EXPECT_THAT(pairs.error().message,
              AllOf(HasSubstr("one.csv and "), HasSubstr("other.csv: no name is in both")));
  EXPECT_EQ(read_pairs(one, folder / "none.csv").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_pairs(folder / "none.csv", one).error().code, ErrorCode::kNotFound);
}

TEST(PairFile, RefusesTagFilesThatAreDamaged) {
  const auto bad = [](const char* what, const char* with) {
    return refusal("a.tag", replaced(kTag, what, with));
  };
  EXPECT_THAT(refusal("a.tag", ""), HasSubstr("is no MNI tag point file"));
  EXPECT_THAT(refusal("a.tag", "1 2 3 4 5 6\n"), HasSubstr("is no MNI tag point file"));
  EXPECT_THAT(bad("Volumes = 2;", "Volumes = 1;"), HasSubstr("\"Volumes = 1;\" must be 2"));
  EXPECT_THAT(bad("Volumes = 2;\n", ""), HasSubstr("comes before \"Volumes = 2;\""));
  EXPECT_THAT(bad("Points =", "Tags ="), HasSubstr("line 5: \"Tags =\" is neither"));
  EXPECT_THAT(bad("1.5 2.5 3.5", "1.5 2.5"), HasSubstr("line 6:"));
  EXPECT_THAT(bad("1.5 2.5 3.5", "1.5 2.5 3.5 4"), HasSubstr("6 or 9 finite numbers"));
  EXPECT_THAT(bad("2.5", "nan"), HasSubstr("line 6:"));
  EXPECT_THAT(bad("\"a\"", "\"a"), HasSubstr("line 6:"));
  EXPECT_THAT(bad("\"a\"", "\"a\" 7"), HasSubstr("line 6:"));
  EXPECT_THAT(bad("\"b c\";", "\"b c\""), HasSubstr("is truncated"));
  EXPECT_THAT(refusal("a.tag", std::string(kTag) + "7 8 9 7 8 9\n"),
              HasSubstr("comes behind the last point"));
  EXPECT_THAT(
      refusal("a.tag", "MNI Tag Point File\nVolumes = 2;\nPoints =\n;\n", ErrorCode::kEmptySet),
      HasSubstr("no landmark"));
}

TEST(PairFile, RefusesTablesOfAnotherShape) {
  EXPECT_THAT(refusal("a.csv", "1,2,3,4,5\n"),
              HasSubstr("line 1: \"1,2,3,4,5\" must be 6 numbers"));
  EXPECT_THAT(refusal("a.csv", "x_src,y_src,z_src,x_dst,y_dst,k_dst,e,f\n1,2,3,4,5,6,7,8\n"),
              HasSubstr("a heading with x_before"));
  EXPECT_THAT(refusal("a.csv", "x_src,y_src,z_src,x_dst,y_dst,z_dst,x_before,f\n1,2,3,4,5,6,7,8\n"),
              HasSubstr("a heading with x_before"));
  EXPECT_THAT(refusal("a.csv", "1,2,3,4,5,6\n1,2,3,4,5\n"), HasSubstr("line 2:"));
  EXPECT_THAT(refusal("a.csv", "1,2,3,4,5,6\n1,2,3,4,5,inf\n"), HasSubstr("line 2:"));
  EXPECT_THAT(refusal("a.csv", "", ErrorCode::kEmptySet), HasSubstr("no landmark"));
  EXPECT_THAT(refusal("a.fcsv", "x"), HasSubstr("a second file must say"));
  EXPECT_THAT(refusal("a.txt", "x"), HasSubstr("must be a .csv or .tag file"));
  const auto none = read_pairs(std::filesystem::path("nowhere/a.csv"));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

// RESECT, patient 4 (Xiao et al. 2017, doi:10.1002/mp.12268).
TEST(PairFile, RealLandmarksAreTheSameInBothFormats) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const auto folder = std::filesystem::path(data) / "resect_case4";
  const auto table = read_pairs(folder / "Case4-MRI-beforeUS.csv");
  const auto tags = read_pairs(folder / "Case4-MRI-beforeUS.tag");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_TRUE(tags) << tags.error().message;
  EXPECT_EQ(table->names.size(), 15U);
  EXPECT_EQ(table->names, tags->names);
  EXPECT_EQ(table->first, tags->first);
  EXPECT_EQ(table->second, tags->second);
}

}  // namespace
}  // namespace brainshift::io
