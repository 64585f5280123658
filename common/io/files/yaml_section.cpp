// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/yaml_section.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>

namespace brainshift::io {

namespace fs = std::filesystem;

struct YamlDocument::State {
  fs::path file;
  YAML::Node root;
  std::map<std::string, int> line_of_key;  // 1-based
  std::string problem;
  std::vector<std::string>
      missing;              // required keys, told together unless something was wrong before
  int line_of_missing = 0;  // of the first one's section

  // 0: unknown.
  int line_of(const std::string& full_key) const {
    const auto found = line_of_key.find(full_key);
    return found == line_of_key.end() ? 0 : found->second;
  }

  void fail_at(int line, const std::string& message) {
    if (!problem.empty() || !missing.empty()) return;
    set_problem(line, message);
  }
  // The keys of a section that is missing itself are not told.
  void miss(const std::string& section, const std::string& key) {
    const bool told = std::any_of(missing.begin(), missing.end(), [&](const std::string& above) {
      return (section + ".").starts_with(above + ".");
    });
    if (!problem.empty() || told) return;
    if (missing.empty()) line_of_missing = line_of(section);
    missing.push_back(key);
  }
  void set_problem(int line, const std::string& message) {
    problem = file.string();
    if (line > 0) problem.append(":").append(std::to_string(line));
    problem.append(": ").append(message);
  }
};

struct YamlSection::Node {
  YAML::Node yaml;
};

namespace {

// Finds an alias inside the node that it stands for. yaml-cpp makes a cycle of it, which no reader
// would ever leave.
class CycleFinder : public YAML::EventHandler {
 public:
  int line() const { return line_; }  // 1-based, of the first such alias; 0: none

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const bool open = std::find(open_.begin(), open_.end(), anchor) != open_.end();
    if (open && line_ == 0) line_ = mark.line + 1;
  }
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open_.push_back(anchor);
  }
  void OnSequenceEnd() override { open_.pop_back(); }
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open_.push_back(anchor);
  }
  void OnMapEnd() override { open_.pop_back(); }
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}

 private:
  std::vector<YAML::anchor_t> open_;  // of the nodes around; 0: without an anchor
  int line_ = 0;
};

// Whether the text is at most one document without a cycle; else what is wrong, with its line.
struct TextProblem {
  int line = 0;  // 0: unknown
  std::string message;
};
std::optional<TextProblem> problem_of(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  CycleFinder finder;
  // No further than the second: yaml-cpp finds documents without end in front of a stray comma.
  int documents = 0;
  while (documents < 2 && parser.HandleNextDocument(finder)) ++documents;
  if (finder.line() > 0) {
    return TextProblem{finder.line(), "an alias stands inside the node that it names"};
  }
  if (documents > 1) return TextProblem{0, "holds 2 YAML documents or more: must be one"};
  return std::nullopt;
}

int line_of(const YAML::Node& node) { return node.Mark().is_null() ? 0 : node.Mark().line + 1; }

// The value as one short line for a message.
std::string shown_value(const YAML::Node& node, int depth = 0) {
  if (node.IsNull()) return "(empty)";
  if (node.IsMap()) return "(a section)";
  if (node.IsScalar()) {
    std::string value = node.Scalar();
    for (char& c : value) {
      if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    }
    return value.size() > 60 ? value.substr(0, 57) + "..." : value;
  }
  if (depth > 1) return "[...]";
  std::string list = "[";
  for (std::size_t i = 0; i < node.size() && i < 6; ++i) {
    list.append(i > 0 ? ", " : "").append(shown_value(node[i], depth + 1));
  }
  return list + (node.size() > 6 ? ", ...]" : "]");
}

// The whole scalar must be one number: "5 mm" and "1,5" are errors.
template <typename T>
bool parse_scalar(const YAML::Node& node, T& value) {
  if (!node.IsScalar()) return false;
  const std::string& text = node.Scalar();
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (text.size() > 1 && *begin == '+' && begin[1] != '-') ++begin;
  T parsed{};
  const auto [stop, error] = std::from_chars(begin, end, parsed);
  if (error != std::errc() || stop != end) return false;
  value = parsed;
  return true;
}

