// SPDX-License-Identifier: GPL-3.0-or-later
// A journal of a small model: observations of two sources, each with its update.
#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/io/recording/surgery_file.hpp"
#include "common/values/model_id.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {

class SmallJournal : public testing::Test {
 protected:
  static BrainModel identified_model() {
    BrainModel model = test_support::toy_patient(3);
    model.case_id = "toy";
    model.model_id = content_hash(model);
    return model;
  }

  static io::SurgeryRecord observation(std::uint64_t sequence, const std::string& source) {
    Observation made;
    made.case_id = "box";
    made.source = source;
    made.sequence = sequence;
    made.body = LandmarkPairs{Points::Ones(3, 4), Points::Ones(3, 4), 0.3};
    return {io::RecordKind::kObservation, sequence, at(sequence, 0), wire::encode(made)};
  }
  // Its field moves every node by `sequence` tenths of a millimetre along x.
  io::SurgeryRecord update(std::uint64_t sequence, std::uint64_t observation) const {
    UpdateMessage message;
    message.session_id = 1;
    message.update.sequence = sequence;
    message.update.observation_sequence = observation;
    message.update.model_id = model.model_id;
    Estimate& estimate = message.update.estimate;
    estimate.status = EstimateStatus::kConverged;
    estimate.displacement = Points::Zero(3, model.mesh.num_nodes());
    estimate.displacement.row(0).setConstant(0.125 * static_cast<double>(sequence));
    estimate.sd_mm = VecX::Constant(model.mesh.num_nodes(), 0.5);
    estimate.known = VecX::Constant(model.mesh.num_nodes(), 0.2);
    estimate.contact.active = 11;
    estimate.quality.flags.set(QualityFlag::kDeadline);
    estimate.quality.flags.set(QualityFlag::kStrengthAtBound);
    estimate.quality.quality = estimate.quality.flags.quality();
    message.update.timings.invert_ms = 2.5;
    return {io::RecordKind::kUpdate, sequence, at(observation, 250), wire::encode(message)};
  }
  static io::SurgeryRecord decision(std::uint64_t observation, Outcome outcome) {
    const Decision made{1, "ius", observation, outcome, observation, 11, ""};
    return {io::RecordKind::kDecision, observation, at(observation, 200), wire::encode(made)};
  }
  // Observations 1 to `count` of ius, every third of the camera instead.
  void write(const std::filesystem::path& to, std::uint64_t count) const {
    auto file = io::SurgeryFile::create(
        to, {.case_id = "box", .model_id = model.model_id, .method = "condensed"});
    ASSERT_TRUE(file) << file.error().message;
    for (std::uint64_t i = 1; i <= count; ++i) {
      ASSERT_TRUE(file->append(observation(i, i % 3 == 0 ? "camera" : "ius")));
      ASSERT_TRUE(file->append(update(i, i)));
    }
    ASSERT_TRUE(file->close());
  }
  // A closed file of these records.
  void write_records(const std::vector<io::SurgeryRecord>& records,
                     const io::SurgeryMeta& meta = {}) const {
    auto file = io::SurgeryFile::create(path, meta);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(file->append(records));
    ASSERT_TRUE(file->close());
  }
  static void run_sql(const std::filesystem::path& file, const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    ASSERT_EQ(sqlite3_close(db), SQLITE_OK);
  }

  const BrainModel model = identified_model();
  const test_support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.surgery";

 private:
  // One observation per second.
  static std::int64_t at(std::uint64_t sequence, std::int64_t milliseconds) {
    return (static_cast<std::int64_t>(sequence) * 1000 + milliseconds) * 1'000'000;
  }
};

}  // namespace brainshift::client
