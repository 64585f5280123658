// SPDX-License-Identifier: GPL-3.0-or-later
// A daemon's report as JSON: the keys are the fields of brainshift.v1.DaemonReport, with
// "well" and "complaint" in front.
#pragma once

#include <string>

#include "common/wire/report.hpp"

namespace brainshift::client {

std::string report_json(const wire::DaemonReport& report);

}  // namespace brainshift::client
