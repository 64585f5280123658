// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/inverter.hpp"

#include <utility>

#include "common/contact/iterative_system.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/descent/descents.hpp"
#include "common/inversion/prepared/condense.hpp"

namespace brainshift::inversion {
namespace {

// An estimate depends on its data alone: there is no state beside the operators.
class Condensed final : public Inverter {
 public:
  Condensed(CondensedInverter inverter, std::uint64_t bytes)
      : inverter_(std::move(inverter)), bytes_(bytes) {}
  void reset() override {}
  std::optional<OmissionErrors> omission_errors() const override {
    return inverter_.omission_errors();
  }
  std::uint64_t bytes() const override { return bytes_; }
  const UpdateProfile* profile() const override { return &inverter_.profile(); }
  std::optional<PosteriorModes> posterior() const override {
    if (!updated_) return std::nullopt;
    return inverter_.posterior();
  }

 private:
  Status invert(const SparseData& data, const InversionOptions& options,
                Estimate& estimate) override {
    const Status done = inverter_.update(data, estimate, options);
    updated_ = done.has_value();
    return done;
  }

  CondensedInverter inverter_;
  bool updated_ = false;
  std::uint64_t bytes_;  // of the operators, which the inverter shares
};

// With the system of equations that belongs to the method.
//   kPaper             steepest descent      refactorises for every new active set
//   kPaperWoodbury     steepest descent      contact as a low-rank correction of the factor
//   kIterativeSolver   conjugate gradients   solves by preconditioned conjugate gradients
Result<Estimate> descend(const PreparedModel& model, Method method, const SparseData& data,
                         const InversionOptions& options) {
  if (method == Method::kPaper) {
    contact::RefactorisedSystem system(model.forward());
    return steepest_descent(model, data, options, system);
  }
  if (method == Method::kPaperWoodbury) {
    contact::WoodburySystem system(model.forward());
    return steepest_descent(model, data, options, system);
  }
  const auto system = contact::IterativeSystem::build(model.forward());
  if (!system) return tl::unexpected(system.error());
  return conjugate_gradients(model, data, options, **system);
}

// Every descent starts from nothing: there is no state beside the model.
class Descent final : public Inverter {
 public:
  Descent(std::shared_ptr<const PreparedModel> model, Method method)
      : model_(std::move(model)), method_(method) {}
  void reset() override {}
  std::optional<OmissionErrors> omission_errors() const override { return std::nullopt; }
  std::uint64_t bytes() const override { return model_->timings().bytes; }

 private:
  Status invert(const SparseData& data, const InversionOptions& options,
                Estimate& estimate) override {
    if (auto status = check_data(data); !status) return status;
    if (auto status = check_whole(data); !status) return status;
    auto made = descend(*model_, method_, data, options);
    if (!made) return tl::unexpected(made.error());
    estimate = std::move(*made);
    return check_estimate(model_->model().mesh, model_->config().material, estimate);
  }

  std::shared_ptr<const PreparedModel> model_;
  Method method_;
};

Result<std::unique_ptr<Inverter>> condense_and_build(const PreparedModel& model,
                                                     const std::stop_token& stop) {
  CondenseOptions options;
  options.stop = stop;
  auto operators = condense(model, options);
  if (!operators) return tl::unexpected(operators.error());
  return condensed_inverter(std::make_shared<const CondensedOperators>(std::move(*operators)),
                            std::make_shared<const geometry::TetLocator>(model.model().mesh),
                            model.config());
}

}  // namespace

Status Inverter::update(const SparseData& data, const InversionOptions& options,
                        Estimate& estimate) {
  if (auto status = invert(data, options, estimate); !status) return status;
  judge(estimate, estimate.quality);
  if (!estimate.quality.usable()) reset();
  return {};
}

Result<std::unique_ptr<Inverter>> condensed_inverter(
    std::shared_ptr<const CondensedOperators> operators,
    std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config,
    const CondensedOptions& options) {
  const std::uint64_t bytes = operators->bytes();
  auto inverter =
      CondensedInverter::build(std::move(operators), std::move(locator), config, options);
  if (!inverter) return tl::unexpected(inverter.error());
  return std::make_unique<Condensed>(std::move(*inverter), bytes);
}

Result<std::unique_ptr<Inverter>> make_inverter(std::shared_ptr<const PreparedModel> model,
                                                Method method, const std::stop_token& stop) {
  if (method == Method::kCondensed) return condense_and_build(*model, stop);
  return std::make_unique<Descent>(std::move(model), method);
}

Result<Estimate> invert(const PreparedModel& model, const SparseData& data, Method method,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  // Shares nothing: the caller's model outlives the inverter, which ends with this function.
  const std::shared_ptr<const PreparedModel> borrowed(std::shared_ptr<void>(), &model);
  const auto inverter = make_inverter(borrowed, method, options.stop);
  if (!inverter) return tl::unexpected(inverter.error());
  Estimate estimate;
  if (auto status = (*inverter)->update(data, options, estimate); !status) {
    return tl::unexpected(status.error());
  }
  return estimate;
}

}  // namespace brainshift::inversion
