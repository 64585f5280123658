// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/journal.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

using test_support::TemporaryFolder;

// What a fake sink was asked to do; the sink itself belongs to the journal.
struct SinkLog {
  std::vector<std::uint64_t> appended;
  int closed = 0;
  std::uint64_t fail_at = 0;   // sequence whose append fails
  std::uint64_t throw_at = 0;  // sequence whose append throws
};

class FakeSink final : public RecordSink {
 public:
  explicit FakeSink(SinkLog& log) : log_(log) {}
  Status append(const io::SurgeryRecord& record) override {
    if (record.sequence == log_.throw_at) throw std::runtime_error("thrown");
    if (record.sequence == log_.fail_at) return fail(ErrorCode::kWriteFailed, "x: disk full");
    log_.appended.push_back(record.sequence);
    return {};
  }
  Status close() override {
    ++log_.closed;
    return {};
  }

 private:
  SinkLog& log_;
};

Journal::Options fake_options(SinkLog& log, std::vector<std::string>& errors) {
  Journal::Options options;
  options.open = [&log](const auto&, const auto&) -> Result<std::unique_ptr<RecordSink>> {
    return std::make_unique<FakeSink>(log);
  };
  options.on_error = [&errors](const Error& error) { errors.push_back(error.message); };
  return options;
}

io::SurgeryRecord record(std::uint64_t sequence,
                         io::RecordKind kind = io::RecordKind::kObservation) {
  return {kind, sequence, 0, "payload " + std::to_string(sequence)};
}

TEST(Journal, WritesASurgeryFileThatReadsBackInOrder) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "a.surgery";
  Journal journal({});
  journal.begin(path, io::SurgeryMeta{"c", "m"});
  for (std::uint64_t i = 1; i <= 20; ++i) {
    journal.append(record(i));
    journal.append(record(i, io::RecordKind::kUpdate));
  }
  journal.stop();
  EXPECT_TRUE(journal.status().has_value());
  const auto file = io::SurgeryFile::open(path);
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(file->meta().case_id, "c");
  const auto observations = file->records(io::RecordKind::kObservation);
  ASSERT_TRUE(observations.has_value());
  ASSERT_EQ(observations->size(), 20u);
  for (std::uint64_t i = 0; i < 20; ++i) {
    EXPECT_EQ((*observations)[i].sequence, i + 1);
    EXPECT_EQ((*observations)[i].payload, "payload " + std::to_string(i + 1));
  }
  EXPECT_EQ(file->records(io::RecordKind::kUpdate)->size(), 20u);
}

TEST(Journal, AppendsNothingAfterAFailedRecordAndSaysSoOnce) {
  SinkLog log;
  log.fail_at = 2;
  std::vector<std::string> errors;
  Journal journal(fake_options(log, errors));
  journal.begin("x", {});
  for (std::uint64_t i = 1; i <= 5; ++i) journal.append(record(i));
  journal.stop();
  const auto status = journal.status();
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, ErrorCode::kWriteFailed);
  EXPECT_EQ(status.error().message, "x: disk full");
  EXPECT_THAT(errors, ElementsAre("x: disk full"));
  EXPECT_THAT(log.appended, ElementsAre(1));
  EXPECT_EQ(log.closed, 1);
}

TEST(Journal, AThrowingSinkIsAFailureToo) {
  SinkLog log;
  log.throw_at = 1;
  std::vector<std::string> errors;
  Journal journal(fake_options(log, errors));
  journal.begin("x", {});
  journal.append(record(1));
  journal.stop();
  EXPECT_FALSE(journal.status().has_value());
  EXPECT_THAT(errors, ElementsAre(HasSubstr("thrown")));
}

TEST(Journal, ANewFileForgetsTheFailureOfTheOldOne) {
  SinkLog log;
  log.fail_at = 1;
  std::vector<std::string> errors;
  Journal journal(fake_options(log, errors));
  journal.begin("x", {});
  journal.append(record(1));
  journal.begin("y", {});
  journal.append(record(2));
  journal.stop();
  EXPECT_TRUE(journal.status().has_value());
  EXPECT_THAT(log.appended, ElementsAre(2));
}

TEST(Journal, AFolderThatDoesNotExistIsAnError) {
  std::vector<std::string> errors;
  Journal::Options options;
  options.on_error = [&](const Error& error) { errors.push_back(error.message); };
  Journal journal(options);
  journal.begin("/nonexistent/folder/a.surgery", {});
  journal.append(record(1));
  journal.stop();
  ASSERT_FALSE(journal.status().has_value());
  EXPECT_THAT(journal.status().error().message, HasSubstr("/nonexistent/folder/a.surgery"));
  EXPECT_EQ(errors.size(), 1u);
}

