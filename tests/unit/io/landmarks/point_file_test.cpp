// SPDX-License-Identifier: GPL-3.0-or-later
// The same three points in every format and frame that Slicer writes, and what is refused.
#include "common/io/landmarks/point_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kJson = R"({
  "@schema": "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
  "markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm",
    "locked": false, "labelFormat": "%N-%d",
    "controlPoints": [
      {"id": "1", "label": "nasion", "position": [-1.5, -2, 3], "selected": true,
       "positionStatus": "defined"},
      {"id": "2", "label": "skipped", "position": [0, 0, 0], "positionStatus": "undefined"},
      {"id": "3", "label": "left, ear", "position": [4, -5e0, 6.25]}
    ]}]})";

constexpr const char* kFcsv =
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    "1,-1.5,-2,3,0,0,0,1,1,1,0,nasion,,\r\n"
    "2,4,-5,6.25,0,0,0,1,1,1,0,\"left, ear\",a note,\n";

std::string point_replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

Result<NamedPoints> read(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  return read_points(folder.write(name, content));
}

void expect_two_points(const std::string& name, const std::string& content, const Vec3& signs) {
  SCOPED_TRACE(name + ": " + content);
  const auto list = read(name, content);
  ASSERT_TRUE(list) << list.error().message;
  EXPECT_THAT(list->names, ElementsAre("nasion", "left, ear"));
  EXPECT_THAT(list->points, ElementsAre(signs.cwiseProduct(Vec3(-1.5, -2, 3)),
                                        signs.cwiseProduct(Vec3(4, -5, 6.25))));
}

std::string point_refusal(const std::string& name, const std::string& content,
                          ErrorCode code = ErrorCode::kUnreadable) {
  const TemporaryFolder folder;
  const auto path = folder.write(name, content);
  const auto list = read_points(path);
  EXPECT_FALSE(list) << content;
  if (list) return {};
  EXPECT_EQ(list.error().code, code) << list.error().message;
  EXPECT_THAT(list.error().message, StartsWith(path.string() + ": "));
  return list.error().message;
}

TEST(PointFile, EverySpellingOfSlicersFramesBecomesRas) {
  for (const auto& [spelling, signs] :
       {std::pair{"LPS", Vec3(-1, -1, 1)}, std::pair{"1", Vec3(-1, -1, 1)},
        std::pair{"RAS", Vec3(1, 1, 1)}, std::pair{"0", Vec3(1, 1, 1)}}) {
    expect_two_points("a.fcsv", point_replaced(kFcsv, "= LPS", "= " + std::string(spelling)),
                      signs);
    expect_two_points("a.mrk.json", point_replaced(kJson, "LPS", spelling), signs);
  }
  expect_two_points("a.mrk.json", point_replaced(kJson, "\"LPS\"", "1"), Vec3(-1, -1, 1));
}

TEST(PointFile, FcsvColumnsAreSlicersUnlessTheFileOrdersThem) {
  expect_two_points(
      "a.fcsv",
      point_replaced(
          kFcsv, "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n", ""),
      Vec3(-1, -1, 1));
  expect_two_points(
      "a.fcsv",
      "# CoordinateSystem = 0\n# columns = label,x,y,z,sel,vis\nnasion,-1.5,-2,3,1,1\n"
      "\"left, ear\",4,-5,6.25,1,1\n",
      Vec3(1, 1, 1));
}

TEST(PointFile, TablesHaveANameOrAHeadingOrNeither) {
  expect_two_points("a.csv", "nasion,-1.5,-2,3\n# a comment\n\n\"left, ear\", 4, -5, 6.25\n",
                    Vec3(1, 1, 1));
  expect_two_points("a.csv", "label,x,y,z\nnasion,-1.5,-2,3\n\"left, ear\",4,-5,6.25\n",
                    Vec3(1, 1, 1));
  expect_two_points("a.csv", "r,a,s,name\n-1.5,-2,3,nasion\n4,-5,6.25,\"left, ear\"\n",
                    Vec3(1, 1, 1));
  // As Slicer exports a list as a table.
  expect_two_points("a.csv",
                    "label,l,p,s,defined,selected,visible,locked,description\n"
                    "nasion,-1.5,-2,3,1,1,1,0,\n\"left, ear\",4,-5,6.25,1,1,1,0,note\n",
                    Vec3(-1, -1, 1));
  const auto bare = read("a.csv", "1,2,3\n4,5,6\n");
  ASSERT_TRUE(bare) << bare.error().message;
  EXPECT_THAT(bare->names, ElementsAre("", ""));
  EXPECT_EQ(bare->points[1], Vec3(4, 5, 6));
}

