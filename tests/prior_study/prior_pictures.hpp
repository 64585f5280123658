// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of the prior's draws.
//   prior-predictive.png  share of draws that move less than so many mm, a panel per place, with
//                         the published targets and their brackets
//   prior-parts.png       5 to 95 % and median of every part alone, per place
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "tests/prior_study/prior_draws.hpp"
#include "tests/prior_study/prior_targets.hpp"

namespace brainshift::prior_study {

// kWriteFailed names the picture. Precondition: `all` begins with the total.
Status draw_pictures(const std::vector<PartDraws>& all, const std::vector<Target>& targets,
                     const std::filesystem::path& folder);

}  // namespace brainshift::prior_study
