// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/journal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "common/core/guarded.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;

// Nothing happens by itself before the first session; any far time will do.
constexpr std::chrono::hours kIdle{1};
// That are tried when others take them.
constexpr int kNames = 16;

// A sink that throws ends its file, not the thread.
template <typename Function>
auto writing(Function&& function) {
  return guarded(ErrorCode::kWriteFailed, "journal", std::forward<Function>(function));
}

// Of the disk that holds the folder; nullopt when it cannot be told.
std::optional<std::uintmax_t> free_bytes(const fs::path& folder) {
  std::error_code failed;
  const fs::space_info space = fs::space(folder, failed);
  if (failed) return std::nullopt;
  return space.available;
}

std::string sequences(const SequenceRange& range) {
  return range.first == range.last ? fmt::format("{}", range.first)
                                   : fmt::format("{} to {}", range.first, range.last);
}

}  // namespace

RecordRanges Journal::Group::ranges() const {
  RecordRanges ranges;
  for (std::size_t i = 0; i < records.size(); ++i) {
    ranges.add(records[i].kind, sources[i], records[i].sequence);
  }
  return ranges;
}

Journal::Journal(Options options)
    : options_(std::move(options)),
      next_check_(Clock::now() + kIdle),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Journal::~Journal() { stop(); }

void Journal::begin(const fs::path& path, const JournalMeta& meta, std::uint64_t session_id) {
  {
    const std::lock_guard lock(mutex_);
    phase_ = Phase::kRecording;
    error_.reset();
    overrun_ = exhausted_ = false;
    session_bytes_ = 0;
    gap_ = {};
    recorded_ = {};
    recorded_.session_id = session_id;
    recorded_.reason = "the file is being opened";
    Item item;
    item.opening = Opening{path, meta, ++generation_};
    queue_.push_back(std::move(item));
    ++openings_;
  }
  wake_.notify_all();
}

void Journal::append(io::SurgeryRecord record, std::string source) {
  if (record.recorded_ns == 0) {
    record.recorded_ns = Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
  }
  bool wake = false;
  {
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kIdle) return;
    const bool over = session_bytes_ + record.payload.size() > options_.max_session_bytes;
    const bool full = queue_.size() >= options_.max_queued ||
                      queued_bytes_ + record.payload.size() > options_.max_queued_bytes;
    if ((full || over) && phase_ != Phase::kFailed) {
      phase_ = Phase::kFailed;
      error_ = Error{
          ErrorCode::kWriteFailed,
          over
              ? fmt::format("journal: the session has {} MiB, its limit", session_bytes_ >> 20)
              : fmt::format("journal: storage is too slow, {} records are waiting", queue_.size())};
      exhausted_ = over;
      overrun_ = true;
      recorded_.recording = false;
      recorded_.reason = error_->message;
      wake = true;
    }
    if (phase_ == Phase::kFailed) {
      gap_.add(record.kind, source, record.sequence);
      recorded_.missing.add(record.kind, source, record.sequence);
    } else {
      // The thread waits for the first record, then for the time to be up or for half a queue.
      wake = queue_.empty() || queue_.size() == options_.max_queued / 2;
      queued_bytes_ += record.payload.size();
      session_bytes_ += record.payload.size();
      queue_.push_back(Item{std::nullopt, std::move(record), std::move(source)});
    }
  }
  if (wake) wake_.notify_all();
}

Status Journal::status() const {
  const std::lock_guard lock(mutex_);
  if (error_) return tl::unexpected(*error_);
  return {};
}

Recorded Journal::recorded() const {
  const std::lock_guard lock(mutex_);
  return recorded_;
}

void Journal::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  wake_.notify_all();
  thread_.join();
}

void Journal::work(const std::stop_token& stop) {
  Group group;
  std::optional<Opening> opening;
  for (bool going = true; going;) {
    const Status done = writing([&]() -> Status {
      going = take(stop, group, opening);
      if (!going) return {};
      if (opening) begin_file(*opening);
      if (!group.records.empty()) write(std::move(group));
      supervise();
      return {};
    });
    if (!done) interrupt(done.error(), std::move(group), std::move(opening));
  }
  (void)writing([&]() -> Status {
    lose(unwritten_.ranges());
    end_session();
    return {};
  });
}

// What was to be done failed without a sink's fault, for want of memory: as if the storage had
// failed, so that recording goes on in a new file. What was taken from the queue is tried there.
void Journal::interrupt(const Error& error, Group group, std::optional<Opening> opening) {
  if (opening) current_ = std::move(*opening);
  if (!group.records.empty()) unwritten_ = std::move(group);
  (void)writing([&]() -> Status {
    end_file(error, false);
    return {};
  });
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, options_.commit_interval, [] { return false; });
}

