// SPDX-License-Identifier: GPL-3.0-or-later
// Every surgery as a dot, by scenario.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::surgeries {

// surgeries-tumour.png: what is left of the tumour's motion, %; surgeries-coverage.png: coverage of
// the 90 % interval; surgeries-field.png: mean field error, mm. Last update of every surgery; the
// heads side by side. kWriteFailed.
Status draw_surgeries(const Rows& rows, const std::filesystem::path& folder);

}  // namespace brainshift::surgeries