bool parse_finite(const YAML::Node& node, double& value) {
  double parsed = 0.0;
  if (!parse_scalar(node, parsed) || !std::isfinite(parsed)) return false;
  value = parsed;
  return true;
}

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

YamlDocument::YamlDocument(std::unique_ptr<State> state) : state_(std::move(state)) {}
YamlDocument::YamlDocument(YamlDocument&&) noexcept = default;
YamlDocument::~YamlDocument() = default;

YamlDocument YamlDocument::parse(const std::string& text, const fs::path& file) {
  auto state = std::make_unique<State>();
  state->file = file;
  try {
    if (const auto problem = problem_of(text)) {
      state->fail_at(problem->line, problem->message);
      return YamlDocument(std::move(state));
    }
    state->root = YAML::Load(text);
    if (!state->root.IsMap()) state->fail_at(0, "is not a YAML mapping of keys to values");
  } catch (const YAML::Exception& exception) {
    const int line = exception.mark.is_null() ? 0 : exception.mark.line + 1;
    state->fail_at(line, "is not valid YAML: " + exception.msg);
  }
  return YamlDocument(std::move(state));
}

YamlSection YamlDocument::root() {
  if (!state_->problem.empty()) return YamlSection(*state_, nullptr, "");
  return YamlSection(*state_, std::make_shared<YamlSection::Node>(YamlSection::Node{state_->root}),
                     "");
}

Status YamlDocument::status() const {
  const std::vector<std::string>& missing = state_->missing;
  if (state_->problem.empty() && missing.size() == 1) {
    state_->set_problem(state_->line_of_missing, missing.front() + ": key is missing");
  } else if (state_->problem.empty() && !missing.empty()) {
    state_->set_problem(0, joined(missing) + ": keys are missing");
  }
  if (state_->problem.empty()) return {};
  return invalid(state_->problem);
}

Error YamlDocument::locate(const Error& error) const {
  const std::string key = error.message.substr(0, error.message.find_first_of(" :["));
  const int line = state_->line_of(key);
  std::string place = state_->file.string();
  if (line > 0) place.append(":").append(std::to_string(line));
  return {error.code, place + ": " + error.message};
}

YamlSection::YamlSection(YamlDocument::State& state, std::shared_ptr<Node> node, std::string prefix)
    : state_(&state), node_(std::move(node)), prefix_(std::move(prefix)) {
  if (!node_) return;
  // yaml-cpp keeps the first of two equal keys without a word.
  std::vector<std::string> seen;
  for (const auto& entry : node_->yaml) {
    if (!entry.first.IsScalar()) {
      state_->fail_at(line_of(entry.first), full_key("") + "a key must be plain text");
      continue;
    }
    const std::string& key = entry.first.Scalar();
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      state_->fail_at(line_of(entry.first), full_key(key) + ": key is given twice");
    }
    seen.push_back(key);
    state_->line_of_key.emplace(full_key(key), line_of(entry.first));
  }
}

std::string YamlSection::full_key(const std::string& key) const {
  return prefix_.empty() ? key : prefix_ + "." + key;
}

int YamlSection::line_of_key(const std::string& key) const {
  return state_->line_of(full_key(key));
}

void YamlSection::refuse_value(const std::string& key, const Node& node, const std::string& what) {
  state_->fail_at(line_of_key(key), full_key(key) + " = " + shown_value(node.yaml) + ": " + what);
}

bool YamlSection::has(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  if (!node_) return false;
  const YAML::Node& map = node_->yaml;
  return static_cast<bool>(map[key]);
}

std::shared_ptr<YamlSection::Node> YamlSection::take(const std::string& key, Presence presence) {
  if (!has(key)) {
    if (presence == Presence::kRequired) {
      state_->miss(prefix_, full_key(key));
    }
    return nullptr;
  }
  const YAML::Node& map = node_->yaml;
  return std::make_shared<Node>(Node{map[key]});
}

YamlSection YamlSection::section(const std::string& key, Presence presence) {
  std::shared_ptr<Node> value = take(key, presence);
  // A heading whose keys are all commented out.
  if (value && value->yaml.IsNull()) value = nullptr;
  if (value && !value->yaml.IsMap()) {
    refuse_value(key, *value, "must be a section of keys and values");
    value = nullptr;
  }
  return YamlSection(*state_, value, full_key(key));
}

