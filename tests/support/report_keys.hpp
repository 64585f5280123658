// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of a run in report.json that scripts rely on.
#pragma once

namespace brainshift::test_support {

inline constexpr const char* kReportKeys[] = {"case",
                                              "scenario",
                                              "method",
                                              "boundary",
                                              "mesh",
                                              "prepare_s",
                                              "model_bytes",
                                              "full_solve_ms",
                                              "updates",
                                              "latency_ms",
                                              "cold_ms",
                                              "stages_ms",
                                              "error_mm",
                                              "recovery_pct",
                                              "field_error_pct",
                                              "coverage_90",
                                              "region_known",
                                              "contact",
                                              "principal_direction_deg",
                                              "left_out",
                                              "quality",
                                              "prior_strengths",
                                              "hypotheses"};

}  // namespace brainshift::test_support
