// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/journal.hpp"

#include <fmt/format.h>

#include <cctype>
#include <system_error>
#include <utility>

#include "common/core/guarded.hpp"

namespace brainshift::server {
namespace {

class SurgeryFileSink final : public RecordSink {
 public:
  explicit SurgeryFileSink(io::SurgeryFile file) : file_(std::move(file)) {}
  Status append(const io::SurgeryRecord& record) override { return file_.append(record); }
  Status close() override { return file_.close(); }

 private:
  io::SurgeryFile file_;
};

// A sink that throws ends its file, not the thread.
template <typename Function>
auto writing(Function&& function) {
  return guarded(ErrorCode::kWriteFailed, "journal", std::forward<Function>(function));
}

}  // namespace

Result<std::unique_ptr<RecordSink>> open_surgery_file(const std::filesystem::path& path,
                                                      const JournalMeta& meta) {
  auto file = io::SurgeryFile::create(path, meta);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<SurgeryFileSink>(std::move(*file));
}

std::filesystem::path journal_path(const std::filesystem::path& folder, const std::string& case_id,
                                   const std::string& session) {
  std::string name = case_id;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
  }
  std::filesystem::path path = folder / fmt::format("{}-{}.surgery", name, session);
  std::error_code ignored;
  for (int attempt = 2; std::filesystem::exists(path, ignored); ++attempt) {
    path = folder / fmt::format("{}-{}-{}.surgery", name, session, attempt);
  }
  return path;
}

Journal::Journal(Options options)
    : options_(std::move(options)), thread_([this](const std::stop_token& stop) { work(stop); }) {}

Journal::~Journal() { stop(); }

void Journal::begin(const std::filesystem::path& path, const JournalMeta& meta) {
  {
    const std::lock_guard lock(mutex_);
    error_.reset();
    Item item;
    item.opening = Opening{path, meta, ++generation_};
    queue_.push_back(std::move(item));
  }
  wake_.notify_all();
}

void Journal::append(io::SurgeryRecord record) {
  std::optional<Error> overrun;
  {
    const std::lock_guard lock(mutex_);
    if (generation_ == 0 || error_) return;
    if (queue_.size() >= options_.max_queued ||
        queued_bytes_ + record.payload.size() > options_.max_queued_bytes) {
      overrun =
          Error{ErrorCode::kWriteFailed,
                fmt::format("journal: storage is too slow, {} records are waiting", queue_.size())};
      error_ = overrun;
    } else {
      queued_bytes_ += record.payload.size();
      queue_.push_back(Item{std::nullopt, std::move(record)});
    }
  }
  if (overrun) {
    if (options_.on_error) options_.on_error(*overrun);
    return;
  }
  wake_.notify_all();
}

Status Journal::status() const {
  const std::lock_guard lock(mutex_);
  if (error_) return tl::unexpected(*error_);
  return {};
}

void Journal::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  wake_.notify_all();
  thread_.join();
}

void Journal::work(const std::stop_token& stop) {
  while (true) {
    Item item;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, stop, [&] { return !queue_.empty(); });
      if (queue_.empty()) break;  // asked to stop, and everything is written
      item = std::move(queue_.front());
      queue_.pop_front();
      queued_bytes_ -= item.record.payload.size();
    }
    write(std::move(item));
  }
  close_sink();
}

void Journal::write(Item item) {
  if (item.opening) {
    close_sink();
    writing_generation_ = item.opening->generation;
    auto sink = writing([&] { return options_.open(item.opening->path, item.opening->meta); });
    if (sink) {
      sink_ = std::move(*sink);
    } else {
      set_error(writing_generation_, sink.error());
    }
    return;
  }
  if (!sink_) return;  // this file has failed already
  const auto status = writing([&] { return sink_->append(item.record); });
  if (status) return;
  set_error(writing_generation_, status.error());
  // A gap in a journal is worse than its end: the file ends with the last record before the
  // failure.
  static_cast<void>(writing([&] { return sink_->close(); }));
  sink_.reset();
}

void Journal::close_sink() {
  if (!sink_) return;
  const auto status = writing([&] { return sink_->close(); });
  sink_.reset();
  if (!status) set_error(writing_generation_, status.error());
}

void Journal::set_error(std::uint64_t generation, const Error& error) {
  {
    const std::lock_guard lock(mutex_);
    if (generation == generation_ && !error_) error_ = error;
  }
  if (options_.on_error) options_.on_error(error);
}

}  // namespace brainshift::server
