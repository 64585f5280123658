// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the text format of Prometheus, as strictly as a monitor may.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>
#include <string>

namespace brainshift::server {

struct Exposition {
  std::map<std::string, std::string> types;  // by family
  std::set<std::string> helped;
  std::map<std::string, double> samples;  // by name with its labels, as they stand there

  double value(const std::string& sample) const {
    const auto found = samples.find(sample);
    EXPECT_NE(found, samples.end()) << sample;
    return found == samples.end() ? -1.0 : found->second;
  }
};

inline Exposition read_exposition(const std::string& text) {
  Exposition result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string sign, kind, family;
    if (line.rfind("# ", 0) == 0) {
      words >> sign >> kind >> family;
      if (kind == "HELP") {
        EXPECT_TRUE(result.helped.insert(family).second) << line;
      }
      if (kind == "TYPE") {
        EXPECT_EQ(result.types.count(family), 0u) << line;
        words >> result.types[family];
      }
      continue;
    }
    const std::size_t blank = line.rfind(' ');
    EXPECT_NE(blank, std::string::npos) << line;
    const std::string number = line.substr(blank + 1);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    EXPECT_EQ(*end, '\0') << line;
    EXPECT_TRUE(result.samples.emplace(line.substr(0, blank), value).second) << line;
  }
  return result;
}

}  // namespace brainshift::server
