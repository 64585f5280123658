// SPDX-License-Identifier: GPL-3.0-or-later
// An inverter without a model, whose estimates are judged as any other's.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "common/inversion/inverter.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {

// Every node moves as the first datum does.
inline Status follow_the_data(const SparseData& data, Estimate& estimate, int nodes) {
  estimate.status = EstimateStatus::kConverged;
  estimate.reason = "test";
  estimate.displacement = Points(Vec3(data.displacements.col(0)).replicate(1, nodes));
  return {};
}

class FakeInverter final : public inversion::Inverter {
 public:
  // call: number of this update since construction, from 1.
  using Update = std::function<Status(int call, const SparseData&,
                                      const inversion::InversionOptions&, Estimate&)>;

  explicit FakeInverter(Update update) : update_(std::move(update)) {}
  explicit FakeInverter(int nodes = 4)
      : update_([nodes](int, const SparseData& data, const auto&, Estimate& estimate) {
          return follow_the_data(data, estimate, nodes);
        }) {}

  void reset() override { ++resets; }
  std::optional<inversion::OmissionErrors> omission_errors() const override { return errors; }
  std::uint64_t bytes() const override { return 0; }

  std::optional<inversion::OmissionErrors> errors;
  int resets = 0;

 private:
  Status invert(const SparseData& data, const inversion::InversionOptions& options,
                Estimate& estimate) override {
    return update_(++calls_, data, options, estimate);
  }

  Update update_;
  int calls_ = 0;
};

}  // namespace brainshift::server
