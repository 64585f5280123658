// SPDX-License-Identifier: GPL-3.0-or-later
// Model files: nothing comes past the checksum that was not written with it. Behind it lies HDF5
// 1.10, which reads outside its memory when a forged checksum vouches for a damaged file
// (docs/hazards.md); what our own checks behind it refuse is in tests/unit/io/model.
#include "common/io/model/model_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) { (void)io::read_model(scratch_file("model.h5", bytes)); }

}  // namespace brainshift::fuzz
