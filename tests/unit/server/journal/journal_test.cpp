// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/journal.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <future>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/journal/record_sink.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/journal/journal_fakes.hpp"

namespace brainshift::server {
namespace {

using io::RecordKind;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A journal that has begun a file.
struct Begun : Journal {
  explicit Begun(const Options& options, const std::filesystem::path& path = "x.surgery",
                 const JournalMeta& meta = {}, std::uint64_t session_id = 0)
      : Journal(options) {
    begin(path, meta, session_id);
  }
};

class JournalTest : public testing::Test {
 protected:
  // An observation of "ius" that is on the disk in the end.
  void records(std::uint64_t sequence, Journal& journal) {
    journal.append(record(sequence), "ius");
    ASSERT_TRUE(
        witness.sees([=](const Recorded& recorded) { return holds(recorded, "ius", sequence); }));
  }
  // Whether the journal comes to count an observation as lost. Nothing tells of it.
  static bool loses(const std::string& source, std::uint64_t sequence, const Journal& journal) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      const RecordRanges missing = journal.recorded().missing;
      const auto found = missing.observations.find(source);
      if (found != missing.observations.end() && found->second.last >= sequence) return true;
      std::this_thread::yield();
    }
    return false;
  }
  // The first file opens when it is let go.
  void stall() {
    storage.on_open = [this](int attempt) {
      if (attempt == 1) opening_.set_value(), let_go_.get_future().wait();
      return Status();
    };
  }

  FakeStorage storage;
  Witness witness;
  Journal::Options options = quick_options(storage, witness);
  std::promise<void> opening_, let_go_;
};

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
  const auto file = value_or_fail(io::SurgeryFile::open(path));
  EXPECT_TRUE(file.state().closed);
  EXPECT_EQ(file.meta().case_id, "c");
  const auto observations = value_or_fail(file.records(io::RecordKind::kObservation));
  ASSERT_EQ(observations.size(), 20u);
  for (std::uint64_t i = 0; i < 20; ++i) {
    EXPECT_EQ(observations[i].sequence, i + 1);
    EXPECT_EQ(observations[i].payload, "payload " + std::to_string(i + 1));
  }
  EXPECT_EQ(file.records(io::RecordKind::kUpdate)->size(), 20u);
}

TEST_F(JournalTest, IgnoresRecordsBeforeTheFirstFile) {
  Journal journal(options);
  journal.append(record(1));
  journal.stop();
  EXPECT_THAT(storage.files(), IsEmpty());
  EXPECT_TRUE(journal.status().has_value());
  EXPECT_FALSE(journal.recorded().recording);
}

// ---------- groups, and what is recorded ----------

TEST_F(JournalTest, WhatWaitsIsCommittedTogether) {
  std::promise<void> go;
  storage.on_open = [&](int) {
    go.get_future().wait();
    return Status();
  };
  Begun journal(options);
  for (std::uint64_t i = 1; i <= 20; ++i) journal.append(record(i), "ius");
  go.set_value();
  journal.stop();
  ASSERT_EQ(storage.files().size(), 1u);
  ASSERT_EQ(storage.files()[0].groups.size(), 1u);
  EXPECT_EQ(storage.files()[0].groups[0].size(), 20u);
}

TEST_F(JournalTest, AGroupIsCommittedWhenItsTimeIsUp) {
  options.commit_interval = std::chrono::milliseconds(5);
  Begun journal(options);
  records(1, journal);
}

TEST_F(JournalTest, WhatIsRecordedIsOnTheDiskAndNothingElse) {
  std::promise<void> reached, go;
  storage.on_append = [&](int attempt) {
    if (attempt == 1) reached.set_value(), go.get_future().wait();
    return Status();
  };
  Begun journal(options, "x.surgery", {}, 7);
  journal.append(record(3), "ius");
  reached.get_future().wait();
  journal.append(record(50), "camera");  // never waits for the disk
  journal.append(record(9, io::RecordKind::kUpdate));
  EXPECT_TRUE(journal.recorded().recording);
  EXPECT_FALSE(holds(journal.recorded(), "ius", 3)) << "accepted, not recorded";
  go.set_value();
  ASSERT_TRUE(witness.sees([](const Recorded& r) { return r.records == 3; }));
  const Recorded recorded = journal.recorded();
  EXPECT_EQ(recorded.session_id, 7u);
  EXPECT_EQ(recorded.file, "x.surgery");
  EXPECT_TRUE(recorded.reason.empty());
  EXPECT_TRUE(holds(recorded, "ius", 3));
  EXPECT_FALSE(holds(recorded, "ius", 4));
  EXPECT_TRUE(holds(recorded, "camera", 50));
  EXPECT_FALSE(holds(recorded, "pointer", 1));
  EXPECT_EQ(recorded.held.updates.last, 9u);
  EXPECT_TRUE(recorded.missing.empty());
}

