// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/key_table.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace brainshift {
namespace {

using Kind = Limits::Kind;

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

void KeyChecker::operator()(const Key& key, const std::vector<int>& value, const Limits& limits) {
  require(!value.empty(), full(key), "must name at least one");
  for (std::size_t i = 0; i < value.size(); ++i) {
    check(full(key) + "[" + std::to_string(i) + "]", value[i], limits);
    require(std::count(value.begin(), value.end(), value[i]) == 1, full(key),
            "names " + std::to_string(value[i]) + " twice");
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

}  // namespace brainshift
