// SPDX-License-Identifier: GPL-3.0-or-later
// Recordings of tracked ultrasound, MetaImage and NRRD.
#include "common/io/recording/sequence_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  for (const char* name : {"sweep.mha", "sweep.nrrd"}) {
    for (const bool tracking_only : {false, true}) {
      const auto recording = io::read_sequence(scratch_file(name, bytes), {"MF", tracking_only});
      if (!recording) continue;
      require(recording->image_ok.size() == static_cast<std::size_t>(recording->num_frames()),
              "every frame has a time and a state");
      require(recording->pixels.empty() == tracking_only, "images are there where they are wanted");
    }
  }
}

}  // namespace brainshift::fuzz
