// SPDX-License-Identifier: Apache-2.0
// Frames written by a second, independent implementation (tests/data/wire/make_golden.py):
// decoding gives the described values, and encoding the described values gives the same bytes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/wire/frame.hpp"
#include "tests/unit/wire/same_values.hpp"

namespace brainshift::wire {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

// ---------- core values from their description ----------

Points points_from(const json& xyz) {
  const auto values = xyz.get<std::vector<double>>();
  return Eigen::Map<const Points>(values.data(), 3, static_cast<Eigen::Index>(values.size() / 3));
}

template <int Rows>
Eigen::Matrix<int, Rows, Eigen::Dynamic> columns_from(const json& indices) {
  const auto values = indices.get<std::vector<int>>();
  return Eigen::Map<const Eigen::Matrix<int, Rows, Eigen::Dynamic>>(
      values.data(), Rows, static_cast<Eigen::Index>(values.size()) / Rows);
}

VecX vector_from(const json& numbers) {
  const auto values = numbers.get<std::vector<double>>();
  return Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
}

TriangleSurface surface_from(const json& value) {
  return {points_from(value["vertices"]["xyz_mm"]), columns_from<3>(value["triangle_indices"])};
}

MeanStd mean_std_from(const json& value) { return {value["mean_mm"], value["std_mm"]}; }

SessionKey session_key_from(const json& value) {
  return {value["boot_id"], value["session_id"], value["model_id"]};
}

Observation observation_from(const json& value) {
  Observation observation;
  observation.case_id = value["case_id"];
  observation.frame = value["frame"];
  observation.source = value["source"];
  observation.sequence = value["sequence"];
  observation.acquired_ns = value["acquired_ns"];
  if (value.contains("session")) {
    observation.session = session_key_from(value["session"]);
    observation.sent_ns = value["sent_ns"];
    observation.daemon_ns = value["daemon_ns"];
  }
  observation.acquired_wall_ns = value["acquired_wall_ns"];
  if (value.contains("tumour_boundary")) {
    const json& body = value["tumour_boundary"];
    observation.body = TumourBoundary{points_from(body["points"]["xyz_mm"]), body["sd_mm"]};
  } else if (value.contains("cortical_surface")) {
    const json& body = value["cortical_surface"];
    observation.body = CorticalSurface{surface_from(body["surface"]), body["sd_mm"]};
  } else if (value.contains("landmark_pairs")) {
    const json& body = value["landmark_pairs"];
    observation.body = LandmarkPairs{points_from(body["undeformed"]["xyz_mm"]),
                                     points_from(body["deformed"]["xyz_mm"]), body["sd_mm"]};
  } else {
    const json& body = value["patient_pose"];
    observation.body =
        PatientPose{vector_from(body["gravity_direction"]), body["fluid_level_mm"].get<double>()};
  }
  return observation;
}

BrainModel model_from(const json& value) {
  BrainModel model;
  model.case_id = value["case_id"];
  model.model_id = value["model_id"];
  model.mesh.nodes = points_from(value["nodes"]["xyz_mm"]);
  model.mesh.tets = columns_from<4>(value["tet_indices"]);
  model.mesh.labels = value["tet_labels"].get<std::vector<int>>();
  model.boundary_triangles = columns_from<3>(value["boundary_indices"]);
  model.septa.triangles = columns_from<3>(value["septa_indices"]);
  model.ventricle_wall = columns_from<3>(value["ventricle_indices"]);
  model.skull = surface_from(value["skull"]);
  model.tumour = surface_from(value["tumour"]);
  model.craniotomy = value["craniotomy"].get<std::vector<int>>();
  model.brainstem = value["brainstem"].get<std::vector<int>>();
  model.slaves = value["slaves"].get<std::vector<int>>();
  model.fixed = value["fixed"].get<std::vector<int>>();
  model.gravity_direction = vector_from(value["gravity_direction"]);
  model.fluid_plane_depth_mm = value["fluid_plane_depth_mm"];
  model.slave_plane_depth_mm = value["slave_plane_depth_mm"];
  return model;
}

Estimate estimate_from(const json& value) {
  Estimate estimate;
  EXPECT_EQ(value["status"], "converged");
  estimate.status = EstimateStatus::kConverged;
  estimate.reason = value["reason"];
  estimate.displacement = points_from(value["displacement"]["xyz_mm"]);
  estimate.sd_mm = vector_from(value["sd_mm"]);
  if (value.contains("known")) {
    const std::string hex = value["known"];
    estimate.known.resize(static_cast<Eigen::Index>(hex.size() / 2));
    for (Eigen::Index i = 0; i < estimate.known.size(); ++i) {
      estimate.known[i] =
          std::stoi(hex.substr(static_cast<std::size_t>(2 * i), 2), nullptr, 16) / 255.0;
    }
    estimate.region_known = value["region_known"];
  }
  const json& contact = value["contact"];
  estimate.contact = {contact["active"], contact["penetrating"], contact["max_penetration_mm"],
                      contact["iterations"]};
  estimate.active_slaves = contact["active_slaves"].get<std::vector<int>>();
  estimate.contact_force_n = vector_from(contact["force_n"]);
  estimate.initial_misfit_mm = mean_std_from(value["initial_misfit"]);
  estimate.misfit_mm = mean_std_from(value["misfit"]);
  for (const json& entry : value["history"]) {
    estimate.history.push_back({entry["iteration"], mean_std_from(entry["misfit"]),
                                entry["penetrating"], entry["max_penetration_mm"],
                                entry["elapsed_ms"]});
  }
  if (!value.contains("quality")) return estimate;  // a daemon that gives no verdicts
  if (value["quality"] == 1) {
    estimate.quality.quality = Quality::kGood;
  } else {
    EXPECT_EQ(value["quality"], 3);
    EXPECT_EQ(value["quality_flags"], (json{1, 17}));
    estimate.quality.quality = Quality::kUnusable;
    estimate.quality.flags.set(QualityFlag::kMisfitUnexplained);
    estimate.quality.flags.set(QualityFlag::kInvertedElements);
  }
  estimate.quality.reason = value["quality_reason"];
  estimate.contact.decrement = contact["decrement"];
  estimate.contact.max_violation_mm = contact["max_violation_mm"];
  estimate.min_volume_ratio = value["min_volume_ratio"];
  estimate.inverted_elements = value["inverted_elements"];
  estimate.misfit_ratio = value["misfit_ratio"];
  estimate.data_outside_region = value["data_outside_region"];
  return estimate;
}

UpdateMessage update_from(const json& value) {
  UpdateMessage message;
  message.session_id = value["session_id"];
  message.boot_id = value["boot_id"];
  Update& update = message.update;
  update.case_id = value["case_id"];
  update.model_id = value["model_id"];
  update.sequence = value["sequence"];
  update.observation_sequence = value["observation_sequence"];
  EXPECT_EQ(value["boundary"], "fixed");
  EXPECT_EQ(value["method"], "paper");
  update.method = Method::kPaper;
  update.boundary = Boundary::kFixed;
  update.final = value["final"] == 1;
  const json& timings = value["timings"];
  update.timings = {timings["register_ms"], timings["invert_ms"], timings["rebuild_ms"],
                    timings["encode_ms"], timings["journal_ms"]};
  if (value.contains("answer_time")) {
    const json& time = value["answer_time"];
    update.answer_time = {time["ms"], time["usual_ms"], time["age_ms"]};
    EXPECT_EQ(time["late"] == 1, update.answer_time.late());
  }
  if (value["status"] == "failed") {
    EXPECT_EQ(value["error_code"], "empty_set");
    message.error = Error{ErrorCode::kEmptySet, value["reason"]};
    return message;
  }
  update.estimate = estimate_from(value);
  const json& T = value["t_undeformed_deformed"];
  const auto rotation = T["rotation_row_major"].get<std::vector<double>>();
  update.T_undeformed_deformed.linear() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  update.T_undeformed_deformed.translation() = vector_from(T["translation_mm"]);
  for (const json& entry : value["left_out"]) {
    update.left_out.push_back({entry["part"], entry["reason"], entry["estimated_error"]});
  }
  if (value.contains("part")) {
    const json& part = value["part"];
    EXPECT_EQ(part["node_steps"], (json{0, 18474}));
    update.part = FieldPart{part["mesh_nodes"], {0, 18474}, part["base_sequence"]};
  }
  return message;
}

DaemonStatus status_from(const json& value) {
  return {value["version"],   value["model_ready"] == 1, value["case_id"],  value["model_id"],
          value["busy"] == 1, value["updates"],          value["uptime_ms"]};
}

SessionState session_state_from(const json& value) {
  EXPECT_EQ(value["phase"], 5);
  return {session_key_from(value["session"]),
          SessionPhase::kDegraded,
          value["newest_update"],
          value["newest_usable"],
          value["age_ms"],
          value["valid_ms"],
          value["reason"],
          value["preparing"] == 1,
          RecordingState{true, "", {{"ius", 12, 3}}},
          value.value("aged_after_ms", 0u),
          value.value("expired_after_ms", 0u),
          value.value("recorded", 0) == 1,
          value.value("method", ""),
          value.value("boundary", "")};
}

Subscription subscription_from(const json& value) {
  Subscription subscription{value["subscription"], value["window"], value["received"]};
  if (!value.contains("choice")) return subscription;
  const json& chosen = value["choice"];
  FieldChoice& choice = subscription.choice;
  if (chosen.contains("ball")) {
    choice.region =
        BallRegion{vector_from(chosen["ball"]["centre_mm"]), chosen["ball"]["radius_mm"]};
  } else {
    choice.region = TumourRegion{chosen["tumour"]["margin_mm"]};
  }
  choice.spacing_mm = chosen["spacing_mm"];
  choice.tolerance_mm = chosen["tolerance_mm"];
  choice.with_sd = chosen["without_sd"] == 0;
  return subscription;
}

SessionRequest session_request_from(const json& value) {
  EXPECT_EQ(value["method"], "paper");
  EXPECT_EQ(value["boundary"], "fixed");
  return {value["case_id"],       Method::kPaper,
          Boundary::kFixed,       value["publish_iterates"] == 1,
          value["takeover"] == 1, value["recorded_clock"] == 1};
}

SessionInfo session_info_from(const json& value) {
  return {value["session_id"], value["model_id"],  value["nodes"],       value["tets"],
          value["slaves"],     value["prepare_s"], value["model_bytes"], value["boot_id"]};
}

LatencyFigures latency_from(const json& value) {
  return {value["count"], value["p50_ms"], value["p95_ms"], value["p99_ms"], value["max_ms"]};
}

DaemonReport report_from(const json& value) {
  DaemonReport report{value["version"],    value["build"],
                      value["machine"],    value["blas_kernel"],
                      value["uptime_ms"],  value["model_ready"] == 1,
                      value["case_id"],    session_state_from(value["session"]),
                      value["owner"],      value["max_age_s"],
                      value["working_ms"], value["limit_ms"],
                      value["usable"],     value["unusable"],
                      value["late"],       value["failures"],
                      value["iterates"]};
  for (const json& counts : value["sources"]) {
    report.sources.push_back({counts["source"], counts["received"], counts["answered"],
                              counts["failed"], counts["replaced"], counts["skipped"],
                              counts["refused"], counts["repeated"], counts["waiting"],
                              counts["age_ms"]});
  }
  report.clients = value["clients"];
  for (const json& viewer : value["viewers"]) {
    report.viewers.push_back({viewer["peer"], viewer["window"], viewer["sent"], viewer["received"],
                              viewer["owed"], viewer["replies_waiting"]});
  }
  report.recent_updates = value["recent_updates"];
  report.bounds_ms = value["bounds_ms"].get<std::vector<double>>();
  for (const json& stage : value["stages"]) {
    report.stages.push_back({stage["stage"], latency_from(stage["recent"]),
                             latency_from(stage["all"]), stage["sum_ms"],
                             stage["bucket_counts"].get<std::vector<std::uint64_t>>()});
  }
  const json& journal = value["journal"];
  report.journal = JournalFigures{journal["recording"] == 1, journal["reason"],  journal["file"],
                                  journal["bytes"],          journal["records"], journal["lost"]};
  report.log_lines_lost = value["log_lines_lost"];
  const json& process = value["process"];
  report.process = {process["resident_bytes"], process["peak_bytes"], process["descriptors"],
                    process["descriptor_limit"], process["threads"]};
  const json& door = value["door"];
  report.door = {door["accepted"],
                 door["closed_for_breach"],
                 door["closed_for_memory"],
                 door["closed_for_silence"],
                 door["closed_for_room"],
                 door["held_bytes"],
                 door["unknown_keys"],
                 door["refused_role"],
                 door["refused_connections"],
                 door["refused_observations"],
                 door["refused_starts"]};
  return report;
}

// ---------- the check ----------

template <typename T>
std::string check(const T& described, const Result<T>& decoded) {
  EXPECT_TRUE(decoded) << decoded.error().message;
  if (decoded) expect_same(described, *decoded);
  return encode(described);
}

// Compares the decoded payload with its description and returns the description encoded by us.
std::string check_message(const std::string& message, const json& value, std::string_view payload) {
  if (message == "Empty") return {};
  if (message == "StatusReply") return check(status_from(value), decode_status(payload));
  if (message == "StartSessionRequest") {
    return check(session_request_from(value), decode_session_request(payload));
  }
  if (message == "StartSessionReply") {
    return check(session_info_from(value), decode_session_info(payload));
  }
  if (message == "ModelReply") return check(model_from(value), decode_model(payload));
  if (message == "Observation") return check(observation_from(value), decode_observation(payload));
  if (message == "ObservationReply") {
    return check(ObservationReceipt{value["observation_sequence"], value["replaced_pending"] == 1},
                 decode_observation_receipt(payload));
  }
  if (message == "Update") return check(update_from(value), decode_update(payload));
  if (message == "SubscribeRequest") {
    return check(subscription_from(value), decode_subscription(payload));
  }
  if (message == "SessionState") {
    return check(session_state_from(value), decode_session_state(payload));
  }
  if (message == "DaemonReport") return check(report_from(value), decode_report(payload));
  if (message == "ErrorReply") {
    EXPECT_EQ(value["code"], "model_not_ready");
    const Error described{ErrorCode::kModelNotReady, value["message"]};
    expect_same(described, decode_error(payload));
    return encode(described);
  }
  ADD_FAILURE() << "no reader for " << message;
  return {};
}

class Golden : public ::testing::TestWithParam<const char*> {};

TEST_P(Golden, FrameHoldsTheDescribedValuesAndIsReproducedByteForByte) {
  const fs::path stem = fs::path(BRAINSHIFT_SOURCE_DIR) / "tests/data/wire" / GetParam();
  const std::string bytes = read(fs::path(stem) += ".bin");
  const json description = json::parse(read(fs::path(stem) += ".json"));
  const auto frame = decode_frame(bytes);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(static_cast<int>(frame->type), description["type"]);
  EXPECT_EQ(frame->request_id, description["request_id"].get<std::uint64_t>());
  const std::string payload =
      check_message(description["message"], description["value"], frame->payload);
  EXPECT_EQ(encode_frame(frame->type, frame->request_id, payload), bytes);
}

INSTANTIATE_TEST_SUITE_P(
    Frames, Golden,
    ::testing::Values("status_request", "status_reply", "start_session_request",
                      "start_session_reply", "model_request", "model_reply", "subscribe_request",
                      "subscribe_ball", "subscribe_tumour", "session_state", "observation_tumour",
                      "observation_cortex", "observation_landmarks", "observation_pose",
                      "observation_reply", "error_reply", "update", "update_unusable",
                      "update_changes", "update_failed", "report_request", "report_reply"),
    [](const auto& frame) { return std::string(frame.param); });

}  // namespace
}  // namespace brainshift::wire
