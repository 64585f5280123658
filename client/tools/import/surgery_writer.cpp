// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/surgery_writer.hpp"

#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

Status write_surgery(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                     const std::vector<Observation>& observations) {
  auto file =
      io::SurgeryFile::create(path, meta);  // refuses a file that exists, and leaves it alone
  if (!file) return tl::unexpected(file.error());
  Status status;
  for (const Observation& observation : observations) {
    if (!status) break;
    status = file->append({io::RecordKind::kObservation, observation.sequence,
                           observation.acquired_ns, wire::encode(observation)});
  }
  if (status) status = file->close();
  if (!status) io::discard_surgery(path);
  return status;
}

}  // namespace brainshift::client