TEST(PointFile, RefusesMarkupsThatAreNoPointList) {
  const auto bad = [](const char* what, const char* with) {
    return point_refusal("a.mrk.json", point_replaced(kJson, what, with));
  };
  EXPECT_THAT(point_refusal("a.mrk.json", ""), HasSubstr("must be JSON with a list \"markups\""));
  EXPECT_THAT(point_refusal("a.mrk.json", "[]"), HasSubstr("a list \"markups\""));
  EXPECT_THAT(point_refusal("a.mrk.json", R"({"markups": []})"), HasSubstr("holds 0 markups"));
  EXPECT_THAT(point_refusal("a.mrk.json", R"({"markups": [7]})"),
              HasSubstr("must hold one point list"));
  EXPECT_THAT(bad("Fiducial", "Plane"), HasSubstr("type = Plane"));
  EXPECT_THAT(bad("\"LPS\"", "\"IJK\""), HasSubstr("coordinateSystem = IJK"));
  EXPECT_THAT(bad("\"LPS\"", "2"), HasSubstr("coordinateSystem = 2"));
  EXPECT_THAT(bad("\"coordinateSystem\": \"LPS\",", ""), HasSubstr("coordinateSystem is missing"));
  EXPECT_THAT(bad("\"mm\"", "\"m\""), HasSubstr("coordinateUnits = \"m\""));
  EXPECT_THAT(bad("controlPoints", "points"), HasSubstr("no list \"controlPoints\""));
  EXPECT_THAT(bad("[-1.5, -2, 3]", "[-1.5, -2]"), HasSubstr("control point 1: position"));
  EXPECT_THAT(bad("6.25", "\"six\""), HasSubstr("control point 3: position"));
  EXPECT_THAT(bad("6.25", "1e999"), HasSubstr("JSON"));
  EXPECT_THAT(point_refusal("a.mrk.json",
                            R"({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
                          "controlPoints": []}]})",
                            ErrorCode::kEmptySet),
              HasSubstr("no point that was placed"));
}

TEST(PointFile, RefusesFcsvThatDoesNotSayWhere) {
  EXPECT_THAT(point_refusal("a.fcsv", point_replaced(kFcsv, "# CoordinateSystem = LPS\n", "")),
              HasSubstr("coordinateSystem is missing"));
  EXPECT_THAT(point_refusal("a.fcsv", point_replaced(kFcsv, "LPS", "2")),
              HasSubstr("coordinateSystem = 2"));
  EXPECT_THAT(point_refusal("a.fcsv", point_replaced(kFcsv, "-1.5,", "nan,")),
              HasSubstr("line 4: \"1,nan"));
  EXPECT_THAT(point_refusal("a.fcsv", point_replaced(kFcsv, "x,y,z", "i,j,k")),
              HasSubstr("line 4"));
  EXPECT_THAT(point_refusal("a.fcsv", std::string(kFcsv) + "3,1\n"), HasSubstr("line 6: \"3,1\""));
  EXPECT_THAT(point_refusal("a.fcsv", "# CoordinateSystem = LPS\n", ErrorCode::kEmptySet),
              HasSubstr("no point"));
}

TEST(PointFile, RefusesTablesOfAnotherShape) {
  EXPECT_THAT(point_refusal("a.csv", "1,2\n"), HasSubstr("line 1: \"1,2\" must be x,y,z"));
  EXPECT_THAT(point_refusal("a.csv", "u,v,w\n1,2,3\n"), HasSubstr("a heading with the columns"));
  EXPECT_THAT(point_refusal("a.csv", "1,2,3\n4,5\n"), HasSubstr("line 2: \"4,5\""));
  EXPECT_THAT(point_refusal("a.csv", "a,1,2,3\n1,2,3\n"), HasSubstr("behind a name"));
  EXPECT_THAT(point_refusal("a.csv", "x,y,z\n1,2,inf\n"), HasSubstr("line 2"));
  EXPECT_THAT(point_refusal("a.csv", "x,y,z\n", ErrorCode::kEmptySet), HasSubstr("no point"));
  EXPECT_THAT(point_refusal("a.csv", "", ErrorCode::kEmptySet), HasSubstr("no point"));
  EXPECT_THAT(point_refusal("a.vtk", "1,2,3\n"),
              HasSubstr("must be a .mrk.json, .fcsv or .csv file"));
  const auto none = read_points("nowhere/a.csv");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
