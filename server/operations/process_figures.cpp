// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/process_figures.hpp"

#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace brainshift::server {

wire::ProcessFigures process_figures() {
  wire::ProcessFigures figures;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    const auto number_of = [&](const std::string& key) {
      return line.rfind(key, 0) == 0 ? std::strtoull(line.c_str() + key.size(), nullptr, 10) : 0;
    };
    if (const auto kib = number_of("VmRSS:")) figures.resident_bytes = kib << 10;
    if (const auto kib = number_of("VmHWM:")) figures.peak_bytes = kib << 10;
    if (const auto threads = number_of("Threads:")) figures.threads = threads;
  }
  std::error_code failed;
  for (std::filesystem::directory_iterator entry("/proc/self/fd", failed), end;
       !failed && entry != end; entry.increment(failed)) {
    ++figures.descriptors;
  }
  if (figures.descriptors > 0) --figures.descriptors;  // the one that reads the folder
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) figures.descriptor_limit = limit.rlim_cur;
  return figures;
}

}  // namespace brainshift::server
