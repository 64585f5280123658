// SPDX-License-Identifier: GPL-3.0-or-later
// MRI -> model -> simulated surgery -> daemon -> client -> report, with the programs a user runs.
// The bounds are loose ones for the coarse mesh; the paper's figures are checked on the full one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"
#include "tests/support/report_keys.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::integration {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kListening = "listening on ";

json read_json(const std::string& path) {
  std::ifstream stream(path);
  return json::parse(stream);
}

const json& run_with_boundary(const json& report, const std::string& boundary) {
  for (const json& run : report) {
    if (run.at("boundary") == boundary) return run;
  }
  throw std::runtime_error("no run with boundary " + boundary);
}

void expect_contract(const json& run) {
  for (const char* key : test_support::kReportKeys) {
    EXPECT_TRUE(run.contains(key)) << key;
  }
  EXPECT_THAT(run.at("quality").at("worst"), testing::AnyOf("good", "caution"));
  EXPECT_EQ(run.at("quality").at("counts").at("unusable"), 0);
  for (const char* key : {"initial", "sparse", "cross", "craniotomy_initial", "craniotomy"}) {
    ASSERT_TRUE(run.at("error_mm").contains(key)) << key;
    EXPECT_TRUE(run.at("error_mm").at(key).at("mean").is_number()) << key;
  }
  for (const char* key : {"register", "invert", "rebuild", "encode", "journal"}) {
    EXPECT_TRUE(run.at("stages_ms").contains(key)) << key;
  }
  EXPECT_EQ(run.at("method"), "condensed");
  EXPECT_GT(run.at("mesh").at("nodes").get<int>(), 500);
  EXPECT_GE(run.at("updates").get<int>(), 1);
  EXPECT_GT(run.at("full_solve_ms").get<double>(), 0.0);
  EXPECT_GT(run.at("stages_ms").at("invert").get<double>(), 0.0);
  EXPECT_FALSE(run.at("left_out").empty());
}

class EndToEnd : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(head_is_installed()) << "Debian's mricron-data is not installed";
    prepared_ =
        run({brainshiftd(), "prepare", "--case", coarse_case(), "--out", model(), "--json"});
    ASSERT_EQ(prepared_.exit_status, 0) << prepared_.err;
  }

  std::string model() const { return files_.path("model.h5"); }

  // A daemon on a free port that keeps a journal.
  std::unique_ptr<Background> serve() {
    std::filesystem::create_directory(files_.path("journal"));
    const auto config =
        files_.write("daemon.yaml",
                     "endpoint: tcp://127.0.0.1:*\njournal_dir: " + files_.path("journal") + "\n");
    auto daemon = std::make_unique<Background>(
        std::vector<std::string>{brainshiftd(), "serve", "--config", config, "--model", model()},
        files_.path("daemon.log"));
    EXPECT_THAT(daemon->first_line(), StartsWith(kListening));
    return daemon;
  }

  static std::string endpoint(const Background& daemon) {
    return daemon.first_line().substr(std::string(kListening).size());
  }

  std::string simulate(const std::string& scenario) {
    const auto surgery = files_.path(scenario + ".surgery");
    const auto simulated = run({brainshift(), "simulate", "--case", coarse_case(), "--scenario",
                                scenario, "--seed", "1", "--out", surgery});
    EXPECT_EQ(simulated.exit_status, 0) << simulated.err;
    return surgery;
  }

  json replay(const std::string& surgery, const Background& daemon) {
    const auto report = files_.path("report.json");
    const auto replayed =
        run({brainshift(), "replay", surgery, "--endpoint", endpoint(daemon), "--report", report});
    EXPECT_EQ(replayed.exit_status, 0) << replayed.err;
    EXPECT_THAT(replayed.out, HasSubstr(", condensed, contact: "));
    return read_json(report);
  }

  std::vector<std::string> journals() const {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(files_.path("journal"))) {
      paths.push_back(entry.path().string());
    }
    return paths;
  }

  Workspace files_;
  Finished prepared_;
};

TEST_F(EndToEnd, PrepareTellsWhatItBuilt) {
  const json told = json::parse(prepared_.out);
  EXPECT_EQ(told.at("case"), "colin27-coarse");
  EXPECT_GT(told.at("mesh").at("nodes").get<int>(), 500);
  for (const char* set : {"craniotomy", "brainstem", "slaves", "fixed"}) {
    EXPECT_GT(told.at("sets").at(set).get<int>(), 0) << set;
  }
  for (const char* boundary : {"contact", "fixed"}) {
    const json& timings = told.at("prepare").at(boundary);
    EXPECT_GT(timings.at("factor_s").get<double>(), 0.0);
    EXPECT_GT(timings.at("factor_nonzeros").get<std::uint64_t>(), 0u);
  }
  EXPECT_EQ(prepared_.err, "");
}

