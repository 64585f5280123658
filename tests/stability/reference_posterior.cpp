// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/reference_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "common/inversion/strengths/prior_strengths.hpp"

namespace brainshift::stability {
namespace {

constexpr int kMaxSets = 400;

std::vector<int> members(const contact::ActiveSet& set) {
  std::vector<int> result;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i]) result.push_back(static_cast<int>(i));
  }
  return result;
}

// T^T N, unknowns x s.
MatrixR normals_of(const Reference& system) {
  const Unknowns& unknowns = system.unknowns();
  MatrixR loads(unknowns.count, system.num_slaves());
  for (int i = 0; i < system.num_slaves(); ++i) {
    const ReferencePair& pair = system.pairs()[static_cast<std::size_t>(i)];
    VectorR nodal = VectorR::Zero(3 * unknowns.num_nodes());
    nodal.segment<3>(3 * pair.slave) = pair.normal;
    loads.col(i) = unknowns.restrict_to(nodal);
  }
  return loads;
}

std::size_t index_of(PriorPart part) { return static_cast<std::size_t>(part); }

}  // namespace

ReferencePatient::ReferencePatient(const BrainModel& brain, const CaseConfig& config,
                                   PatientMatrices matrices)
    : mesh(brain.mesh),
      kernel(std::move(matrices.kernel)),
      modes(std::move(matrices.modes)),
      part_of_mode(std::move(matrices.part_of_mode)),
      system(std::move(matrices.stiffness), std::move(matrices.unknowns), std::move(matrices.pairs),
             static_cast<Real>(config.contact.penalty_n_per_mm)) {
  const MatrixR normals = normals_of(system);
  contact_columns = system.solve_free(normals);
  compliance = normals.transpose() * contact_columns;
}

MatrixR ReferencePatient::kernel_times(const MatrixR& nodal) const {
  MatrixR out(nodal.rows(), nodal.cols());
  for (Eigen::Index j = 0; j < nodal.cols(); ++j) {
    const VectorR column = nodal.col(j);
    const Eigen::Map<const PointsR> w(column.data(), 3, kernel.rows());
    const PointsR f = w * kernel;  // symmetric
    out.col(j) = Eigen::Map<const VectorR>(f.data(), f.size());
  }
  return out;
}

MatrixR ReferencePatient::covariance_times(const MatrixR& nodal,
                                           const PriorScaleValues& scales) const {
  const auto fine = static_cast<Real>(scales[index_of(PriorPart::kFine)]);
  MatrixR out = fine * fine * kernel_times(nodal);
  MatrixR scaled = modes;
  for (std::size_t j = 0; j < part_of_mode.size(); ++j) {
    scaled.col(static_cast<Eigen::Index>(j)) *=
        static_cast<Real>(scales[index_of(part_of_mode[j])]);
  }
  const MatrixR amplitudes = scaled.transpose() * nodal;
  out += scaled * amplitudes;
  return out;
}

MatrixR ReferencePatient::expand(const MatrixR& unknowns) const {
  MatrixR nodal(3 * mesh.num_nodes(), unknowns.cols());
  for (Eigen::Index j = 0; j < unknowns.cols(); ++j) {
    nodal.col(j) = system.unknowns().expand(unknowns.col(j));
  }
  return nodal;
}

MatrixR ReferencePatient::restrict_to(const MatrixR& nodal) const {
  MatrixR unknowns(system.unknowns().count, nodal.cols());
  for (Eigen::Index j = 0; j < nodal.cols(); ++j) {
    unknowns.col(j) = system.unknowns().restrict_to(nodal.col(j));
  }
  return unknowns;
}

MatrixR sampling_rows(const TetMesh& mesh, const Points& positions) {
  const MatrixR weights = sampling_weights(mesh, positions);
  MatrixR rows = MatrixR::Zero(3 * positions.cols(), 3 * mesh.num_nodes());
  for (Eigen::Index i = 0; i < weights.rows(); ++i) {
    for (Eigen::Index n = 0; n < weights.cols(); ++n) {
      for (int axis = 0; axis < 3; ++axis) rows(3 * i + axis, 3 * n + axis) = weights(i, n);
    }
  }
  return rows;
}

// The linear model of one set: with D = Phi_AA + 1 / beta and Z = A Phi_TA D^-1,
//   B = [I, -Z] over (data, slaves of the set),   right = d - Z 0p_A
struct ReferencePosterior::SetModel {
  std::vector<int> slaves;
  CholeskyFactor compliance;  // D
  MatrixR z;                  // 3m x k
  VectorR gaps;               // 0p of the set
  VectorR right;
};

