// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/calculix_truth.hpp"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common/io/files/csv_numbers.hpp"

namespace brainshift::evidence {

namespace fs = std::filesystem;

Status write_points(const Points& points, const fs::path& file) {
  std::ofstream out(file);
  for (const auto& p : points.colwise()) {
    out << fmt::format("{:.5f},{:.5f},{:.5f}\n", p[0], p[1], p[2]);
  }
  out.close();
  if (out) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

Result<Points> read_points(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return fail(ErrorCode::kNotFound, file.string() + ": cannot be read");
  std::vector<double> values;
  int line_number = 0;
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    const auto cells = io::cells_of(line);
    bool fine = cells.size() == 3;
    for (std::size_t k = 0; fine && k < 3; ++k) {
      fine = io::parse_number(cells[k], values.emplace_back());
    }
    if (!fine) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("{}:{}: not three numbers", file.string(), line_number));
    }
  }
  return Points(
      Eigen::Map<const Points>(values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)));
}

Result<Points> read_calculix_truth(const fs::path& folder, int patient, const Points& nodes) {
  const auto own = read_points(folder / "nodes.csv");
  if (!own) return own;
  if (own->cols() != nodes.cols() || (*own - nodes).colwise().norm().maxCoeff() > kSameNode_mm) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("calculix: the fields are of a mesh with {} nodes; this one has {} or "
                            "others",
                            own->cols(), nodes.cols()));
  }
  auto u = read_points(folder / fmt::format("patient-{}.csv", patient));
  if (u && u->cols() != nodes.cols()) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("calculix: patient-{}.csv has {} rows for {} nodes", patient, u->cols(),
                            nodes.cols()));
  }
  return u;
}

GivenTruth::GivenTruth(Points displacement, const contact::PenaltyContact& contact) {
  truth_.active = contact::count(contact.penetrating(displacement));
  if (contact.num_slaves() > 0) {
    truth_.max_penetration_mm = contact.penetration(displacement).maxCoeff();
  }
  truth_.displacement = std::move(displacement);
}

Result<client::Truth> GivenTruth::solve(const Points& /*load*/) { return truth_; }

}  // namespace brainshift::evidence
