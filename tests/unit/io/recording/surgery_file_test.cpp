// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_file.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const SurgeryMeta kMeta = {.case_id = "colin27",
                           .model_id = "0123456789abcdef",
                           .case_file = "",
                           .scenario = "Köln 'quoted'",
                           .seed = std::numeric_limits<std::uint64_t>::max(),
                           .method = "condensed",
                           .boundary = "contact",
                           .created_utc = "2025-01-31T12:34:56Z",
                           .software = "a test"};

SurgeryRecord record(std::uint64_t sequence, RecordKind kind = RecordKind::kObservation) {
  return {kind, sequence, static_cast<std::int64_t>(sequence % 1000) * 1000 - 1,
          std::string("\0payload\xff ", 10) + std::to_string(sequence)};
}

SurgeryTruth sample_truth() {
  SurgeryTruth truth;
  truth.displacement = Points::NullaryExpr(3, 50, [](Eigen::Index i, Eigen::Index j) {
    return 1.0 / static_cast<double>(1 + i + 3 * j);
  });
  truth.displacement(0, 0) = -0.0;
  truth.displacement(1, 0) = std::numeric_limits<double>::denorm_min();
  truth.points["sparse"] = {{{0, 1, 2, 49}, {0.1, 0.2, 0.3, 0.4}}, {{3, 3, 3, 3}, {1, 0, 0, 0}}};
  truth.points["cross"] = {{{9, 8, 7, 6}, {1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0}}};
  truth.scalars = {{"fluid_level_mm", 1.0 / 3.0}, {"sag_mm", -4.0}};
  return truth;
}

class SurgeryFileTest : public ::testing::Test {
 protected:
  SurgeryFile make() { return value_or_fail(SurgeryFile::create(path, kMeta)); }
  void make_complete() {
    SurgeryFile file = make();
    for (std::uint64_t i = 1; i <= 20; ++i) ASSERT_TRUE(file.append(record(i)));
    ASSERT_TRUE(file.write_truth(1, sample_truth()));
    ASSERT_TRUE(file.close());
  }
  void expect_open_refused(ErrorCode code, const std::string& text) {
    EXPECT_THAT(refusal_of(SurgeryFile::open(path), code),
                testing::AllOf(HasSubstr(path.string()), HasSubstr(text),
                               testing::Not(testing::HasSubstr("\n"))));
  }
  // Runs SQL on the file behind SurgeryFile's back.
  void tamper(const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    ASSERT_EQ(sqlite3_close(db), SQLITE_OK);
  }
  std::vector<std::string> files_in_folder() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.path()))
      names.push_back(entry.path().filename());
    return names;
  }

  const test_support::TemporaryFolder folder;
  fs::path path = folder / "one.surgery";
};

void expect_error(const Status& status, ErrorCode code, const std::string& text) {
  EXPECT_THAT(refusal_of(status, code), HasSubstr(text));
}

// ---------- what is written is read ----------

TEST_F(SurgeryFileTest, RecordsAndMetaComeBackInOrderAndBitForBit) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.append(record(2)));
  ASSERT_TRUE(file.append(record(1)));
  ASSERT_TRUE(file.append(record(1, RecordKind::kUpdate)));
  SurgeryRecord extreme = record(3);
  extreme.sequence = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  extreme.recorded_ns = std::numeric_limits<std::int64_t>::min();
  extreme.payload.clear();
  ASSERT_TRUE(file.append(extreme));
  SurgeryRecord large = record(4);
  large.payload = std::string(3u << 20, '\x80');
  ASSERT_TRUE(file.append(large));
  ASSERT_TRUE(file.close());

  const auto opened = value_or_fail(SurgeryFile::open(path));
  EXPECT_EQ(opened.meta(), kMeta);
  const auto observations = opened.records(RecordKind::kObservation).value();
  const std::vector<SurgeryRecord> expected = {record(2), record(1), extreme, large};
  ASSERT_EQ(observations.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(observations[i].kind, RecordKind::kObservation);
    EXPECT_EQ(observations[i].sequence, expected[i].sequence);
    EXPECT_EQ(observations[i].recorded_ns, expected[i].recorded_ns);
    EXPECT_EQ(observations[i].payload, expected[i].payload);
  }
  ASSERT_EQ(opened.records(RecordKind::kUpdate).value().size(), 1u);
}