TEST_F(JournalTest, ANewSessionStartsItsOwnCount) {
  Begun journal(options, "x.surgery", {}, 1);
  records(3, journal);
  journal.begin("y.surgery", {}, 2);
  EXPECT_EQ(journal.recorded().session_id, 2u);
  EXPECT_FALSE(holds(journal.recorded(), "ius", 3));
  journal.stop();
  EXPECT_TRUE(storage.files()[0].closed);
}

// ---------- failures ----------

TEST_F(JournalTest, AFailedTransactionGoesToANewFileAsAWhole) {
  storage.on_append = [](int attempt) { return attempt == 2 ? disk_full() : Status(); };
  Begun journal(options, "x.surgery", {.case_id = "c"});
  records(1, journal);
  records(2, journal);
  journal.append(record(3), "ius");
  journal.stop();
  EXPECT_TRUE(journal.status().has_value());
  EXPECT_THAT(witness.errors(), ElementsAre("x: disk full"));
  EXPECT_THAT(witness.resumed(), ElementsAre("x-2.surgery"));
  const auto files = storage.files();
  ASSERT_EQ(files.size(), 2u);
  EXPECT_TRUE(files[0].closed);
  EXPECT_THAT(files[0].groups, ElementsAre(ElementsAre(1)));
  EXPECT_THAT(files[1].groups, ElementsAre(ElementsAre(2), ElementsAre(3)));
  EXPECT_EQ(files[1].meta.case_id, "c");
  EXPECT_EQ(files[1].meta.continues, "x.surgery");
  EXPECT_EQ(files[1].meta.gap, "x: disk full; not recorded: nothing");
  EXPECT_TRUE(journal.recorded().missing.empty());
}

TEST_F(JournalTest, RecordingGoesOnWhenStorageReturnsAndTheGapIsStated) {
  std::atomic<bool> broken{true};
  storage.on_append = [&](int attempt) { return attempt == 2 ? disk_full() : Status(); };
  storage.on_open = [&](int attempt) { return attempt > 1 && broken ? disk_full() : Status(); };
  Begun journal(options);
  records(1, journal);
  journal.append(record(2), "ius");
  ASSERT_TRUE(witness.sees([](const Recorded& r) { return !r.recording; }));
  ASSERT_FALSE(journal.status().has_value());
  EXPECT_EQ(journal.status().error().code, ErrorCode::kWriteFailed);
  EXPECT_EQ(journal.status().error().message, "x: disk full");
  EXPECT_EQ(journal.recorded().reason, "x: disk full");
  // Until the failed transaction is given up, these may still be queued for the next try.
  ASSERT_TRUE(loses("ius", 2, journal));
  journal.append(record(3), "ius");
  journal.append(record(4), "camera");
  journal.append(record(5, io::RecordKind::kUpdate));
  ASSERT_TRUE(loses("camera", 4, journal));
  broken = false;
  ASSERT_TRUE(witness.sees_resumption());
  EXPECT_TRUE(journal.status().has_value());
  records(6, journal);
  journal.stop();
  const auto files = storage.files();
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[1].meta.gap,
            "x: disk full; not recorded: observations 4 of camera (1), observations 2 to 3 of ius "
            "(2), updates 5 (1)");
  const Recorded recorded = journal.recorded();
  EXPECT_FALSE(holds(recorded, "ius", 3));
  EXPECT_FALSE(holds(recorded, "camera", 4));
  EXPECT_EQ(recorded.missing.updates.last, 5u);
  EXPECT_THAT(witness.errors(), ElementsAre("x: disk full"));
}

TEST_F(JournalTest, RecordingWaitsForEnoughSpace) {
  const TemporaryFolder folder;
  storage.on_append = [](int attempt) { return attempt == 1 ? disk_full() : Status(); };
  options.resume_free_bytes = std::numeric_limits<std::uintmax_t>::max();
  Begun journal(options, folder / "x.surgery");
  journal.append(record(1), "ius");
  ASSERT_TRUE(loses("ius", 1, journal));
  journal.stop();
  EXPECT_EQ(storage.files().size(), 1u);
  EXPECT_FALSE(journal.status().has_value());
}

TEST_F(JournalTest, AFileThatIsGoneIsNoticedWithoutAnyRecordAndWhatItHeldIsLost) {
  std::atomic<bool> gone{false};
  storage.on_check = [&] {
    return gone.exchange(false) ? Status(fail(ErrorCode::kWriteFailed, "x: was deleted"))
                                : Status();
  };
  Begun journal(options);
  records(1, journal);
  gone = true;
  ASSERT_TRUE(witness.sees_resumption());
  EXPECT_FALSE(holds(journal.recorded(), "ius", 1));
  records(2, journal);
  journal.stop();
  EXPECT_EQ(storage.files()[1].meta.gap, "x: was deleted; not recorded: observations 1 of ius (1)");
}

