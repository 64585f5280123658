// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_check.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/io/files/file_access.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

// The payload must be what its kind says; counts it.
Status count(const io::SurgeryRecord& record, JournalCheck& check) {
  const auto undecodable = [&](const Error& error) {
    return io::unreadable(
        check.file, fmt::format("record {}: {} {}: {}", check.records + 1, to_string(record.kind),
                                record.sequence, error.message));
  };
  switch (record.kind) {
    case io::RecordKind::kObservation: {
      const auto observation = wire::decode_observation(record.payload);
      if (!observation) return undecodable(observation.error());
      check.observations[observation->source].add(record.sequence);
      break;
    }
    case io::RecordKind::kUpdate: {
      const auto update = wire::decode_update(record.payload);
      if (!update) return undecodable(update.error());
      check.updates.add(record.sequence);
      break;
    }
    case io::RecordKind::kDecision: {
      const auto decision = wire::decode_decision(record.payload);
      if (!decision) return undecodable(decision.error());
      ++check.decisions[std::string(to_string(decision->outcome))];
      break;
    }
  }
  ++check.records;
  return {};
}

std::string text_of(const Numbers& numbers) {
  std::string text = fmt::format("{} ({} to {}", numbers.count, numbers.first, numbers.last);
  if (numbers.left_out() > 0) text += fmt::format(", {} numbers left out", numbers.left_out());
  return text + ")";
}

}  // namespace

void Numbers::add(std::uint64_t sequence) {
  first = count == 0 ? sequence : std::min(first, sequence);
  last = count == 0 ? sequence : std::max(last, sequence);
  ++count;
}

std::uint64_t Numbers::left_out() const {
  const std::uint64_t span = count == 0 ? 0 : last - first + 1;
  return span > count ? span - count : 0;
}

Result<JournalCheck> check_journal(const std::filesystem::path& path) {
  JournalCheck check;
  check.file = path;
  auto file = io::SurgeryFile::open(path);
  if (!file) {
    check.broken = file.error();
    file = io::SurgeryFile::open_damaged(path);
    if (!file) return tl::unexpected(*check.broken);
  }
  check.meta = file->meta();
  check.state = file->state();
  const Status ok =
      file->visit([&](const io::SurgeryRecord& record) { return count(record, check); });
  if (!ok && !check.broken) check.broken = ok.error();
  return check;
}

std::vector<std::string> report_lines(const JournalCheck& check) {
  std::vector<std::string> lines;
  const io::SurgeryMeta& meta = check.meta;
  lines.push_back(fmt::format("{}: {}", check.file.string(), describe(check.state)));
  const auto add = [&](const std::string& name, const std::string& text) {
    if (!text.empty()) lines.push_back(fmt::format("  {:<13}{}", name, text));
  };
  add("case", meta.case_id);
  add("model", meta.model_id);
  add("session", meta.method.empty() ? "" : meta.method + ", " + meta.boundary);
  add("written by", meta.software + (meta.created_utc.empty() ? "" : ", " + meta.created_utc));
  add("computed on", meta.machine.empty() ? "" : meta.machine + ", BLAS " + meta.blas_kernel);
  for (const auto& [source, numbers] : check.observations) {
    add("observations", fmt::format("{} of {}", text_of(numbers), source));
  }
  if (check.updates.count > 0) add("updates", text_of(check.updates));
  std::string decisions;
  for (const auto& [outcome, count] : check.decisions) {
    decisions += fmt::format("{}{} {}", decisions.empty() ? "" : ", ", count, outcome);
  }
  add("decisions", decisions);
  add("goes on from", meta.continues);
  add("gap", meta.gap);
  if (check.broken) {
    add("broken", check.broken->message);
    add("valid", fmt::format("the first {} of {} records", check.records, check.state.records));
  } else {
    add("checksums", "all match");
  }
  return lines;
}

}  // namespace brainshift::client
