// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/read_patient.hpp"

#include <gmock/gmock.h>

#include <set>
#include <string>

#include "tests/support/results.hpp"
#include "tests/unit/patient/box_case.hpp"

namespace brainshift::patient {
namespace {

using ::testing::HasSubstr;

TEST_F(BoxCase, IsReadAndBuiltFromItsFile) {
  std::set<std::string> stages;
  const auto patient = value_or_fail(
      read_patient(case_file_, [&](std::string_view stage, double) { stages.emplace(stage); }));
  EXPECT_EQ(patient.config.file, case_file_);
  EXPECT_EQ(patient.model.case_id, patient.config.case_id);
  EXPECT_GT(patient.model.slaves.size(), 4u);
  EXPECT_FALSE(stages.empty());
  const auto again = value_or_fail(build_patient(patient.config));
  EXPECT_EQ(again.model_id, patient.model.model_id);
}

TEST_F(BoxCase, ErrorsOfEachStepPassThrough) {
  refusal_of(read_patient(folder_ / "none.yaml"), ErrorCode::kNotFound);
  CaseConfig far = config();
  far.craniotomy.centre_mm += Vec3(500, 0, 0);
  refusal_of(build_patient(far), ErrorCode::kEmptySet);
  std::filesystem::remove(folder_ / "box.vtu");
  EXPECT_THAT(sentence_of(read_patient(case_file_)), HasSubstr("mesh.file"));
}

}  // namespace
}  // namespace brainshift::patient
