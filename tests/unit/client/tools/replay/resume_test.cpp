// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/resume.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/io/recording/surgery_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

Observation observed(const std::string& source, std::uint64_t sequence) {
  Observation observation;
  observation.case_id = "box";
  observation.source = source;
  observation.sequence = sequence;
  observation.body = LandmarkPairs{Points::Ones(3, 4), Points::Ones(3, 4), 0.3};
  return observation;
}

io::SurgeryRecord resumed_record(const std::string& source, std::uint64_t sequence) {
  return {io::RecordKind::kObservation, sequence, 0, wire::encode(observed(source, sequence))};
}

class Resume : public testing::Test {
 protected:
  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "crashed.surgery";
};

TEST_F(Resume, AJournalThatWasNotClosedSaysWhatEachSourceRecordedLast) {
  auto file = io::SurgeryFile::create(path, {.model_id = "m"});
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append(resumed_record("ius", 4)));
  ASSERT_TRUE(file->append(resumed_record("camera", 50)));
  ASSERT_TRUE(file->append(resumed_record("ius", 6)));
  ASSERT_TRUE(file->append({io::RecordKind::kUpdate, 3, 0, "opaque"}));
  const auto point = read_resume_point(path);
  ASSERT_TRUE(point) << point.error().message;
  EXPECT_EQ(point->meta.model_id, "m");
  EXPECT_EQ(point->records, 4u);
  EXPECT_FALSE(point->broken);
  EXPECT_EQ(describe(*point), "goes on after observation 50 of camera and 6 of ius, update 3");
}

TEST_F(Resume, ABrokenJournalCountsUpToTheBreak) {
  {
    auto file = io::SurgeryFile::create(path, {});
    ASSERT_TRUE(file);
    std::vector<io::SurgeryRecord> records;
    for (std::uint64_t i = 1; i <= 200; ++i) records.push_back(resumed_record("ius", i));
    ASSERT_TRUE(file->append(records));
    ASSERT_TRUE(file->close());
  }
  fs::resize_file(path, fs::file_size(path) * 9 / 10);
  const auto point = read_resume_point(path);
  ASSERT_TRUE(point) << point.error().message;
  ASSERT_TRUE(point->broken);
  EXPECT_THAT(point->broken->message, HasSubstr("record "));
  EXPECT_EQ(point->last.at("ius"), point->records);
  EXPECT_LT(point->records, 200u);
  EXPECT_GT(point->records, 50u);
}

TEST_F(Resume, TheLastRecordedObservationOfEverySourceIsSentAgain) {
  std::vector<RecordedObservation> recording;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    recording.push_back({0, observed("ius", i)});
    recording.push_back({0, observed("camera", 10 + i)});
    recording.push_back({0, observed("pointer", i)});
  }
  ResumePoint point;
  point.last = {{"ius", 4}, {"camera", 13}, {"stranger", 9}};
  std::vector<std::string> left;
  for (const auto& one : remaining(recording, point)) {
    left.push_back(one.observation.source + std::to_string(one.observation.sequence));
  }
  EXPECT_THAT(left, ElementsAre("pointer1", "pointer2", "camera13", "pointer3", "ius4", "camera14",
                                "pointer4"));
  EXPECT_EQ(remaining(recording, {}).size(), recording.size());
  EXPECT_EQ(describe(ResumePoint{}), "begins anew: no observation is recorded");
}

}  // namespace
}  // namespace brainshift::client
