// SPDX-License-Identifier: GPL-3.0-or-later
// OmissionErrors: what an update may have lost by the parts that its scene leaves out.
#pragma once

namespace brainshift::inversion {

// Upper estimates of the greatest move of any node, mm; 0 for a part that was carried.
struct OmissionErrors {
  double contact_mm = 0.0;
  double gravity_modes_mm = 0.0;
  double far_field_mm = 0.0;
  // Least distance between a slave and the skull, mm; negative when a slave penetrates, infinite
  // without slaves.
  double nearest_slave_mm = 0.0;
};

}  // namespace brainshift::inversion
