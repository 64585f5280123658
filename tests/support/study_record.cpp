// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/study_record.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace brainshift::test_support {
namespace {

// Cells hold no commas, quotes or line breaks (tests/benchmarks/csv_table.hpp).
const std::string& cell(const std::string& text) {
  if (text.find_first_of(",\"\n") != std::string::npos) {
    throw std::invalid_argument(text + ": a cell of a table has no comma, quote or line break");
  }
  return text;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

// One write per row in append mode, so that tests that run at the same time do not mix their
// rows.
void append(const char* name, const std::string& row) {
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) return;
  const auto path = std::filesystem::path(folder) / name;
  std::FILE* file = std::fopen(path.c_str(), "a");
  const bool written = file != nullptr && std::fputs((row + "\n").c_str(), file) >= 0;
  const bool closed = file != nullptr && std::fclose(file) == 0;
  if (!written || !closed) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace

void record(const StudyPoint& point) {
  append("points.csv", cell(point.study) + "," + cell(point.series) + "," + cell(point.x_name) +
                           "," + cell(point.y_name) + "," + number(point.x) + "," +
                           number(point.y));
}

bool record_check(const std::string& study, const std::string& name, double value,
                  const std::string& bound, bool pass, const std::string& source) {
  append("checks.csv", cell(study) + "," + cell(name) + "," + number(value) + "," + cell(bound) +
                           "," + (pass ? "1" : "0") + "," + cell(source));
  return pass;
}

void record_figure(const std::string& study, const std::string& name, double value,
                   const std::string& note, const std::string& source) {
  append("checks.csv", cell(study) + "," + cell(name) + "," + number(value) + "," + cell(note) +
                           ",," + cell(source));
}

void record_left_out(const std::string& study, const std::string& reason) {
  append("left_out.csv", cell(study) + "," + cell(reason));
}

}  // namespace brainshift::test_support
