// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/read_patient.hpp"

#include <gmock/gmock.h>

#include <set>
#include <string>

#include "tests/unit/patient/box_case.hpp"

namespace brainshift::patient {
namespace {

using ::testing::HasSubstr;

TEST_F(BoxCase, IsReadAndBuiltFromItsFile) {
  std::set<std::string> stages;
  const auto patient =
      read_patient(case_file_, [&](std::string_view stage, double) { stages.emplace(stage); });
  ASSERT_TRUE(patient.has_value()) << patient.error().message;
  EXPECT_EQ(patient->config.file, case_file_);
  EXPECT_EQ(patient->model.case_id, patient->config.case_id);
  EXPECT_GT(patient->model.slaves.size(), 4u);
  EXPECT_FALSE(stages.empty());
  const auto again = build_patient(patient->config);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->model_id, patient->model.model_id);
}

TEST_F(BoxCase, ErrorsOfEachStepPassThrough) {
  const auto no_case = read_patient(folder_ / "none.yaml");
  ASSERT_FALSE(no_case.has_value());
  EXPECT_EQ(no_case.error().code, ErrorCode::kNotFound);
  CaseConfig far = config();
  far.craniotomy.centre_mm += Vec3(500, 0, 0);
  const auto no_craniotomy = build_patient(far);
  ASSERT_FALSE(no_craniotomy.has_value());
  EXPECT_EQ(no_craniotomy.error().code, ErrorCode::kEmptySet);
  std::filesystem::remove(folder_ / "box.vtu");
  const auto no_mesh = read_patient(case_file_);
  ASSERT_FALSE(no_mesh.has_value());
  EXPECT_THAT(no_mesh.error().message, HasSubstr("mesh.file"));
}

}  // namespace
}  // namespace brainshift::patient