TEST(Journal, IgnoresRecordsBeforeTheFirstFile) {
  SinkLog log;
  std::vector<std::string> errors;
  Journal journal(fake_options(log, errors));
  journal.append(record(1));
  journal.stop();
  EXPECT_TRUE(log.appended.empty());
  EXPECT_TRUE(journal.status().has_value());
}

TEST(Journal, StorageThatStallsEndsTheJournalInsteadOfFillingMemory) {
  std::promise<void> opening;
  std::promise<void> resume;
  SinkLog log;
  std::vector<std::string> errors;
  Journal::Options options = fake_options(log, errors);
  options.max_queued = 3;
  options.open = [&, open = options.open](const auto& path, const auto& meta) {
    opening.set_value();
    resume.get_future().wait();
    return open(path, meta);
  };
  Journal journal(options);
  journal.begin("x", {});
  opening.get_future().wait();
  for (std::uint64_t i = 1; i <= 3; ++i) journal.append(record(i));
  EXPECT_TRUE(journal.status().has_value());
  journal.append(record(4));
  ASSERT_FALSE(journal.status().has_value());
  EXPECT_THAT(journal.status().error().message, HasSubstr("3 records are waiting"));
  resume.set_value();
  journal.stop();
  EXPECT_THAT(log.appended, ElementsAre(1, 2, 3));
}

TEST(Journal, BytesInTheQueueAreBoundedToo) {
  std::promise<void> opening;
  std::promise<void> resume;
  SinkLog log;
  std::vector<std::string> errors;
  Journal::Options options = fake_options(log, errors);
  options.max_queued_bytes = 100;
  options.open = [&, open = options.open](const auto& path, const auto& meta) {
    opening.set_value();
    resume.get_future().wait();
    return open(path, meta);
  };
  Journal journal(options);
  journal.begin("x", {});
  opening.get_future().wait();
  journal.append({io::RecordKind::kUpdate, 1, 0, std::string(60, 'a')});
  EXPECT_TRUE(journal.status().has_value());
  journal.append({io::RecordKind::kUpdate, 2, 0, std::string(60, 'a')});
  EXPECT_FALSE(journal.status().has_value());
  resume.set_value();
}

// A file-size limit stands for a full disk. It holds for the whole process, hence the child.
void journal_on_a_full_disk(const std::filesystem::path& path) {
  std::signal(SIGXFSZ, SIG_IGN);
  Journal journal({});
  journal.begin(path, io::SurgeryMeta{"c"});
  journal.append(record(1));
  const rlimit limit{128 * 1024, 128 * 1024};
  setrlimit(RLIMIT_FSIZE, &limit);
  journal.append({io::RecordKind::kUpdate, 2, 0, std::string(1 << 20, 'a')});
  journal.stop();
  std::exit(journal.status() ? 0 : 42);
}

TEST(JournalDeathTest, AFullDiskIsReportedAndLeavesAReadableFile) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  // The dying process runs this test from its start: it must find the folder of the one that
  // watches.
  constexpr const char* kVariable = "BRAINSHIFT_FULL_DISK_FOLDER";
  std::optional<TemporaryFolder> folder;
  if (getenv(kVariable) == nullptr) setenv(kVariable, folder.emplace().path().c_str(), 1);
  const auto path = std::filesystem::path(getenv(kVariable)) / "j.surgery";
  EXPECT_EXIT(journal_on_a_full_disk(path), testing::ExitedWithCode(42), "");
  const auto file = io::SurgeryFile::open(path);
  ASSERT_TRUE(file.has_value()) << file.error().message;
  EXPECT_EQ(file->records(io::RecordKind::kObservation)->size(), 1u);
  EXPECT_EQ(file->records(io::RecordKind::kUpdate)->size(), 0u);
}

TEST(JournalPath, KeepsTheCaseIdInsideTheFolder) {
  EXPECT_EQ(journal_path("/j", "../a b/c", "1"), "/j/.._a_b_c-1.surgery");
}

TEST(JournalPath, NeverNamesAFileThatExists) {
  const TemporaryFolder folder;
  const auto first = journal_path(folder.path(), "c", "1");
  ASSERT_TRUE(io::SurgeryFile::create(first, {}).has_value());
  const auto second = journal_path(folder.path(), "c", "1");
  EXPECT_EQ(second.filename(), "c-1-2.surgery");
}

}  // namespace
}  // namespace brainshift::server
