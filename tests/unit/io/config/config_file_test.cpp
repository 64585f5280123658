// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/config_file.hpp"

#include <gmock/gmock.h>

#include "common/configuration/case_keys.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/config/documented_keys.hpp"

namespace brainshift::io {
namespace {

using test_support::content_of;
using test_support::expect_edits_refused;
using test_support::expect_refused;
using test_support::replaced;

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

// Line numbers in the tests below count from this text's first line.
constexpr const char* kMinimal = R"(case_id: small
images: {brain: mask.nii}
tumour: {ellipsoid: {centre_mm: [1, 2, 3], semi_axes_mm: [4, 5, 6]}}
craniotomy: {centre_mm: [7, 8, 9]}
brainstem: {centre_mm: [0, 0, -60]}
)";

constexpr const char* kFull = R"(case_id: full
images: {mri: /data/t1.nii, brain: sub/../mask.nii}
mesh:
  generate:
    edge_mm: 6
    tumour_edge_mm: 3
    craniotomy_edge_mm: 4
    tumour_margin_mm: 11
    craniotomy_margin_mm: 12
    smoothing_mm: 1.5
tumour:
  label_volume: {file: labels.nii, label: 7}
craniotomy:
  centre_mm: [7, 8, 9]
  long_axis_mm: 30
  short_axis_mm: 20
  long_axis_direction: [0, 3, 4]
brainstem: {centre_mm: [0, 1, -60], radius_mm: 9}
gravity: {direction: [0, 0, -2]}
material:
  shear_modulus_pa: 2200
  poisson_ratio: 0.45
  tissue_density_kg_m3: 1040
  fluid_density_saturated_kg_m3: 1007
  fluid_density_unsaturated_kg_m3: 1.2
contact: {gap_mm: 2, skull_file: skull.stl, slave_depth_mm: 25, penalty_n_per_mm: 6}
prior:
  correlation_length_mm: 7
  force_density_sd_n_m3: 900
  gravity_mode_sd: 0.5
  gravity_levels_mm: [1, -2.5]
inversion: {sigma_mm: 0.3, sparse_points: 100, max_iterations: 40, relative_misfit_change: 1e-4}
)";