TEST_F(JournalTest, ACommitToAFileThatIsGoneIsDoneAgain) {
  std::atomic<bool> gone{false};
  storage.on_append = [&](int attempt) {
    if (attempt == 1) gone = true;
    return Status();
  };
  storage.on_check = [&] {
    return gone ? Status(fail(ErrorCode::kWriteFailed, "x: was deleted")) : Status();
  };
  storage.on_open = [&](int) {
    gone = false;
    return Status();
  };
  Begun journal(options);
  records(1, journal);
  journal.stop();
  ASSERT_EQ(storage.files().size(), 2u);
  EXPECT_THAT(storage.files()[1].groups, ElementsAre(ElementsAre(1)));
}

TEST_F(JournalTest, AThrowingSinkIsAFailureToo) {
  storage.on_append = [](int attempt) -> Status {
    if (attempt == 1) throw std::runtime_error("thrown");
    return {};
  };
  Begun journal(options);
  records(1, journal);
  journal.stop();
  EXPECT_THAT(witness.errors(), ElementsAre(HasSubstr("thrown")));
}

TEST_F(JournalTest, ANewFileForgetsTheFailureOfTheOldOne) {
  storage.on_open = [](int attempt) { return attempt == 1 ? disk_full() : Status(); };
  options.retry_interval = std::chrono::hours(1);
  Begun journal(options);
  ASSERT_TRUE(witness.sees([](const Recorded& r) { return !r.reason.empty(); }));
  journal.append(record(1), "ius");
  ASSERT_TRUE(loses("ius", 1, journal));
  journal.begin("y.surgery", {});
  EXPECT_TRUE(journal.status().has_value());
  journal.append(record(2), "ius");
  journal.stop();
  EXPECT_TRUE(journal.status().has_value());
  ASSERT_EQ(storage.files().size(), 1u);
  EXPECT_THAT(storage.files()[0].groups, ElementsAre(ElementsAre(2)));
  EXPECT_TRUE(storage.files()[0].meta.gap.empty());
}

TEST(Journal, AFolderThatDoesNotExistIsAnError) {
  Witness witness;
  Journal::Options options;
  witness.watch(options);
  Journal journal(options);
  journal.begin("/nonexistent/folder/a.surgery", {});
  journal.append(record(1), "ius");
  journal.stop();
  ASSERT_FALSE(journal.status().has_value());
  EXPECT_THAT(journal.status().error().message, HasSubstr("/nonexistent/folder/a.surgery"));
  EXPECT_EQ(witness.errors().size(), 1u);
  EXPECT_EQ(journal.recorded().missing.observations.at("ius").count, 1u);
}

// ---------- slow storage ----------

TEST_F(JournalTest, StorageThatStallsLosesRecordsInsteadOfFillingMemory) {
  stall();
  options.max_queued = 3;
  Begun journal(options);
  opening_.get_future().wait();
  for (std::uint64_t i = 1; i <= 3; ++i) journal.append(record(i), "ius");
  EXPECT_TRUE(journal.status().has_value());
  journal.append(record(4), "ius");
  ASSERT_FALSE(journal.status().has_value()) << "at once, while the storage still stalls";
  EXPECT_THAT(journal.status().error().message, HasSubstr("3 records are waiting"));
  EXPECT_FALSE(journal.recorded().recording);
  let_go_.set_value();
  ASSERT_TRUE(witness.sees_resumption());
  journal.append(record(5), "ius");
  journal.stop();
  const auto files = storage.files();
  ASSERT_EQ(files.size(), 2u);
  EXPECT_THAT(files[0].groups, ElementsAre(ElementsAre(1, 2, 3)));
  EXPECT_THAT(files[1].groups, ElementsAre(ElementsAre(5)));
  EXPECT_THAT(files[1].meta.gap, HasSubstr("observations 4 of ius (1)"));
  EXPECT_FALSE(holds(journal.recorded(), "ius", 4));
  EXPECT_TRUE(holds(journal.recorded(), "ius", 5));
}

TEST_F(JournalTest, BytesInTheQueueAreBoundedToo) {
  stall();
  options.max_queued_bytes = 100;
  Begun journal(options);
  opening_.get_future().wait();
  journal.append({io::RecordKind::kUpdate, 1, 0, std::string(60, 'a')});
  EXPECT_TRUE(journal.status().has_value());
  journal.append({io::RecordKind::kUpdate, 2, 0, std::string(60, 'a')});
  EXPECT_FALSE(journal.status().has_value());
  let_go_.set_value();
}

