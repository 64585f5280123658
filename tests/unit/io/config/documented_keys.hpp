// SPDX-License-Identifier: GPL-3.0-or-later
// A documented YAML file beside the table of its keys.
#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/key_documenter.hpp"

namespace brainshift::io {

// The words of a file with one blank between them; comment signs, also nested ones, are left out.
inline std::string words_of(const std::string& yaml) {
  std::istringstream words(yaml);
  std::string text = " ";
  for (std::string word; words >> word;) {
    if (word != "#") text += word + " ";
  }
  return text;
}

// Every text of the table stands in the file, in the table's order, directly in front of its key.
// Only a remark that begins with "Here:" and holds no other colon may come between.
inline void expect_documented(const std::string& yaml, const std::vector<KeyDocument>& documents) {
  const std::string text = words_of(yaml);
  std::size_t from = 0;
  for (const KeyDocument& document : documents) {
    const std::string key = document.key.substr(document.key.rfind('.') + 1) + ": ";
    const std::string words = document.text.empty() ? " " : " " + document.text + " ";
    bool found = false;
    for (std::size_t at = text.find(words, from); at != std::string::npos && !found;
         at = text.find(words, at + 1)) {
      const std::size_t behind = at + words.size();
      const std::size_t remark = text.compare(behind, 6, "Here: ") == 0 ? 6 : 0;
      const std::size_t colon = text.find(": ", behind + remark);
      if (colon == std::string::npos || colon + 2 < behind + key.size()) continue;
      const std::size_t name = colon + 2 - key.size();
      found = text.compare(name, key.size(), key) == 0 && (remark > 0 || name == behind);
      if (found) from = colon;
    }
    EXPECT_TRUE(found) << document.key << " must be documented, in the table's order, as\n"
                       << document.text;
  }
}

}  // namespace brainshift::io
