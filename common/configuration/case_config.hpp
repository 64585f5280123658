// SPDX-License-Identifier: Apache-2.0
// CaseConfig: what a case file says, as plain values in the units of its keys.
//
// case_keys.hpp is the table of the keys: names, ranges, meanings, sources. Read from YAML by
// io::read_case_config, which resolves relative paths against the case file and rejects unknown
// keys. Defaults: Table 1 and sections 2.2-2.6 of Ji, Roberts, Hartov, Paulsen (2009), unless
// case_keys.hpp names another source.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

// Mesh made from the brain mask. Edge lengths are target sizes of tetrahedra.
struct MeshGeneration {
  double edge_mm = 5.75;
  double tumour_edge_mm = 5.75;      // within tumour_margin_mm of the tumour
  double craniotomy_edge_mm = 5.75;  // within craniotomy_margin_mm of the craniotomy's rim
  double tumour_margin_mm = 10.0;
  double craniotomy_margin_mm = 10.0;
  // Width of the Gaussian that smooths the mask before its half-level is meshed; closes sulci.
  double smoothing_mm = 2.0;
};
struct MeshFile {
  std::filesystem::path path;  // Gmsh .msh or VTK .vtu, mm RAS
};

struct TumourEllipsoid {
  Vec3 centre_mm = Vec3::Zero();
  Vec3 semi_axes_mm = Vec3::Ones();
};
struct TumourLabel {
  std::filesystem::path path;               // NIfTI, NRRD or .mgz label volume
  std::vector<int> labels = {1};            // the tumour is all of them together
  std::optional<std::string> segment = {};  // of a .seg.nrrd, by name; then labels do not matter
};
struct TumourSurfaceFile {
  std::filesystem::path path;  // .stl, .ply, .obj or .vtp, mm RAS, closed
};

// An opening on the brain surface: boundary nodes within an ellipse around `centre_mm`, in the
// plane tangential to the surface, with the given full axes (the paper's "45 x 24 mm").
struct Craniotomy {
  Vec3 centre_mm = Vec3::Zero();  // projected to the nearest boundary point
  double long_axis_mm = 45.0;
  double short_axis_mm = 24.0;
  Vec3 long_axis_direction = Vec3(0, 1, 0);  // projected to the tangent plane
};

// Boundary nodes within a sphere: where brainstem leaves the skull.
struct Brainstem {
  Vec3 centre_mm = Vec3::Zero();
  double radius_mm = 12.0;
};

// What differs from tissue to tissue.
struct TissueStiffness {
  double shear_modulus_pa = 2100.0;
  double poisson_ratio = 0.46;
};

// Stiffness of the tissues that a label map tells apart, over that of the brain. The mean over a
// head is 1.
struct TissueRatios {
  double white_matter = 1.16;
  double grey_matter = 0.85;
  double cerebellum = 0.85;
  double brainstem = 1.8;
};

struct Material {  // Table 1
  double shear_modulus_pa = 2100.0;
  double poisson_ratio = 0.46;
  double tissue_density_kg_m3 = 1000.0;
  double fluid_density_saturated_kg_m3 = 1000.0;
  double fluid_density_unsaturated_kg_m3 = 1.0;
  double permeability_m3_s_kg = 1e-7;  // k
  double biot_coefficient = 1.0;       // alpha
  double storage_per_pa = 0.0;         // 1/S
  // Tissues of another stiffness (contact/forward_model.hpp): the tumour, and labels of the mesh.
  std::optional<TissueStiffness> tumour;
  std::map<int, TissueStiffness> regions;
  TissueRatios tissues;  // of tetrahedra with the labels of values/brain_model.hpp
};
double largest_poisson_ratio(const Material& material);

struct ContactConfig {
  double gap_mm = 1.0;                              // brain to skull (section 2.6)
  std::optional<std::filesystem::path> skull_file;  // patient's own inner skull surface instead
  double slave_depth_mm = 20.0;                     // second plane below the fluid plane
  double penalty_n_per_mm = 5.0;                    // beta (section 2.3)
};

// Structures inside the brain, from a label map (anatomy/regions.hpp).
enum class LabelNumbers { kFreeSurfer, kAal };
struct AnatomyConfig {
  std::optional<std::filesystem::path> labels;
  LabelNumbers numbers = LabelNumbers::kFreeSurfer;
  bool tissues = true;     // white and grey matter, cerebellum, brainstem: a stiffness each
  bool septa = true;       // falx and tentorium: slits with a fixed sheet
  bool ventricles = true;  // cavities
  double septum_gap_mm = 0.5;
};

