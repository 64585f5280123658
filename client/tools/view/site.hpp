// SPDX-License-Identifier: GPL-3.0-or-later
// Site: what browsers are shown, as one thread publishes it and the server's threads hand it out.
// The header Of of an answer says what it belongs to.
//
//   /            the page; /page.css, /page.js, /surface.js
//   /events      a PageState per event, several a second for as long as the publisher lives
//   /model       JSON: model_id, case_id, surfaces of tumour and brain, grids of field and MRI;
//                Of: model_id
//   /inside      a byte per voxel of the field's grid: 1 in the brain; Of: model_id
//   /mri         GreyVolume::voxels, where an MRI was given; Of: model_id
//   /field       FieldVolume::Encoded, of the newest usable update alone; Of: PageState::field
//   /advice      JSON: what to measure next (page_advice.hpp), where there is a journal; asking for
//                it has it computed of the field that is shown, and it is empty until then
//   /history     JSON: an array of the session's updates, the newest last; Of: session
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/lib/field_status.hpp"
#include "client/tools/view/http_server.hpp"
#include "client/tools/view/volumes.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session.hpp"

namespace brainshift::client {

inline constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

// A final update as the strips show it; null in JSON where a number is NaN.
struct HistoryPoint {
  std::uint64_t update = 0;
  std::string quality;            // "failed" without a field
  double motion_mm = kNoNumber;   // mean displacement of the tumour's nodes
  double motion_sd = kNoNumber;   // mean of their sd_mm: per component, taken for one common error
  double misfit_mm = kNoNumber;   // mean over the data
  double latency_ms = kNoNumber;  // AnswerTime::ms
  bool late = false;
};
// tumour: nodes inside it. usable, unusable and failed ones; of no part.
HistoryPoint history_point(const UpdateMessage& message, const std::vector<NodeIndex>& tumour);

struct SourceLine {
  std::string name;
  double per_s = kNoNumber;    // observations that arrived, over the last seconds
  double age_s = kNoNumber;    // since the last one arrived
  std::uint64_t dropped = 0;   // replaced by a newer one, skipped or refused
  int data = 0, outliers = 0;  // of the shown update; 0: it has none of this source
  bool contradicts = false;    // SourceSummary::consistent is false
};

struct PageState {
  std::string endpoint;
  std::string model_id, case_id;  // of the page's model; empty: none yet
  FieldStatus status;
  std::string session;           // BOOT.SESSION; empty: none
  std::string field;             // BOOT.SESSION.UPDATE of the newest usable field; empty: none
  std::string method, boundary;  // of the session
  std::string quality, quality_reason;  // of that field; "none" without one
  std::string newest_failure;           // why the newest update gave no usable field; else empty
  double grid_error_mm = kNoNumber;
  std::optional<HistoryPoint> shown;  // of that field
  std::vector<SourceLine> sources;
  std::vector<Omission> left_out;
  std::uint64_t history = 0;  // counts the points of /history ever made
  bool advises = false;       // there is /advice
};
// One line. clock_ms: of the publisher, so that a page notices events that wait in a queue.
std::string to_json(const PageState& state, double clock_ms);
std::string to_json(const std::deque<HistoryPoint>& points);
std::string to_json(const BrainModel& model, const FieldGrid& field,
                    const std::optional<FieldGrid>& mri);

// Thread-safe.
class Site {
 public:
  // Replaces everything of another model.
  void show_model(const std::string& model_id, std::string json, std::string inside,
                  std::optional<std::string> mri);
  void show_field(const std::string& of, std::string bytes);
  void show_history(const std::string& session, std::string json);
  void show_advice(std::string json);
  void publish(std::string state);
  // Called on the server's threads whenever a page asks for /advice. Before source() is used.
  void on_advice_asked(std::function<void()> asked);

  // For a server that does not outlive this.
  HttpSource source();

 private:
  using Body = std::shared_ptr<const std::string>;
  std::optional<HttpAnswer> get(std::string_view path) const;
  std::optional<HttpEvent> wait(std::uint64_t after, std::chrono::milliseconds most);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::string model_id_, field_of_, history_of_;
  Body model_, inside_, mri_, field_, history_, advice_;
  std::function<void()> advice_asked_;
  HttpEvent event_;
};

}  // namespace brainshift::client