TEST_F(SurgeryFileTest, TruthComesBackBitForBit) {
  make_complete();
  const auto file = value_or_fail(SurgeryFile::open(path));
  const auto truth = value_or_fail(file.read_truth(1));
  ASSERT_EQ(truth.displacement.cols(), 50);
  EXPECT_TRUE(std::signbit(truth.displacement(0, 0)));
  EXPECT_EQ(truth.displacement(1, 0), std::numeric_limits<double>::denorm_min());
  ASSERT_EQ(truth.points.size(), 2u);
  ASSERT_EQ(truth.points.at("sparse").size(), 2u);
  EXPECT_EQ(truth.points.at("sparse")[0].nodes, Eigen::Vector4i(0, 1, 2, 49));
  EXPECT_EQ(truth.points.at("sparse")[0].weights, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4));
  EXPECT_EQ(truth.points.at("sparse")[1].nodes, Eigen::Vector4i(3, 3, 3, 3));
  EXPECT_EQ(truth.points.at("cross")[0].weights,
            Eigen::Vector4d(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0));
  EXPECT_EQ(truth.scalars, sample_truth().scalars);
  EXPECT_EQ(truth.displacement, sample_truth().displacement);
}

TEST_F(SurgeryFileTest, EachObservationHasItsOwnTruth) {
  SurgeryFile file = make();
  SurgeryTruth first = sample_truth();
  SurgeryTruth second;
  second.displacement = Points::Constant(3, 4, 2.5);
  ASSERT_TRUE(file.write_truth(1, first));
  ASSERT_TRUE(file.write_truth(2, second));
  EXPECT_EQ(file.read_truth(1).value().displacement, first.displacement);
  EXPECT_EQ(file.read_truth(2).value().displacement, second.displacement);
  EXPECT_TRUE(file.read_truth(2).value().points.empty());
  EXPECT_EQ(file.read_truth(3).error().code, ErrorCode::kNotFound);
}

TEST_F(SurgeryFileTest, AfterCloseThereIsOneFile) {
  make_complete();
  EXPECT_THAT(files_in_folder(), ::testing::ElementsAre("one.surgery"));
  ASSERT_TRUE(SurgeryFile::open(path));
  EXPECT_THAT(files_in_folder(), ::testing::ElementsAre("one.surgery"));
}

TEST_F(SurgeryFileTest, ALiveFileCanBeReadWhileItIsWritten) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.append(record(1)));
  const auto reader = value_or_fail(SurgeryFile::open(path));
  EXPECT_EQ(reader.records(RecordKind::kObservation).value().size(), 1u);
  ASSERT_TRUE(file.append(record(2)));
  EXPECT_EQ(reader.records(RecordKind::kObservation).value().size(), 2u);
}

TEST_F(SurgeryFileTest, TheNewestComeFirstAndWhatLiesBeforeThemIsNotRead) {
  SurgeryFile file = make();
  for (std::uint64_t i = 1; i <= 6; ++i) {
    ASSERT_TRUE(
        file.append(record(i, i % 2 == 0 ? RecordKind::kUpdate : RecordKind::kObservation)));
  }
  std::vector<std::uint64_t> seen;
  const auto until = [&](std::uint64_t last) {
    seen.clear();
    return value_or_fail(SurgeryFile::open(path))
        .newest_first(RecordKind::kObservation, [&](const SurgeryRecord& one) -> Result<bool> {
          EXPECT_EQ(one.payload, record(one.sequence).payload);
          seen.push_back(one.sequence);
          return one.sequence > last;
        });
  };
  EXPECT_TRUE(until(0));
  EXPECT_THAT(seen, testing::ElementsAre(5, 3, 1));
  tamper("UPDATE record SET payload = x'00' WHERE id = 2");  // the one before record 3
  EXPECT_TRUE(until(3));
  EXPECT_THAT(seen, testing::ElementsAre(5, 3));
  tamper("UPDATE record SET payload = x'00' WHERE id = 3");
  expect_error(until(1), ErrorCode::kUnreadable, "record 3: the checksum does not match");
  EXPECT_THAT(seen, testing::ElementsAre(5));
}

