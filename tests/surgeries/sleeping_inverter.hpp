// SPDX-License-Identifier: GPL-3.0-or-later
// An inverter that sleeps through updates: until it is woken, the brain has not moved. A pipeline
// over it gathers evidence as any other does, so that the update that wakes it is the estimate of
// all evidence by an inverter that starts cold.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "common/inversion/inverter.hpp"

namespace brainshift::surgeries {

class SleepingInverter final : public inversion::Inverter {
 public:
  // awake: read at every update; must outlive this object. nodes: of the mesh.
  SleepingInverter(std::unique_ptr<inversion::Inverter> inverter, const bool& awake, int nodes)
      : inverter_(std::move(inverter)), awake_(awake), nodes_(nodes) {}

  void reset() override { inverter_->reset(); }
  std::optional<inversion::OmissionErrors> omission_errors() const override {
    if (awake_) return inverter_->omission_errors();
    return std::nullopt;
  }
  std::uint64_t bytes() const override { return inverter_->bytes(); }

 private:
  Status invert(const SparseData& data, const inversion::InversionOptions& options,
                Estimate& estimate) override {
    if (awake_) return inverter_->update(data, options, estimate);
    estimate = Estimate{};
    estimate.displacement = Points::Zero(3, nodes_);
    return {};
  }

  std::unique_ptr<inversion::Inverter> inverter_;
  const bool& awake_;
  int nodes_;
};

}  // namespace brainshift::surgeries
