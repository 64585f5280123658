// SPDX-License-Identifier: GPL-3.0-or-later
// A patient small enough for dense linear algebra: a box brain of 60 mm, gravity along -z.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::test_support {

// Box mesh cells^3. Craniotomy: nodes of the top face within 16 mm of its centre. Brainstem:
// nodes of the bottom face within 8 mm of its centre. Fixed: the other boundary nodes at z <= 30
// mm. Slaves: the rest of the boundary. Skull: the boundary moved outwards by gap_mm. Tumour: a
// ball of radius 10 mm at (30, 30, 40).
BrainModel toy_patient(int cells = 5, double gap_mm = 1.0);

CaseConfig toy_config();

}  // namespace brainshift::test_support
