// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/command_words.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

namespace brainshift::io {
namespace {

std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, changed});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string nearest_word(std::string_view typed, const std::vector<std::string>& words) {
  std::string nearest;
  std::size_t least = 3;
  if (typed.size() > 64) return nearest;
  for (const std::string& word : words) {
    const std::size_t distance = edits(typed, word);
    if (distance < least && 2 * distance < word.size()) {
      least = distance;
      nearest = word;
    }
  }
  return nearest;
}

void become(const std::string& program, char** argv) {
  std::error_code none;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", none);
  std::string name = program;
  argv[0] = name.data();
  if (!none) execv((own.parent_path() / program).c_str(), argv);
  execvp(program.c_str(), argv);
}

}  // namespace brainshift::io
