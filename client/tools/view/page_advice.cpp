// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/page_advice.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <system_error>
#include <tuple>
#include <utility>

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string one_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string answer_of(const std::string& of, const Result<Advised>& advised) {
  if (!advised) return one_line({{"of", of}, {"reason", advised.error().message}});
  auto candidates = nlohmann::ordered_json::array();
  for (const advice::Advice& one : advised->advice) {
    if (!one.reason.empty()) continue;
    const Vec3 at = one.candidate.centre();
    candidates.push_back({{"name", one.candidate.name},
                          {"kind", to_string(one.candidate.kind)},
                          {"sd_mm", one.after_mm},
                          {"less_mm", one.reduction_mm()},
                          {"where_mm", {at[0], at[1], at[2]}}});
  }
  return one_line({{"of", of},
                   {"target", advised->target.name},
                   {"before_mm", advised->advice.front().before_mm},
                   {"candidates", std::move(candidates)}});
}

}  // namespace

PageAdvice::PageAdvice(fs::path model, fs::path journals, std::function<void(std::string)> told)
    : model_(std::move(model)),
      journals_(std::move(journals)),
      told_(std::move(told)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

PageAdvice::~PageAdvice() = default;

void PageAdvice::show(ShownField field) {
  {
    const std::lock_guard lock(mutex_);
    shown_ = std::move(field);
  }
  changed_.notify_all();
}

void PageAdvice::show_nothing() {
  const std::lock_guard lock(mutex_);
  shown_.reset();
}

void PageAdvice::ask() {
  {
    const std::lock_guard lock(mutex_);
    asked_ = Clock::now();
  }
  changed_.notify_all();
}

void PageAdvice::run(const std::stop_token& stop) {
  const sched_param none{};
  pthread_setschedparam(pthread_self(), SCHED_IDLE, &none);
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const bool wanted = changed_.wait_for(lock, stop, kKept, [&] {
      const bool asked = asked_ > tried_ && Clock::now() - asked_ < kAsked;
      return asked && shown_ && shown_->name != answered_;
    });
    if (!wanted) {
      if (Clock::now() - asked_ > kKept) adviser_.reset();
      continue;
    }
    const ShownField field = *shown_;
    tried_ = Clock::now();
    lock.unlock();
    const auto advised = compute(field, stop);
    if (!stop.stop_requested()) told_(answer_of(field.name, advised));
    lock.lock();
    // What the journal did not hold yet may be there at the next question.
    if (advised || advised.error().code != ErrorCode::kUnavailable) answered_ = field.name;
  }
}

Result<Advised> PageAdvice::compute(const ShownField& field, const std::stop_token& stop) try {
  const auto file = journal();
  if (!file) return tl::unexpected(file.error());
  if (!adviser_ || boundary_ != field.boundary) {
    adviser_.reset();
    auto opened = Adviser::open(
        {.model = model_, .boundary = field.boundary, .candidates = {}, .target_mm = {}});
    if (!opened) return tl::unexpected(opened.error());
    adviser_ = std::move(*opened);
    boundary_ = field.boundary;
  }
  return adviser_->now(*file, field.session, field.used, stop);
} catch (const std::exception& error) {
  adviser_.reset();
  return fail(ErrorCode::kInternal, error.what());
}

Result<fs::path> PageAdvice::journal() const {
  std::error_code error;
  fs::path newest;
  fs::file_time_type at;
  for (fs::directory_iterator entry(journals_, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() != ".surgery") continue;
    // What is not yet folded into a running journal lies in the log beside it.
    std::error_code gone;
    auto time = entry->last_write_time(gone);
    if (gone) continue;
    const auto log = fs::last_write_time(fs::path(entry->path()) += "-wal", gone);
    if (!gone) time = std::max(time, log);
    if (newest.empty() || time > at) std::tie(newest, at) = std::pair(entry->path(), time);
  }
  if (error) return fail(ErrorCode::kNotFound, journals_.string() + ": " + error.message());
  if (newest.empty()) {
    return fail(ErrorCode::kNotFound, journals_.string() + " holds no journal");
  }
  return newest;
}

}  // namespace brainshift::client
