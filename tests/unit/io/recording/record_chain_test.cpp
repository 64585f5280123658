// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/record_chain.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <random>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/recording/surgery_records.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// Golden values: zlib.crc32 of Python over the bytes that record_chain.hpp lists.
TEST(RecordChain, FollowsItsFormula) {
  const std::uint32_t start = chain_start({{"case_id", "colin27"}, {"seed", "7"}});
  EXPECT_EQ(start, 0xafdf9ea4u);
  const std::uint32_t link =
      chain_link(start, {RecordKind::kObservation, 3, -5, std::string("\0abc", 4)});
  EXPECT_EQ(link, 0x426270feu);
  EXPECT_EQ(chain_end(link, 1), 0x2c10d3c3u);
}

TEST(RecordChain, EveryMemberOfARecordAndItsPredecessorCount) {
  const SurgeryRecord record = numbered_record(1);
  const std::uint32_t link = chain_link(7, record);
  EXPECT_NE(chain_link(8, record), link);
  const auto changed = [&](auto change) {
    SurgeryRecord other = record;
    change(other);
    return chain_link(7, other) != link;
  };
  EXPECT_TRUE(changed([](auto& r) { r.kind = RecordKind::kDecision; }));
  EXPECT_TRUE(changed([](auto& r) { ++r.sequence; }));
  EXPECT_TRUE(changed([](auto& r) { ++r.recorded_ns; }));
  EXPECT_TRUE(changed([](auto& r) { r.payload.back() ^= 1; }));
  EXPECT_TRUE(changed([](auto& r) { r.payload += '\0'; }));
}

TEST(RecordChain, TruthIsCheckedAsAWhole) {
  SurgeryTruth truth;
  truth.displacement = Points::Ones(3, 4);
  truth.points["sparse"] = {{{0, 1, 2, 3}, {1, 0, 0, 0}}};
  truth.scalars = {{"sag_mm", 1.0}};
  const std::uint32_t checksum = truth_checksum(1, truth);
  EXPECT_NE(truth_checksum(2, truth), checksum);
  const auto changed = [&](auto change) {
    SurgeryTruth other = truth;
    change(other);
    return truth_checksum(1, other) != checksum;
  };
  EXPECT_TRUE(changed([](auto& t) { t.displacement(2, 3) = 2.0; }));
  EXPECT_TRUE(changed([](auto& t) { t.points["sparse"][0].nodes[3] = 0; }));
  EXPECT_TRUE(changed([](auto& t) { t.points["sparse"][0].weights[1] = 0.5; }));
  EXPECT_TRUE(changed([](auto& t) { t.scalars["sag_mm"] = 2.0; }));
  EXPECT_TRUE(changed([](auto& t) { t.scalars.clear(); }));
}

class ChangedFile : public ::testing::Test {
 protected:
  static constexpr std::uint64_t kRecords = 40;

  void SetUp() override {
    write_numbered(path, kRecords);
    good = test_support::content_of(path);
  }
  void write(const std::string& bytes) const {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  }
  // Nothing that was changed is handed over; an error, or everything as it was written.
  bool is_safe() const {
    const auto file = SurgeryFile::open(path);
    if (!file) return true;
    const Visited visited = visit_all(*file);
    if (!is_prefix(visited.records)) return false;
    if (file->meta() != SurgeryMeta{.case_id = "c", .model_id = "m"}) return false;
    return !visited.status || !file->state().closed || visited.records.size() == kRecords;
  }
  bool is_found() const {
    const auto file = SurgeryFile::open(path);
    return !file || !visit_all(*file).status;
  }

  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "one.surgery";
  std::string good;
};

TEST_F(ChangedFile, EveryBitFlipNearAPayloadIsFound) {
  std::mt19937 random(1);
  int found = 0;
  const int flips = 60;
  for (int i = 0; i < flips; ++i) {
    const SurgeryRecord record = numbered_record(1 + random() % kRecords);
    const std::size_t begin = good.find(record.payload);
    ASSERT_NE(begin, std::string::npos);
    // The payload, and before it kind, sequence and time.
    const std::size_t at = begin - 12 + random() % (record.payload.size() + 12);
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    write(bytes);
    found += is_found() ? 1 : 0;
    EXPECT_TRUE(is_safe()) << "byte " << at;
  }
  EXPECT_EQ(found, flips);
}

