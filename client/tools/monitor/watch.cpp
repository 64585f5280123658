// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/lib/client.hpp"
#include "common/core/text.hpp"

namespace brainshift::client {
namespace {

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> length_mm(std::string_view text) {
  constexpr std::string_view kUnit = "mm";
  if (!text.ends_with(kUnit)) return std::nullopt;
  return number(text.substr(0, text.size() - kUnit.size()));
}

std::optional<Vec3> place_mm(std::string_view text) {
  std::vector<double> entries;
  while (true) {
    const std::size_t comma = text.find(',');
    const auto entry = number(text.substr(0, comma));
    if (!entry) return std::nullopt;
    entries.push_back(*entry);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (entries.size() != 3) return std::nullopt;
  return Vec3(entries[0], entries[1], entries[2]);
}

std::optional<Region> region(std::string_view text) {
  if (text == "brain") return WholeBrain{};
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::string_view where = text.substr(0, colon);
  const auto reach_mm = length_mm(text.substr(colon + 1));
  if (!reach_mm) return std::nullopt;
  if (where == "tumour") return TumourRegion{*reach_mm};
  const auto centre_mm = place_mm(where);
  if (!centre_mm) return std::nullopt;
  return BallRegion{*centre_mm, *reach_mm};
}

tl::unexpected<Error> refuse(std::string_view option, std::string_view text,
                             std::string_view must_be) {
  return invalid(fmt::format("{} {}: must be {}", option, text, must_be));
}

using std::chrono::milliseconds;

// How long a line waits for the daemon to say how old its field is.
constexpr milliseconds kForItsAge{20};
constexpr milliseconds kBetweenLooks{250};
constexpr std::size_t kColumns = 80;  // of a terminal

nlohmann::json number_or_null(double value) {
  if (std::isfinite(value)) return value;
  return nullptr;
}

std::string json_line(const WatchedUpdate& update) {
  nlohmann::ordered_json line = {{"sequence", update.sequence},
                                 {"failure", update.failure},
                                 {"quality", update.quality},
                                 {"quality_reason", update.doubt},
                                 {"answer_ms", update.answer_time.ms},
                                 {"late", update.answer_time.late()},
                                 {"age_s", number_or_null(update.status.age_s)},
                                 {"currency", to_string(update.status.currency)},
                                 {"reason", update.status.reason},
                                 {"recorded", update.status.recorded},
                                 {"method", update.method},
                                 {"boundary", update.boundary},
                                 {"nodes", update.nodes},
                                 {"mesh_nodes", update.mesh_nodes},
                                 {"received_nodes", update.received_nodes},
                                 {"received_bytes", update.received_bytes},
                                 {"tumour_mm", nullptr},
                                 {"tumour_sd_mm", nullptr}};
  if (update.tumour) line["tumour_mm"] = update.tumour->mm;
  if (update.tumour && update.tumour->sd_mm) line["tumour_sd_mm"] = *update.tumour->sd_mm;
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

// Further lines below a line, broken between words.
std::string continued(const std::string& given) {
  const std::string text = one_line(given, '?');
  constexpr std::size_t kWidth = kColumns - 2;
  std::string lines;
  for (std::size_t from = 0; from < text.size();) {
    std::size_t to = text.size();
    if (to - from > kWidth) {
      to = text.rfind(' ', from + kWidth);
      if (to == std::string::npos || to <= from) to = from + kWidth;
    }
    lines += "\n  " + text.substr(from, to - from);
    from = to < text.size() && text[to] == ' ' ? to + 1 : to;
  }
  return lines;
}

std::string motion_text(const std::optional<geometry::TumourMotion>& motion) {
  if (!motion) return "no tumour node";
  if (!motion->sd_mm) return fmt::format("tumour {:.2f} mm", motion->mm);
  return fmt::format("tumour {:.2f} ± {:.2f} mm", motion->mm, *motion->sd_mm);
}

std::string status_text(const FieldStatus& status) {
  std::string text(to_string(status.currency));
  if (status.recorded) text += ", RECORDED";
  if (!status.reason.empty()) text += ": " + status.reason;
  return text;
}

std::string status_line(const FieldStatus& status, bool json) {
  if (!json) return status_text(status);
  const nlohmann::ordered_json line = {{"currency", to_string(status.currency)},
                                       {"reason", status.reason},
                                       {"recorded", status.recorded},
                                       {"age_s", number_or_null(status.age_s)}};
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

// Tells final updates and, between them, that the field is no longer current.
class Watcher {
 public:
  Watcher(Client client, const WatchOptions& options,
          const std::function<void(const std::string&)>& tell)
      : client_(std::move(client)), options_(options), tell_(tell) {}

  Status run() {
    const auto model = client_.model();
    if (!model) return tl::unexpected(model.error());
    tumour_ = geometry::tumour_nodes(*model);
    mesh_nodes_ = static_cast<int>(model->mesh.nodes.cols());
    if (Status status = client_.subscribe(1, options_.choice); !status) return status;
    while (options_.count == 0 || told_ < options_.count) {
      auto message = std::exchange(next_, std::nullopt);
      if (!message) message = next_final(kBetweenLooks);
      if (*message) {
        tell(**message);
      } else if (message->error().code == ErrorCode::kUnavailable) {
        tell_change();
      } else {
        return tl::unexpected(message->error());
      }
    }
    return {};
  }

 private:
  // Provisional fields are for programs that ask, not to be shown.
  Result<UpdateMessage> next_final(std::chrono::milliseconds timeout) {
    auto message = client_.next_update(timeout);
    while (message && !message->update.final) message = client_.next_update(timeout);
    return message;
  }

  void tell(const UpdateMessage& message) {
    WatchedUpdate update = watched(message, tumour_, mesh_nodes_);
    // Its age comes with the answer to the renewal that this wait sends, if nothing newer does.
    auto newer = next_final(kForItsAge);
    if (newer) next_ = std::move(newer);
    update.status = client_.field_status();
    if (next_) {
      update.status = {Currency::kSuperseded, "a newer update has come", std::nan(""),
                       update.status.recorded};
    }
    last_ = update.status.currency;
    tell_(watch_line(update, options_.json));
    ++told_;
  }

  void tell_change() {
    const FieldStatus status = client_.field_status();
    if (status.currency == last_) return;
    last_ = status.currency;
    tell_(status_line(status, options_.json));
  }

  Client client_;
  const WatchOptions& options_;
  const std::function<void(const std::string&)>& tell_;
  std::vector<NodeIndex> tumour_;
  int mesh_nodes_ = 0;
  std::uint64_t told_ = 0;
  std::optional<Currency> last_;               // of the newest line
  std::optional<Result<UpdateMessage>> next_;  // came while a line waited
};

}  // namespace

Result<double> parse_length(std::string_view option, std::string_view text) {
  const auto length = length_mm(text);
  if (!length) return refuse(option, text, "a length like 10mm");
  return *length;
}

Result<FieldChoice> parse_choice(const ChoiceText& text) {
  FieldChoice choice;
  const auto chosen = region(text.region);
  if (!chosen) {
    return refuse("--region", text.region, "brain, tumour:40mm, or a ball like -30,12,44:40mm");
  }
  choice.region = *chosen;
  const auto spacing_mm = parse_length("--decimate", text.spacing);
  if (!spacing_mm) return tl::unexpected(spacing_mm.error());
  choice.spacing_mm = *spacing_mm;
  const auto tolerance_mm = parse_length("--tolerance", text.tolerance);
  if (!tolerance_mm) return tl::unexpected(tolerance_mm.error());
  choice.tolerance_mm = *tolerance_mm;
  choice.with_sd = !text.without_sd;
  return validate(choice).map([&] { return choice; });
}

WatchedUpdate watched(const UpdateMessage& message, const std::vector<NodeIndex>& tumour,
                      int mesh_nodes) {
  const Estimate& estimate = message.update.estimate;
  WatchedUpdate update;
  update.sequence = message.update.sequence;
  update.received_nodes = message.received_nodes;
  update.received_bytes = message.received_bytes;
  update.mesh_nodes = mesh_nodes;
  update.method = to_string(message.update.method);
  update.boundary = to_string(message.update.boundary);
  if (message.error) {
    update.failure = message.error->message;
    return update;
  }
  update.quality = to_string(estimate.quality.quality);
  update.doubt = estimate.quality.reason;
  update.answer_time = message.update.answer_time;
  update.nodes = static_cast<int>(estimate.displacement.cols());
  update.tumour = geometry::tumour_motion(message.update, tumour);
  return update;
}

std::string watch_line(const WatchedUpdate& update, bool json) {
  if (json) return json_line(update);
  std::string line = fmt::format("update {}  ", update.sequence);
  line += std::isfinite(update.status.age_s) ? fmt::format("{:.2f} s old", update.status.age_s)
                                             : "age unknown";
  if (!update.failure.empty()) {
    line += fmt::format("  no field, {}", to_string(update.status.currency));
    return line + continued(update.failure) + continued(update.status.reason);
  }
  line += "  " + motion_text(update.tumour);
  line += fmt::format("  {}, {}", update.quality, update.boundary);
  const std::string status = fmt::format("{}{}", to_string(update.status.currency),
                                         update.status.recorded ? ", RECORDED" : "");
  const bool fits = line.size() + 2 + status.size() <= kColumns;
  line += fits ? ", " + status : continued(status);
  if (!update.doubt.empty()) line += continued(update.quality + ": " + update.doubt);
  if (!update.status.reason.empty()) {
    line +=
        continued(fmt::format("{}: {}", to_string(update.status.currency), update.status.reason));
  }
  if (update.answer_time.late()) line += continued("LATE: " + sentence(update.answer_time));
  if (update.nodes < update.mesh_nodes || update.received_nodes < update.nodes) {
    line += continued(fmt::format("{} of {} nodes ({} sent, {:.1f} kB)", update.nodes,
                                  update.mesh_nodes, update.received_nodes,
                                  1e-3 * static_cast<double>(update.received_bytes)));
  }
  return line;
}

Status watch(const WatchOptions& options, const std::function<void(const std::string&)>& tell) {
  auto client = Client::connect(options.endpoint, {.keys = options.keys});
  if (!client) return tl::unexpected(client.error());
  return Watcher(std::move(*client), options, tell).run();
}

}  // namespace brainshift::client
