// SPDX-License-Identifier: GPL-3.0-or-later
// A DaemonReport as metric families: names with their units, HELP and TYPE, as monitors that scrape
// expect them (docs/operations.md lists them). Times are seconds, sizes bytes; a name that ends in
// _total only grows until the daemon ends.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

#include "common/wire/report.hpp"

namespace brainshift::server {

std::vector<prometheus::MetricFamily> metric_families(const wire::DaemonReport& report);

}  // namespace brainshift::server
