// SPDX-License-Identifier: GPL-3.0-or-later
// replay FILE_OR_FOLDER...: gives every file to a fuzz target once. A folder that does not exist
// counts as empty. Exit status: 0, or 1 when there was no file at all.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/fuzz/fuzz_target.hpp"

namespace fs = std::filesystem;

namespace {

void replay(const fs::path& file) {
  std::printf("%s\n", file.c_str());  // the last one named is the one that failed
  std::fflush(stdout);
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  brainshift::fuzz::run(bytes);
}

}  // namespace

int main(int argc, char** argv) {
  int files = 0;
  for (int i = 1; i < argc; ++i) {
    if (fs::is_regular_file(argv[i])) {
      replay(argv[i]);
      ++files;
    } else if (fs::is_directory(argv[i])) {
      for (const auto& entry : fs::recursive_directory_iterator(argv[i])) {
        if (!entry.is_regular_file()) continue;
        replay(entry.path());
        ++files;
      }
    }
  }
  std::printf("%d inputs\n", files);
  return files > 0 ? 0 : 1;
}
