// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/site.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/tools/view/page_files.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tumour_motion.hpp"

namespace brainshift::client {
namespace {

using Json = nlohmann::ordered_json;

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json json_of(const HistoryPoint& point) {
  return {{"update", point.update},
          {"quality", point.quality},
          {"motion_mm", number_json(point.motion_mm)},
          {"motion_sd", number_json(point.motion_sd)},
          {"misfit_mm", number_json(point.misfit_mm)},
          {"latency_ms", number_json(point.latency_ms)},
          {"late", point.late}};
}

Json json_of(const FieldGrid& grid) {
  return {{"dims", grid.dims},
          {"origin_mm", {grid.origin_mm[0], grid.origin_mm[1], grid.origin_mm[2]}},
          {"spacing_mm", grid.spacing_mm}};
}

// Hundredths of a millimetre are enough for a picture.
Json json_of(const TriangleSurface& surface) {
  Json vertices = Json::array();
  for (const double mm : surface.vertices.reshaped())
    vertices.push_back(std::round(100.0 * mm) / 100.0);
  const auto& triangles = surface.triangles;
  return {{"vertices", std::move(vertices)},
          {"triangles", std::vector<int>(triangles.data(), triangles.data() + triangles.size())}};
}

constexpr const char* kJsonType = "application/json";
constexpr const char* kBytesType = "application/octet-stream";

std::shared_ptr<const std::string> shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

HistoryPoint history_point(const UpdateMessage& message, const std::vector<NodeIndex>& tumour) {
  const Update& update = message.update;
  const Estimate& estimate = update.estimate;
  HistoryPoint point;
  point.update = update.sequence;
  point.latency_ms = update.answer_time.ms > 0.0 ? update.answer_time.ms : kNoNumber;
  point.late = update.answer_time.late();
  point.quality = message.error ? "failed" : std::string(to_string(estimate.quality.quality));
  if (message.error || !update.usable()) return point;
  point.misfit_mm = estimate.misfit_mm.mean;
  const auto motion = geometry::tumour_motion(update, tumour);
  if (motion) point.motion_mm = motion->mm;
  if (motion) point.motion_sd = motion->sd_mm.value_or(kNoNumber);
  return point;
}

std::string to_json(const PageState& state, double clock_ms) {
  Json sources = Json::array(), left_out = Json::array();
  for (const SourceLine& source : state.sources) {
    sources.push_back({{"name", source.name},
                       {"per_s", number_json(source.per_s)},
                       {"age_s", number_json(source.age_s)},
                       {"dropped", source.dropped},
                       {"data", source.data},
                       {"outliers", source.outliers},
                       {"contradicts", source.contradicts}});
  }
  for (const Omission& each : state.left_out) {
    left_out.push_back(
        {{"part", each.part}, {"reason", each.reason}, {"error", each.estimated_error}});
  }
  return line_of({{"clock_ms", clock_ms},
                  {"endpoint", state.endpoint},
                  {"model_id", state.model_id},
                  {"case_id", state.case_id},
                  {"currency", to_string(state.status.currency)},
                  {"reason", state.status.reason},
                  {"age_s", number_json(state.status.age_s)},
                  {"recorded", state.status.recorded},
                  {"session", state.session},
                  {"field", state.field},
                  {"method", state.method},
                  {"boundary", state.boundary},
                  {"quality", state.quality},
                  {"quality_reason", state.quality_reason},
                  {"newest_failure", state.newest_failure},
                  {"grid_error_mm", number_json(state.grid_error_mm)},
                  {"shown", state.shown ? json_of(*state.shown) : Json(nullptr)},
                  {"sources", sources},
                  {"left_out", left_out},
                  {"history", state.history},
                  {"advises", state.advises}});
}

std::string to_json(const std::deque<HistoryPoint>& points) {
  Json all = Json::array();
  for (const HistoryPoint& point : points) all.push_back(json_of(point));
  return line_of(all);
}

std::string to_json(const BrainModel& model, const FieldGrid& field,
                    const std::optional<FieldGrid>& mri) {
  const Points &vertices = model.tumour.vertices, &nodes = model.mesh.nodes;
  const Vec3 centre =
      vertices.cols() > 0 ? Vec3(vertices.rowwise().mean()) : Vec3(nodes.rowwise().mean());
  return line_of({{"model_id", model.model_id},
                  {"case_id", model.case_id},
                  {"centre_mm", {centre[0], centre[1], centre[2]}},
                  {"tumour", json_of(model.tumour)},
                  {"brain", json_of(geometry::surface_of(nodes, model.boundary_triangles))},
                  {"septa", json_of(geometry::surface_of(nodes, model.septa.triangles))},
                  {"ventricles", json_of(geometry::surface_of(nodes, model.ventricle_wall))},
                  {"field", json_of(field)},
                  {"mri", mri ? json_of(*mri) : Json(nullptr)}});
}

void Site::show_model(const std::string& model_id, std::string json, std::string inside,
                      std::optional<std::string> mri) {
  const std::lock_guard lock(mutex_);
  model_id_ = model_id;
  model_ = shared(std::move(json));
  inside_ = shared(std::move(inside));
  mri_ = mri ? shared(std::move(*mri)) : nullptr;
  field_ = history_ = advice_ = nullptr;
}

void Site::show_field(const std::string& of, std::string bytes) {
  const std::lock_guard lock(mutex_);
  field_of_ = of;
  field_ = shared(std::move(bytes));
}

void Site::show_history(const std::string& session, std::string json) {
  const std::lock_guard lock(mutex_);
  history_of_ = session;
  history_ = shared(std::move(json));
}

void Site::show_advice(std::string json) {
  const std::lock_guard lock(mutex_);
  advice_ = shared(std::move(json));
}

void Site::on_advice_asked(std::function<void()> asked) { advice_asked_ = std::move(asked); }

void Site::publish(std::string state) {
  {
    const std::lock_guard lock(mutex_);
    ++event_.number;
    event_.data = std::move(state);
  }
  changed_.notify_all();
}

std::optional<HttpAnswer> Site::get(std::string_view path) const {
  const auto page = [](const char* type, std::string_view text) {
    return HttpAnswer{type, shared(std::string(text)), ""};
  };
  if (path == "/") return page("text/html; charset=utf-8", kPageHtml);
  if (path == "/page.css") return page("text/css; charset=utf-8", kPageStyle);
  if (path == "/page.js") return page("text/javascript; charset=utf-8", kPageScript);
  if (path == "/surface.js") return page("text/javascript; charset=utf-8", kSurfaceScript);
  if (path == "/advice" && advice_asked_) advice_asked_();
  const std::lock_guard lock(mutex_);
  const auto held = [](const char* type, const Body& body,
                       const std::string& of) -> std::optional<HttpAnswer> {
    if (!body) return std::nullopt;
    return HttpAnswer{type, body, of};
  };
  if (path == "/model") return held(kJsonType, model_, model_id_);
  if (path == "/inside") return held(kBytesType, inside_, model_id_);
  if (path == "/mri") return held(kBytesType, mri_, model_id_);
  if (path == "/field") return held(kBytesType, field_, field_of_);
  if (path == "/history") return held(kJsonType, history_, history_of_);
  if (path == "/advice" && advice_asked_) {
    return HttpAnswer{kJsonType, advice_ ? advice_ : shared("{}"), ""};
  }
  return std::nullopt;
}

std::optional<HttpEvent> Site::wait(std::uint64_t after, std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, most, [&] { return event_.number > after; })) return std::nullopt;
  return event_;
}

HttpSource Site::source() {
  return {
      [this](std::string_view path) { return get(path); },
      [this](std::uint64_t after, std::chrono::milliseconds most) { return wait(after, most); }};
}

}  // namespace brainshift::client