TEST_F(SurgeryFileTest, AcknowledgedRecordsSurviveAKill) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto file = SurgeryFile::create(path, kMeta);
    for (std::uint64_t i = 1; file && i <= 5; ++i) {
      if (!file->append(record(i))) ::_exit(1);
    }
    ::kill(::getpid(), SIGKILL);
  }
  int state = 0;
  ASSERT_EQ(::waitpid(child, &state, 0), child);
  ASSERT_TRUE(WIFSIGNALED(state));
  const auto file = value_or_fail(SurgeryFile::open(path));
  const auto records = file.records(RecordKind::kObservation).value();
  ASSERT_EQ(records.size(), 5u);
  EXPECT_EQ(records[4].payload, record(5).payload);
}

TEST_F(SurgeryFileTest, RecordsGoToAWriteAheadLog) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.append(record(1)));
  EXPECT_TRUE(fs::exists(fs::path(path) += "-wal"));
}

// ---------- failures ----------

TEST_F(SurgeryFileTest, CreateRefusesToOverwriteAnything) {
  std::ofstream(path) << "precious";
  EXPECT_EQ(refusal_of(SurgeryFile::create(path, kMeta), ErrorCode::kWriteFailed),
            path.string() + ": exists already");
  EXPECT_EQ(fs::file_size(path), 8u);
}

TEST_F(SurgeryFileTest, ADiscardedFileLeavesNothingBehind) {
  const fs::path other = folder / "two.surgery";
  std::ofstream(other) << "precious";
  {
    SurgeryFile file = make();
    ASSERT_TRUE(file.append(record(1)));
    ASSERT_TRUE(fs::exists(fs::path(path) += "-wal"));
    discard_surgery(path);
  }
  for (const auto& entry : fs::directory_iterator(path.parent_path())) {
    EXPECT_EQ(entry.path(), other);
  }
  discard_surgery(path);
  EXPECT_TRUE(fs::exists(other));
}

TEST_F(SurgeryFileTest, CreateInAFolderThatDoesNotExistNamesTheFile) {
  path = folder / "nowhere" / "one.surgery";
  EXPECT_THAT(refusal_of(SurgeryFile::create(path, kMeta), ErrorCode::kWriteFailed),
              HasSubstr(path.string()));
}

TEST_F(SurgeryFileTest, OpenRefusesWhatIsNoSurgeryFile) {
  expect_open_refused(ErrorCode::kNotFound, "");
  std::ofstream(path).close();
  expect_open_refused(ErrorCode::kUnreadable, "not a surgery file");
  std::ofstream(path) << std::string(8192, 'x');
  expect_open_refused(ErrorCode::kUnreadable, "not a database");
  fs::remove(path);
  tamper("CREATE TABLE meta(key, value); PRAGMA user_version = 1;");
  expect_open_refused(ErrorCode::kUnreadable, "not a surgery file");
  fs::remove(path);
  fs::create_directory(path);
  expect_open_refused(ErrorCode::kUnreadable, "");
}

TEST_F(SurgeryFileTest, OpenRefusesOtherVersionsAndMissingTables) {
  make_complete();
  for (const char* version : {"1", "3"}) {
    tamper((std::string("PRAGMA user_version = ") + version).c_str());
    expect_open_refused(ErrorCode::kUnreadable,
                        std::string("version ") + version + ", must be version 2");
  }
  tamper("PRAGMA user_version = 2; DROP TABLE truth_scalar");
  expect_open_refused(ErrorCode::kUnreadable, "truth_scalar");
}