// parse_case_config as /cases/c.yaml; an error is one line that begins with the file.
Result<CaseConfig> parse(const std::string& text) {
  auto read = parse_case_config(text, "/cases/c.yaml");
  if (!read) {
    EXPECT_THAT(read.error().message, StartsWith("/cases/c.yaml:"));
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
  return read;
}

TEST(CaseFile, MinimalFileHasTheDefaultsOfCaseConfig) {
  const auto read = value_or_fail(parse(kMinimal));
  const CaseConfig defaults;
  EXPECT_EQ(read.case_id, "small");
  EXPECT_EQ(read.file, "/cases/c.yaml");
  EXPECT_EQ(read.brain, "/cases/mask.nii");
  EXPECT_THAT(read.mri.string(), IsEmpty());
  const auto& generate = std::get<MeshGeneration>(read.mesh);
  EXPECT_EQ(generate.edge_mm, MeshGeneration{}.edge_mm);
  EXPECT_EQ(generate.tumour_edge_mm, MeshGeneration{}.tumour_edge_mm);
  EXPECT_EQ(generate.smoothing_mm, MeshGeneration{}.smoothing_mm);
  EXPECT_EQ(read.craniotomy.long_axis_mm, defaults.craniotomy.long_axis_mm);
  EXPECT_EQ(read.brainstem.radius_mm, defaults.brainstem.radius_mm);
  EXPECT_EQ(read.gravity_direction, defaults.gravity_direction);
  EXPECT_EQ(read.material.poisson_ratio, defaults.material.poisson_ratio);
  EXPECT_EQ(read.contact.gap_mm, defaults.contact.gap_mm);
  EXPECT_FALSE(read.contact.skull_file);
  EXPECT_EQ(read.prior.gravity_levels_mm, defaults.prior.gravity_levels_mm);
  EXPECT_EQ(read.inversion.max_iterations, defaults.inversion.max_iterations);
}

TEST(CaseFile, EveryKeyArrivesInItsField) {
  const auto read = value_or_fail(parse(kFull));
  EXPECT_EQ(read.mri, "/data/t1.nii");
  EXPECT_EQ(read.brain, "/cases/mask.nii");
  const auto& generate = std::get<MeshGeneration>(read.mesh);
  EXPECT_EQ(generate.edge_mm, 6);
  EXPECT_EQ(generate.tumour_edge_mm, 3);
  EXPECT_EQ(generate.craniotomy_edge_mm, 4);
  EXPECT_EQ(generate.tumour_margin_mm, 11);
  EXPECT_EQ(generate.craniotomy_margin_mm, 12);
  EXPECT_EQ(generate.smoothing_mm, 1.5);
  EXPECT_EQ(std::get<TumourLabel>(read.tumour).path, "/cases/labels.nii");
  EXPECT_EQ(std::get<TumourLabel>(read.tumour).labels, std::vector<int>{7});
  EXPECT_EQ(std::get<TumourLabel>(read.tumour).segment, std::nullopt);
  EXPECT_EQ(read.craniotomy.centre_mm, Vec3(7, 8, 9));
  EXPECT_EQ(read.craniotomy.long_axis_mm, 30);
  EXPECT_EQ(read.craniotomy.short_axis_mm, 20);
  EXPECT_LT((read.craniotomy.long_axis_direction - Vec3(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_EQ(read.brainstem.centre_mm, Vec3(0, 1, -60));
  EXPECT_EQ(read.brainstem.radius_mm, 9);
  EXPECT_EQ(read.gravity_direction, Vec3(0, 0, -1)) << "normalised";
  EXPECT_EQ(read.material.shear_modulus_pa, 2200);
  EXPECT_EQ(read.material.poisson_ratio, 0.45);
  EXPECT_EQ(read.material.tissue_density_kg_m3, 1040);
  EXPECT_EQ(read.material.fluid_density_saturated_kg_m3, 1007);
  EXPECT_EQ(read.material.fluid_density_unsaturated_kg_m3, 1.2);
  EXPECT_EQ(read.contact.gap_mm, 2);
  EXPECT_EQ(read.contact.skull_file, fs::path("/cases/skull.stl"));
  EXPECT_EQ(read.contact.slave_depth_mm, 25);
  EXPECT_EQ(read.contact.penalty_n_per_mm, 6);
  EXPECT_EQ(read.prior.correlation_length_mm, 7);
  EXPECT_EQ(read.prior.force_density_sd_n_m3, 900);
  EXPECT_EQ(read.prior.gravity_mode_sd, 0.5);
  EXPECT_THAT(read.prior.gravity_levels_mm, ElementsAre(1, -2.5));
  EXPECT_EQ(read.inversion.sigma_mm, 0.3);
  EXPECT_EQ(read.inversion.sparse_points, 100);
  EXPECT_EQ(read.inversion.max_iterations, 40);
  EXPECT_EQ(read.inversion.relative_misfit_change, 1e-4);
}

TEST(CaseFile, ReadyMeshAndTumourSurfaceNeedNoBrainMask) {
  const std::string text =
      replaced(replaced(kMinimal, "images: {brain: mask.nii}", "mesh: {file: head.msh}"),
               "{ellipsoid: {centre_mm: [1, 2, 3], semi_axes_mm: [4, 5, 6]}}",
               "{surface: {file: tumour.stl}}");
  const auto read = value_or_fail(parse(text));
  EXPECT_EQ(std::get<MeshFile>(read.mesh).path, "/cases/head.msh");
  EXPECT_EQ(std::get<TumourSurfaceFile>(read.tumour).path, "/cases/tumour.stl");
}

TEST(CaseFile, EdgeLengthHoldsForRegionsWithoutTheirOwn) {
  const auto read = value_or_fail(
      parse_case_config(std::string(kMinimal) + "mesh: {generate: {edge_mm: 12}}", "c"));
  EXPECT_EQ(std::get<MeshGeneration>(read.mesh).tumour_edge_mm, 12);
  EXPECT_EQ(std::get<MeshGeneration>(read.mesh).craniotomy_edge_mm, 12);
}

TEST(CaseFile, HeadingWithoutKeysMeansDefaults) {
  const auto read = value_or_fail(
      parse_case_config(std::string(kMinimal) + "material:\n  # nothing\nmesh:\n", "c"));
  EXPECT_EQ(read.material.poisson_ratio, Material{}.poisson_ratio);
}

TEST(CaseFile, RelativeCaseFileGivesAbsolutePaths) {
  const auto read = value_or_fail(parse_case_config(kMinimal, "cases/c.yaml"));
  EXPECT_EQ(read.brain, fs::current_path() / "cases/mask.nii");
}

TEST(CaseFile, EmptyGravityLevelsAreAllowed) {
  const auto read = value_or_fail(
      parse_case_config(std::string(kMinimal) + "prior: {gravity_levels_mm: []}", "c"));
  EXPECT_THAT(read.prior.gravity_levels_mm, IsEmpty());
}

TEST(CaseFile, TextOfACaseReadsBackAsTheSameCase) {
  for (const char* text : {kMinimal, kFull}) {
    const auto first = value_or_fail(parse(text));
    const std::string written = case_config_text(first);
    const auto second = parse_case_config(written, first.file);
    ASSERT_TRUE(second) << second.error().message << written;
    // Every key is in the text with all digits, so equal texts are equal cases.
    EXPECT_EQ(case_config_text(*second), written);
    EXPECT_EQ(second->gravity_direction, first.gravity_direction);
    EXPECT_EQ(second->craniotomy.long_axis_direction, first.craniotomy.long_axis_direction);
  }
}

TEST(CaseFile, TextKeepsAwkwardNamesAndNumbers) {
  auto config = parse(kMinimal).value();
  config.case_id = "a: \"b\" \\ #c\t[é]";
  config.brain = "/data/with space/it's.nii";
  config.inversion.sigma_mm = 0.1 + 0.2;
  const auto read = value_or_fail(parse_case_config(case_config_text(config), config.file));
  EXPECT_EQ(read.case_id, config.case_id);
  EXPECT_EQ(read.brain, config.brain);
  EXPECT_EQ(read.inversion.sigma_mm, config.inversion.sigma_mm);
}

TEST(CaseFile, KeysOfPorePressureAreReadAndWritten) {
  const std::string text = replaced(
      std::string(kFull) + "scene: {pressure: on, pressure_step_s: 5}\n", "_unsaturated_kg_m3: 1.2",
      "_unsaturated_kg_m3: 1.2\n  permeability_m3_s_kg: 2e-8\n  biot_coefficient: 0.75\n"
      "  storage_per_pa: 3e-6");
  const auto read = value_or_fail(parse(text));
  const auto again = value_or_fail(parse(case_config_text(read)));
  for (const CaseConfig& config : {read, again}) {
    EXPECT_EQ(config.scene.pressure, Carry::kOn);
    EXPECT_EQ(config.scene.pressure_step_s, 5.0);
    EXPECT_EQ(config.material.permeability_m3_s_kg, 2e-8);
    EXPECT_EQ(config.material.biot_coefficient, 0.75);
    EXPECT_EQ(config.material.storage_per_pa, 3e-6);
  }
}

TEST(CaseFile, StiffnessOfTissuesIsReadAndWritten) {
  const std::string text =
      replaced(kFull, "_unsaturated_kg_m3: 1.2",
               "_unsaturated_kg_m3: 1.2\n  tumour: {shear_modulus_pa: 6300}\n"
               "  regions: {2: {poisson_ratio: 0.3}, 7: {shear_modulus_pa: 1e5}}");
  const auto read = value_or_fail(parse(text));
  const auto again = value_or_fail(parse(case_config_text(read)));
  for (const CaseConfig& config : {read, again}) {
    const Material& material = config.material;
    ASSERT_TRUE(material.tumour);
    EXPECT_EQ(material.tumour->shear_modulus_pa, 6300.0);
    EXPECT_EQ(material.tumour->poisson_ratio, material.poisson_ratio) << "as the rest";
    ASSERT_EQ(material.regions.size(), 2u);
    EXPECT_EQ(material.regions.at(2).poisson_ratio, 0.3);
    EXPECT_EQ(material.regions.at(2).shear_modulus_pa, material.shear_modulus_pa);
    EXPECT_EQ(material.regions.at(7).shear_modulus_pa, 1e5);
    EXPECT_EQ(largest_poisson_ratio(material), material.poisson_ratio);
  }
}

TEST(CaseFile, AnatomyIsReadAndWritten) {
  EXPECT_FALSE(value_or_fail(parse(kMinimal)).anatomy.labels);
  const std::string text = std::string(kMinimal) +
                           "material: {tissues: {brainstem: 2.5}}\n"
                           "anatomy: {labels: maps/aseg.mgz, numbers: aal, septa: off, "
                           "septum_gap_mm: 0.25}\n";
  const auto read = value_or_fail(parse(text));
  const auto again = value_or_fail(parse(case_config_text(read)));
  for (const CaseConfig& config : {read, again}) {
    EXPECT_EQ(config.anatomy.labels, fs::path("/cases/maps/aseg.mgz"));
    EXPECT_EQ(config.anatomy.numbers, LabelNumbers::kAal);
    EXPECT_TRUE(config.anatomy.tissues);
    EXPECT_FALSE(config.anatomy.septa);
    EXPECT_TRUE(config.anatomy.ventricles);
    EXPECT_EQ(config.anatomy.septum_gap_mm, 0.25);
    EXPECT_EQ(config.material.tissues.brainstem, 2.5);
    EXPECT_EQ(config.material.tissues.white_matter, TissueRatios{}.white_matter);
  }
  EXPECT_THAT(sentence_of(parse(std::string(kMinimal) + "mesh: {file: h.msh}\n"
                                                        "anatomy: {labels: aseg.mgz}\n")),
              testing::HasSubstr("anatomy.labels: needs a mesh that is generated (mesh.generate)"));
}

TEST(CaseFile, SectionsThatDoNothingWithoutLabelsAreRefusedByKey) {
  const test_support::TemporaryFolder folder;
  const auto refusal = [&](const std::string& section) {
    return sentence_of(read_case_config(folder.write("c.yaml", kMinimal + section)));
  };
  EXPECT_THAT(refusal("anatomy: {septa: on}\n"),
              testing::HasSubstr("c.yaml:6: anatomy: does nothing without anatomy.labels"));
  EXPECT_THAT(
      refusal("material:\n  tissues: {brainstem: 1.8}\n"),
      testing::HasSubstr("c.yaml:7: material.tissues: does nothing without anatomy.labels"));
  value_or_fail(read_case_config(folder.write("c.yaml", kMinimal + std::string("anatomy:\n"))));
  const CaseConfig plain = value_or_fail(parse(kMinimal));
  value_or_fail(read_case_config(folder.write("c.yaml", case_config_text(plain))));
  value_or_fail(parse(kMinimal + std::string("anatomy: {septa: on}\n")));  // of an earlier model
}

TEST(CaseFile, BadFilesAreRefusedInOneLineThatNamesFileLineKeyAndValue) {
  expect_edits_refused(
      parse, kFull,
      {{"gravity:", "gravitation: 1\ngravity:", ":19: gravitation: unknown key"},
       {"poisson_ratio", "poison_ratio",
        ":22: material.poison_ratio: unknown key (known here: shear_modulus_pa, "
        "poisson_ratio,"},
       {"edge_mm", "edge", ":5: mesh.generate.edge: unknown key"},
       {"label: 7", "labels: 7", ":12: tumour.label_volume.labels: unknown key"},
       {"    smoothing_mm: 1.5", "    edge_mm: 7",
        ":10: mesh.generate.edge_mm: key is given twice"},
       {"gravity: {direction: [0, 0, -2]}", "brainstem: {centre_mm: [0, 0, 0]}",
        ":19: brainstem: key is given twice"},
       {"edge_mm: 6", "edge_mm: &a [1, *a]", ":5: an alias stands inside the node that it names"},
       {"edge_mm: 6", "edge_mm: 6 mm", ":5: mesh.generate.edge_mm = 6 mm: must be a finite number"},
       {"0.45", "0,45", ":22: material.poisson_ratio = 0,45: must be"},
       {"0.45", "soft", ":22: material.poisson_ratio = soft: must be"},
       {"0.45", "", ":22: material.poisson_ratio = (empty): must be"},
       {"0.45", "[0.45, 1]", ":22: material.poisson_ratio = [0.45, 1]: must be"},
       {"0.45", ".nan", ":22: material.poisson_ratio = .nan: must be"},
       {"shear_modulus_pa: 2200", "shear_modulus_pa: inf",
        ":21: material.shear_modulus_pa = inf: must be"},
       {"0.45", "1e999", ":22: material.poisson_ratio = 1e999: must be"},
       {"sparse_points: 100", "sparse_points: 100.5",
        ":32: inversion.sparse_points = 100.5: must be an integer"},
       {"label: 7", "label: 99999999999",
        ":12: tumour.label_volume.label = 99999999999: must be an integer or a list of integers"},
       {"[7, 8, 9]", "[7, 8]",
        ":14: craniotomy.centre_mm = [7, 8]: must be a list of three finite numbers"},
       {"[7, 8, 9]", "[7, 8, 9, 10]", ":14: craniotomy.centre_mm = [7, 8, 9, 10]: must be"},
       {"[7, 8, 9]", "[7, 8, z]", ":14: craniotomy.centre_mm = [7, 8, z]: must be"},
       {"[7, 8, 9]", "7", ":14: craniotomy.centre_mm = 7: must be"},
       {"[1, -2.5]", "1", ":31: prior.gravity_levels_mm = 1: must be a list"},
       {"{gap_mm: 2, skull_file: skull.stl, slave_depth_mm: 25, "
        "penalty_n_per_mm: 6}",
        "2", ":26: contact = 2: must be a section"},
       {"case_id: full", "case_id: [a]", ":1: case_id = [a]: must be text"},
       {"brain: sub/../mask.nii", "brain: {a: b}", ":2: images.brain = (a section): must be text"},
       {"  label_volume:", "  surface: {file: t.stl}\n  label_volume:",
        ":11: tumour has label_volume, surface: must have exactly one of ellipsoid, "
        "label_volume, surface"},
       {"  label_volume: {file: labels.nii, label: 7}", "  {}",
        ":11: tumour has none: must have exactly one of"},
       {"mesh:", "mesh:\n  file: a.msh", ":3: mesh has generate, file: must have exactly one of"},
       {"file: labels.nii, ", "", ":12: tumour.label_volume.file: key is missing"},
       {"file: labels.nii", "file: ''", ":12: tumour.label_volume.file: must name a file"},
       {"label: 7", "segment: ''", ":12: tumour.label_volume.segment: must not be empty"},
       {"skull_file: skull.stl", "skull_file: ''", ":26: contact.skull_file: must name a file"},
       {"case_id: full\n", "", ": case_id: key is missing"},
       {"centre_mm: [7, 8, 9]\n  long_axis_mm: 30\n  short_axis_mm: 20\n"
        "  long_axis_direction: [0, 3, 4]\nbrainstem: {centre_mm: [0, 1, -60], radius_mm: 9}",
        "long_axis_mm: 30", ": craniotomy.centre_mm, brainstem: keys are missing"},
       {"case_id: full", "case_id: ''", ":1: case_id: must not be empty"},
       {"  centre_mm: [7, 8, 9]\n", "", ":13: craniotomy.centre_mm: key is missing"},
       {"brainstem: {centre_mm: [0, 1, -60], radius_mm: 9}\n", "", ": brainstem: key is missing"},
       {", brain: sub/../mask.nii", "", ": images.brain: must name"},
       {"0.45", "0.6", ":22: material.poisson_ratio = 0.6: must be between"},
       {"-2.5", "-2500", ":31: prior.gravity_levels_mm[1] = -2500: must be between"},
       {"short_axis_mm: 20", "short_axis_mm: 31",
        ":16: craniotomy.short_axis_mm = 31: must be between 1 and 30"},
       {"[0, 0, -2]", "[0, 0, 0]", ":19: gravity.direction length = 0"},
       {"mesh:", "mesh: [", "is not valid YAML"},
       {"mesh:", ", A\nmesh:", "YAML"},
       {"mesh:", "---\nmesh:", "holds 2 YAML documents"}},
      ErrorCode::kInvalidArgument);
  const std::string above = "_unsaturated_kg_m3: 1.2";
  expect_edits_refused(
      parse, kFull,
      {{above, above + "\n  regions: {white: {shear_modulus_pa: 3000}}",
        "material.regions.white: must be a label of the mesh"},
       {above, above + "\n  regions: {3: {shear_modulus_pa: -1}}",
        "material.regions.3.shear_modulus_pa = -1"},
       {above, above + "\n  tumour: {poisson_ratio: 0.5}", "material.tumour.poisson_ratio = 0.5"},
       {above, above + "\n  tumour: {stiffness: 0.5}", "material.tumour.stiffness"}},
      ErrorCode::kInvalidArgument);
}

TEST(CaseFile, WhatIsNoMappingIsRefused) {
  const char* words = "c.yaml: is not a YAML mapping";
  expect_refused(parse,
                 {{"", words}, {"# nothing\n", words}, {"just text", words}, {"[1, 2]", words}},
                 ErrorCode::kInvalidArgument);
  std::string garbage;
  for (int i = 0; i < 3000; ++i) garbage += static_cast<char>(i * 37 % 251);
  EXPECT_FALSE(parse(garbage));
}

TEST(CaseFile, MissingFileIsNotFound) {
  EXPECT_EQ(refusal_of(read_case_config("/nowhere/c.yaml"), ErrorCode::kNotFound),
            "/nowhere/c.yaml: no such file");
}

TEST(ShippedCases, AllReadAndAreValid) {
  int cases = 0;
  for (const auto& entry :
       fs::directory_iterator(fs::path(BRAINSHIFT_SOURCE_DIR) / "config/cases")) {
    if (entry.path().extension() != ".yaml") continue;
    ++cases;
    const auto read = value_or_fail(read_case_config(entry.path()));
    EXPECT_EQ(read.case_id, entry.path().stem().string());
  }
  EXPECT_GE(cases, 2);
}

TEST(ShippedCases, DefaultCaseHasThePapersTumourVolume) {
  const auto read = value_or_fail(
      read_case_config(fs::path(BRAINSHIFT_SOURCE_DIR) / "config/cases/colin27.yaml"));
  const Vec3 axes = std::get<TumourEllipsoid>(read.tumour).semi_axes_mm;
  EXPECT_NEAR(4.0 / 3.0 * 3.14159265358979 * axes.prod(), 10990.0, 0.01);
}

TEST(ShippedCases, DefaultCaseDocumentsEveryKeyAsTheTableDoes) {
  expect_documented(content_of(fs::path(BRAINSHIFT_SOURCE_DIR) / "config/cases/colin27.yaml"),
                    documents_of<CaseConfig>());
}

}  // namespace
}  // namespace brainshift::io
