// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "client/tools/export/manifest.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

TEST(ExportFormat, EveryWordIsItsFormat) {
  for (const ExportFormat format : kAllExportFormats) {
    EXPECT_EQ(parse_formats({std::string(to_string(format))}).value(), ExportFormats{format});
  }
  EXPECT_EQ(parse_formats({"sd", "nrrd", "sd"}).value(),
            (ExportFormats{ExportFormat::kSd, ExportFormat::kNrrd}));
}

TEST(ExportFormat, AllIsMoreThanTheDefaultByTheSeries) {
  ExportFormats all = parse_formats({"all"}).value();
  EXPECT_EQ(all.size(), kAllExportFormats.size());
  EXPECT_EQ(all.erase(ExportFormat::kSeries), 1u);
  EXPECT_EQ(all, default_formats());
  EXPECT_EQ(parse_formats({}).value(), default_formats());
}

TEST(ExportFormat, AnotherWordIsNamedWithThoseThereAre) {
  for (const char* word : {"", "nifti", "NRRD", "sd ", "h5"}) {
    EXPECT_THAT(refusal_of(parse_formats({"sd", word}), ErrorCode::kInvalidArgument),
                testing::AllOf(HasSubstr("--formats: \"" + std::string(word) +
                                         "\" is not a format: must be nifti-1007, "),
                               HasSubstr("series, or all")));
  }
}

using nlohmann::json;

Manifest example() {
  Manifest manifest;
  manifest.software = "brainshift 1";
  manifest.surgery = "a.surgery";
  manifest.case_id = "toy";
  manifest.message.session_id = 41;
  manifest.message.update.sequence = 7;
  manifest.message.update.model_id = "abc";
  QualityVerdict& verdict = manifest.message.update.estimate.quality;
  verdict.flags.set(QualityFlag::kVolumeLost);
  verdict.quality = Quality::kUnusable;
  verdict.reason = "an element lost its volume";
  manifest.grid.dims = {4, 5, 6};
  manifest.volume_ratios = (VecX(4) << 1.25, 0.4, -0.5, 0.0).finished();
  manifest.files = {{"f.nrrd", "displacement field", "resampling", "LPS", "LPS", "mm", "ITK"},
                    {"series/a.pvd", "fields", "modeling", "RAS", "RAS", "mm", "ParaView", false},
                    {"sd.nii", "sd", "", "RAS", "", "mm", "any"}};
  return manifest;
}

TEST(Manifest, EveryFileSaysWhatItIs) {
  const json read = json::parse(to_json(example()));
  const json& field = read.at("files").at(0);
  EXPECT_EQ(field.at("file"), "f.nrrd");
  EXPECT_EQ(field.at("direction"), "resampling");
  EXPECT_EQ(field.at("vectors_frame"), "LPS");
  EXPECT_EQ(field.at("units"), "mm");
  EXPECT_EQ(field.at("session_id"), 41);
  EXPECT_EQ(field.at("model_id"), "abc");
  EXPECT_EQ(field.at("sequence"), 7);
  EXPECT_EQ(field.at("quality"), "unusable");
  EXPECT_EQ(field.at("read_by"), "ITK");
  EXPECT_TRUE(read.at("files").at(1).at("sequence").is_null());
  EXPECT_TRUE(read.at("files").at(1).at("quality").is_null());
  EXPECT_TRUE(read.at("files").at(2).at("direction").is_null());
  EXPECT_TRUE(read.at("files").at(2).at("vectors_frame").is_null());
}

TEST(Manifest, QualityFoldsAndDirectionAreTold) {
  const json read = json::parse(to_json(example()));
  EXPECT_EQ(read.at("quality").at("usable"), false);
  EXPECT_EQ(read.at("quality").at("flags"), json({"volume_lost"}));
  EXPECT_EQ(read.at("volume_ratio").at("folded"), 2);
  EXPECT_EQ(read.at("volume_ratio").at("below_half"), 3);
  EXPECT_EQ(read.at("volume_ratio").at("min"), -0.5);
  EXPECT_EQ(read.at("volume_ratio").at("elements"), 4);
  EXPECT_THAT(read.at("direction_means").get<std::string>(), HasSubstr("undeformed place"));
  EXPECT_NE(direction_means(io::FieldDirection::kModeling),
            direction_means(io::FieldDirection::kResampling));
  EXPECT_EQ(read.at("grid").at("dims"), json({4, 5, 6}));
  EXPECT_EQ(read.at("grid").at("T_ras_voxel").at(3), json({0.0, 0.0, 0.0, 1.0}));
}

TEST(Manifest, ANameThatIsNotUtf8IsNoReasonToFail) {
  Manifest manifest = example();
  manifest.surgery = "\xff.surgery";
  EXPECT_NO_THROW(json::parse(to_json(manifest)));
}

}  // namespace
}  // namespace brainshift::client