TEST_F(SurgeryFileTest, EveryTruncationIsRefused) {
  make_complete();
  const auto size = fs::file_size(path);
  for (std::uintmax_t kept = size - 1; kept > 0; kept = kept > 997 ? kept - 997 : kept - 1) {
    fs::resize_file(path, kept);
    const auto file = SurgeryFile::open(path);
    ASSERT_FALSE(file) << kept << " of " << size << " bytes";
    EXPECT_EQ(file.error().code, ErrorCode::kUnreadable);
    if (kept < 200) break;
  }
}

TEST_F(SurgeryFileTest, AFileIsAddedToAndKeepsWhatItHas) {
  make_complete();
  {
    auto file = value_or_fail(SurgeryFile::open_to_append(path));
    EXPECT_EQ(file.meta(), kMeta);
    ASSERT_TRUE(file.append(record(21)));
    EXPECT_TRUE(fs::exists(fs::path(path) += "-wal")) << "an acknowledged record survives a kill";
    ASSERT_TRUE(file.close());
  }
  const auto file = value_or_fail(SurgeryFile::open(path));
  const auto records = value_or_fail(file.records(RecordKind::kObservation));
  ASSERT_EQ(records.size(), 21U);
  EXPECT_EQ(records.front().payload, record(1).payload);
  EXPECT_EQ(records.back().payload, record(21).payload);
  EXPECT_TRUE(file.read_truth(1));
}

TEST_F(SurgeryFileTest, NothingIsAddedToWhatIsNoSurgeryFile) {
  EXPECT_EQ(SurgeryFile::open_to_append(path).error().code, ErrorCode::kNotFound);
  const std::string other(4096, 'x');
  std::ofstream(path, std::ios::binary) << other;
  EXPECT_EQ(SurgeryFile::open_to_append(path).error().code, ErrorCode::kUnreadable);
  std::ifstream stream(path, std::ios::binary);
  const std::string after{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(after, other) << "it was touched";
}

TEST_F(SurgeryFileTest, AFileOpenedForReadingOrClosedRefusesWrites) {
  make_complete();
  auto file = value_or_fail(SurgeryFile::open(path));
  expect_error(file.append(record(9)), ErrorCode::kWriteFailed, "opened for reading");
  expect_error(file.write_truth(9, sample_truth()), ErrorCode::kWriteFailed, "opened for reading");
  EXPECT_TRUE(file.close());
  EXPECT_TRUE(file.close());
  expect_error(file.append(record(9)), ErrorCode::kWriteFailed, "closed");
  EXPECT_EQ(file.records(RecordKind::kObservation).error().code, ErrorCode::kUnreadable);
  EXPECT_EQ(file.read_truth(1).error().code, ErrorCode::kUnreadable);
}

TEST_F(SurgeryFileTest, CloseTellsWhenAReaderKeepsTheLog) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.append(record(1)));
  sqlite3* reader = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &reader), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(reader, "BEGIN; SELECT * FROM record", nullptr, nullptr, nullptr),
            SQLITE_OK);
  expect_error(file.close(), ErrorCode::kWriteFailed, "in use");
  ASSERT_EQ(sqlite3_close(reader), SQLITE_OK);
  EXPECT_EQ(SurgeryFile::open(path).value().records(RecordKind::kObservation).value().size(), 1u);
}

TEST_F(SurgeryFileTest, InvalidRecordsAreRefused) {
  SurgeryFile file = make();
  expect_error(file.append(record(1ull << 63)), ErrorCode::kInvalidArgument, "9223372036854775808");
  EXPECT_TRUE(file.append(record(1)));
  EXPECT_EQ(file.records(RecordKind::kObservation).value().size(), 1u);
}

