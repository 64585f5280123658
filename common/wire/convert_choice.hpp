// SPDX-License-Identifier: Apache-2.0
// What a viewer chose, and the nodes that a field is of, to and from their messages.
// Private to common/wire: it includes the Protobuf header.
#pragma once

#include "brainshift/v1/brainshift.pb.h"
#include "common/values/estimate.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/checked_values.hpp"

namespace brainshift::wire {

void set_choice(const FieldChoice& choice, pb::FieldChoice& out);
// kProtocol: a centre that is not three numbers; otherwise the errors of validate(FieldChoice).
Result<FieldChoice> get_choice(const pb::FieldChoice& message);

void set_part(const FieldPart& part, pb::FieldPart& out);
// kProtocol: a mesh without nodes or with more than kMaxPoints, a node twice or outside the mesh,
// no node without a base, a base that is not below the update's sequence, or a base of an update
// that is not final. Does not compare with the number of displacements.
FieldPart get_part(const pb::Update& message, Checked& checked);

}  // namespace brainshift::wire