// Prior on forces, zero mean: families of loads (prior/load_modes.hpp), and smooth residual fields
// of random force density with three correlation lengths (prior/force_prior.hpp). A standard
// deviation of 0 leaves a family out. Where the strengths are estimated, a surgery may have up to
// kLargestStrength times these, or none of a family.
struct PriorConfig {
  // Residual fields: fine (the paper's), medium and coarse correlation length. Parts that are off
  // explain nothing that others do not explain as well (docs/ablations.md, docs/decisions/0030).
  double correlation_length_mm = 5.0;
  double medium_length_mm = 20.0;
  double coarse_length_mm = 60.0;
  double force_density_sd_n_m3 = 0.0;
  double medium_density_sd_n_m3 = 1000.0;
  double coarse_density_sd_n_m3 = 1000.0;
  // Drainage and pose, in units of the full buoyancy load.
  double gravity_mode_sd = 1.0;
  // Standard deviation of the direction of gravity. A mode across it has gravity_mode_sd times the
  // tangent of this angle.
  double gravity_direction_sd_deg = 0.0;
  // How differently fluid drains, or air enters, on the left and on the right, and in front and at
  // the back; in units of the full buoyancy load.
  double gravity_sides_sd = 0.25, gravity_ends_sd = 0.25;
  // Fluid planes below the reference plane.
  std::vector<double> gravity_levels_mm = {-40.0, -20.0, 0.0, 20.0, 40.0, 60.0};
  // Volume strain of swelling or shrinking tissue around the tumour: standard deviation at its
  // centre. Oedema that raises the water content of white matter from 0.70 to 0.75 adds 0.2.
  double tumour_volume_strain_sd = 0.06;
  std::vector<double> tumour_volume_radii_mm = {15.0, 30.0, 50.0};  // sds of the Gaussians
  // Volume strain of the whole brain and of its halves (mannitol, engorgement).
  double brain_volume_strain_sd = 0.007;
  // Tissue that is removed at the tumour: its weight, in units of the tumour's weight in air, and
  // the stress that it carried.
  double resection_weight_sd = 0.0;
  double resection_stress_sd_pa = 0.0;
  double opening_pressure_sd_pa = 930.0;  // pull and pressure at the craniotomy
  // Pressure of the fluid in the ventricles against that before surgery: drained or dammed up.
  double ventricle_pressure_sd_pa = 500.0;
  // Volume strain where the ventricles lie, standard deviation of a bump: six of them lose a third
  // of 25 ml with about one and a half (docs/decisions/0041).
  double ventricle_volume_strain_sd = 0.03;
  // Pressure of a retractor or a sleeve on tissue along the way to the tumour: 20 to 40 mmHg are
  // usual where there is one, 2.7 to 5.3 kPa, five to eleven times this.
  double tract_pressure_sd_pa = 500.0;
  // Method condensed: the strength of each part is estimated from the data of an update.
  bool estimate_scales = true;
  // Weight of the hypothesis that every part is as strong as before the data, whatever they say
  // about single ones: they see a part of the brain, and it keeps what they cannot see.
  double broad_weight = 0.1;
};
// Greatest strength of a part of the prior, in units of the case's standard deviation.
inline constexpr double kLargestStrength = 8.0;

struct InversionConfig {
  double sigma_mm = 0.2;    // sd of the data misfit (section 2.2)
  int sparse_points = 200;  // boundary points used for guidance (section 2.6)
  int max_iterations = 40;  // the paper needed 10 to 19 with contact (Table 5); twice that
  double relative_misfit_change = 0.001;  // eq. 17
};

// How measured points of a surface guide the model.
enum class SurfaceGuidance {
  // Distances along the normal to the deformed model's surface, which may slide along it. Method
  // condensed only.
  kDistances,
  // Displacements of a rigid alignment (paper 2.7), as for the other methods.
  kRigid,
};
std::string_view to_string(SurfaceGuidance guidance);  // "distances", "rigid"