ReferencePosterior::ReferencePosterior(ReferencePatient& patient, const SparseData& data)
    : patient_(patient), rows_(3 * data.size()), variance_(3 * data.size()) {
  const MatrixR rows = sampling_rows(patient.mesh, data.positions);
  loads_ = patient.restrict_to(rows.transpose());
  data_ = Eigen::Map<const VecX>(data.displacements.data(), rows_).cast<Real>();
  for (Eigen::Index i = 0; i < rows_; ++i) {
    variance_[i] = static_cast<Real>(data.sd_mm[i / 3]) * static_cast<Real>(data.sd_mm[i / 3]);
  }
  sampled_contact_ = loads_.transpose() * patient.contact_columns;

  MatrixR x(loads_.rows(), rows_ + sampled_contact_.cols());
  x << patient.system.solve_free(loads_), patient.contact_columns;
  const MatrixR nodal = patient.expand(x);
  covariance_of_part_[index_of(PriorPart::kFine)] = nodal.transpose() * patient.kernel_times(nodal);
  const MatrixR amplitudes = nodal.transpose() * patient.modes;
  for (std::size_t j = 0; j < patient.part_of_mode.size(); ++j) {
    MatrixR& part = covariance_of_part_[index_of(patient.part_of_mode[j])];
    if (part.size() == 0) part = MatrixR::Zero(x.cols(), x.cols());
    const auto column = amplitudes.col(static_cast<Eigen::Index>(j));
    part += column * column.transpose();
  }
}

std::optional<ReferencePosterior::SetModel> ReferencePosterior::model_of(
    const contact::ActiveSet& set) const {
  SetModel model;
  model.slaves = members(set);
  const auto k = static_cast<Eigen::Index>(model.slaves.size());
  model.z.resize(rows_, k);
  model.gaps.resize(k);
  model.right = data_;
  if (k == 0) return model;
  for (Eigen::Index i = 0; i < k; ++i) {
    const auto slave = static_cast<std::size_t>(model.slaves[static_cast<std::size_t>(i)]);
    model.gaps[i] = patient_.system.pairs()[slave].initial_penetration_mm;
  }
  MatrixR d = patient_.compliance(model.slaves, model.slaves);
  d.diagonal().array() += 1 / patient_.system.beta();
  model.compliance.compute(d);
  if (model.compliance.info() != Eigen::Success) return std::nullopt;
  const MatrixR columns = sampled_contact_(Eigen::all, model.slaves);
  model.z = model.compliance.solve(columns.transpose()).transpose();
  model.right -= model.z * model.gaps;
  return model;
}

MatrixR ReferencePosterior::covariance(const PriorScaleValues& scales) const {
  const Eigen::Index size = rows_ + sampled_contact_.cols();
  MatrixR psi = MatrixR::Zero(size, size);
  for (std::size_t part = 0; part < covariance_of_part_.size(); ++part) {
    const auto s = static_cast<Real>(scales[part]);
    if (covariance_of_part_[part].size() > 0) psi += s * s * covariance_of_part_[part];
  }
  return psi;
}

MatrixR ReferencePosterior::innovation(const SetModel& model, const MatrixR& psi) const {
  const Eigen::Index slaves = psi.rows() - rows_;
  MatrixR result = psi.topLeftCorner(rows_, rows_);
  result.diagonal() += variance_;
  if (model.slaves.empty()) return result;
  const MatrixR cross = psi.topRightCorner(rows_, slaves)(Eigen::all, model.slaves);
  const MatrixR own = psi.bottomRightCorner(slaves, slaves)(model.slaves, model.slaves);
  const MatrixR half = cross * model.z.transpose();
  const MatrixR seen = model.z * own;
  result -= half + half.transpose();
  result += seen * model.z.transpose();
  return result;
}

std::optional<contact::ActiveSet> ReferencePosterior::find_set(
    const PriorScaleValues& scales) const {
  const MatrixR psi = covariance(scales);
  const auto slaves = static_cast<Eigen::Index>(patient_.system.num_slaves());
  VectorR gaps(slaves);
  for (Eigen::Index i = 0; i < slaves; ++i) {
    gaps[i] = patient_.system.pairs()[static_cast<std::size_t>(i)].initial_penetration_mm;
  }
  contact::ActiveSet set(static_cast<std::size_t>(slaves), 0);
  std::set<contact::ActiveSet> visited;
  bool cycled = false;
  for (int k = 0; k < kMaxSets; ++k) {
    const auto model = model_of(set);
    if (!model) return std::nullopt;
    const Eigen::LLT<MatrixR> factor(innovation(*model, psi));
    if (factor.info() != Eigen::Success) return std::nullopt;
    const VectorR mu = factor.solve(model->right);
    VectorR multipliers = VectorR::Zero(psi.rows());  // B^T mu
    multipliers.head(rows_) = mu;
    const VectorR at_slaves = -(model->z.transpose() * mu);
    for (std::size_t i = 0; i < model->slaves.size(); ++i) {
      multipliers[rows_ + model->slaves[i]] = at_slaves[static_cast<Eigen::Index>(i)];
    }
    const VectorR free = (psi * multipliers).tail(slaves);  // N . u of the free body
    VectorR forces(0);
    VectorR penetration = gaps - free;
    if (!model->slaves.empty()) {
      forces = model->compliance.solve(VectorR(penetration(model->slaves)));
      penetration -= patient_.compliance(Eigen::all, model->slaves) * forces;
    }
    contact::ActiveSet next(set.size());
    for (Eigen::Index i = 0; i < slaves; ++i) {
      next[static_cast<std::size_t>(i)] = penetration[i] > 0;
    }
    for (std::size_t i = 0; i < model->slaves.size(); ++i) {
      next[static_cast<std::size_t>(model->slaves[i])] = forces[static_cast<Eigen::Index>(i)] >= 0;
    }
    if (next == set) return set;
    cycled = cycled || !visited.insert(set).second;
    if (cycled) {
      const auto first = static_cast<std::size_t>(
          std::mismatch(set.begin(), set.end(), next.begin()).first - set.begin());
      set[first] = next[first];
    } else {
      set = std::move(next);
    }
  }
  return std::nullopt;
}