TEST_F(EndToEnd, TheSimulatedSurgeryOfThePaperIsRecovered) {
  const auto surgery = simulate("paper");
  const auto daemon = serve();
  const json report = replay(surgery, *daemon);
  ASSERT_EQ(report.size(), 2u);
  for (const json& run : report) {
    expect_contract(run);
    EXPECT_EQ(run.at("scenario"), "paper");
  }
  const json& contact = run_with_boundary(report, "contact");
  const json& fixed = run_with_boundary(report, "fixed");
  const double cross = contact.at("error_mm").at("cross").at("mean").get<double>();
  EXPECT_LT(cross, 0.2);
  EXPECT_LT(cross, 0.15 * contact.at("error_mm").at("initial").at("mean").get<double>());
  EXPECT_GT(contact.at("recovery_pct").get<double>(), 85.0);
  EXPECT_LT(contact.at("contact").at("max_penetration_mm").get<double>(), 0.2);
  EXPECT_LT(contact.at("error_mm").at("craniotomy").at("mean").get<double>(),
            fixed.at("error_mm").at("craniotomy").at("mean").get<double>());
  EXPECT_EQ(daemon->end(SIGTERM), 0);
}

TEST_F(EndToEnd, TumourBoundaryPointsThatMustBeRegisteredFirstAreRecovered) {
  const auto surgery = simulate("paper-icp");
  const auto daemon = serve();
  const json report = replay(surgery, *daemon);
  const json& contact = run_with_boundary(report, "contact");
  expect_contract(contact);
  EXPECT_GT(contact.at("recovery_pct").get<double>(), 75.0);
  EXPECT_GT(contact.at("stages_ms").at("register").get<double>(), 0.0);
  EXPECT_EQ(daemon->end(SIGINT), 0);
}

// Sequences that count on, a row per update, and the truth of the observation that was sent last.
TEST_F(EndToEnd, ARecordedSurgeryCanBeRepeatedToMeasureLatency) {
  const auto surgery = simulate("paper");
  const auto daemon = serve();
  const auto report = files_.path("report.json"), csv = files_.path("latency.csv");
  const auto replayed =
      run({brainshift(), "replay", surgery, "--endpoint", endpoint(*daemon), "--report", report,
           "--boundary", "contact", "--method", "paper", "--repeat", "3", "--latency-csv", csv});
  ASSERT_EQ(replayed.exit_status, 0) << replayed.err;
  const json runs = read_json(report);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].at("updates"), 3);
  EXPECT_TRUE(runs[0].at("failures").empty());
  EXPECT_DOUBLE_EQ(runs[0].at("truth_scalars").at("fluid_level_mm").get<double>(), 55.0);
  EXPECT_GT(runs[0].at("recovery_pct").get<double>(), 85.0);

  std::ifstream stream(csv);
  std::string line, last;
  std::vector<double> latency;
  ASSERT_TRUE(std::getline(stream, line));
  EXPECT_THAT(line, StartsWith("update,observation_sequence,latency_ms,"));
  while (std::getline(stream, line)) {
    const auto rest = line.substr(line.find(',', line.find(',') + 1) + 1);
    latency.push_back(std::stod(rest));
    last = line;
  }
  ASSERT_EQ(latency.size(), 3u);
  EXPECT_THAT(last, StartsWith("3,3,"));
  EXPECT_NEAR(latency[0], runs[0].at("cold_ms").get<double>(), 1e-3);
  EXPECT_NEAR(*std::max_element(latency.begin() + 1, latency.end()),
              runs[0].at("latency_ms").at("max").get<double>(), 1e-3);
  EXPECT_EQ(daemon->end(SIGTERM), 0);
}

