// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/init/position.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string_view>

#include "common/core/text.hpp"
#include "common/io/files/csv_numbers.hpp"

namespace brainshift::client {
namespace {

struct Lying {
  const char* word;
  Vec3 gravity;
};
const Lying kLying[] = {{"supine", {0, -1, 0}},
                        {"prone", {0, 1, 0}},
                        {"sitting", {0, 0, -1}},
                        {"left-lateral", {-1, 0, 0}},
                        {"right-lateral", {1, 0, 0}}};

// The head's rotation against the body: about `axis` by `sign` times the angle.
struct HeadTurn {
  const char* word;
  Vec3 axis;
  double sign;
  double most_deg;
};
const HeadTurn kTurns[] = {
    {"left", {0, 0, 1}, 1.0, 180.0},        {"right", {0, 0, 1}, -1.0, 180.0},
    {"flexed", {1, 0, 0}, -1.0, 90.0},      {"extended", {1, 0, 0}, 1.0, 90.0},
    {"tilted-left", {0, 1, 0}, -1.0, 90.0}, {"tilted-right", {0, 1, 0}, 1.0, 90.0}};
constexpr double kMostTable_deg = 90.0;

tl::unexpected<Error> refuse(std::string_view word, const std::string& what) {
  return invalid(fmt::format("--position: {}: {}", in_quotes(word), what));
}

}  // namespace

Result<Vec3> gravity_of_position(const std::string& position) {
  const auto words = io::cells_of(position);
  Vec3 gravity = Vec3::Zero();
  for (const Lying& lying : kLying) {
    if (words.front() == lying.word) gravity = lying.gravity;
  }
  if (gravity.isZero()) {
    return refuse(words.front(),
                  "must begin with supine, prone, sitting, left-lateral or right-lateral");
  }
  for (const bool table : {true, false}) {
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::string_view word = words[i];
      const std::size_t dash = word.rfind('-');
      const std::string_view change = word.substr(0, dash);
      const bool raised = change == "raised";
      double degrees = 0.0, most = raised || change == "lowered" ? kMostTable_deg : 0.0;
      const HeadTurn* turn = nullptr;
      for (const HeadTurn& known : kTurns) {
        if (change == known.word) turn = &known, most = known.most_deg;
      }
      if (most == 0.0) {
        return refuse(word,
                      "must be left-, right-, flexed-, extended-, tilted-left-, tilted-right-, "
                      "raised- or lowered-DEGREES, as in supine,left-30");
      }
      const bool number =
          dash != std::string_view::npos && io::parse_number(word.substr(dash + 1), degrees);
      if (!number || !(degrees >= 0.0 && degrees <= most)) {
        return refuse(word, fmt::format("must end in -DEGREES, 0 to {:g}", most));
      }
      const double angle = degrees * std::numbers::pi / 180.0;
      if (turn != nullptr && !table) {
        gravity = Eigen::AngleAxisd(turn->sign * angle, turn->axis).inverse() * gravity;
      } else if (turn == nullptr && table) {
        if (words.front() == "sitting") return refuse(word, "a sitting patient's table is level");
        gravity = std::cos(angle) * gravity - std::sin(raised ? angle : -angle) * Vec3::UnitZ();
      }
    }
  }
  return gravity.normalized();
}

}  // namespace brainshift::client
