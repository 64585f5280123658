// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_checks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/core/statistics.hpp"
#include "tests/benchmarks/paired_test.hpp"
#include "tests/evidence/evidence_truths.hpp"
#include "tests/evidence/paper_tables.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::Rows;
using test_support::record_check;
using test_support::record_figure;
using test_support::record_left_out;

constexpr double kSignificant = 0.05;

// All ingredients together, and another code.
bool far_off(const std::string& truth) { return truth == "all" || truth == "calculix"; }

class EvidenceChecks {
 public:
  explicit EvidenceChecks(const Rows& all) : all_(all), head_(all.text(0, "head")) {}

  void run() {
    for (const std::string& truth : all_.values("truth")) {
      if (left_out(truth)) continue;
      recovered(truth);
      craniotomy(truth);
      boundaries(truth);
      intervals(truth);
      shift(truth);
      unusable(truth);
    }
    mean_coverage();
    for (const std::string& patient : all_.values("patient")) of_patient(patient);
    refused();
  }

 private:
  // Fields of another code are those of one mesh; refused() says so.
  bool left_out(const std::string& truth) const {
    const Rows rows = all_.where("truth", truth);
    return truth == "calculix" && rows.where("status", "refused").size() == rows.size();
  }
  Rows of(const std::string& truth, const char* boundary, const char* data) const {
    return all_.where("truth", truth).where("boundary", boundary).where("data", data);
  }
  void check(const std::string& name, double value, const std::string& bound, bool pass) {
    record_check(head_, name, value, bound, pass, source());
  }
  void figure(const std::string& name, double value, const std::string& note) {
    record_figure(head_, name, value, note, source());
  }
  std::string source() const {
    return fmt::format("twins of {} patients; {} nodes", all_.values("patient").size(),
                       all_.text(0, "nodes"));
  }

  void recovered(const std::string& truth) {
    const double alone = patient_mean(of(truth, "contact", "tumour"), "recovered_pct");
    const double fixed = patient_mean(of(truth, "fixed", "tumour"), "recovered_pct");
    const double joint = patient_mean(of(truth, "contact", "tumour+cortex"), "recovered_pct");
    const double least = truth == "consistency" ? 95.0 : far_off(truth) ? 80.0 : 88.0;
    check(truth + ": tumour recovered %", alone,
          fmt::format(">= {:.0f} (paper {:.0f}; fixed {:.1f}; with cortex {:.1f})", least,
                      paper::kMeanContactRecovered, fixed, joint),
          alone >= least);
  }

  void craniotomy(const std::string& truth) {
    const double alone = patient_mean(of(truth, "contact", "tumour"), "cppd_mm");
    const double before = patient_mean(of(truth, "contact", "tumour"), "initial_cppd_mm");
    const double fixed = patient_mean(of(truth, "fixed", "tumour"), "cppd_mm");
    const double joint = patient_mean(of(truth, "contact", "tumour+cortex"), "cppd_mm");
    const std::string beside =
        fmt::format("paper {:.1f} and fixed {:.1f}; here before {:.2f} and fixed {:.2f}",
                    paper::kMeanContactCppd_mm, paper::kMeanFixedCppd_mm, before, fixed);
    const std::string name = truth + ": craniotomy CPPD mm from the tumour alone";
    if (truth == "consistency") {
      check(name, alone, "<= 1.0 (" + beside + ")", alone <= 1.0);
    } else {
      figure(name, alone, "shown (" + beside + ")");
    }
    const double most = truth == "consistency" ? 0.5 : 1.0;
    check(truth + ": craniotomy CPPD mm from tumour and cortex", joint,
          fmt::format("<= {:.1f} (paper: none)", most), joint <= most);
  }

  // Contact against fixed on the same surgeries: worse only where a test says so.
  void boundaries(const std::string& truth) {
    for (const auto& [column, what] :
         {std::pair{"tumour_mm", "tumour error"}, std::pair{"cppd_mm", "craniotomy CPPD"}}) {
      std::vector<double> contact, fixed;
      for (const char* data : {"tumour", "tumour+cortex"}) {
        const Rows a = of(truth, "contact", data), b = of(truth, "fixed", data);
        if (a.size() != b.size()) continue;  // a surgery that was refused
        for (std::size_t i = 0; i < a.size(); ++i) {
          contact.push_back(a.number(i, column));
          fixed.push_back(b.number(i, column));
        }
      }
      const bench::PairedTest test = bench::paired_t_test(contact, fixed);
      if (test.pairs < 2) continue;
      check(fmt::format("{}: {} with contact less that of fixed mm", truth, what), test.mean,
            fmt::format("<= 0 or p > {} (p {:.2g}; {} pairs)", kSignificant, test.p, test.pairs),
            test.mean <= 0.0 || test.p > kSignificant);
    }
  }

