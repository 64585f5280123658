// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/bridge_line.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

using nlohmann::ordered_json;

std::string line_text(const ordered_json& object) {
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

std::string shown_line(const ShownLine& line, bool json) {
  const ShownState& state = line.state;
  if (json) {
    ordered_json object = {{"event", "update"}};
    object.update(ordered_json::parse(to_json(state)));
    object["dims"] = line.dims;
    object["made_ms"] = line.made_ms;
    object["clients"] = line.clients;
    object["replaced"] = line.replaced;
    return line_text(object);
  }
  std::string text = fmt::format("update {}", state.sequence);
  if (std::isfinite(state.age_ms)) {
    text += fmt::format("  age {:.2f} s", 1e-3 * state.age_ms);
  } else {
    text += "  age unknown";
  }
  text += fmt::format("  {}, {}  {} x {} x {} voxels, {:g} mm, error {:.2f} mm  {:.1f} ms",
                      state.quality, to_string(state.currency), line.dims[0], line.dims[1],
                      line.dims[2], state.spacing_mm, state.grid_error_mm, line.made_ms);
  text += fmt::format("  {} client{}", line.clients, line.clients == 1 ? "" : "s");
  if (line.replaced > 0) text += fmt::format(", {} replaced", line.replaced);
  return text;
}

std::string note_line(const std::string& sentence, bool json) {
  if (!json) return sentence;
  return line_text({{"event", "note"}, {"text", sentence}});
}

}  // namespace brainshift::client
