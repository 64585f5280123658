// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/run_report.hpp"

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <type_traits>

#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

using Json = nlohmann::ordered_json;

// Every key is named once, in a visit() below; Writer and Reader walk the same list.
enum class Need { kOptional, kRequired };

template <typename A>
void visit(A& a, MeanStd& v) {
  a("mean", v.mean), a("std", v.std);
}
template <typename A>
void visit(A& a, MeshSize& v) {
  a("nodes", v.nodes), a("tets", v.tets), a("slaves", v.slaves);
}
template <typename A>
void visit(A& a, LatencyPercentiles& v) {
  a("p50", v.p50), a("p95", v.p95), a("p99", v.p99), a("max", v.max);
}
template <typename A>
void visit(A& a, StageTimings& v) {
  a("register", v.register_ms), a("invert", v.invert_ms), a("rebuild", v.rebuild_ms);
  a("encode", v.encode_ms), a("journal", v.journal_ms);
}
template <typename A>
void visit(A& a, RunErrors& v) {
  a("initial", v.initial), a("sparse_initial", v.sparse_initial), a("sparse", v.sparse);
  a("cross", v.cross);
  a("craniotomy_initial", v.craniotomy_initial), a("craniotomy", v.craniotomy);
  a("craniotomy_displacement_initial", v.craniotomy_displacement_initial);
  a("craniotomy_displacement", v.craniotomy_displacement);
}
template <typename A>
void visit(A& a, FieldError& v) {
  a("p50", v.p50), a("p99", v.p99), a("max", v.max);
}
template <typename A>
void visit(A& a, ContactSummary& v) {
  a("active", v.active), a("penetrating", v.penetrating);
  a("max_penetration_mm", v.max_penetration_mm), a("iterations", v.iterations);
}
template <typename A>
void visit(A& a, Omission& v) {
  a("part", v.part), a("reason", v.reason), a("estimated_error", v.estimated_error);
}
template <typename A>
void visit(A& a, SourceSummary& v) {
  a("source", v.source), a("observation_sequence", v.observation_sequence), a("age_s", v.age_s);
  a("data", v.data), a("outliers", v.outliers), a("chi_square", v.chi_square);
  a("degrees_of_freedom", v.degrees_of_freedom), a("p_value", v.p_value);
  a("consistent", v.consistent);
}
template <typename A>
void visit(A& a, RunFailure& v) {
  a("observation_sequence", v.observation_sequence), a("code", v.code), a("message", v.message);
}
template <typename A>
void visit(A& a, TracePoint& v) {
  a("iteration", v.iteration), a("sparse", v.sparse), a("cross", v.cross);
  a("penetrating", v.penetrating), a("max_penetration_mm", v.max_penetration_mm);
  a("elapsed_ms", v.elapsed_ms);
}
template <typename A>
void visit(A& a, QualityCounts& v) {
  a("good", v.good), a("caution", v.caution), a("unusable", v.unusable);
  a("not_judged", v.not_judged);
}
template <typename A>
void visit(A& a, RunQuality& v) {
  a("worst", v.worst), a("last", v.last), a("reason", v.reason), a("counts", v.counts);
  a("flags", v.flags), a("last_flags", v.last_flags);
}
template <typename A>
void visit(A& a, PartStrength& v) {
  a("part", v.part), a("mean", v.mean), a("absent", v.absent), a("at_bound", v.at_bound);
}
template <typename A>
void visit(A& a, WeightedStrengths& v) {
  a("scales", v.scales), a("weight", v.weight);
}
template <typename A>
void visit(A& a, TumourShift& v) {
  a("mean", v.mean), a("sd", v.sd);
}
template <typename A>
void visit(A& a, CoursePoint& v) {
  a("time_s", v.time_s), a("source", v.source), a("quality", v.quality), a("reason", v.reason);
  a("tumour_mm", v.tumour_mm), a("tumour_sd_mm", v.tumour_sd_mm);
  a("true_tumour_mm", v.true_tumour_mm), a("misfit_mm", v.misfit_mm);
  a("latency_ms", v.latency_ms);
}
template <typename A>
void visit(A& a, LeftOutScore& v) {
  a("source", v.source), a("kind", v.kind), a("points", v.points), a("failed", v.failed);
  a("initial", v.initial), a("rigid", v.rigid), a("error", v.error);
  a("coverage_90", v.coverage_90);
}
template <typename A>
void visit(A& a, RunReport& v) {
  a("case", v.case_id, Need::kRequired), a("scenario", v.scenario, Need::kRequired);
  a("method", v.method, Need::kRequired), a("boundary", v.boundary, Need::kRequired);
  a("seed", v.seed), a("model_id", v.model_id), a("case_file", v.case_file);
  a("surgery_file", v.surgery_file), a("field_file", v.field_file);
  a("mesh", v.mesh), a("prepare_s", v.prepare_s), a("factor_s", v.factor_s);
  a("model_bytes", v.model_bytes), a("full_solve_ms", v.full_solve_ms);
  a("updates", v.updates), a("superseded", v.superseded), a("status", v.status);
  a("reason", v.reason), a("quality", v.quality);
  a("latency_ms", v.latency_ms), a("cold_ms", v.cold_ms);
  a("first_iterate_ms", v.first_iterate_ms), a("stages_ms", v.stages_ms);
  a("tumour_shift_mm", v.tumour_shift_mm), a("course", v.course);
  a("leave_one_out", v.leave_one_out);
  a("error_mm", v.error_mm), a("recovery_pct", v.recovery_pct);
  a("craniotomy_recovery_pct", v.craniotomy_recovery_pct);
  a("craniotomy_displacement_recovery_pct", v.craniotomy_displacement_recovery_pct);
  a("field_error_pct", v.field_error_pct), a("share_below_5_pct", v.share_below_5_pct);
  a("largest_true_displacement_mm", v.largest_true_displacement_mm);
  a("coverage_90", v.coverage_90), a("region_known", v.region_known), a("contact", v.contact);
  a("ventricle_change_cc", v.ventricle_change_cc);
  a("principal_direction_deg", v.principal_direction_deg);
  a("principal_direction_true_deg", v.principal_direction_true_deg);
  a("truth_scalars", v.truth_scalars), a("left_out", v.left_out), a("failures", v.failures);
  a("sources", v.sources), a("prior_strengths", v.prior_strengths);
  a("hypotheses", v.hypotheses), a("trace", v.trace);
}

