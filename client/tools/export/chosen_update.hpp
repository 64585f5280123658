// SPDX-License-Identifier: GPL-3.0-or-later
// The update of a journal that is exported.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

struct UpdateChoice {
  std::optional<std::uint64_t> sequence = std::nullopt;  // none: the last usable one
  // With `sequence`: also an update that is unusable or that nobody judged.
  bool allow_unusable = false;
};

struct ChosenUpdate {
  UpdateMessage message;
  double time_s = 0.0;  // since the first record of the file
};

// nodes: of the model. `path` is the file's, for messages.
//   kEmptySet         no update at all (a simulated surgery, an imported recording), or none usable
//   kNotFound         no update of that sequence; the sentence says which there are
//   kInvalidArgument  it is unusable, and that is not allowed; the sentence gives flags and reason.
//                     It carries no field. allow_unusable without a sequence
//   kUnreadable       a displacement of another number of nodes; a record that is not what was
//                     written
Result<ChosenUpdate> choose_update(const io::SurgeryFile& file, const std::filesystem::path& path,
                                   int nodes, const UpdateChoice& choice);

}  // namespace brainshift::client
