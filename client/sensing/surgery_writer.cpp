// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/sensing/surgery_writer.hpp"

#include <ctime>

#include "common/io/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::sensing {

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

Status write_surgery(const std::filesystem::path& path,
                     const std::map<std::string, std::string>& meta,
                     const std::vector<Observation>& observations) {
  auto file =
      io::SurgeryFile::create(path, meta);  // refuses a file that exists, and leaves it alone
  if (!file) return tl::unexpected(file.error());
  Status status;
  for (const Observation& observation : observations) {
    if (!status) break;
    status = file->append(
        {"observation", observation.sequence, observation.acquired_ns, wire::encode(observation)});
  }
  if (status) status = file->close();
  if (!status) {
    for (const char* suffix : {"", "-wal", "-shm"}) {
      std::error_code ignored;
      std::filesystem::remove(path.string() + suffix, ignored);
    }
  }
  return status;
}

}  // namespace brainshift::sensing