// Anywhere: in headers, tables, seals, and in bytes that mean nothing.
TEST_F(ChangedFile, NoBitFlipIsEverReadAsGood) {
  std::mt19937 random(2);
  int found = 0;
  for (std::size_t at = 0; at < good.size(); at += 1 + random() % 90) {
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    write(bytes);
    EXPECT_TRUE(is_safe()) << "byte " << at;
    found += is_found() ? 1 : 0;
  }
  EXPECT_GT(found, 300) << "the flips missed the records";
}

TEST_F(ChangedFile, ACutFileIsRefusedAndItsValidPrefixIsRecovered) {
  std::size_t most = 0;
  for (std::size_t kept = good.size() - 1; kept > 4096; kept -= 1500) {
    write(good.substr(0, kept));
    EXPECT_FALSE(SurgeryFile::open(path)) << kept;
    const auto damaged = SurgeryFile::open_damaged(path);
    if (!damaged) continue;  // not even the tables are left
    const Visited visited = visit_all(*damaged);
    EXPECT_TRUE(is_prefix(visited.records)) << kept;
    EXPECT_FALSE(visited.status) << kept;
    most = std::max(most, visited.records.size());
  }
  EXPECT_GT(most, kRecords / 2);
  EXPECT_LT(most, kRecords);
}

TEST_F(ChangedFile, ABrokenRecordIsNamedWithItsFileAndThePrefixIsGiven) {
  run_sql(path, "UPDATE record SET payload = x'00' WHERE id = 17");
  const auto file = value_or_fail(SurgeryFile::open(path));
  const Visited visited = visit_all(file);
  EXPECT_THAT(refusal_of(visited.status), HasSubstr(path.string() + ": record 17: "));
  EXPECT_EQ(visited.records.size(), 16u);
  EXPECT_TRUE(is_prefix(visited.records));
  EXPECT_FALSE(file.records(RecordKind::kObservation));
  EXPECT_FALSE(SurgeryFile::open_to_append(path)) << "nothing is added to a broken chain";
}

TEST_F(ChangedFile, RecordsThatAreLostSwappedOrInsertedBreakTheChain) {
  const auto expect_broken_after = [&](const char* sql, const char* record) {
    write(good);
    run_sql(path, sql);
    const auto file = value_or_fail(SurgeryFile::open(path));
    const Visited visited = visit_all(file);
    EXPECT_THAT(sentence_of(visited.status), HasSubstr(record)) << sql;
    EXPECT_TRUE(is_prefix(visited.records));
  };
  expect_broken_after("DELETE FROM record WHERE id = 5", "record 5: ");
  expect_broken_after(
      "UPDATE record SET id = 99 WHERE id = 5; UPDATE record SET id = 5 WHERE id = 6;"
      "UPDATE record SET id = 6 WHERE id = 99",
      "record 5: ");
  expect_broken_after("UPDATE record SET sequence = 6 WHERE id = 40", "record 40: ");
  expect_broken_after("UPDATE record SET kind = 'update' WHERE id = 1", "record 1: ");
  expect_broken_after("UPDATE seal SET crc = crc + 1 WHERE name = 'closed'", "seal");
}

TEST_F(ChangedFile, ChangedMetaAndTruthAreFound) {
  run_sql(path, "UPDATE meta SET value = 'd' WHERE key = 'case_id'");
  EXPECT_THAT(sentence_of(SurgeryFile::open(path)), HasSubstr("meta"));
  fs::remove(path);
  auto with_truth = value_or_fail(SurgeryFile::create(path, {.case_id = "c"}));
  SurgeryTruth truth;
  truth.displacement = Points::Ones(3, 50);
  truth.points["sparse"] = {{{0, 1, 2, 3}, {1, 0, 0, 0}}};
  ASSERT_TRUE(with_truth.write_truth(1, truth));
  ASSERT_TRUE(with_truth.close());
  ASSERT_TRUE(SurgeryFile::open(path)->read_truth(1));
  run_sql(path, "UPDATE truth_point SET node2 = 4");
  EXPECT_THAT(refusal_of(SurgeryFile::open(path)->read_truth(1), ErrorCode::kUnreadable),
              HasSubstr("truth of observation 1"));
}

}  // namespace
}  // namespace brainshift::io
