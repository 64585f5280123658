// SPDX-License-Identifier: GPL-3.0-or-later
// PageAdvice: where to measure next, for the page (client/tools/advise/advise.hpp).
//
// It plays the observations of the shown field again, from the daemon's journal, on a thread that
// runs only when the processor has nothing else to do (SCHED_IDLE): the daemon never waits. Nothing
// is read or computed unless a page has asked within kAsked; the model is let go kKept after the
// last question.
#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "client/tools/advise/advise.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::client {

// The field on the page.
struct ShownField {
  std::string name;  // boot.session.update
  SessionKey session;
  Boundary boundary = Boundary::kContact;
  std::map<std::string, std::uint64_t> used;  // sequence of the observation, by source
};

class PageAdvice {
 public:
  static constexpr std::chrono::seconds kAsked{3}, kKept{120};

  // model: the model file; journals: the daemon's journal_dir. told: on the thread, with one JSON
  // object of one line: {"of": ShownField::name, "target", "before_mm", "candidates": [{"name",
  // "kind", "sd_mm", "less_mm", "where_mm"}]}, best first, those that cannot be used left out; or
  // {"of", "reason"}.
  PageAdvice(std::filesystem::path model, std::filesystem::path journals,
             std::function<void(std::string)> told);
  ~PageAdvice();  // ends a computation that is under way

  void show(ShownField field);
  void show_nothing();
  void ask();  // a page wants to know; from any thread

 private:
  void run(const std::stop_token& stop);
  Result<Advised> compute(const ShownField& field, const std::stop_token& stop);
  // The newest journal in the folder.
  Result<std::filesystem::path> journal() const;

  const std::filesystem::path model_, journals_;
  const std::function<void(std::string)> told_;
  std::optional<Adviser> adviser_;  // of boundary_; the thread's alone
  Boundary boundary_ = Boundary::kContact;

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<ShownField> shown_;
  std::string answered_;  // ShownField::name
  std::chrono::steady_clock::time_point asked_, tried_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace brainshift::client
