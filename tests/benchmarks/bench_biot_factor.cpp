// SPDX-License-Identifier: GPL-3.0-or-later
// Ways to solve one backward-Euler step of Biot consolidation on the default head
// (docs/decisions/0011): L D L^T of the whole matrix, and conjugate gradients on the pressure
// Schur complement with the Cholesky factor of K. One BLAS thread. Prints a table; about two
// minutes. Arguments: step sizes in seconds (default 60 1 0.01).
#include <sys/resource.h>

#include <cstdio>
#include <cstdlib>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/stopwatch.hpp"
#include "common/fem/biot_matrix.hpp"
#include "common/geometry/surface.hpp"
#include "common/linalg/openblas.hpp"
#include "common/linalg/symmetric_indefinite.hpp"
#include "common/patient/read_patient.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

constexpr int kColumns = 64;

using bench::median_ms;
using bench::value_or_exit;

double peak_gib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / (1024.0 * 1024.0);
}

// |b - A x| / |b|.
double relative_residual(const linalg::SymmetricMatrix& lower, const VecX& b, const VecX& x) {
  return (b - linalg::multiply(lower, x)).norm() / b.norm();
}

// (C + G^T K^-1 G) p = -g - G^T K^-1 f by conjugate gradients,
// preconditioned with C + M / (lambda + 2 G).
class SchurComplement {
 public:
  SchurComplement(const fem::BiotMatrix& biot, const linalg::SymmetricMatrix& preconditioner)
      : nu_(biot.displacement_unknowns), np_(biot.pressure_unknowns) {
    const auto& a = biot.lower;
    stiffness_ = a.block(0, 0, nu_, nu_);
    coupling_ = -a.block(nu_, 0, np_, nu_);  // G^T
    pressure_ = -a.block(nu_, nu_, np_, np_);
    factor_.emplace_back(value_or_exit(linalg::SparseCholesky::factorise(stiffness_)));
    const linalg::SymmetricMatrix p = pressure_ + preconditioner;
    inner_.emplace_back(value_or_exit(linalg::SparseCholesky::factorise(p)));
  }
  VecX solve(const VecX& b, double tolerance) {
    const VecX f = b.head(nu_);
    const VecX w = factor_[0].solve(f);
    VecX r = -b.tail(np_) - coupling_ * w;
    VecX p = VecX::Zero(np_), z = inner_[0].solve(r), d = z;
    double rz = r.dot(z);
    const double stop = tolerance * r.norm();
    for (iterations = 0; iterations < 500 && r.norm() > stop; ++iterations) {
      const VecX gd = coupling_.transpose() * d;
      const VecX s = linalg::multiply(pressure_, d) + coupling_ * factor_[0].solve(gd);
      const double step = rz / d.dot(s);
      p += step * d;
      r -= step * s;
      z = inner_[0].solve(r);
      const double next = r.dot(z);
      d = z + next / rz * d;
      rz = next;
    }
    VecX x(nu_ + np_);
    x.head(nu_) = factor_[0].solve(VecX(f + coupling_.transpose() * p));
    x.tail(np_) = p;
    return x;
  }
  std::uint64_t bytes() const { return factor_[0].bytes() + inner_[0].bytes(); }
  int iterations = 0;

 private:
  long nu_, np_;
  linalg::SymmetricMatrix stiffness_, coupling_, pressure_;
  std::vector<linalg::SparseCholesky> factor_, inner_;
};

fem::PoroMaterial tissue(const Material& material) {
  fem::PoroMaterial poro;
  poro.elastic = fem::elasticity_from(material);
  poro.permeability = 1e5;  // 1e-7 m^3 s/kg
  return poro;
}

