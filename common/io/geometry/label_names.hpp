// SPDX-License-Identifier: GPL-3.0-or-later
// What the labels of a label map are called: BIDS's tables beside segmentations, *_dseg.tsv.
//
// Columns between tabs; the heading has `index` and `name`, others do not matter.
// Source: bids-specification, "Imaging derivatives", "Common image-derived labels".
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/core/error.hpp"

namespace brainshift::io {

using LabelNames = std::map<int, std::string>;

// kNotFound; kUnreadable naming file and line: a heading without index or name, an index that is no
// whole number or stands twice, a row without a name; a table without heading or rows.
Result<LabelNames> read_label_names(const std::filesystem::path& path);

// The table beside a map: sub-1_dseg.tsv beside sub-1_dseg.nii.gz. No names where there is none.
Result<LabelNames> label_names_beside(const std::filesystem::path& map);

}  // namespace brainshift::io
