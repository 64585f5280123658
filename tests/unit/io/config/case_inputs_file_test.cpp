// SPDX-License-Identifier: GPL-3.0-or-later
// load_case_inputs: which files are read, and which key a bad one is blamed on.
#include <gmock/gmock.h>

#include "common/io/config/config_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;

using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kSurface =
    "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\nendsolid s\n";

class CaseInputsFile : public testing::Test {
 protected:
  CaseInputsFile() {
    TetMesh mesh;
    mesh.nodes.resize(3, 4);
    mesh.nodes << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
    mesh.tets.resize(4, 1);
    mesh.tets << 0, 1, 2, 3;
    EXPECT_TRUE(write_vtu(folder_ / "mesh.vtu", mesh, {}));
    folder_.write("s.stl", kSurface);
    folder_.write("t1.nii", "only looked up");
    config_.mesh = MeshFile{folder_ / "mesh.vtu"};
    config_.tumour = TumourSurfaceFile{folder_ / "s.stl"};
    config_.contact.skull_file = folder_ / "s.stl";
    config_.mri = folder_ / "t1.nii";
  }
  void expect_blame(ErrorCode code, const std::string& key, const std::string& file) {
    EXPECT_THAT(refusal_of(load_case_inputs(config_), code),
                testing::AllOf(StartsWith(key + ": "), HasSubstr(file)));
  }
  TemporaryFolder folder_;
  CaseConfig config_;
};

TEST_F(CaseInputsFile, NamedFilesAreReadAndOthersAreNot) {
  const auto inputs = value_or_fail(load_case_inputs(config_));
  EXPECT_EQ(inputs.mesh.value().num_tets(), 1);
  EXPECT_EQ(inputs.tumour_surface.value().num_triangles(), 1);
  EXPECT_EQ(inputs.skull.value().num_triangles(), 1);
  EXPECT_FALSE(inputs.brain);
  EXPECT_FALSE(inputs.tumour_labels);
}

TEST_F(CaseInputsFile, WhatCanBeReadIsReadBesideWhatCannot) {
  config_.mri = folder_ / "no_t1.nii";
  config_.tumour = TumourSurfaceFile{folder_ / "no_s.stl"};
  const ReadableInputs read = load_readable_inputs(config_);
  EXPECT_THAT(sentence_of(read.status), StartsWith("images.mri: "));
  EXPECT_TRUE(read.inputs.mesh);
  EXPECT_FALSE(read.inputs.tumour_surface);
  EXPECT_TRUE(read.inputs.skull);
}

TEST_F(CaseInputsFile, ASegmentOfASegmentationIsTheTumour) {
  const auto file = folder_.write(
      "t.seg.nrrd",
      std::string("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 1 1\nencoding: raw\nspace: LPS\n"
                  "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
                  "Segment0_Name:=Brain\nSegment0_LabelValue:=1\n"
                  "Segment1_Name:=Tumour\nSegment1_LabelValue:=2\n\n") +
          "\1\2");
  config_.tumour = TumourLabel{file, {5}, "Tumour"};
  const auto inputs = value_or_fail(load_case_inputs(config_));
  EXPECT_THAT(inputs.tumour_labels.value().values, testing::ElementsAre(0, 5));
  config_.tumour = TumourLabel{file, {5}};
  expect_blame(ErrorCode::kInvalidArgument, "tumour.label_volume.file", "\"Brain\", \"Tumour\"");
}

TEST_F(CaseInputsFile, MissingFilesAreBlamedOnTheirKeys) {
  config_.mri = folder_ / "no_t1.nii";
  expect_blame(ErrorCode::kNotFound, "images.mri", "no_t1.nii: no such file");
  config_.mri.clear();
  config_.contact.skull_file = folder_ / "no_skull.stl";
  expect_blame(ErrorCode::kNotFound, "contact.skull_file", "no_skull.stl: no such file");
  config_.tumour = TumourSurfaceFile{folder_ / "no_tumour.stl"};
  expect_blame(ErrorCode::kNotFound, "tumour.surface.file", "no_tumour.stl: no such file");
  config_.tumour = TumourLabel{folder_ / "no_labels.nii", {1}};
  expect_blame(ErrorCode::kNotFound, "tumour.label_volume.file", "no_labels.nii: no such file");
  config_.mesh = MeshFile{folder_ / "no_mesh.vtu"};
  expect_blame(ErrorCode::kNotFound, "mesh.file", "no_mesh.vtu: no such file");
  config_.mesh = MeshGeneration{};
  config_.brain = folder_ / "no_brain.nii";
  expect_blame(ErrorCode::kNotFound, "images.brain", "no_brain.nii: no such file");
}

TEST_F(CaseInputsFile, UnreadableFilesAreBlamedOnTheirKeys) {
  config_.mesh = MeshGeneration{};
  config_.brain = folder_ / "t1.nii";
  expect_blame(ErrorCode::kUnreadable, "images.brain", "t1.nii: is not a NIfTI image");
}

}  // namespace
}  // namespace brainshift::io