struct Writer {
  Json object = Json::object();

  template <typename T>
  void operator()(const char* key, T& value, Need = Need::kOptional) {
    object[key] = encode(value);
  }

  static Json encode(double value) { return value; }  // dumped as null when not finite
  static Json encode(std::string& value) { return value; }
  static Json encode(bool value) { return value; }
  template <typename T>
  requires std::is_integral_v<T>
  static Json encode(T value) { return value; }
  template <typename T>
  static Json encode(std::optional<T>& value) {
    return value ? encode(*value) : Json(nullptr);
  }
  template <typename T>
  static Json encode(std::vector<T>& values) {
    Json array = Json::array();
    for (T& value : values) array.push_back(encode(value));
    return array;
  }
  template <typename T>
  static Json encode(std::map<std::string, T>& values) {
    Json map = Json::object();
    for (auto& [key, value] : values) map[key] = encode(value);
    return map;
  }
  template <typename T>
  requires(std::is_class_v<T>) static Json encode(T& value) {
    Writer writer;
    visit(writer, value);
    return std::move(writer.object);
  }
};

// Reads an object; the first complaint stays in `error` and later ones are dropped.
struct Reader {
  const Json& object;
  std::string path;
  std::string& error;

  template <typename T>
  void operator()(const char* key, T& value, Need need = Need::kOptional) {
    const std::string here = path + "." + key;
    const auto found = object.find(key);
    if (found == object.end()) {
      if (need == Need::kRequired) complain(path + ": key \"" + key + "\" is missing");
      return;
    }
    if (found->is_null() && need == Need::kOptional) {
      absent(value);
      return;
    }
    decode(*found, here, value);
  }

