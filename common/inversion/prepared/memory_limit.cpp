// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/memory_limit.hpp"

#include <sstream>

namespace brainshift::inversion {

Status check_memory(const PreparedModel& model, std::uint64_t bytes) {
  const double limit_gib = model.config().condensed.memory_limit_gib;
  const double needed_gib = static_cast<double>(bytes) / (1024.0 * 1024.0 * 1024.0);
  if (needed_gib <= limit_gib) return {};
  std::ostringstream text;
  text.precision(3);
  text << "condensed.memory_limit_gib = " << limit_gib << ": the preparation needs " << needed_gib
       << " GiB (" << model.forward().contact().num_slaves() << " slaves, "
       << model.model().mesh.num_nodes() << " nodes); raise the limit or coarsen the mesh";
  return fail(ErrorCode::kInvalidArgument, text.str());
}

}  // namespace brainshift::inversion
