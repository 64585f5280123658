// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/resume.hpp"

#include "common/io/files/file_access.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

Result<ResumePoint> read_resume_point(const std::filesystem::path& journal) {
  const auto file = io::SurgeryFile::open_damaged(journal);
  if (!file) return tl::unexpected(file.error());
  ResumePoint point;
  point.meta = file->meta();
  const Status whole = file->visit([&](const io::SurgeryRecord& record) -> Status {
    if (record.kind == io::RecordKind::kObservation) {
      const auto observation = wire::decode_observation(record.payload);
      if (!observation) {
        return io::file_error(
            ErrorCode::kUnreadable, journal,
            "observation " + std::to_string(record.sequence) + ": " + observation.error().message);
      }
      point.last[observation->source] = record.sequence;
    }
    if (record.kind == io::RecordKind::kUpdate) point.last_update = record.sequence;
    ++point.records;
    return {};
  });
  if (!whole) point.broken = whole.error();
  return point;
}

std::vector<RecordedObservation> remaining(const std::vector<RecordedObservation>& recording,
                                           const ResumePoint& point) {
  std::vector<RecordedObservation> left;
  for (const RecordedObservation& recorded : recording) {
    const auto last = point.last.find(recorded.observation.source);
    if (last != point.last.end() && recorded.observation.sequence < last->second) continue;
    left.push_back(recorded);
  }
  return left;
}

std::string describe(const ResumePoint& point) {
  if (point.last.empty()) return "begins anew: no observation is recorded";
  std::string text;
  for (const auto& [source, sequence] : point.last) {
    text += text.empty() ? "goes on after observation " : " and ";
    text += std::to_string(sequence) + " of " + source;
  }
  if (point.last_update > 0) text += ", update " + std::to_string(point.last_update);
  return text;
}

}  // namespace brainshift::client
