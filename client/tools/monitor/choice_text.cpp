// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/choice_text.hpp"

#include <charconv>
#include <optional>
#include <vector>

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
  std::string sentence(option);
  sentence.append(" ").append(text).append(": must be ").append(must_be);
  return fail(ErrorCode::kInvalidArgument, std::move(sentence));
}

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

}  // namespace brainshift::client
