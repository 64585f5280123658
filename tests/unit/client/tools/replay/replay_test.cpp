// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

class ReplayInput : public testing::Test {
 protected:
  Error refused(int repeat = 1, Speed speed = Speed::kMax) const {
    ReplayOptions options;
    options.repeat = repeat;
    options.speed = speed;
    options.surgery = folder / "s.surgery";
    options.report = folder / "R.json";
    options.endpoint = "tcp://127.0.0.1:1";
    const Status status = replay(options);
    EXPECT_FALSE(status);
    EXPECT_FALSE(std::filesystem::exists(options.report));
    return status ? Error{} : status.error();
  }
  const test_support::TemporaryFolder folder;
};

// A surgery whose observations have these sequence numbers.
void record(const std::filesystem::path& path, const std::vector<std::uint64_t>& sequences) {
  auto file = io::SurgeryFile::create(path, io::SurgeryMeta{"box", "m"});
  ASSERT_TRUE(file);
  for (const std::uint64_t sequence : sequences) {
    Observation observation;
    observation.case_id = "box";
    observation.source = "ius";
    observation.sequence = sequence;
    observation.body = LandmarkPairs{Points::Random(3, 4), Points::Random(3, 4), 0.3};
    ASSERT_TRUE(
        file->append({io::RecordKind::kObservation, sequence, 0, wire::encode(observation)}));
  }
  ASSERT_TRUE(file->close());
}

TEST_F(ReplayInput, RepeatThatDoesNotFitIsRefused) {
  constexpr std::uint64_t kLargest = (std::uint64_t{1} << 63) - 1;
  record(folder / "s.surgery", {kLargest - 4, kLargest - 3});
  for (const int repeat : {0, -1, 3, 1000}) {
    const Error error = refused(repeat);
    EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(error.message, HasSubstr("repeat = " + std::to_string(repeat)));
  }
  const Error recorded_times = refused(2, Speed::kRecorded);
  EXPECT_EQ(recorded_times.code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(recorded_times.message, HasSubstr("speed max"));
}

TEST_F(ReplayInput, MissingSurgeryIsNamed) {
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("s.surgery"));
}

TEST_F(ReplayInput, SurgeryWithoutModelIdIsRefused) {
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box"})->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("meta.model_id"));
}

TEST_F(ReplayInput, SurgeryWithoutObservationIsRefused) {
  ASSERT_TRUE(io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box", "m"})->close());
  EXPECT_EQ(refused().code, ErrorCode::kEmptySet);
}

TEST_F(ReplayInput, UndecodableObservationIsNamed) {
  auto file = io::SurgeryFile::create(folder / "s.surgery", io::SurgeryMeta{"box", "m"});
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append({io::RecordKind::kObservation, 12, 0, "\xff\xff\xff"}));
  ASSERT_TRUE(file->close());
  const Error error = refused();
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("observation 12"));
}

}  // namespace
}  // namespace brainshift::client
