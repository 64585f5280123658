// SPDX-License-Identifier: GPL-3.0-or-later
// A journal of the toy patient as a daemon would leave it, made without a daemon: updates with a
// field that is known, of any quality; and the model file that belongs to it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/values/quality.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::test_support {

// toy_patient(cells) with its model_id.
BrainModel toy_model(int cells = 3);

// A smooth sag of 3 to 6 mm, times `scale`: 3 x n, at places x.
Points toy_displacement(const Points& x, double scale = 1.0);

// A final update of session 41 with the field toy_displacement(., scale), a standard deviation of
// 0.25 mm everywhere, 0.6 known, and the flag, if any, that makes its quality.
UpdateMessage toy_update(const BrainModel& model, std::uint64_t sequence, Quality quality,
                         double scale = 1.0);

// A closed file with one observation, and the updates a second after it. Throws
// std::runtime_error.
void write_toy_journal(const std::filesystem::path& path, const BrainModel& model,
                       const std::vector<UpdateMessage>& updates);
void write_toy_model(const std::filesystem::path& path, const BrainModel& model);

}  // namespace brainshift::test_support