  void intervals(const std::string& truth) {
    const double alone = patient_mean(of(truth, "contact", "tumour"), "coverage_90");
    const double joint = patient_mean(of(truth, "contact", "tumour+cortex"), "coverage_90");
    figure(truth + ": coverage of the 90 % interval", joint,
           fmt::format("shown (from the tumour alone {:.2f})", alone));
  }

  // Where an update from the tumour and one beside the cortex are both unusable, the daemon makes
  // the latter again from the cortex alone.
  void unusable(const std::string& truth) {
    const Rows contact = all_.where("truth", truth).where("boundary", "contact");
    const Rows fixed = all_.where("truth", truth).where("boundary", "fixed");
    figure(truth + ": updates of quality unusable",
           static_cast<double>(contact.where("quality", "unusable").size()),
           fmt::format("shown; of {} (fixed {} of {})", contact.size(),
                       fixed.where("quality", "unusable").size(), fixed.size()));
  }

  void mean_coverage() {
    std::vector<double> means;
    for (const std::string& truth : all_.values("truth")) {
      if (truth == "consistency") continue;
      const double mean = patient_mean(of(truth, "contact", "tumour+cortex"), "coverage_90");
      if (std::isfinite(mean)) means.push_back(mean);
    }
    if (means.empty()) return;
    const double mean = mean_std(means).mean;
    check("adverse truths: coverage of the 90 % interval", mean, "0.75 to 0.97",
          mean >= 0.75 && mean <= 0.97);
  }

  // An update must not do worse at the tumour than shifting it by the same boundary does.
  void shift(const std::string& truth) {
    const Rows rows = of(truth, "contact", "tumour");
    const int worse =
        static_cast<int>(rows.where([](const Rows& all, std::size_t i) {
                               return all.number(i, "tumour_mm") > all.number(i, "shift_tumour_mm");
                             })
                             .size());
    const std::string name = truth + ": updates worse at the tumour than a rigid shift of it";
    const std::string beside =
        fmt::format("{} (estimate {:.2f}; shift {:.2f}; best rigid motion {:.2f} mm)", rows.size(),
                    patient_mean(rows, "tumour_mm"), patient_mean(rows, "shift_tumour_mm"),
                    patient_mean(rows, "rigid_tumour_mm"));
    if (far_off(truth)) {
      check(name, worse, "0 of " + beside, worse == 0);
    } else {
      figure(name, worse, "shown; of " + beside);
    }
  }

  // The consistency truth of a patient beside the paper's Tables 3, 4 and 6.
  void of_patient(const std::string& patient) {
    const auto index = static_cast<std::size_t>(std::stoi(patient) - 1);
    if (index >= paper::kMisfit_mm.size()) return;
    const Rows contact = of("consistency", "contact", "tumour").where("patient", patient);
    const Rows fixed = of("consistency", "fixed", "tumour").where("patient", patient);
    if (contact.empty()) return;
    const auto show = [&](const char* what, double ours, double theirs, double also) {
      figure(fmt::format("patient {}: {}", patient, what), ours,
             theirs < 0.0 ? "shown (paper: none)"
                          : fmt::format("shown (paper {:g}; here fixed {:.3g})", theirs, also));
    };
    show("initial misfit mm", contact.mean("initial_mm"), paper::kMisfit_mm[index],
         fixed.mean("initial_mm"));
    show("tumour recovered %", contact.mean("recovered_pct"), paper::kContactRecovered[index],
         fixed.mean("recovered_pct"));
    show("initial CPPD mm", contact.mean("initial_cppd_mm"), paper::kInitialCppd_mm[index],
         fixed.mean("initial_cppd_mm"));
    show("CPPD mm", contact.mean("cppd_mm"), paper::kContactCppd_mm[index], fixed.mean("cppd_mm"));
    show("principal direction to gravity degrees", contact.mean("direction_deg"),
         paper::kDirection_deg[index], fixed.mean("direction_deg"));
  }

  void refused() {
    const Rows rows = all_.where("status", "refused");
    figure("updates that were refused", static_cast<double>(rows.size()),
           fmt::format("shown; of {}", all_.size()));
    for (const std::string& reason : rows.values("reason")) record_left_out(head_, reason);
  }

  const Rows& all_;
  std::string head_;
};

}  // namespace

double patient_mean(const Rows& rows, const char* column) {
  std::vector<double> means;
  for (const std::string& patient : rows.values("patient")) {
    const double mean = rows.where("patient", patient).mean(column);
    if (std::isfinite(mean)) means.push_back(mean);
  }
  return means.empty() ? std::numeric_limits<double>::quiet_NaN() : mean_std(means).mean;
}

void check_evidence(const Rows& head) { EvidenceChecks(head).run(); }

}  // namespace brainshift::evidence
