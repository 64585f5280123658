// SPDX-License-Identifier: GPL-3.0-or-later
// The same three points in every format and frame that Slicer writes, and what is refused.
#include "common/io/landmarks/point_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::replaced;
using test_support::TemporaryFolder;
using testing::ElementsAre;

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

Result<NamedPoints> read(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  return read_points(folder.write(name, content));
}

void expect_two_points(const std::string& name, const std::string& content, const Vec3& signs) {
  SCOPED_TRACE(name + ": " + content);
  const auto list = value_or_fail(read(name, content));
  EXPECT_THAT(list.names, ElementsAre("nasion", "left, ear"));
  EXPECT_THAT(list.points, ElementsAre(signs.cwiseProduct(Vec3(-1.5, -2, 3)),
                                       signs.cwiseProduct(Vec3(4, -5, 6.25))));
}

// read_points of a file of this name; an error begins with its path.
auto reading_points(const std::string& name) {
  return [name](const std::string& content) {
    const TemporaryFolder folder;
    const auto path = folder.write(name, content);
    auto read = read_points(path);
    if (!read) {
      EXPECT_THAT(read.error().message, testing::StartsWith(path.string() + ": "));
    }
    return read;
  };
}

TEST(PointFile, EverySpellingOfSlicersFramesBecomesRas) {
  for (const auto& [spelling, signs] :
       {std::pair{"LPS", Vec3(-1, -1, 1)}, std::pair{"1", Vec3(-1, -1, 1)},
        std::pair{"RAS", Vec3(1, 1, 1)}, std::pair{"0", Vec3(1, 1, 1)}}) {
    expect_two_points("a.fcsv", replaced(kFcsv, "= LPS", "= " + std::string(spelling)), signs);
    expect_two_points("a.mrk.json", replaced(kJson, "LPS", spelling), signs);
  }
  expect_two_points("a.mrk.json", replaced(kJson, "\"LPS\"", "1"), Vec3(-1, -1, 1));
}

TEST(PointFile, FcsvColumnsAreSlicersUnlessTheFileOrdersThem) {
  expect_two_points(
      "a.fcsv",
      replaced(kFcsv, "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n",
               ""),
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
  const auto bare = value_or_fail(read("a.csv", "1,2,3\n4,5,6\n"));
  EXPECT_THAT(bare.names, ElementsAre("", ""));
  EXPECT_EQ(bare.points[1], Vec3(4, 5, 6));
}

TEST(PointFile, PointsThatNobodyPlacedAreLeftOutOfEveryFormat) {
  // Slicer 5: two columns more than are named, the first of them 2 where the point was placed.
  expect_two_points(
      "a.fcsv",
      replaced(replaced(kFcsv, "nasion,,", "nasion,,,2,0"), "a note,", "a note,,2,0") +
          "3,0,0,0,0,0,0,1,1,1,0,lost,,,0,0\n4,1,1,1,0,0,0,1,1,1,0,seen,,,1,0\n",
      Vec3(-1, -1, 1));
  expect_two_points("a.csv",
                    "label,l,p,s,defined\nnasion,-1.5,-2,3,1\nlost,0,0,0,0\n"
                    "\"left, ear\",4,-5,6.25,TRUE\n",
                    Vec3(-1, -1, 1));
  EXPECT_THAT(refusal_of(read("a.csv", "x,y,z,defined\n1,2,3,maybe\n")),
              testing::HasSubstr("line 2: \"1,2,3,maybe\" has \"maybe\" as defined"));
  EXPECT_THAT(refusal_of(read("a.csv", "x,y,z,defined\n1,2,3,0\n"), ErrorCode::kEmptySet),
              testing::HasSubstr("no point that was placed"));
}

TEST(PointFile, AByteOrderMarkCostsNoName) {
  expect_two_points("a.csv", "\xEF\xBB\xBFnasion,-1.5,-2,3\n\"left, ear\",4,-5,6.25\n",
                    Vec3(1, 1, 1));
  expect_two_points("A.CSV", "\xEF\xBB\xBFLabel,R,A,S\nnasion,-1.5,-2,3\n\"left, ear\",4,-5,6.25\n",
                    Vec3(1, 1, 1));
}

TEST(PointFile, RefusesMarkupsThatAreNoPointList) {
  expect_refused(reading_points("a.mrk.json"),
                 {{"", "must be JSON with a list \"markups\""},
                  {"[]", "a list \"markups\""},
                  {R"({"markups": []})", "holds 0 markups"},
                  {R"({"markups": [7]})", "must hold one point list"}});
  expect_edits_refused(reading_points("a.mrk.json"), kJson,
                       {{"Fiducial", "Plane", "type = Plane"},
                        {"\"LPS\"", "\"IJK\"", "coordinateSystem = IJK"},
                        {"\"LPS\"", "2", "coordinateSystem = 2"},
                        {"\"coordinateSystem\": \"LPS\",", "", "coordinateSystem is missing"},
                        {"\"mm\"", "\"m\"", "coordinateUnits = \"m\""},
                        {"controlPoints", "points", "no list \"controlPoints\""},
                        {"[-1.5, -2, 3]", "[-1.5, -2]", "control point 1: position"},
                        {"6.25", "\"six\"", "control point 3: position"},
                        {"6.25", "1e999", "JSON"}});
  expect_refused(reading_points("a.mrk.json"),
                 {{R"({"markups": [{"type": "Fiducial", "coordinateSystem": "RAS",
                          "controlPoints": []}]})",
                   "no point that was placed"}},
                 ErrorCode::kEmptySet);
}

TEST(PointFile, RefusesFcsvThatDoesNotSayWhere) {
  expect_refused(reading_points("a.fcsv"), {{replaced(kFcsv, "# CoordinateSystem = LPS\n", ""),
                                             "coordinateSystem is missing"},
                                            {replaced(kFcsv, "LPS", "2"), "coordinateSystem = 2"},
                                            {replaced(kFcsv, "-1.5,", "nan,"), "line 4: \"1,nan"},
                                            {replaced(kFcsv, "x,y,z", "i,j,k"), "line 3"},
                                            {std::string(kFcsv) + "3,1\n", "line 6: \"3,1\""}});
  expect_refused(reading_points("a.fcsv"), {{"# CoordinateSystem = LPS\n", "no point"}},
                 ErrorCode::kEmptySet);
}

TEST(PointFile, RefusesTablesOfAnotherShape) {
  expect_refused(reading_points("a.csv"), {{"1,2\n", "line 1: \"1,2\" must be x,y,z"},
                                           {"u,v,w\n1,2,3\n", "line 1: \"u,v,w\" must be"},
                                           {"# u,v,w\n1,2,3\n", "line 1: \"u,v,w\" must be"},
                                           {"x_m,y_m,z_m\n1,2,3\n", "a heading with the columns"},
                                           {"x,y,z\n1,2,3,4\n", "no more cells"},
                                           {"1,2,3\n4,5\n",
                                            "line 2: \"4,5\" must have three "
                                            "finite numbers and nothing else"},
                                           {"a,b,1,2\n",
                                            "line 1: \"a,b,1,2\" must have three "
                                            "finite numbers behind a name"},
                                           {"a,1,2,3\n1,2,3\n", "behind a name"},
                                           {"x,y,z\n1,2,inf\n", "line 2"}});
  expect_refused(reading_points("a.csv"), {{"x,y,z\n", "no point"}, {"", "no point"}},
                 ErrorCode::kEmptySet);
  expect_refused(reading_points("a.vtk"), {{"1,2,3\n", "must be a .mrk.json, .fcsv or .csv file"}});
  refusal_of(read_points("nowhere/a.csv"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
