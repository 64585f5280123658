// SPDX-License-Identifier: GPL-3.0-or-later
// Which columns of U an update uses: a scene may leave out the gravity modes (the first ones) or
// the last ones.
#pragma once

namespace brainshift::inversion {

struct ModeWindow {
  int first = 0, count = 0;
};

}  // namespace brainshift::inversion