TEST_F(EndToEnd, TheJournalHoldsWhatWasAskedAndAnswered) {
  const auto surgery = simulate("paper");
  const auto daemon = serve();
  const json report = replay(surgery, *daemon);
  ASSERT_EQ(daemon->end(SIGTERM), 0);
  const auto paths = journals();
  ASSERT_EQ(paths.size(), 2u) << "one per session, and no leftovers of the write-ahead log";
  const auto recorded = io::SurgeryFile::open(surgery)->records(io::RecordKind::kObservation);
  ASSERT_TRUE(recorded.has_value());
  for (const std::string& path : paths) {
    const auto journal = io::SurgeryFile::open(path);
    ASSERT_TRUE(journal.has_value()) << journal.error().message;
    EXPECT_EQ(journal->meta().case_id, "colin27-coarse");
    const auto observations = journal->records(io::RecordKind::kObservation);
    ASSERT_TRUE(observations.has_value());
    ASSERT_EQ(observations->size(), recorded->size());
    // What was asked, with its session and the daemon's time.
    auto observation = wire::decode_observation(observations->front().payload);
    ASSERT_TRUE(observation.has_value()) << observation.error().message;
    EXPECT_EQ(observation->session.model_id, journal->meta().model_id);
    EXPECT_GT(observation->session.session_id, 0u);
    observation->session = {};
    observation->daemon_ns = 0;
    EXPECT_TRUE(wire::encode(*observation) == recorded->front().payload);
    const auto updates = journal->records(io::RecordKind::kUpdate);
    ASSERT_TRUE(updates.has_value());
    ASSERT_EQ(updates->size(), recorded->size());
    const auto update = wire::decode_update(updates->front().payload);
    ASSERT_TRUE(update.has_value());
    EXPECT_EQ(update->update.observation_sequence, recorded->front().sequence);
  }
}

// A session is recorded, checked, exported, damaged and mended, as a user does it.
TEST_F(EndToEnd, AJournalIsCheckedExportedAndRepaired) {
  const auto surgery = simulate("paper");
  {
    const auto daemon = serve();
    replay(surgery, *daemon);
    ASSERT_EQ(daemon->end(SIGTERM), 0);
  }
  const std::string journal = journals().front();
  const auto checked = run({brainshift(), "journal", "check", surgery, journal});
  ASSERT_EQ(checked.exit_status, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr(journal + ": "));
  EXPECT_THAT(checked.out, HasSubstr("records, closed"));
  EXPECT_THAT(checked.out, HasSubstr("checksums    all match"));

  const auto csv = files_.path("records.csv"), fields = files_.path("fields");
  const auto exported = run({brainshift(), "journal", "export", journal, "--csv", csv, "--vtu",
                             fields, "--model", model()});
  ASSERT_EQ(exported.exit_status, 0) << exported.err;
  EXPECT_TRUE(std::filesystem::exists(csv));
  EXPECT_TRUE(std::filesystem::exists(std::filesystem::path(fields) /
                                          std::filesystem::path(journal).stem() += ".pvd"));

  const auto damaged = files_.path("damaged.surgery"), mended = files_.path("mended.surgery");
  std::filesystem::copy_file(journal, damaged);
  std::filesystem::resize_file(damaged, std::filesystem::file_size(damaged) * 9 / 10);
  const auto broken = run({brainshift(), "journal", "check", damaged});
  EXPECT_EQ(broken.exit_status, 2);
  EXPECT_THAT(broken.err, HasSubstr(damaged));
  const auto repaired = run({brainshift(), "journal", "repair", damaged, "--out", mended});
  ASSERT_EQ(repaired.exit_status, 0) << repaired.err;
  EXPECT_EQ(run({brainshift(), "journal", "check", mended}).exit_status, 0);
  EXPECT_EQ(run({brainshift(), "journal", "repair", damaged, "--out", mended}).exit_status, 1)
      << "nothing is replaced";
}