// What is made of the room's measurements.
struct SensingConfig {
  // Observations of other sources are used beside the newest one until they are older than this.
  double max_age_s = 120.0;
  // Method condensed: data far from what the others and the prior say count less
  // (inversion/condensed/robust_weights.hpp).
  bool robust_weights = true;
  SurfaceGuidance surface = SurfaceGuidance::kDistances;
  int surface_points = 300;  // that guide the model
  // How well the camera's pose is known: an error that all points of a surface share.
  double surface_pose_sd_mm = 0.2;
  double surface_pose_sd_deg = 0.2;
  SurfaceGuidance tumour = SurfaceGuidance::kDistances;
  // How well the probe's pose is known: an error that all points of a boundary share
  // (docs/decisions/0020).
  double probe_pose_sd_mm = 0.0;
  double probe_pose_sd_deg = 0.0;
  // What neighbouring points of a tumour boundary are off by alike along the normal, beside the
  // noise that their observation states (docs/decisions/0029, 0031).
  double boundary_error_sd_mm = 0.4;
  // What neighbours on the outline are off by alike besides is a common error of unknown size
  // (docs/decisions/0039).
  bool boundary_outline_errors = true;
  // Of a boundary's points those within this distance are averaged (docs/decisions/0031). 0: none.
  double boundary_average_mm = 3.0;
  // How well the image that landmarks were found in during surgery is registered: an error that all
  // pairs of an observation share.
  double landmark_pose_sd_mm = 0.0;
  double landmark_pose_sd_deg = 0.0;
};

// What becomes of data outside the region that was prepared (method condensed).
enum class OutsideRegion {
  // All modes are read there. What they leave out of the prior is added to the datum's variance.
  kExtend,
  // kInvalidArgument names the datum.
  kRefuse,
};
std::string_view to_string(OutsideRegion outside);  // "extend", "refuse"

// What is prepared before surgery for the condensed method.
struct CondensedConfig {
  // Largest number of prior modes kept, those of the load families among them.
  int max_rank = 189;
  // Bound on the memory that preparation may use, GiB; more is refused before the work begins.
  double memory_limit_gib = 8.0;
  // An update's answer is due when this time has passed since its observation was taken up, ms: the
  // best iterate by then (docs/decisions/0046).
  double deadline_ms = 3000.0;
  int max_contact_iterations = 100;
  // Nodes at which the standard deviation is evaluated; interpolated between them.
  int uncertainty_nodes = 600;
  OutsideRegion outside_region = OutsideRegion::kExtend;
};

// Which parts of the work a scene carries. kAuto: decided from case and data. Every Update lists
// each omission with its reason and an estimate of the error.
enum class Carry { kAuto, kOn, kOff };
std::string_view to_string(Carry carry);  // "auto", "on", "off"

struct SceneConfig {
  Carry pressure = Carry::kAuto;
  Carry contact = Carry::kAuto;
  Carry rotation = Carry::kAuto;  // in ICP
  Carry surface = Carry::kAuto;   // cortical surface data
  Carry uncertainty = Carry::kAuto;
  Carry gravity_modes = Carry::kAuto;
  Carry far_field = Carry::kAuto;       // kOff: only the region of interest is rebuilt
  double region_of_interest_mm = 40.0;  // around the tumour, used with far_field off
  double pressure_step_s = 60.0;        // since the load changed, used with pressure on
};

struct CaseConfig {
  std::string case_id;
  std::filesystem::path file;  // where it was read from; empty for a case made in memory

  std::filesystem::path mri;    // T1 MRI; pictures are drawn on it
  std::filesystem::path brain;  // mask or skull-stripped MRI: voxels > 0 are brain

  std::variant<MeshGeneration, MeshFile> mesh = MeshGeneration{};
  std::variant<TumourEllipsoid, TumourLabel, TumourSurfaceFile> tumour = TumourEllipsoid{};
  Craniotomy craniotomy;
  Brainstem brainstem;
  Vec3 gravity_direction = Vec3(0, -1, 0);  // normalised on reading
  Material material;
  AnatomyConfig anatomy;
  ContactConfig contact;
  PriorConfig prior;
  InversionConfig inversion;
  SensingConfig sensing;
  CondensedConfig condensed;
  SceneConfig scene;
};

// Ok, or kInvalidArgument. The message names key, value and constraint
// ("material.poisson_ratio = 0.6: must be ...").
Status validate(const CaseConfig& config);

}  // namespace brainshift
