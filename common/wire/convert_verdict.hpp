// SPDX-License-Identifier: Apache-2.0
// The verdict of an update and the strengths of its prior, to and from its message.
// Private to common/wire: it includes the Protobuf header.
#pragma once

#include "brainshift/v1/brainshift.pb.h"
#include "common/values/estimate.hpp"
#include "common/wire/checked_values.hpp"

namespace brainshift::wire {

void set_verdict(const QualityVerdict& verdict, pb::Update& out);
// kProtocol: an unknown value, a flag that occurs twice, a verdict that its flags contradict, and
// flags without a verdict.
QualityVerdict get_verdict(const pb::Update& message, Checked& checked);

// prior_scales, prior_absent, prior_at_bound and hypotheses. Strengths that are the case's, with no
// hypothesis, are not sent.
void set_prior(const Estimate& estimate, pb::Update& out);
// kNotFinite; kProtocol: an unknown part, a part that is missing or occurs twice, a probability
// outside [0, 1], a negative strength, hypotheses without parts, of another size, or more than
// kMaxHypotheses.
void get_prior(const pb::Update& message, Estimate& estimate, Checked& checked);

}  // namespace brainshift::wire