void measure(const BrainModel& model, const CaseConfig& config, double dt_s) {
  const contact::ForwardModel forward =
      value_or_exit(contact::ForwardModel::build(model, config, Boundary::kContact));
  std::vector<NodeIndex> surface;
  geometry::boundary_surface(model.mesh, &surface);
  const fem::PressureMap pressure(model.mesh.num_nodes(), surface);
  const auto materials = fem::MaterialMap::uniform(tissue(config.material), model.mesh.num_tets());
  Stopwatch watch;
  const fem::BiotMatrix biot =
      fem::assemble_biot(model.mesh, materials, forward.dofs(), pressure, dt_s);
  std::printf("dt %g s: %ld unknowns, %d of %d tets stabilised, assembled in %.0f ms\n", dt_s,
              static_cast<long>(biot.lower.rows()), biot.stabilised_tets, model.mesh.num_tets(),
              watch.milliseconds());
  const VecX b = VecX::LinSpaced(biot.lower.rows(), -1.0, 1.0);
  VecX x;

  watch = Stopwatch();
  const auto ldl =
      value_or_exit(linalg::SymmetricIndefinite::factorise(biot.lower, biot.pressure_unknowns));
  const double ldl_s = watch.seconds();
  const double ldl_ms = median_ms([&] { (void)ldl.solve(b, x); }, 7);
  const double residual = relative_residual(biot.lower, b, x);
  Eigen::MatrixXd columns(biot.lower.rows(), kColumns), y;
  for (int j = 0; j < kColumns; ++j) columns.col(j) = (1.0 + j) * b.array().sin();
  const double block_ms = median_ms([&] { (void)ldl.solve_many(columns, y); }, 3) / kColumns;
  std::printf(
      "  L D L^T (MUMPS)     analyse %.2f s  factor %.2f s  total %.2f s  solve %.0f ms  column "
      "%.1f ms  "
      "factor %.2f GiB  peak %.2f GiB  residual %.1e  backward %.1e  rcond %.1e  nnz %.1f M\n",
      ldl.analyse_seconds(), ldl.factor_seconds(), ldl_s, ldl_ms, block_ms,
      static_cast<double>(ldl.bytes()) / (1 << 30), peak_gib(), residual,
      ldl.last_check().backward_error, ldl.rcond(), static_cast<double>(ldl.nonzeros()) / 1e6);

  // Mass over the confined modulus: the pressure Schur complement of
  // an incompressible fluid, undrained.
  auto mass_only = materials;
  for (auto& m : mass_only.materials) {
    m.storage = 1.0 / (m.elastic.lambda + 2.0 * m.elastic.shear);
    m.permeability = 0.0;
  }
  const fem::BiotMatrix mass =
      fem::assemble_biot(model.mesh, mass_only, forward.dofs(), pressure, 1.0, false);
  const long nu = mass.displacement_unknowns, np = mass.pressure_unknowns;
  watch = Stopwatch();
  SchurComplement schur(biot, linalg::SymmetricMatrix(-mass.lower.block(nu, nu, np, np)));
  const double schur_s = watch.seconds();
  const double schur_ms = median_ms([&] { x = schur.solve(b, 1e-12); }, 3);
  std::printf(
      "  Schur complement    total %.2f s  solve %.0f ms (%d iterations)  factor %.2f GiB  "
      "residual %.1e\n",
      schur_s, schur_ms, schur.iterations, static_cast<double>(schur.bytes()) / (1 << 30),
      relative_residual(biot.lower, b, x));
  std::printf("  elasticity alone    factor %.2f s  solve %.0f ms\n",
              forward.factor().factor_seconds(),
              median_ms([&] { (void)forward.factor().solve(VecX(b.head(nu))); }, 7));
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  using namespace brainshift;
  linalg::use_single_threaded_blas();
  const char* name = std::getenv("BRAINSHIFT_CASE");
  const auto [config, model] =
      value_or_exit(patient::read_patient(name != nullptr ? name : BRAINSHIFT_DEFAULT_CASE));
  std::vector<double> steps;
  for (int i = 1; i < argc; ++i) steps.push_back(std::atof(argv[i]));
  if (steps.empty()) steps = {60.0, 1.0, 0.01};
  for (const double dt_s : steps) measure(model, config, dt_s);
  return 0;
}
