// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/transform_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>

namespace brainshift::tracking {
namespace {

bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }

std::string joined(const std::set<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

Status check_unique(const std::vector<FramePair>& links) {
  std::map<std::set<std::string>, std::string> seen;
  for (const FramePair& link : links) {
    if (link.from == link.to) return invalid(link.name() + ": leads from a frame to itself");
    const auto [other, is_new] = seen.emplace(std::set{link.from, link.to}, link.name());
    if (!is_new) {
      return invalid("frames " + link.from + " and " + link.to + " are linked twice, by " +
                     other->second + " and " + link.name());
    }
  }
  return {};
}

// How each frame was reached first: the step that leads to it and where that began.
struct Arrival {
  std::string previous;
  std::optional<ChainStep> step;  // none: the start
};

std::map<std::string, Arrival> walk(const std::vector<FramePair>& links, const std::string& from) {
  std::map<std::string, Arrival> arrivals = {{from, {}}};
  std::deque<std::string> waiting = {from};
  while (!waiting.empty()) {
    const std::string here = waiting.front();
    waiting.pop_front();
    for (std::size_t i = 0; i < links.size(); ++i) {
      const bool along = links[i].from == here;
      if (!along && links[i].to != here) continue;
      const std::string& next = along ? links[i].to : links[i].from;
      if (arrivals.emplace(next, Arrival{here, ChainStep{i, !along}}).second) {
        waiting.push_back(next);
      }
    }
  }
  return arrivals;
}

tl::unexpected<Error> not_connected(const std::vector<FramePair>& links,
                                    const std::map<std::string, Arrival>& arrivals,
                                    const std::string& from, const std::string& to) {
  std::set<std::string> reached, others;
  for (const auto& [name, arrival] : arrivals) reached.insert(name);
  for (const FramePair& link : links) {
    for (const std::string& name : {link.from, link.to}) {
      if (reached.count(name) == 0) others.insert(name);
    }
  }
  return invalid("no chain from " + from + " to " + to + ": " + from + " is connected to " +
                 joined(reached) + "; other known frames: " + joined(others));
}

}  // namespace

Result<FramePair> parse_transform_name(std::string_view name) {
  int found = 0;
  std::size_t at = 0;
  for (std::size_t i = 1; i + 2 < name.size(); ++i) {
    if (name.substr(i, 2) == "To" && is_capital(name[i + 2])) {
      at = i;
      ++found;
    }
  }
  if (found != 1 || !is_capital(name.front())) {
    return invalid("transform name \"" + std::string(name) +
                   "\": must be two frame names with capital letters joined by one \"To\"");
  }
  return FramePair{std::string(name.substr(0, at)), std::string(name.substr(at + 2))};
}

bool is_image_frame(std::string_view frame) { return frame.ends_with("Image"); }

Result<std::vector<ChainStep>> shortest_chain(const std::vector<FramePair>& links,
                                              const std::string& from, const std::string& to) {
  if (Status unique = check_unique(links); !unique) return tl::unexpected(unique.error());
  const auto arrivals = walk(links, from);
  const auto end = arrivals.find(to);
  if (end == arrivals.end()) return not_connected(links, arrivals, from, to);
  std::vector<ChainStep> steps;
  for (const Arrival* at = &end->second; at->step; at = &arrivals.at(at->previous)) {
    steps.push_back(*at->step);
  }
  std::reverse(steps.begin(), steps.end());
  return steps;
}

}  // namespace brainshift::tracking
