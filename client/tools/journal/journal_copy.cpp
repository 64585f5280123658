// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_copy.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <functional>
#include <set>
#include <utility>

#include "common/io/files/file_access.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// Committed together: as few syncs as memory allows.
constexpr std::size_t kGroupBytes = 16u << 20;

// A new surgery file that appears under its name when it is complete.
class NewSurgery {
 public:
  static Result<NewSurgery> create(const fs::path& out, const io::SurgeryMeta& meta) {
    std::error_code ignored;
    if (fs::exists(fs::symlink_status(out, ignored))) {
      return io::invalid_file(out, "exists already");
    }
    fs::path temporary = out;
    temporary.replace_filename(fmt::format(".{}.tmp-{}", out.filename().string(), ::getpid()));
    auto file = io::SurgeryFile::create(temporary, meta);
    if (!file) return io::write_failed(out, file.error().message);
    return NewSurgery(out, temporary, std::move(*file));
  }
  NewSurgery(NewSurgery&& other) noexcept
      : out_(std::move(other.out_)),
        temporary_(std::exchange(other.temporary_, {})),
        file_(std::move(other.file_)),
        group_(std::move(other.group_)) {}
  NewSurgery& operator=(NewSurgery&&) = delete;
  ~NewSurgery() {
    if (!temporary_.empty()) io::discard_surgery(temporary_);
  }

  Status append(const io::SurgeryRecord& record) {
    bytes_ += record.payload.size();
    group_.push_back(record);
    return bytes_ < kGroupBytes ? Status() : flush();
  }
  Status write_truth(std::uint64_t sequence, const io::SurgeryTruth& truth) {
    return file_.write_truth(sequence, truth);
  }
  Status commit() {
    if (Status ok = flush(); !ok) return ok;
    if (Status ok = file_.close(); !ok) return ok;
    std::error_code failed;
    if (!fs::exists(out_, failed)) fs::rename(temporary_, out_, failed);
    if (failed) return io::write_failed(out_, failed.message());
    temporary_.clear();
    return {};
  }

 private:
  NewSurgery(fs::path out, fs::path temporary, io::SurgeryFile file)
      : out_(std::move(out)), temporary_(std::move(temporary)), file_(std::move(file)) {}
  Status flush() {
    Status status = group_.empty() ? Status() : file_.append(group_);
    group_.clear();
    bytes_ = 0;
    return status;
  }

  fs::path out_;
  fs::path temporary_;  // empty once it has its name
  io::SurgeryFile file_;
  std::vector<io::SurgeryRecord> group_;
  std::size_t bytes_ = 0;
};

// Truth that is not there, or is damaged, is no reason to lose the records.
Status copy_truth(const io::SurgeryFile& from, const std::set<std::uint64_t>& sequences,
                  NewSurgery& to) {
  for (const std::uint64_t sequence : sequences) {
    const auto truth = from.read_truth(sequence);
    if (!truth) continue;
    if (Status ok = to.write_truth(sequence, *truth); !ok) return ok;
  }
  return {};
}

using Keep = std::function<Result<bool>(const io::SurgeryRecord&)>;

// The records that `keep` chooses, until the first bad one.
Result<CopiedJournal> copy(const io::SurgeryFile& from, const Keep& keep, NewSurgery& to) {
  CopiedJournal copied;
  copied.of = from.state().records;
  std::set<std::uint64_t> observations;
  Status written;
  const Status visited = from.visit([&](const io::SurgeryRecord& record) -> Status {
    const auto kept = keep(record);
    if (!kept) return tl::unexpected(kept.error());
    if (!*kept) return {};
    ++copied.kept;
    if (record.kind == io::RecordKind::kObservation) observations.insert(record.sequence);
    written = to.append(record);
    return written;
  });
  if (!written) return tl::unexpected(written.error());
  if (!visited) copied.broken = visited.error();
  if (Status ok = copy_truth(from, observations, to); !ok) return tl::unexpected(ok.error());
  return copied;
}

}  // namespace

Result<CopiedJournal> repair_journal(const fs::path& file, const fs::path& out) {
  const auto whole = io::SurgeryFile::open(file);
  const auto from = io::SurgeryFile::open_damaged(file);
  if (!from) return tl::unexpected(whole ? from.error() : whole.error());
  io::SurgeryMeta meta = from->meta();
  meta.gap = fmt::format("{}{}the valid prefix of {}", meta.gap, meta.gap.empty() ? "" : "; ",
                         file.filename().string());
  auto to = NewSurgery::create(out, meta);
  if (!to) return tl::unexpected(to.error());
  auto copied = copy(
      *from, [](const io::SurgeryRecord&) { return true; }, *to);
  if (!copied) return copied;
  if (!whole && !copied->broken) copied->broken = whole.error();
  if (copied->kept == 0) {
    return io::file_error(
        ErrorCode::kEmptySet, file,
        copied->broken ? "no record is valid: " + copied->broken->message : "holds no record");
  }
  if (Status ok = to->commit(); !ok) return tl::unexpected(ok.error());
  return copied;
}

Result<CopiedJournal> trim_journal(const fs::path& file, std::uint64_t first, std::uint64_t last,
                                   const fs::path& out) {
  if (first > last) {
    return invalid(fmt::format("first = {}: must be at most last = {}", first, last));
  }
  const auto from = io::SurgeryFile::open(file);
  if (!from) return tl::unexpected(from.error());
  io::SurgeryMeta meta = from->meta();
  meta.gap = fmt::format("{}{}observations {} to {} of {}", meta.gap, meta.gap.empty() ? "" : "; ",
                         first, last, file.filename().string());
  auto to = NewSurgery::create(out, meta);
  if (!to) return tl::unexpected(to.error());
  const auto in_range = [&](std::uint64_t sequence) {
    return sequence >= first && sequence <= last;
  };
  const Keep keep = [&](const io::SurgeryRecord& record) -> Result<bool> {
    // A decision has the sequence of the observation that it is about.
    if (record.kind != io::RecordKind::kUpdate) return in_range(record.sequence);
    const auto message = wire::decode_update(record.payload);
    if (!message) {
      return io::unreadable(file,
                            fmt::format("update {}: {}", record.sequence, message.error().message));
    }
    return in_range(message->update.observation_sequence);
  };
  auto copied = copy(*from, keep, *to);
  if (!copied) return copied;
  if (copied->broken) return tl::unexpected(*copied->broken);
  if (copied->kept == 0) {
    return io::file_error(ErrorCode::kEmptySet, file,
                          fmt::format("no observation from {} to {}", first, last));
  }
  if (Status ok = to->commit(); !ok) return tl::unexpected(ok.error());
  return copied;
}

}  // namespace brainshift::client