TEST_F(SurgeryFileTest, InvalidTruthIsRefusedAndLeavesNothingBehind) {
  SurgeryFile file = make();
  const auto expect = [&](ErrorCode code, const char* text, auto change) {
    SurgeryTruth truth = sample_truth();
    change(truth);
    expect_error(file.write_truth(1, truth), code, text);
    EXPECT_EQ(file.read_truth(1).error().code, ErrorCode::kNotFound);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect(ErrorCode::kNotFinite, "displacement", [&](auto& t) { t.displacement(2, 7) = nan; });
  expect(ErrorCode::kNotFinite, "sag_mm", [&](auto& t) { t.scalars["sag_mm"] = nan; });
  expect(ErrorCode::kNotFinite, "cross", [&](auto& t) { t.points["cross"][0].weights[1] = nan; });
  expect(ErrorCode::kInvalidArgument, "node 50, must be in [0, 50)",
         [](auto& t) { t.points["cross"][0].nodes[3] = 50; });
  expect(ErrorCode::kInvalidArgument, "node -1",
         [](auto& t) { t.points["sparse"][1].nodes[0] = -1; });
}

TEST_F(SurgeryFileTest, TruthIsWrittenOnceAndASecondTimeChangesNothing) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.write_truth(1, sample_truth()));
  expect_error(file.write_truth(1, sample_truth()), ErrorCode::kWriteFailed, "truth_field");
  EXPECT_EQ(file.read_truth(1).value().points.at("sparse").size(), 2u);
  // No transaction was left open: what is acknowledged now is seen by others at once.
  ASSERT_TRUE(file.append(record(1)));
  EXPECT_EQ(SurgeryFile::open(path).value().records(RecordKind::kObservation).value().size(), 1u);
}

TEST_F(SurgeryFileTest, TruthThatDoesNotFitItsNodeCountIsUnreadable) {
  make_complete();
  tamper("UPDATE truth_field SET nodes = 49");
  EXPECT_EQ(SurgeryFile::open(path).value().read_truth(1).error().code, ErrorCode::kUnreadable);
  tamper("UPDATE truth_field SET nodes = 50; UPDATE truth_point SET node2 = 50");
  EXPECT_EQ(SurgeryFile::open(path).value().read_truth(1).error().code, ErrorCode::kUnreadable);
}

// The operating system refuses to let a file grow: what a full disk does to SQLite's writes.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(SurgeryFileTest, AFullDiskIsReportedAndLosesNoAcknowledgedRecord) {
  SurgeryFile file = make();
  ASSERT_TRUE(file.append(record(1)));
  SurgeryRecord large = record(2);
  large.payload.resize(1u << 20);
  {
    const FileSizeLimit limit(256u << 10);
    const Status status = file.append(large);
    expect_error(status, ErrorCode::kWriteFailed, path.string() + ": cannot write record: ");
    expect_error(file.write_truth(1,
                                  [] {
                                    SurgeryTruth truth = sample_truth();
                                    truth.displacement = Points::Ones(3, 50000);
                                    return truth;
                                  }()),
                 ErrorCode::kWriteFailed, "cannot write truth");
  }
  EXPECT_TRUE(file.append(record(3)));
  ASSERT_TRUE(file.close());
  const auto opened = value_or_fail(SurgeryFile::open(path));
  const auto records = opened.records(RecordKind::kObservation).value();
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].payload, record(1).payload);
  EXPECT_EQ(records[1].payload, record(3).payload);
  EXPECT_EQ(opened.read_truth(1).error().code, ErrorCode::kNotFound);
}

TEST_F(SurgeryFileTest, ACreationThatFailsLeavesNothingBehind) {
  const FileSizeLimit limit(2000);
  EXPECT_THAT(refusal_of(SurgeryFile::create(path, kMeta), ErrorCode::kWriteFailed),
              HasSubstr(path.string()));
  EXPECT_THAT(files_in_folder(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace brainshift::io