// A daemon is killed. Another one goes on where the journal ends, with the same final field.
TEST_F(EndToEnd, AfterACrashTheReplayGoesOnToTheSameFinalField) {
  const auto surgery = simulate("sag-progress");
  const auto play = [&](const Background& daemon, const std::string& name,
                        const std::vector<std::string>& more) {
    std::vector<std::string> command = {brainshift(),
                                        "replay",
                                        surgery,
                                        "--endpoint",
                                        endpoint(daemon),
                                        "--report",
                                        files_.path(name + ".json"),
                                        "--boundary",
                                        "contact"};
    command.insert(command.end(), more.begin(), more.end());
    const auto played = run(command);
    EXPECT_EQ(played.exit_status, 0) << played.err;
    return played;
  };
  {
    const auto daemon = serve();
    play(*daemon, "whole", {});
    daemon->end(SIGKILL);
  }
  // What a crash after the third observation leaves.
  const auto paths = journals();
  const auto journal = std::find_if(paths.begin(), paths.end(), [](const std::string& path) {
    return std::filesystem::path(path).extension() == ".surgery";
  });
  ASSERT_NE(journal, paths.end());
  const auto crashed = files_.path("crashed.surgery");
  const auto trimmed = run(
      {brainshift(), "journal", "trim", *journal, "--from", "1", "--to", "3", "--out", crashed});
  ASSERT_EQ(trimmed.exit_status, 0) << trimmed.err;

  const auto daemon = serve();
  const auto resumed = play(*daemon, "rest", {"--resume", crashed});
  EXPECT_THAT(resumed.out, HasSubstr("goes on after observation 3 of "));
  const json whole = read_json(files_.path("whole.json"))[0];
  const json rest = read_json(files_.path("rest.json"))[0];
  EXPECT_EQ(rest.at("updates").get<int>(), whole.at("updates").get<int>() - 2);
  EXPECT_EQ(rest.at("error_mm"), whole.at("error_mm"));
  EXPECT_EQ(test_support::content_of(files_.path("rest-sag-progress-contact.vtu")),
            test_support::content_of(files_.path("whole-sag-progress-contact.vtu")));
  EXPECT_EQ(daemon->end(SIGTERM), 0);
}

// The same daemon gives the same bits again; a journal that says otherwise is found out.
TEST_F(EndToEnd, AJournalIsVerifiedBitForBit) {
  const auto surgery = simulate("joint-sag");
  {
    const auto daemon = serve();
    const auto played = run({brainshift(), "replay", surgery, "--endpoint", endpoint(*daemon),
                             "--report", files_.path("report.json"), "--boundary", "contact"});
    ASSERT_EQ(played.exit_status, 0) << played.err;
    ASSERT_EQ(daemon->end(SIGTERM), 0);
  }
  const std::string journal = journals().front();
  const auto meta = io::SurgeryFile::open(journal)->meta();
  EXPECT_FALSE(meta.build.empty());
  EXPECT_FALSE(meta.machine.empty());
  const auto daemon = serve();
  const auto verified =
      run({brainshift(), "replay", journal, "--verify", "--endpoint", endpoint(*daemon)});
  EXPECT_EQ(verified.exit_status, 0) << verified.out << verified.err;
  if (!meta.blas_kernel.empty()) {
    EXPECT_THAT(verified.out, HasSubstr("agree bit for bit"));
  }
  EXPECT_THAT(verified.out, HasSubstr("greatest difference 0 mm"));

  // Another observation than the one that was answered.
  const auto other = files_.path("other.surgery");
  {
    const auto original = io::SurgeryFile::open(journal);
    auto changed = io::SurgeryFile::create(other, meta);
    bool first = true;
    ASSERT_TRUE(original->visit([&](io::SurgeryRecord record) {
      if (record.kind == io::RecordKind::kObservation && first) {
        first = false;
        auto observation = wire::decode_observation(record.payload).value();
        std::get<TumourBoundary>(observation.body).points.array() += 0.1;
        record.payload = wire::encode(observation);
      }
      return changed->append(record);
    }));
    ASSERT_TRUE(changed->close());
  }
  const auto differs =
      run({brainshift(), "replay", other, "--verify", "--endpoint", endpoint(*daemon)});
  EXPECT_EQ(differs.exit_status, 1);
  EXPECT_THAT(differs.err, HasSubstr("answers differ; the first: update 1 "));
  EXPECT_THAT(differs.out, HasSubstr("displacement"));
  EXPECT_EQ(daemon->end(SIGTERM), 0);
}

// ---------- without a model ----------

TEST(WithoutAModel, TheDaemonRunsAndTellsClientsThatNoModelIsLoaded) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  Background daemon({brainshiftd(), "serve", "--config", config}, files.path("daemon.log"));
  ASSERT_THAT(daemon.first_line(), StartsWith(kListening));
  auto client = client::Client::connect(daemon.first_line().substr(std::string(kListening).size()));
  ASSERT_TRUE(client.has_value());
  const auto status = client->status();
  ASSERT_TRUE(status.has_value()) << status.error().message;
  EXPECT_FALSE(status->model_ready);
  const auto session =
      client->start_session({"colin27-coarse", Method::kPaper, Boundary::kContact, false});
  ASSERT_FALSE(session.has_value());
  EXPECT_EQ(session.error().code, ErrorCode::kModelNotReady);
  EXPECT_THAT(session.error().message, HasSubstr("no model is loaded"));
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

}  // namespace
}  // namespace brainshift::integration