TEST_F(JournalTest, ASessionHasALimitOfBytesBeyondWhichItSaysSo) {
  options.max_session_bytes = 100;
  Begun journal(options);
  journal.append({RecordKind::kUpdate, 1, 0, std::string(60, 'a')});
  EXPECT_TRUE(journal.status().has_value());
  journal.append({RecordKind::kUpdate, 2, 0, std::string(60, 'a')});
  EXPECT_THAT(sentence_of(journal.status()), HasSubstr("its limit"));
  ASSERT_TRUE(witness.sees_errors(1));
  journal.append({RecordKind::kUpdate, 3, 0, "a"});
  EXPECT_FALSE(journal.status().has_value()) << "what is small does not slip in behind";
  journal.begin("y.surgery", {});
  records(4, journal);
}

// What stands for any allocation of the journal's thread that fails.
TEST_F(JournalTest, AnExceptionOnItsThreadEndsTheFileAndNotTheProcess) {
  std::atomic<int> told = 0;
  options.on_recorded = [&, tell = options.on_recorded](const Recorded& recorded) {
    if (++told == 2) throw std::bad_alloc();
    tell(recorded);
  };
  Begun journal(options);
  journal.append(record(1), "ius");
  ASSERT_TRUE(witness.sees_errors(1));
  ASSERT_TRUE(witness.sees_resumption());
  records(2, journal);
}

TEST(Journal, ANameThatAnotherTookInTheSameMomentCostsNoRecord) {
  const TemporaryFolder folder;
  folder.write("a.surgery", "another daemon's");
  Journal journal({});
  journal.begin(folder / "a.surgery", {});
  journal.append(record(1), "ius");
  journal.stop();
  EXPECT_EQ(journal.recorded().file, folder / "a-2.surgery");
  EXPECT_TRUE(holds(journal.recorded(), "ius", 1));
  EXPECT_TRUE(journal.recorded().missing.empty());
}

// ---------- what a set of records holds ----------

TEST(RecordRanges, SourcesAndUpdatesAreCountedApart) {
  RecordRanges ranges;
  EXPECT_TRUE(ranges.empty());
  EXPECT_EQ(describe(ranges), "nothing");
  for (const std::uint64_t i : {5u, 6u, 9u}) ranges.add(RecordKind::kObservation, "ius", i);
  ranges.add(RecordKind::kObservation, "camera", 50);
  ranges.add(RecordKind::kUpdate, "", 3);
  ranges.add(RecordKind::kDecision, "", 7);
  EXPECT_FALSE(ranges.empty());
  EXPECT_EQ(ranges.observations.at("ius"), (SequenceRange{5, 9, 3}));
  EXPECT_EQ(ranges.updates, (SequenceRange{3, 3, 1}));
  EXPECT_EQ(describe(ranges),
            "observations 50 of camera (1), observations 5 to 9 of ius (3), updates 3 (1)");
}

TEST(RecordRanges, TheUnionSpansBoth) {
  RecordRanges a, b;
  a.add(RecordKind::kObservation, "ius", 7);
  b.add(RecordKind::kObservation, "ius", 4);
  b.add(RecordKind::kObservation, "camera", 1);
  b.add(RecordKind::kUpdate, "", 2);
  a.add(b);
  EXPECT_EQ(a.observations.at("ius"), (SequenceRange{4, 7, 2}));
  EXPECT_EQ(a.observations.at("camera"), (SequenceRange{1, 1, 1}));
  EXPECT_EQ(a.updates, (SequenceRange{2, 2, 1}));
  a.add(RecordRanges{});
  EXPECT_EQ(a.updates, (SequenceRange{2, 2, 1}));
}

// ---------- the file ----------

namespace fs = std::filesystem;

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

TEST(JournalPath, NeverNamesAFileWhoseLogIsLeft) {
  const TemporaryFolder folder;
  folder.write("a.surgery-wal", "left behind");
  EXPECT_EQ(free_path(folder / "a.surgery"), folder / "a-2.surgery");
  folder.write("a-2.surgery", "");
  EXPECT_EQ(free_path(folder / "a.surgery"), folder / "a-3.surgery");
  EXPECT_EQ(free_path(folder / "a.surgery", folder / "a-3.surgery"), folder / "a-4.surgery");
  fs::create_symlink("nowhere", folder / "b.surgery");
  EXPECT_EQ(free_path(folder / "b.surgery"), folder / "b-2.surgery");
}

TEST(SurgeryFileSink, NoticesThatItsFileIsGone) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.surgery";
  auto sink = value_or_fail(open_surgery_file(path, {}));
  const std::vector<io::SurgeryRecord> records = {{io::RecordKind::kUpdate, 1, 0, "x"}};
  ASSERT_TRUE(sink->append(records));
  EXPECT_TRUE(sink->check());
  fs::remove(path);
  EXPECT_EQ(sentence_of(sink->check()),
            path.string() + ": was deleted, replaced or cut while it was recorded");
}

}  // namespace
}  // namespace brainshift::server