bool Journal::take(const std::stop_token& stop, Group& group, std::optional<Opening>& opening) {
  group = {};
  opening.reset();
  std::unique_lock lock(mutex_);
  wake_.wait_until(lock, stop, next_check_, [&] { return !queue_.empty() || overrun_; });
  if (queue_.empty()) return !stop.stop_requested();
  if (openings_ == 0) {
    wake_.wait_until(lock, stop, Clock::now() + options_.commit_interval, [&] {
      return openings_ > 0 || overrun_ || queue_.size() > options_.max_queued / 2;
    });
  }
  // A session in front of another one, without a record: nothing is to be written of it.
  while (queue_.size() > 1 && queue_[0].opening && queue_[1].opening) {
    queue_.pop_front();
    --openings_;
  }
  if (queue_.front().opening) {
    opening = std::move(queue_.front().opening);
    queue_.pop_front();
    --openings_;
    return true;
  }
  // What follows throws nothing: no record is lost between queue and group.
  group.records.reserve(queue_.size());
  group.sources.reserve(queue_.size());
  while (!queue_.empty() && !queue_.front().opening) {
    Item& item = queue_.front();
    queued_bytes_ -= item.record.payload.size();
    group.records.push_back(std::move(item.record));
    group.sources.push_back(std::move(item.source));
    queue_.pop_front();
  }
  return true;
}

// A file in which nothing was observed tells nobody anything, and starts alone must not fill the
// folder. One that goes on after a failure stays: its meta says what is missing.
void Journal::end_session() {
  const bool empty = sink_ && contents_.empty() && path_ == current_.path &&
                     writing([&] { return sink_->check(); }).has_value();
  close_sink();
  if (empty) io::discard_surgery(path_);
}

// Another daemon may have taken the name since it was found free: then the next one.
Result<std::unique_ptr<RecordSink>> Journal::open_file(fs::path& path, const JournalMeta& meta) {
  for (int tries = 1;; ++tries) {
    auto sink = writing([&] { return options_.open(path, meta); });
    if (sink || tries == kNames || free_path(path) == path) return sink;
    path = free_path(path);
  }
}

void Journal::begin_file(const Opening& opening) {
  end_session();
  unwritten_ = {};
  contents_ = {};
  current_ = opening;
  path_.clear();
  fs::path path = opening.path;
  auto sink = open_file(path, opening.meta);
  if (!sink) {
    end_file(sink.error(), false);
    next_check_ = Clock::now() + options_.retry_interval;
    return;
  }
  sink_ = std::move(*sink);
  current_.path = path_ = path;
  next_check_ = Clock::now() + options_.check_interval;
  {
    const std::lock_guard lock(mutex_);
    if (current_.generation != generation_) return;
    recorded_.file = path_;
    recorded_.recording = phase_ == Phase::kRecording;
    if (recorded_.recording) recorded_.reason.clear();
  }
  tell_recorded();
}

void Journal::write(Group group) {
  if (!sink_) return lose(group.ranges());
  const Status status = commit(group);
  if (status) return tell_recorded();
  const Status in_place = writing([&] { return sink_->check(); });
  unwritten_ = std::move(group);
  end_file(in_place ? status.error() : in_place.error(), !in_place);
}

Status Journal::commit(const Group& group) {
  if (Status ok = writing([&] { return sink_->append(group.records); }); !ok) return ok;
  // A commit to a file that nobody will find again is none.
  if (Status ok = writing([&] { return sink_->check(); }); !ok) return ok;
  next_check_ = Clock::now() + options_.check_interval;
  const RecordRanges ranges = group.ranges();
  contents_.add(ranges);
  const std::lock_guard lock(mutex_);
  if (current_.generation == generation_) {
    recorded_.records += group.records.size();
    recorded_.held.add(ranges);
  }
  return {};
}

// What is due besides writing: a failure that append() has found, the file's place, the next try.
void Journal::supervise() {
  std::optional<Error> overrun;
  {
    const std::lock_guard lock(mutex_);
    // What was queued before it is written first.
    if (overrun_ && queue_.empty() && current_.generation == generation_) {
      overrun = error_;
      overrun_ = false;
    }
  }
  if (overrun) {
    end_file(*overrun, false);
    next_check_ = Clock::now() + options_.retry_interval;
    return;
  }
  if (current_.generation == 0) {
    next_check_ = Clock::now() + kIdle;
    return;
  }
  if (Clock::now() < next_check_) return;
  if (sink_) {
    next_check_ = Clock::now() + options_.check_interval;
    if (Status ok = writing([&] { return sink_->check(); }); !ok) end_file(ok.error(), true);
  }
  if (!sink_) resume();
}

