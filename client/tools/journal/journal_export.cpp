// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_export.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <utility>

#include "common/core/text.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "common/io/model/field_series_file.hpp"
#include "common/io/model/model_file.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// Quoted where a comma or a quote would end it.
std::string csv_text(const std::string& given) {
  const std::string text = one_line(given, '?');
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += c;
  }
  return quoted + '"';
}

std::string xml_text(const std::string& text) {
  std::string escaped;
  for (const char c : one_line(text, '?')) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '"') {
      escaped += "&quot;";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string update_columns(const Update& update) {
  const StageTimings& t = update.timings;
  const Estimate& estimate = update.estimate;
  const double motion =
      estimate.displacement.cols() == 0 ? 0.0 : estimate.displacement.colwise().norm().maxCoeff();
  return fmt::format("{},{},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{:.6f}",
                     update.observation_sequence, to_string(estimate.status),
                     to_string(estimate.quality.quality), flags_text(estimate.quality),
                     t.register_ms, t.invert_ms, t.rebuild_ms, t.encode_ms, t.journal_ms,
                     estimate.contact.active, motion);
}

Status write_field(const fs::path& out, const BrainModel& model, const Estimate& estimate) {
  std::vector<io::NodeField> fields;
  fields.push_back({"displacement", estimate.displacement});
  if (estimate.sd_mm.size() > 0) fields.push_back({"sd_mm", estimate.sd_mm.transpose()});
  if (estimate.known.size() > 0) fields.push_back({"known", estimate.known.transpose()});
  return io::write_vtu(out, model.mesh, fields);
}

// Seconds since the first record that it was asked for.
class RecordClock {
 public:
  double seconds(std::int64_t recorded_ns) {
    constexpr double kNanosecondsPerSecond = 1e9;
    if (!first_ns_) first_ns_ = recorded_ns;
    return static_cast<double>(recorded_ns - *first_ns_) / kNanosecondsPerSecond;
  }

 private:
  std::optional<std::int64_t> first_ns_;
};

// "PATH: KIND SEQUENCE: reason".
tl::unexpected<Error> undecodable_record(const fs::path& path, const io::SurgeryRecord& record,
                                         const Error& error) {
  return io::unreadable(
      path, fmt::format("{} {}: {}", to_string(record.kind), record.sequence, error.message));
}

// Shows every usable update; gives their number. As above; kUnreadable for a field of another
// number of nodes, kEmptySet without a usable update.
using ShowField = std::function<Status(const Update&, double time_s)>;
Result<int> visit_fields(const io::SurgeryFile& file, const fs::path& path, const BrainModel& model,
                         const ShowField& show) {
  int fields = 0;
  const Status ok =
      visit_updates(file, path, [&](const UpdateMessage& message, double time_s) -> Status {
        if (message.error || !message.update.usable()) return {};
        const auto nodes = message.update.estimate.displacement.cols();
        if (nodes != model.mesh.num_nodes()) {
          return io::unreadable(
              path, fmt::format("update {}: displacement of {} nodes, the model has {}",
                                message.update.sequence, nodes, model.mesh.num_nodes()));
        }
        ++fields;
        return show(message.update, time_s);
      });
  if (!ok) return tl::unexpected(ok.error());
  if (fields == 0) return io::file_error(ErrorCode::kEmptySet, path, "holds no usable update");
  return fields;
}

}  // namespace

std::string flags_text(const QualityVerdict& verdict) {
  std::string text;
  for (const QualityFlag flag : kAllQualityFlags) {
    if (!verdict.flags.has(flag)) continue;
    text += text.empty() ? "" : "+";
    text += to_string(flag);
  }
  return text;
}

Result<BrainModel> recorded_model(const io::SurgeryFile& file, const fs::path& path,
                                  const fs::path& model_file) {
  auto model = io::read_model(model_file, {});
  if (!model) return tl::unexpected(model.error());
  if (model->model.model_id != file.meta().model_id) {
    return io::invalid_file(
        path, fmt::format("meta.model_id is \"{}\", but {} holds \"{}\"", file.meta().model_id,
                          model_file.string(), model->model.model_id));
  }
  return std::move(model->model);
}

Status visit_updates(const io::SurgeryFile& file, const fs::path& path, const ShowUpdate& show) {
  RecordClock clock;
  return file.visit([&](const io::SurgeryRecord& record) -> Status {
    const double time_s = clock.seconds(record.recorded_ns);
    if (record.kind != io::RecordKind::kUpdate) return {};
    const auto message = wire::decode_update(record.payload);
    if (!message) return undecodable_record(path, record, message.error());
    return show(*message, time_s);
  });
}

Result<std::string> records_csv(const io::SurgeryFile& file, const fs::path& path) {
  std::string text =
      "record,kind,sequence,source,recorded_s,bytes,observation_sequence,status,quality,flags,"
      "register_ms,invert_ms,rebuild_ms,encode_ms,journal_ms,active,max_motion_mm\n";
  RecordClock clock;
  std::uint64_t id = 0;
  const Status ok = file.visit([&](const io::SurgeryRecord& record) -> Status {
    std::string source;
    std::string columns(10, ',');
    if (record.kind == io::RecordKind::kObservation) {
      const auto observation = wire::decode_observation(record.payload);
      if (!observation) return undecodable_record(path, record, observation.error());
      source = csv_text(observation->source);
    } else if (record.kind == io::RecordKind::kDecision) {
      const auto decision = wire::decode_decision(record.payload);
      if (!decision) return undecodable_record(path, record, decision.error());
      source = csv_text(decision->source);
      columns = fmt::format("{},{},,,,,,,,{},", decision->observation_sequence,
                            to_string(decision->outcome), decision->active);
    } else {
      const auto message = wire::decode_update(record.payload);
      if (!message) return undecodable_record(path, record, message.error());
      columns = update_columns(message->update);
    }
    text += fmt::format("{},{},{},{},{:.6f},{},{}\n", ++id, to_string(record.kind), record.sequence,
                        source, clock.seconds(record.recorded_ns), record.payload.size(), columns);
    return {};
  });
  if (!ok) return tl::unexpected(ok.error());
  return text;
}

Result<int> write_field_series(const io::SurgeryFile& file, const fs::path& path,
                               const BrainModel& model, const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return io::write_failed(folder, failed.message());
  std::string list;
  auto fields = visit_fields(file, path, model, [&](const Update& update, double time_s) -> Status {
    const std::string name = fmt::format("{}-{:06}.vtu", path.stem().string(), update.sequence);
    list += fmt::format("    <DataSet timestep=\"{:.6f}\" file=\"{}\"/>\n", time_s, xml_text(name));
    return write_field(folder / name, model, update.estimate);
  });
  if (!fields) return fields;
  const std::string pvd =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n" +
      list + "  </Collection>\n</VTKFile>\n";
  const fs::path out = folder / (path.stem().string() + ".pvd");
  if (Status written = io::write_file(out, pvd); !written) return tl::unexpected(written.error());
  return fields;
}

Result<int> write_field_file(const io::SurgeryFile& file, const fs::path& path,
                             const BrainModel& model, const fs::path& out) {
  auto series = io::FieldSeriesFile::create(out, model);
  if (!series) return tl::unexpected(series.error());
  auto fields = visit_fields(file, path, model, [&](const Update& update, double time_s) -> Status {
    return series->add(update, time_s);
  });
  if (!fields) return fields;
  if (Status whole = series->commit(); !whole) return tl::unexpected(whole.error());
  return fields;
}

}  // namespace brainshift::client
