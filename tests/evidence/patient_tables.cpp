// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/patient_tables.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "common/core/statistics.hpp"
#include "tests/benchmarks/paired_test.hpp"
#include "tests/evidence/paper_tables.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::Rows;

std::string cell(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("–");
}

class PatientTables {
 public:
  PatientTables(const Rows& rows, std::ostream& out) : rows_(rows), out_(out) {}

  void write() {
    out_ << "| | 1 | 2 | 3 | 4 | 5 | mean |\n|---|---|---|---|---|---|---|\n";
    both("Table 3: initial misfit, mm", paper::kMisfit_mm, "contact", "initial_mm", 1);
    both("error at the tumour with contact, mm", paper::kContactError_mm, "contact", "tumour_mm",
         2);
    both("the same, fixed", paper::kFixedError_mm, "fixed", "tumour_mm", 2);
    both("recovered with contact, %", paper::kContactRecovered, "contact", "recovered_pct", 0);
    both("the same, fixed", paper::kFixedRecovered, "fixed", "recovered_pct", 0);
    contact_against_fixed();
    both("Table 4: CPPD before, mm", paper::kInitialCppd_mm, "contact", "initial_cppd_mm", 1);
    both("CPPD with contact, mm", paper::kContactCppd_mm, "contact", "cppd_mm", 2);
    both("the same, fixed", paper::kFixedCppd_mm, "fixed", "cppd_mm", 2);
    both("Table 5: iterations with contact", paper::kContactIterations, "contact", "contact_sets",
         0);
    both("the same, fixed", paper::kFixedIterations, "fixed", "contact_sets", 0);
    both("time with contact, s", paper::kContactTime_s, "contact", "update_ms", 2, 1e-3);
    both("the same, fixed", paper::kFixedTime_s, "fixed", "update_ms", 2, 1e-3);
    both("Table 6: principal direction to gravity with contact, degrees", paper::kDirection_deg,
         "contact", "direction_deg", 0);
    both("the same, fixed", paper::kFixedDirection_deg, "fixed", "direction_deg", 0);
    line("the same, truth",
         each([&](int patient) { return of(patient, "contact").mean("true_direction_deg"); }), 0);
  }

 private:
  // Rows of the consistency truth, from the tumour alone.
  Rows of(int patient, const char* boundary) const {
    return rows_.where("patient", std::to_string(patient))
        .where("truth", "consistency")
        .where("boundary", boundary)
        .where("data", "tumour");
  }
  std::vector<double> each(const std::function<double(int)>& value) const {
    std::vector<double> values;
    for (int patient = 1; patient <= paper::kPatients; ++patient) values.push_back(value(patient));
    return values;
  }

  void line(const std::string& name, const std::vector<double>& values, int digits) {
    std::vector<double> finite;
    out_ << "| " << name << " |";
    for (const double value : values) {
      out_ << ' ' << cell(value, digits) << " |";
      if (std::isfinite(value)) finite.push_back(value);
    }
    out_ << ' ' << cell(finite.empty() ? std::nan("") : mean_std(finite).mean, digits) << " |\n";
  }

  void both(const std::string& name, const paper::Figures& theirs, const char* boundary,
            const char* column, int digits, double factor = 1.0) {
    line(name + ": paper", each([&](int patient) {
           const double value = theirs[static_cast<std::size_t>(patient - 1)];
           return value < 0.0 ? std::nan("") : value;
         }),
         digits);
    line("*here*", each([&](int patient) { return factor * of(patient, boundary).mean(column); }),
         digits);
  }

  void contact_against_fixed() {
    out_ << "| p that contact and fixed differ at the tumour: paper | < 0.01 | > 0.05 | > 0.05 | "
            "< 0.01 | > 0.05 | |\n| *here, all truths* |";
    for (int patient = 1; patient <= paper::kPatients; ++patient) {
      const Rows own = rows_.where("patient", std::to_string(patient)).where("data", "tumour");
      const auto errors = [&](const char* boundary) {
        const Rows some = own.where("boundary", boundary);
        std::vector<double> values;
        for (std::size_t i = 0; i < some.size(); ++i) values.push_back(some.number(i, "tumour_mm"));
        return values;
      };
      const std::vector<double> contact = errors("contact"), fixed = errors("fixed");
      const bool pairs = contact.size() == fixed.size() && contact.size() > 1;
      const bench::PairedTest test =
          pairs ? bench::paired_t_test(contact, fixed) : bench::PairedTest{};
      out_ << (test.pairs > 1 ? fmt::format(" {:.2g}; {} by {:.2f} mm |", test.p,
                                            test.mean < 0.0 ? "contact better" : "fixed better",
                                            std::abs(test.mean))
                              : std::string(" – |"));
    }
    out_ << " |\n";
  }

  const Rows& rows_;
  std::ostream& out_;
};

}  // namespace

Status write_patient_tables(const Rows& rows, const std::filesystem::path& file) {
  std::ofstream out(file);
  PatientTables(rows, out).write();
  out.close();
  if (out) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

}  // namespace brainshift::evidence
