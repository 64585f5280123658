// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/platform.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "common/io/files/checksum.hpp"
#include "common/io/files/csv_numbers.hpp"

namespace brainshift::server {
namespace {

// The value of the first line "KEY : value"; empty without one.
std::string_view value_of(std::string_view text, std::string_view key) {
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && io::trimmed(line.substr(0, colon)) == key) {
      return io::trimmed(line.substr(colon + 1));
    }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return {};
}

}  // namespace

std::string program_build(std::string_view version) {
  const auto checksum = io::file_checksum("/proc/self/exe");
  if (!checksum) return std::string(version);
  return fmt::format("{} crc {:08x}", version, checksum->crc32);
}

std::string machine_type(std::string_view architecture, std::string_view cpu_info) {
  const std::string_view vendor = value_of(cpu_info, "vendor_id");
  const std::string_view family = value_of(cpu_info, "cpu family");
  const std::string_view model = value_of(cpu_info, "model");
  if (vendor.empty() || family.empty() || model.empty()) return std::string(architecture);
  return fmt::format("{} {} family {} model {}", architecture, vendor, family, model);
}

std::string machine_type() {
  utsname names{};
  if (::uname(&names) != 0) return {};
  std::ifstream stream("/proc/cpuinfo");
  const std::string info{std::istreambuf_iterator<char>(stream), {}};
  return machine_type(names.machine, info);
}

}  // namespace brainshift::server