std::optional<Posterior> ReferencePosterior::of_set(const contact::ActiveSet& set,
                                                    const PriorScaleValues& scales) {
  return of_set(set, std::vector<Hypothesis>{{scales, 1.0}});
}

std::optional<Posterior> ReferencePosterior::of_set(const contact::ActiveSet& set,
                                                    const std::vector<Hypothesis>& hypotheses) {
  Reference& system = patient_.system;
  if (!system.activate(set)) return std::nullopt;
  const MatrixR adjoints = system.solve(loads_);  // K_p^-1 T^T A^T
  const MatrixR nodal = patient_.expand(adjoints);
  const VectorR shift = system.displacement(Points::Zero(3, patient_.mesh.num_nodes()));
  const VectorR misfit = data_ - loads_.transpose() * system.unknowns().restrict_to(shift);
  MatrixR load = MatrixR::Zero(loads_.rows(), 1);
  for (const Hypothesis& each : hypotheses) {
    const MatrixR forces = patient_.restrict_to(patient_.covariance_times(nodal, each.scales));
    MatrixR innovation = adjoints.transpose() * forces;
    innovation.diagonal() += variance_;
    const Eigen::LLT<MatrixR> factor(innovation);
    if (factor.info() != Eigen::Success) return std::nullopt;
    load += static_cast<Real>(each.weight) * (forces * factor.solve(misfit));
  }
  Posterior result;
  result.active = set;
  result.displacement = shift + patient_.expand(system.solve(load)).col(0);
  result.penetration = system.penetration(result.displacement);
  for (Eigen::Index i = 0; i < result.penetration.size(); ++i) {
    const Real p = result.penetration[i];
    const bool active = set[static_cast<std::size_t>(i)] != 0;
    const Real wrong = active ? -system.beta() * p * patient_.compliance(i, i) : p;
    result.violation_mm = std::max(result.violation_mm, wrong);
  }
  return result;
}

std::optional<Real> ReferencePosterior::log_evidence(const SetModel& model,
                                                     const PriorScaleValues& scales) const {
  const Eigen::LLT<MatrixR> factor(innovation(model, covariance(scales)));
  if (factor.info() != Eigen::Success) return std::nullopt;
  const MatrixR lower = factor.matrixL();
  const VectorR white = factor.matrixL().solve(model.right);
  Real log_p = -white.squaredNorm() / 2 - lower.diagonal().array().log().sum();
  // Half the weight at 0, the rest log-normal about 1 on the grid of strengths.
  const Real width = std::log(Real(3));
  Real sum = 0;
  for (const double strength : inversion::kStrengths) {
    if (strength > 0) sum += std::exp(-std::pow(std::log(Real(strength)) / width, 2) / 2);
  }
  for (std::size_t part = 0; part < scales.size(); ++part) {
    if (covariance_of_part_[part].size() == 0) continue;
    const auto strength = static_cast<Real>(scales[part]);
    log_p += std::log(Real(0.5L));
    if (strength > 0) log_p -= std::log(sum) + std::pow(std::log(strength) / width, 2) / 2;
  }
  return log_p;
}

std::optional<Real> ReferencePosterior::gain_left(const contact::ActiveSet& set,
                                                  const PriorScaleValues& scales) const {
  const auto model = model_of(set);
  if (!model) return std::nullopt;
  const auto start = log_evidence(*model, scales);
  if (!start) return std::nullopt;
  PriorScaleValues best = scales;
  Real highest = *start;
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t part = 0; part < best.size(); ++part) {
      if (covariance_of_part_[part].size() == 0) continue;
      for (const double strength : inversion::kStrengths) {
        PriorScaleValues other = best;
        other[part] = strength;
        const auto there = log_evidence(*model, other);
        if (!there || *there <= highest + Real(0.01L)) continue;
        highest = *there;
        best = other;
        moved = true;
      }
    }
  }
  return highest - *start;
}

}  // namespace brainshift::stability
