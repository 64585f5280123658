// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/prepare_model.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <string>
#include <vector>

#include "common/patient/read_patient.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/patient/box_case.hpp"

namespace brainshift::patient {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST_F(BoxCase, IsPreparedUnderBothBoundaries) {
  std::vector<std::string> stages;
  PrepareOptions options;
  options.progress = [&](std::string_view stage, double) {
    if (stages.empty() || stages.back() != stage) stages.emplace_back(stage);
  };
  const auto prepared = value_or_fail(prepare_model(config(), options));
  const io::ModelFile& file = prepared.file;
  EXPECT_EQ(file.model.model_id, read_patient(case_file_)->model.model_id);
  ASSERT_EQ(file.condensed.size(), kPreparedBoundaries.size());
  for (std::size_t i = 0; i < kPreparedBoundaries.size(); ++i) {
    EXPECT_EQ(file.condensed[i].boundary, kPreparedBoundaries[i]);
    EXPECT_EQ(file.condensed[i].model_id, file.model.model_id);
    EXPECT_GT(file.condensed[i].prepare_s, 0.0);
    EXPECT_GT(prepared.timings[i].factor_nonzeros, 0u);
  }
  ASSERT_EQ(file.inputs.size(), 2u);
  EXPECT_EQ(file.inputs[0].key, "case");
  EXPECT_EQ(file.inputs[1].key, "mesh.file");
  EXPECT_FALSE(prepared.checkpoint.has_value());
  EXPECT_EQ(stages.front(), "read images");
  EXPECT_THAT(stages, Contains("contact: contact columns"));
  EXPECT_THAT(stages, Contains("fixed: prior modes"));
  // What comes out can be written: the model file checks that the parts belong together.
  EXPECT_TRUE(io::write_model(folder_ / "m.h5", file));
}

// Leaves a checkpoint with all contact columns.
void interrupt(const CaseConfig& config, const std::filesystem::path& checkpoint) {
  PrepareOptions options;
  options.checkpoint = checkpoint;
  std::stop_source stop;
  options.stop = stop.get_token();
  options.progress = [&](std::string_view stage, double) {
    if (stage == "contact: compact columns") stop.request_stop();
  };
  refusal_of(prepare_model(config, options), ErrorCode::kUnavailable);
  ASSERT_TRUE(std::filesystem::exists(checkpoint));
}

TEST_F(BoxCase, AnInterruptedPreparationGoesOnFromItsCheckpoint) {
  PrepareOptions options;
  options.checkpoint = folder_ / "m.h5.partial";
  interrupt(config(), options.checkpoint);

  int resumed = 0;
  options.on_resume = [&] { ++resumed; };
  auto finished = value_or_fail(prepare_model(config(), options));
  EXPECT_EQ(resumed, 1);
  PrepareOptions afresh;
  const auto whole = value_or_fail(prepare_model(config(), afresh));
  EXPECT_TRUE(finished.file.condensed[0].responses.parts() ==
              whole.file.condensed[0].responses.parts());
  ASSERT_TRUE(finished.checkpoint.has_value());
  EXPECT_TRUE(finished.checkpoint->remove());
  EXPECT_FALSE(std::filesystem::exists(options.checkpoint));
}

// Columns are read by parts, which no checksum covers: what cannot be read as a whole must not be.
TEST_F(BoxCase, ACheckpointThatIsAlteredWhileItIsOpenEndsThePreparation) {
  PrepareOptions options;
  options.checkpoint = folder_ / "m.h5.partial";
  interrupt(config(), options.checkpoint);
  options.on_resume = [&] {
    std::fstream bytes(options.checkpoint, std::ios::binary | std::ios::in | std::ios::out);
    bytes.seekp(24 + 40 + 1).put('\x7f').flush();  // in the first block's numbers
  };
  EXPECT_THAT(refusal_of(prepare_model(config(), options), ErrorCode::kUnreadable),
              HasSubstr("was altered while the file was open"));
}

TEST_F(BoxCase, StopsBeforeTheLongWorkWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  PrepareOptions options;
  options.stop = stop.get_token();
  std::vector<std::string> stages;
  options.progress = [&](std::string_view stage, double) { stages.emplace_back(stage); };
  refusal_of(prepare_model(config(), options), ErrorCode::kUnavailable);
  EXPECT_THAT(stages, ::testing::Each(StartsWith("read")));
}

TEST_F(BoxCase, AFailedPreparationLeavesNoEmptyCheckpoint) {
  CaseConfig small = config();
  small.condensed.memory_limit_gib = 1e-6;
  PrepareOptions options;
  options.checkpoint = folder_ / "m.h5.partial";
  EXPECT_THAT(sentence_of(prepare_model(small, options)), HasSubstr("condensed.memory_limit_gib"));
  EXPECT_FALSE(std::filesystem::exists(options.checkpoint));
}

}  // namespace
}  // namespace brainshift::patient
