// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/pipeline/left_out.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

namespace brainshift::server {
namespace {

constexpr double kHydraulicConductivity_m3s_kg = 1e-7;  // Table 1
// The drained field agrees with Biot's to about 0.02 % in energy from five consolidation times on
// (docs/DESIGN 3.1: 10 s at 2 s).
constexpr double kDrainedAfterTimes = 5.0;

double volume_mm3(const TetMesh& mesh) {
  double six_volumes = 0.0;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    const Vec3 origin = mesh.nodes.col(mesh.tets(0, t));
    const Vec3 a = mesh.nodes.col(mesh.tets(1, t)) - origin;
    const Vec3 b = mesh.nodes.col(mesh.tets(2, t)) - origin;
    const Vec3 c = mesh.nodes.col(mesh.tets(3, t)) - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6.0;
}

}  // namespace

double consolidation_time_s(const TetMesh& mesh, const Material& material) {
  const double shear_pa = material.shear_modulus_pa;
  const double lame_pa =
      2.0 * shear_pa * material.poisson_ratio / (1.0 - 2.0 * material.poisson_ratio);
  const double c_v_m2_s = kHydraulicConductivity_m3s_kg * (lame_pa + 2.0 * shear_pa);
  const double radius_m = 1e-3 * std::cbrt(3.0 * volume_mm3(mesh) / (4.0 * std::numbers::pi));
  return radius_m * radius_m / c_v_m2_s;
}

std::vector<Omission> model_omissions(const BrainModel& model, const CaseConfig& config,
                                      Method method, Boundary boundary) {
  const double drained_s = consolidation_time_s(model.mesh, config.material);
  std::vector<Omission> omissions;
  omissions.push_back(
      {"pressure",
       fmt::format("drained limit: pore pressure relaxes in about {:.1f} s (R^2/c_v), faster than "
                   "updates follow each other",
                   drained_s),
       fmt::format("about 0.02 % in energy for updates at least {:.0f} s apart",
                   std::ceil(kDrainedAfterTimes * drained_s))});
  if (method == Method::kPaper) {
    omissions.push_back(
        {"uncertainty", "method paper computes no posterior covariance",
         "none: displacements are unaffected, their standard deviation is unknown"});
  }
  if (boundary == Boundary::kFixed) {
    omissions.push_back({"contact",
                         "fixed boundary: the brain surface cannot leave or approach the skull",
                         "about 1.6 mm at the craniotomy, the average of the paper's five cases"});
  }
  return omissions;
}

std::vector<Omission> registration_omissions(const registration::IcpResult& icp,
                                             double rotation_prior_sd_deg) {
  std::vector<Omission> omissions;
  if (!icp.rotation_observable) {
    const std::string held =
        rotation_prior_sd_deg > 0.0
            ? fmt::format("held by a prior of {:.1f} deg", rotation_prior_sd_deg)
            : std::string("undetermined");
    omissions.push_back({"rotation",
                         fmt::format("the boundary shows {} of 6 rigid motions; the others are {}",
                                     icp.observable_axes, held),
                         rotation_prior_sd_deg > 0.0
                             ? fmt::format("about {:.2f} mm per 10 mm from the tumour's centre",
                                           10.0 * rotation_prior_sd_deg * std::numbers::pi / 180.0)
                             : std::string("unknown")});
  }
  if (!icp.converged) {
    omissions.push_back({"registration convergence",
                         fmt::format("alignment stopped after {} iterations", icp.iterations),
                         fmt::format("residual {:.2f} mm rms", icp.rms_mm)});
  }
  return omissions;
}

}  // namespace brainshift::server
