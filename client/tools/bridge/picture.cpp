// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/tools/journal/journal_export.hpp"

namespace brainshift::client {
namespace {

using nlohmann::ordered_json;

std::string text_of(const ordered_json& value) {
  return value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ordered_json to_object(const ShownState& state) {
  ordered_json object = {{"sequence", state.sequence},
                         {"session_id", state.session_id},
                         {"model_id", state.model_id},
                         {"case_id", state.case_id},
                         {"quality", state.quality},
                         {"flags", state.flags},
                         {"currency", to_string(state.currency)},
                         {"reason", state.reason},
                         {"age_ms", nullptr},
                         {"direction", "modeling"},
                         {"recorded", state.recorded},
                         {"method", state.method},
                         {"boundary", state.boundary},
                         {"blank", state.blank},
                         {"has_sd", state.has_sd},
                         {"has_known", state.has_known},
                         {"grid_error_mm", state.grid_error_mm},
                         {"spacing_mm", state.spacing_mm},
                         {"fade_mm", state.fade_mm}};
  if (std::isfinite(state.age_ms)) object["age_ms"] = std::round(state.age_ms);
  return object;
}

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace

std::string flag_names(const Update& update) {
  std::string names = flags_text(update.estimate.quality);
  if (update.answer_time.late()) names += names.empty() ? "late" : "+late";
  return names;
}

std::string to_json(const ShownState& state) { return text_of(to_object(state)); }

igtl::Metadata to_metadata(const ShownState& state) {
  igtl::Metadata metadata;
  const ordered_json object = to_object(state);  // must outlive items()
  for (const auto& [key, value] : object.items()) {
    std::string text = "unknown";
    if (value.is_string()) {
      // By way of JSON, which replaces bytes that are no UTF-8.
      text = nlohmann::json::parse(text_of(value)).get<std::string>();
    } else if (!value.is_null()) {
      text = text_of(value);
    }
    const std::uint16_t encoding = is_ascii(text) ? igtl::kUsAscii : igtl::kUtf8;
    metadata.push_back({key, std::move(text), encoding});
  }
  return metadata;
}

igtl::StatusReport to_status(const ShownState& state) {
  igtl::StatusReport report;
  if (state.usable()) {
    if (state.quality == "caution") report.text = "caution: " + state.flags;
    return report;
  }
  report.code = igtl::kStatusNotReady;
  report.error_name = "NotReady";
  report.text = state.reason.empty() ? "no current field" : state.reason;
  if (state.recorded) {
    report.text = "RECORDED, not the patient now" +
                  (state.reason.empty() ? std::string() : ": " + state.reason);
  }
  std::erase(report.text, '\0');
  return report;
}

igtl::Timestamp time_now() {
  return igtl::to_timestamp(std::chrono::system_clock::now().time_since_epoch());
}

PicturePtr blank_picture(const std::shared_ptr<const Rest>& rest, ShownState state) {
  state.blank = true;
  state.has_sd = state.has_known = false;
  state.sequence = 0;
  state.grid_error_mm = 0.0;
  auto picture = std::make_shared<Picture>();
  picture->state = std::move(state);
  picture->time = time_now();
  picture->rest = rest;
  return picture;
}

std::string shown_line(const ShownLine& line, bool json) {
  const ShownState& state = line.state;
  if (json) {
    ordered_json object = {{"event", "update"}};
    object.update(ordered_json::parse(to_json(state)));
    object["dims"] = line.dims;
    object["made_ms"] = line.made_ms;
    object["clients"] = line.clients;
    object["replaced"] = line.replaced;
    return text_of(object);
  }
  std::string text = fmt::format("update {}", state.sequence);
  text += std::isfinite(state.age_ms) ? fmt::format("  age {:.2f} s", 1e-3 * state.age_ms)
                                      : "  age unknown";
  text +=
      fmt::format("  {}{}, {}, {}, {}  {} x {} x {} voxels, {:g} mm, error {:.2f} mm  {:.1f} ms",
                  state.recorded ? "RECORDED, " : "", state.method, state.boundary, state.quality,
                  to_string(state.currency), line.dims[0], line.dims[1], line.dims[2],
                  state.spacing_mm, state.grid_error_mm, line.made_ms);
  text += fmt::format("  {} client{}", line.clients, line.clients == 1 ? "" : "s");
  if (line.replaced > 0) text += fmt::format(", {} replaced", line.replaced);
  return text;
}

std::string note_line(const std::string& sentence, bool json) {
  if (!json) return sentence;
  return text_of({{"event", "note"}, {"text", sentence}});
}

}  // namespace brainshift::client
