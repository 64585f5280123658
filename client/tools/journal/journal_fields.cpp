// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_fields.hpp"

#include <fmt/format.h>

#include <utility>

#include "common/io/files/file_access.hpp"
#include "common/io/model/model_file.hpp"

namespace brainshift::client {

namespace fs = std::filesystem;

double RecordClock::seconds(std::int64_t recorded_ns) {
  constexpr double kNanosecondsPerSecond = 1e9;
  if (!first_ns_) first_ns_ = recorded_ns;
  return static_cast<double>(recorded_ns - *first_ns_) / kNanosecondsPerSecond;
}

tl::unexpected<Error> undecodable_record(const fs::path& path, const io::SurgeryRecord& record,
                                         const Error& error) {
  return io::file_error(
      ErrorCode::kUnreadable, path,
      fmt::format("{} {}: {}", to_string(record.kind), record.sequence, error.message));
}

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
    return io::file_error(
        ErrorCode::kInvalidArgument, path,
        fmt::format("meta.model_id is \"{}\", but {} holds \"{}\"", file.meta().model_id,
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

Result<int> visit_fields(const io::SurgeryFile& file, const fs::path& path, const BrainModel& model,
                         const ShowField& show) {
  int fields = 0;
  const Status ok =
      visit_updates(file, path, [&](const UpdateMessage& message, double time_s) -> Status {
        if (message.error || !message.update.usable()) return {};
        const auto nodes = message.update.estimate.displacement.cols();
        if (nodes != model.mesh.num_nodes()) {
          return io::file_error(
              ErrorCode::kUnreadable, path,
              fmt::format("update {}: displacement of {} nodes, the model has {}",
                          message.update.sequence, nodes, model.mesh.num_nodes()));
        }
        ++fields;
        return show(message.update, time_s);
      });
  if (!ok) return tl::unexpected(ok.error());
  if (fields == 0) return io::file_error(ErrorCode::kEmptySet, path, "holds no usable update");
  return fields;
}

}  // namespace brainshift::client