std::string YamlSection::one_of(const std::vector<std::string>& keys, Presence presence) {
  std::vector<std::string> present;
  for (const std::string& key : keys) {
    if (has(key)) present.push_back(key);
  }
  if (present.size() == 1) return present.front();
  if (present.empty() && presence == Presence::kOptional) return {};
  const std::string found = present.empty() ? "none" : joined(present);
  state_->fail_at(state_->line_of(prefix_),
                  prefix_ + " has " + found + ": must have exactly one of " + joined(keys));
  return {};
}

void YamlSection::number(const std::string& key, double& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node || parse_finite(node->yaml, value)) return;
  refuse_value(key, *node, "must be a finite number");
}

void YamlSection::integer(const std::string& key, int& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node || parse_scalar(node->yaml, value)) return;
  refuse_value(key, *node, "must be an integer");
}

void YamlSection::text(const std::string& key, std::string& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node) return;
  if (!node->yaml.IsScalar()) return refuse_value(key, *node, "must be text");
  value = node->yaml.Scalar();
}

void YamlSection::choice(const std::string& key, std::string& value,
                         const std::vector<std::string>& words) {
  std::string word = value;
  text(key, word);
  if (std::find(words.begin(), words.end(), word) != words.end()) {
    value = word;
    return;
  }
  state_->fail_at(line_of_key(key),
                  full_key(key) + " = " + word + ": must be one of " + joined(words));
}

void YamlSection::fail(const std::string& key, const std::string& what) {
  state_->fail_at(line_of_key(key), full_key(key) + ": " + what);
}

void YamlSection::path(const std::string& key, fs::path& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node) return;
  std::string name;
  if (!node->yaml.IsNull()) text(key, name);
  if (name.empty()) {
    value.clear();
    if (presence == Presence::kRequired) fail(key, "must name a file");
    return;
  }
  value = (fs::absolute(state_->file).parent_path() / name).lexically_normal();
}

void YamlSection::vector3(const std::string& key, Vec3& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node) return;
  Vec3 parsed = Vec3::Zero();
  bool ok = node->yaml.IsSequence() && node->yaml.size() == 3;
  for (int i = 0; ok && i < 3; ++i) ok = parse_finite(node->yaml[i], parsed[i]);
  if (!ok) return refuse_value(key, *node, "must be a list of three finite numbers");
  value = parsed;
}

void YamlSection::numbers(const std::string& key, std::vector<double>& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node) return;
  bool ok = node->yaml.IsSequence();
  std::vector<double> parsed(ok ? node->yaml.size() : 0);
  for (std::size_t i = 0; ok && i < parsed.size(); ++i) ok = parse_finite(node->yaml[i], parsed[i]);
  if (!ok) return refuse_value(key, *node, "must be a list of finite numbers");
  value = std::move(parsed);
}

void YamlSection::integers(const std::string& key, std::vector<int>& value, Presence presence) {
  const std::shared_ptr<Node> node = take(key, presence);
  if (!node) return;
  std::vector<int> parsed(node->yaml.IsSequence() ? node->yaml.size() : 1);
  bool ok = !parsed.empty();
  for (std::size_t i = 0; ok && i < parsed.size(); ++i) {
    ok = parse_scalar(node->yaml.IsSequence() ? node->yaml[i] : node->yaml, parsed[i]);
  }
  if (!ok) return refuse_value(key, *node, "must be an integer or a list of integers");
  value = std::move(parsed);
}

std::vector<std::string> YamlSection::names() {
  std::vector<std::string> keys;
  if (!node_) return keys;
  for (const auto& entry : node_->yaml) {
    if (!entry.first.IsScalar()) continue;
    keys.push_back(entry.first.Scalar());
    has(keys.back());
  }
  return keys;
}

void YamlSection::done() {
  if (!node_) return;
  for (const auto& entry : node_->yaml) {
    if (!entry.first.IsScalar()) continue;
    const std::string& key = entry.first.Scalar();
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    state_->fail_at(line_of(entry.first),
                    full_key(key) + ": unknown key (known here: " + joined(known_) + ")");
  }
}

}  // namespace brainshift::io
