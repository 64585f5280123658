// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/model_inputs.hpp"

#include <gmock/gmock.h>

#include "common/io/config/config_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kCase = R"(case_id: example
images: {mri: mri.nii, brain: mask.nii}
tumour: {label_volume: {file: labels.nii, label: 1}}
craniotomy: {centre_mm: [7, 8, 9]}
brainstem: {centre_mm: [0, 0, -60]}
gravity: {direction: [1, -2, 3]}
contact: {skull_file: skull.stl}
)";

class ModelInputsTest : public testing::Test {
 protected:
  ModelInputsTest() {
    for (const char* name : {"mri.nii", "mask.nii", "labels.nii", "skull.stl"}) {
      folder_.write(name, std::string("content of ") + name);
    }
    config_ = read_case_config(folder_.write("case.yaml", kCase)).value();
  }
  TemporaryFolder folder_;
  CaseConfig config_;
};

std::vector<std::string> keys(const std::vector<InputFile>& inputs) {
  std::vector<std::string> found;
  for (const InputFile& input : inputs) found.push_back(input.key);
  return found;
}

TEST_F(ModelInputsTest, EveryFileOfACaseIsRecorded) {
  const auto inputs = value_or_fail(record_inputs(config_));
  EXPECT_THAT(keys(inputs), ElementsAre("case", "contact.skull_file", "images.brain", "images.mri",
                                        "tumour.label_volume.file"));
  EXPECT_EQ(inputs[3].path, folder_ / "mri.nii");
  EXPECT_EQ(inputs[3].bytes, 18u);
  // python3 -c "import zlib; print(hex(zlib.crc32(b'content of mri.nii')))"
  EXPECT_EQ(inputs[3].crc32, 0x5bd61ed2u);
}

TEST_F(ModelInputsTest, MeshAndSurfaceFilesAreRecorded) {
  config_.mesh = MeshFile{folder_.write("brain.msh", "mesh")};
  config_.tumour = TumourSurfaceFile{folder_.write("tumour.ply", "surface")};
  const auto inputs = value_or_fail(record_inputs(config_));
  EXPECT_THAT(keys(inputs), ElementsAre("case", "contact.skull_file", "images.mri", "mesh.file",
                                        "tumour.surface.file"));
}

TEST_F(ModelInputsTest, MissingFileCannotBeRecorded) {
  std::filesystem::remove(folder_ / "skull.stl");
  EXPECT_THAT(refusal_of(record_inputs(config_), ErrorCode::kNotFound),
              HasSubstr("contact.skull_file: "));
}

TEST_F(ModelInputsTest, UnchangedInputsPassInSilence) {
  const auto notes = value_or_fail(check_inputs(record_inputs(config_).value()));
  EXPECT_THAT(notes, IsEmpty());
}

TEST_F(ModelInputsTest, ChangedFileIsNamed) {
  const auto inputs = record_inputs(config_).value();
  for (const char* name : {"mri.nii", "mask.nii", "labels.nii", "skull.stl"}) {
    const std::string content = test_support::content_of(folder_ / name);
    for (const std::string& other : {content + "!", "Content" + content.substr(7)}) {
      folder_.write(name, other);
      EXPECT_THAT(refusal_of(check_inputs(inputs), ErrorCode::kInvalidArgument),
                  testing::AllOf(HasSubstr(std::string(name) + " has changed"),
                                 HasSubstr("run brainshiftd prepare again")));
    }
    folder_.write(name, content);
  }
  EXPECT_TRUE(check_inputs(inputs));
}

TEST_F(ModelInputsTest, CaseCountsByWhatItSays) {
  const auto inputs = record_inputs(config_).value();
  folder_.write("case.yaml", std::string("# a comment\n") + kCase);
  EXPECT_TRUE(check_inputs(inputs));
  folder_.write("case.yaml", std::string(kCase) + "material: {poisson_ratio: 0.41}\n");
  EXPECT_THAT(sentence_of(check_inputs(inputs)), HasSubstr("case.yaml has changed"));
  folder_.write("case.yaml", "no case any more");
  EXPECT_FALSE(check_inputs(inputs));
}

TEST_F(ModelInputsTest, MissingFileIsOnlyANote) {
  const auto inputs = record_inputs(config_).value();
  std::filesystem::remove(folder_ / "mri.nii");
  const auto notes = value_or_fail(check_inputs(inputs));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("mri.nii: no such file")));
}

TEST_F(ModelInputsTest, CaseMadeInMemoryIsNoInput) {
  config_.file.clear();
  EXPECT_EQ(keys(record_inputs(config_).value()).front(), "contact.skull_file");
}

}  // namespace
}  // namespace brainshift::io
