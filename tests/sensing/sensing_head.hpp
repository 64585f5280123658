// SPDX-License-Identifier: GPL-3.0-or-later
// The default head, prepared once, and the daemon's pipeline on it without the daemon.
#pragma once

#include <memory>

#include "client/replay/run_report.hpp"
#include "client/twin/surgery.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "server/pipeline/pipeline.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::sensing {

// Contact boundary. `thousand_nodes`: wanted size of the mesh. swelling_strain_sd: prior.swelling_strain_sd of the case.
// Prints how long it took.
Result<bench::Head> make_default_head(double thousand_nodes, double swelling_strain_sd);

// Updates as a session makes them: warm, with the evidence of the other sources.
class Surgery {
 public:
  static Result<Surgery> begin(const bench::Head& head, const CaseConfig& config);
  Result<Update> observe(const Observation& observation);
  // Forgets everything, as a new session does.
  void restart();

 private:
  Surgery(std::shared_ptr<inversion::CondensedInverter> inverter,
          std::shared_ptr<const server::Pipeline> pipeline, double max_age_s);
  std::shared_ptr<inversion::CondensedInverter> inverter_;
  std::shared_ptr<const server::Pipeline> pipeline_;
  server::Evidence evidence_;
};

// Errors and coverage of an update; the truth is read here only.
Result<client::RunReport> score_update(const bench::Head& head, const io::SurgeryTruth& truth,
                                       const Update& update);

}  // namespace brainshift::sensing
