// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/integration/workspace.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace brainshift::integration {

Workspace::Workspace() {
  std::string name = (std::filesystem::temp_directory_path() / "brainshift-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::system_error(errno, std::generic_category(), name);
  }
  folder_ = name;
}

Workspace::~Workspace() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string Workspace::write(const std::string& name, const std::string& content) const {
  const std::string file = path(name);
  std::ofstream stream(file, std::ios::binary);
  stream << content;
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file);
  return file;
}

std::string brainshiftd() { return BRAINSHIFTD; }
std::string brainshift() { return BRAINSHIFT; }
std::string coarse_case() { return BRAINSHIFT_SOURCE_DIR "/config/cases/colin27-coarse.yaml"; }

std::string examples_folder() { return BRAINSHIFT_SOURCE_DIR "/docs/examples/solve"; }

std::string coarse_case_text() {
  std::ifstream stream(coarse_case(), std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + coarse_case());
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool head_is_installed() {
  return std::filesystem::exists("/usr/share/mricron/templates/ch2bet.nii.gz");
}

std::string with_line(const std::string& text, const std::string& section, const std::string& key,
                      const std::string& line) {
  const std::size_t top = ("\n" + text).find("\n" + section + ":");
  if (top == std::string::npos) throw std::runtime_error("no section " + section);
  std::size_t start = text.find('\n', top) + 1;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::size_t word = text.find_first_not_of(' ', start);
    if (text.compare(word, key.size() + 1, key + ":") == 0) {
      return text.substr(0, word) + line + text.substr(end);
    }
    start = end + 1;
  }
  throw std::runtime_error("no key " + key + " in section " + section);
}

}  // namespace brainshift::integration
