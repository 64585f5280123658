// SPDX-License-Identifier: GPL-3.0-or-later
// Surgery files, read and added to.
#include "common/io/recording/surgery_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  const std::string name = "fuzz.surgery";
  const auto path = scratch_file(name, bytes);
  for (const char* beside : {"-wal", "-shm", "-journal"}) {
    std::filesystem::remove(path.string() + beside);
  }
  if (const auto file = io::SurgeryFile::open(path)) {
    const auto observations = file->records(io::RecordKind::kObservation);
    (void)file->records(io::RecordKind::kUpdate);
    (void)file->read_truth(observations && !observations->empty() ? observations->front().sequence
                                                                  : 1);
  }
  auto file = io::SurgeryFile::open_to_append(path);
  if (!file) return;
  (void)file->append({io::RecordKind::kObservation, 1000000, 1, "payload"});
  (void)file->close();
}

}  // namespace brainshift::fuzz
