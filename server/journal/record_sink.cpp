// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/record_sink.hpp"

#include <fmt/format.h>

#include <cctype>
#include <system_error>
#include <utility>

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;

class SurgeryFileSink final : public RecordSink {
 public:
  explicit SurgeryFileSink(io::SurgeryFile file) : file_(std::move(file)) {}
  Status append(std::span<const io::SurgeryRecord> records) override {
    if (Status ok = check(); !ok) return ok;
    return file_.append(records);
  }
  Status check() override {
    if (file_.in_place()) return {};
    return fail(ErrorCode::kWriteFailed,
                file_.path().string() + ": was deleted, replaced or cut while it was recorded");
  }
  Status close() override { return file_.close(); }

 private:
  io::SurgeryFile file_;
};

bool is_free(const fs::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;
    if (fs::exists(fs::symlink_status(fs::path(path) += suffix, ignored))) return false;
  }
  return true;
}

}  // namespace

Result<std::unique_ptr<RecordSink>> open_surgery_file(const fs::path& path,
                                                      const JournalMeta& meta) {
  auto file = io::SurgeryFile::create(path, meta);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<SurgeryFileSink>(std::move(*file));
}

fs::path free_path(const fs::path& path, const fs::path& but_not) {
  fs::path candidate = path;
  for (int number = 2; candidate == but_not || !is_free(candidate); ++number) {
    candidate = path;
    candidate.replace_filename(
        fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string()));
  }
  return candidate;
}

fs::path journal_path(const fs::path& folder, const std::string& case_id,
                      const std::string& session) {
  std::string name = case_id;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
  }
  return free_path(folder / fmt::format("{}-{}.surgery", name, session));
}

}  // namespace brainshift::server