  void complain(const std::string& sentence) const {
    if (error.empty()) error = sentence;
  }
  // null stands for "not finite" where the value itself is not optional.
  static void absent(double& value) { value = std::numeric_limits<double>::quiet_NaN(); }
  template <typename T>
  static void absent(T& value) {
    value = T{};
  }

  void decode(const Json& json, const std::string& here, double& value) const {
    if (!json.is_number()) return complain(here + " must be a number");
    value = json.get<double>();
  }
  void decode(const Json& json, const std::string& here, bool& value) const {
    if (!json.is_boolean()) return complain(here + " must be true or false");
    value = json.get<bool>();
  }
  void decode(const Json& json, const std::string& here, std::string& value) const {
    if (!json.is_string()) return complain(here + " must be a string");
    value = json.get<std::string>();
  }
  template <typename T>
  requires std::is_integral_v<T>
  void decode(const Json& json, const std::string& here, T& value) const {
    if (!json.is_number_integer() || (std::is_unsigned_v<T> && !json.is_number_unsigned())) {
      return complain(here + " must be " + (std::is_unsigned_v<T> ? "a count" : "an integer"));
    }
    value = json.get<T>();
  }
  template <typename T>
  void decode(const Json& json, const std::string& here, std::optional<T>& value) const {
    value.emplace();
    decode(json, here, *value);
  }
  template <typename T>
  void decode(const Json& json, const std::string& here, std::vector<T>& values) const {
    if (!json.is_array()) return complain(here + " must be an array");
    values.assign(json.size(), T{});
    for (std::size_t i = 0; i < json.size(); ++i) {
      decode(json[i], here + "[" + std::to_string(i) + "]", values[i]);
    }
  }
  template <typename T>
  void decode(const Json& json, const std::string& here, std::map<std::string, T>& values) const {
    if (!json.is_object()) return complain(here + " must be an object");
    values.clear();
    for (const auto& [key, value] : json.items()) {
      decode(value, std::string(here).append(".").append(key), values[key]);
    }
  }
  template <typename T>
  requires(std::is_class_v<T>) void decode(const Json& json, const std::string& here,
                                           T& value) const {
    if (!json.is_object()) return complain(here + " must be an object");
    Reader reader{json, here, error};
    visit(reader, value);
  }
};

// The parser's own message names line and column but may span lines.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return text;
}

}  // namespace

std::string to_json(const std::vector<RunReport>& runs) {
  std::vector<RunReport> copy = runs;  // visit() walks mutable values, so that reading shares it
  return Writer::encode(copy).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<std::vector<RunReport>> from_json(const std::string& text, const std::string& origin) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    return fail(ErrorCode::kUnreadable, one_line(origin + ": not JSON: " + error.what()));
  }
  if (!json.is_array()) {
    return fail(ErrorCode::kUnreadable, origin + ": must be an array with one object per run");
  }
  std::vector<RunReport> runs;
  std::string error;
  const Reader reader{json, "", error};
  reader.decode(json, "", runs);
  if (!error.empty()) return fail(ErrorCode::kUnreadable, origin + ": " + one_line(error));
  return runs;
}

Status write_reports(const std::filesystem::path& path, const std::vector<RunReport>& runs) {
  return io::write_file(path, to_json(runs));
}

Result<std::vector<RunReport>> read_reports(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    return fail(ErrorCode::kNotFound, path.string() + ": no such file");
  }
  if (std::filesystem::is_directory(path, ignored)) {
    return io::unreadable(path, "is a folder, not a report");
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return io::unreadable(path, "cannot be read");
  return from_json(text.str(), path.string());
}

}  // namespace brainshift::client
