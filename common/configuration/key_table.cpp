// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/key_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

namespace brainshift {
namespace {

using Kind = Limits::Kind;

// The shortest text of a number, with exponents as people write them: 1e6, 1e-7.
std::string digits(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  std::string text(buffer, error == std::errc() ? end : buffer);
  const std::size_t exponent = text.find('e');
  if (exponent == std::string::npos) return text;
  if (text[exponent + 1] == '+') text.erase(exponent + 1, 1);
  const std::size_t first = exponent + (text[exponent + 1] == '-' ? 2 : 1);
  while (text[first] == '0' && first + 1 < text.size()) text.erase(first, 1);
  return text;
}

template <typename List>
std::string digits_of_list(const List& values) {
  std::string text;
  for (const double value : values) text.append(text.empty() ? "" : ", ").append(digits(value));
  return "[" + text + "]";
}

// "range 0 to 20"; for the entries of a list "each 0 to 20".
std::string range_of(const Limits& limits, const char* word) {
  switch (limits.kind) {
    case Kind::kNone:
    case Kind::kFinite: return {};
    case Kind::kNotNegative: return "at least 0";
    case Kind::kDirection: return "any length but 0";
    case Kind::kBetween:
      return std::string(word) + " " + digits(limits.low) + " to " +
             (limits.high_key != nullptr ? limits.high_key : digits(limits.high));
  }
  return {};
}

}  // namespace

std::string must_be(const std::string& key, double value, const std::string& constraint) {
  std::ostringstream text;
  text << key << " = " << value << ": must be " << constraint;
  return text.str();
}

void KeyChecker::check(bool ok, const std::string& key, double value,
                       const std::string& constraint) {
  if (!ok && message_.empty()) message_ = must_be(key, value, constraint);
}

void KeyChecker::check(const std::string& key, double value, const Limits& limits) {
  switch (limits.kind) {
    case Kind::kNone: return;
    case Kind::kFinite:
    case Kind::kDirection: return check(std::isfinite(value), key, value, "finite");
    case Kind::kNotNegative:
      return check(std::isfinite(value) && value >= 0.0, key, value, "finite and >= 0");
    case Kind::kBetween: {
      std::ostringstream range;
      range << "between " << limits.low << " and " << limits.high;
      return check(value >= limits.low && value <= limits.high, key, value, range.str());
    }
  }
}

void KeyChecker::operator()(const Key& key, const Vec3& value, const Limits& limits, Need) {
  for (int i = 0; i < 3; ++i) check(full(key) + "[" + std::to_string(i) + "]", value[i], limits);
  if (limits.kind == Kind::kDirection) {
    check(value.norm() > 1e-9, full(key) + " length", value.norm(), "> 0");
  }
}

void KeyChecker::operator()(const Key& key, const std::vector<double>& value,
                            const Limits& limits) {
  for (std::size_t i = 0; i < value.size(); ++i) {
    check(full(key) + "[" + std::to_string(i) + "]", value[i], limits);
  }
}

void KeyChecker::operator()(const Key& key, const std::string& value, Need need) {
  require(need == Need::kOptional || !value.empty(), full(key), "must not be empty");
}

void KeyChecker::require(bool ok, const std::string& key, const std::string& what) {
  if (!ok && message_.empty()) message_ = key + ": " + what;
}

Status KeyChecker::status() const {
  if (message_.empty()) return {};
  return invalid(message_);
}

void KeyDocumenter::add(const Key& key, const std::string& standard, const std::string& range) {
  std::string text = key.meaning;
  if (*key.unit != '\0') text.append(", ").append(key.unit);
  if (!text.empty()) text += ".";
  if (!standard.empty()) {
    text.append(" ").append(standard);
    if (*key.source != '\0') text.append(" (").append(key.source).append(")");
    text.append(range.empty() ? "" : "; ").append(range).append(".");
  }
  if (*key.note != '\0') text.append(text.empty() ? "" : " ").append(key.note);
  documents_.push_back({full(key), text});
}

void KeyDocumenter::operator()(const Key& key, double value, const Limits& limits) {
  add(key, "Default " + digits(value), range_of(limits, "range"));
}

void KeyDocumenter::operator()(const Key& key, double, const Limits& limits, const SameAs& same) {
  add(key, std::string("Default ") + same.key, range_of(limits, "range"));
}

void KeyDocumenter::operator()(const Key& key, const Vec3& value, const Limits& limits, Need need) {
  add(key, need == Need::kRequired ? "No default" : "Default " + digits_of_list(value),
      range_of(limits, "each"));
}

void KeyDocumenter::operator()(const Key& key, const std::vector<double>& value,
                               const Limits& limits) {
  add(key, "Default " + digits_of_list(value), range_of(limits, "each"));
}

void KeyDocumenter::operator()(const Key& key, const std::string& value, Need need) {
  if (need == Need::kRequired) return add(key, "No default", "not empty");
  add(key, "Default " + (value.empty() ? "none" : value), "");
}

void KeyDocumenter::operator()(const Key& key, const std::filesystem::path&, Need need) {
  add(key, need == Need::kRequired ? "No default" : "Default none", "");
}

void KeyDocumenter::operator()(const Key& key, const std::optional<std::filesystem::path>&) {
  add(key, "Default none", "");
}

void KeyDocumenter::operator()(const Key& key, const std::optional<std::string>&) {
  add(key, "Default none", "not empty");
}

}  // namespace brainshift
