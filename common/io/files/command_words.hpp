// SPDX-License-Identifier: GPL-3.0-or-later
// Words typed at the wrong place: what was meant, and the other of the two programs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace brainshift::io {

// The word that `typed` becomes with the fewest letters added, taken away, changed or swapped with
// their neighbour (optimal string alignment), where these are at most two and fewer than half of
// its letters; the first of several. Empty: none is near.
std::string nearest_word(std::string_view typed, const std::vector<std::string>& words);

// Becomes `program` with these arguments (argv[0] is replaced): the one beside this program's own
// file, or else the one that PATH finds. Returns when there is none.
void become(const std::string& program, char** argv);

}  // namespace brainshift::io
