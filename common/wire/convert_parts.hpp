// SPDX-License-Identifier: Apache-2.0
// Parts of messages: what a viewer chose, the nodes that a field is of, the verdict of an update
// and the strengths of its prior. Private to common/wire: it includes the Protobuf header.
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

void set_verdict(const QualityVerdict& verdict, pb::Update& out);
// kProtocol: an unknown value, a flag that occurs twice, a verdict that its flags contradict, and
// flags without a verdict.
QualityVerdict get_verdict(const pb::Update& message, Checked& checked);

// prior_scales, prior_absent, prior_at_bound and hypotheses. Strengths that are the case's, with no
// hypothesis, are not sent.
void set_prior(const Estimate& estimate, pb::Update& out);
// Parts that a peer with an older prior does not list are absent: strength 0, probability 1.
// kNotFinite; kProtocol: an unknown part, a part that occurs twice, a probability outside [0, 1], a
// negative strength, hypotheses without parts, of another size, or more than kMaxHypotheses.
void get_prior(const pb::Update& message, Estimate& estimate, Checked& checked);

}  // namespace brainshift::wire