void Journal::resume() {
  next_check_ = Clock::now() + options_.retry_interval;
  fs::path path = free_path(current_.path, path_);
  const auto available = free_bytes(path.parent_path());
  const bool scarce = available && *available < options_.resume_free_bytes;
  Opening next = current_;
  {
    const std::lock_guard lock(mutex_);
    if (current_.generation != generation_ || phase_ != Phase::kFailed || exhausted_) return;
    if (!scarce) phase_ = Phase::kResuming;
    next.meta.continues = path_.filename().string();
    next.meta.gap = fmt::format("{}; not recorded: {}", error_->message, describe(gap_));
  }
  auto sink = scarce ? fail(ErrorCode::kWriteFailed, "no space") : open_file(path, next.meta);
  if (sink) {
    sink_ = std::move(*sink);
    contents_ = {};
    if (unwritten_.records.empty() || commit(unwritten_)) {
      unwritten_ = {};
      path_ = path;
      next_check_ = Clock::now() + options_.check_interval;
      {
        const std::lock_guard lock(mutex_);
        if (current_.generation != generation_) return;
        if (phase_ == Phase::kResuming) {  // no overrun meanwhile
          phase_ = Phase::kRecording;
          error_.reset();
          gap_ = {};
          recorded_.recording = true;
          recorded_.reason.clear();
        }
        recorded_.file = path_;
      }
      if (options_.on_resumed) options_.on_resumed(path_);
      tell_recorded();
      return;
    }
    close_sink();
    io::discard_surgery(path);
  }
  lose(unwritten_.ranges());
  unwritten_ = {};
  const std::lock_guard lock(mutex_);
  if (current_.generation == generation_) phase_ = Phase::kFailed;
}

// The file ends with the last record before the failure. contents_lost: nobody will find it again.
void Journal::end_file(const Error& error, bool contents_lost) {
  {
    const std::lock_guard lock(mutex_);
    if (current_.generation == generation_) {
      phase_ = Phase::kFailed;
      overrun_ = false;
      recorded_.recording = false;
      error_ = error;
      recorded_.reason = error.message;
    }
  }
  if (contents_lost) lose(contents_);
  contents_ = {};
  close_sink();
  next_check_ = Clock::now();
  if (options_.on_error) options_.on_error(error);
  tell_recorded();
}

void Journal::close_sink() {
  if (!sink_) return;
  const auto status = writing([&] { return sink_->close(); });
  sink_.reset();
  std::optional<Error> told;
  {
    const std::lock_guard lock(mutex_);
    if (status || error_) return;  // the failure before this one is what matters
    told = status.error();
    if (current_.generation == generation_) error_ = told;
  }
  if (options_.on_error) options_.on_error(*told);
}

void Journal::lose(const RecordRanges& ranges) {
  const std::lock_guard lock(mutex_);
  if (current_.generation != generation_) return;
  gap_.add(ranges);
  recorded_.missing.add(ranges);
}

void Journal::tell_recorded() {
  if (options_.on_recorded) options_.on_recorded(recorded());
}

// ---------- what a set of records holds ----------

void SequenceRange::add(const SequenceRange& other) {
  if (other.count == 0) return;
  first = count == 0 ? other.first : std::min(first, other.first);
  last = count == 0 ? other.last : std::max(last, other.last);
  count += other.count;
}

void RecordRanges::add(io::RecordKind kind, const std::string& source, std::uint64_t sequence) {
  const SequenceRange one{sequence, sequence, 1};
  if (kind == io::RecordKind::kObservation) observations[source].add(one);
  if (kind == io::RecordKind::kUpdate) updates.add(one);
}

void RecordRanges::add(const RecordRanges& other) {
  for (const auto& [source, range] : other.observations) observations[source].add(range);
  updates.add(other.updates);
}

std::string describe(const RecordRanges& ranges) {
  std::string text;
  const auto append = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const auto& [source, range] : ranges.observations) {
    append(fmt::format("observations {} of {} ({})", sequences(range), source, range.count));
  }
  if (ranges.updates.count > 0) {
    append(fmt::format("updates {} ({})", sequences(ranges.updates), ranges.updates.count));
  }
  return text.empty() ? "nothing" : text;
}

}  // namespace brainshift::server
