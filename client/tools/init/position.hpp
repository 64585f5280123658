// SPDX-License-Identifier: GPL-3.0-or-later
// How a patient lies during surgery, in words, as the direction of gravity in the head's RAS.
//
// WORD[,CHANGE-DEGREES]...
//   WORD      supine (on the back, gravity -A), prone (+A), sitting (-S), left-lateral (on the
//             left side, -R), right-lateral (+R)
//   raised, lowered           the table: head end up or down; not of a sitting patient
//   left, right               the head is turned: the face goes to the patient's left or right
//   flexed, extended          chin to chest, or away from it
//   tilted-left, -right       ear to the left or right shoulder
// Changes of the table come first. Those of the head are about its own axes, in the order given:
// with rotations R_1, R_2, ... of the head against the body, g = ... R_2^T R_1^T g_body.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

// Unit. kInvalidArgument quotes the word and lists those that there are: an unknown word, degrees
// that are no number from 0 to 180 (tables and necks: 90), a raised table of a sitting patient.
Result<Vec3> gravity_of_position(const std::string& position);

}  // namespace brainshift::client
