// SPDX-License-Identifier: GPL-3.0-or-later
// A folder of its own for each test, the programs under test, and the coarse case.
#pragma once

#include <filesystem>
#include <string>

namespace brainshift::integration {

class Workspace {
 public:
  Workspace();
  ~Workspace();
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  const std::filesystem::path& folder() const { return folder_; }
  // Returns the new file's path.
  std::string write(const std::string& name, const std::string& content) const;

 private:
  std::filesystem::path folder_;
};

std::string brainshiftd();
std::string brainshift();
std::string coarse_case();       // path
std::string coarse_case_text();  // content
std::string examples_folder();   // docs/examples/solve
bool head_is_installed();        // Debian's mricron-data

// The YAML text with one line replaced: the first below the top-level `section:` whose key is
// `key`. Keeps the indentation; throws when there is no such line.
std::string with_line(const std::string& text, const std::string& section, const std::string& key,
                      const std::string& line);

}  // namespace brainshift::integration
