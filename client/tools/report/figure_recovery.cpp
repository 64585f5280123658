// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "client/tools/pictures/bars.hpp"
#include "client/tools/report/figures.hpp"
#include "client/tools/report/paper_values.hpp"

namespace brainshift::client {

Figure recovery_figure(const std::vector<RunGroup>& groups, const std::vector<ReportedRun>& runs) {
  BarSpec spec;
  spec.title = "Share of the deformation recovered";
  spec.subtitle =
      "100 (1 - mean error / mean without correction); craniotomy by closest-point projection "
      "distance";
  spec.y_label = "recovered (%)";
  spec.series = {{"contact boundary", palette::kBlue, {}},
                 {"fixed boundary", palette::kOrange, {}}};
  spec.reference_legend = "Ji et al. 2009 (simulated case)";
  spec.references.resize(2);

  using Value = std::optional<double> RunReport::*;
  const auto add = [&](const RunGroup& group, const char* place, Value value) {
    const auto of = [&](std::optional<std::size_t> run) {
      return run ? runs[*run].report.*value : std::nullopt;
    };
    const RunReport& any = runs[group.contact ? *group.contact : *group.fixed].report;
    const bool tumour = value == &RunReport::recovery_pct;
    spec.groups.push_back(any.scenario + "\n" + any.method + "\n" + place);
    spec.series[0].values.push_back(of(group.contact));
    spec.series[1].values.push_back(of(group.fixed));
    std::optional<double> contact;
    std::optional<double> fixed;
    if (any.scenario == "paper") {
      contact = tumour ? paper::kContactRecovery_pct : paper::kContactCraniotomyRecovery_pct;
      if (tumour) fixed = paper::kFixedRecovery_pct;
    } else if (any.scenario == "paper-icp" && tumour) {
      contact = paper::kIcpRecovery_pct;
    }
    spec.references[0].push_back(contact);
    spec.references[1].push_back(fixed);
  };
  for (const RunGroup& group : groups) {
    add(group, "tumour", &RunReport::recovery_pct);
    add(group, "craniotomy", &RunReport::craniotomy_recovery_pct);
  }
  // Worse than doing nothing is possible; one bad value must not flatten all others.
  double lowest = 0.0;
  for (const BarSeries& series : spec.series) {
    for (const auto& value : series.values) lowest = std::min(lowest, value.value_or(0.0));
  }
  spec.y_min = lowest < 0.0 ? std::max(-100.0, 1.1 * lowest - 8.0) : 0.0;
  spec.y_max = 112.0;

  Figure figure;
  figure.file_name = "recovery.png";
  figure.caption =
      "Deformation recovered at the tumour (cross-validation points) and at the craniotomy "
      "(closest-point "
      "projection distance), contact against fixed boundary. Black ticks: the paper's simulated "
      "case.";
  figure.image = draw_bars(spec);
  return figure;
}

}  // namespace brainshift::client
