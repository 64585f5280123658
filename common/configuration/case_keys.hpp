// SPDX-License-Identifier: Apache-2.0
// The table of the keys of a case file (key_table.hpp says how to read it).
//
// io::parse_case_config and io::case_config_text read and write by it, validate(CaseConfig)
// checks by it, and a test compares config/cases/colin27.yaml with its documentation. The order
// of the calls is the order of the written file; the checksum of a case depends on it. "Paper" is
// Ji, Roberts, Hartov, Paulsen (2009).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/configuration/key_table.hpp"

namespace brainshift {

// A case's files that are read, each with the key that names it, in the table's order. A brain
// mask beside a ready mesh is not read.
struct NamedFile {
  std::string key;
  std::filesystem::path path;
};
std::vector<NamedFile> named_files(const CaseConfig& config);

// The key of one path of `config`, by its address; empty for any other path.
std::string key_of(const CaseConfig& config, const std::filesystem::path& member);

// ---- the table ----

inline constexpr Word<bool> kScalesWords[] = {{true, "estimated"}, {false, "fixed"}};
inline constexpr Word<bool> kOutlierWords[] = {{true, "downweighted"}, {false, "kept"}};
inline constexpr Word<bool> kOutlineWords[] = {{true, "estimated"}, {false, "none"}};
inline constexpr Word<SurfaceGuidance> kGuidanceWords[] = {
    {SurfaceGuidance::kDistances, "distances"}, {SurfaceGuidance::kRigid, "rigid"}};
inline constexpr Word<OutsideRegion> kOutsideWords[] = {{OutsideRegion::kExtend, "extend"},
                                                        {OutsideRegion::kRefuse, "refuse"}};
inline constexpr Word<LabelNumbers> kNumbersWords[] = {{LabelNumbers::kFreeSurfer, "freesurfer"},
                                                       {LabelNumbers::kAal, "aal"}};
inline constexpr Word<bool> kUsedWords[] = {{true, "on"}, {false, "off"}};
inline constexpr Word<Carry> kCarryWords[] = {
    {Carry::kAuto, "auto"}, {Carry::kOn, "on"}, {Carry::kOff, "off"}};

inline const char* kind_name(const MeshGeneration&) { return "generate"; }
inline const char* kind_name(const MeshFile&) { return "file"; }
inline const char* kind_name(const TumourEllipsoid&) { return "ellipsoid"; }
inline const char* kind_name(const TumourLabel&) { return "label_volume"; }
inline const char* kind_name(const TumourSurfaceFile&) { return "surface"; }

template <typename A, Of<MeshGeneration> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v)}, Need::kOptional, [&] {
    a({"edge_mm", "mm", "Target edge length of tetrahedra", "",
       "5.75 gives about the 18 thousand nodes and 100 thousand tetrahedra of the paper's meshes. "
       "Below 1 mm a head has millions of tetrahedra; above 40 mm it is no longer a head."},
      v.edge_mm, between(1.0, 40.0));
    // Refinement is opt-in: without their own keys the regions get the general edge length.
    a({"tumour_edge_mm", "mm", "Target edge length within tumour_margin_mm of the tumour"},
      v.tumour_edge_mm, between(0.5, 40.0), SameAs{v.edge_mm, "edge_mm"});
    a({"craniotomy_edge_mm", "mm",
       "Target edge length within craniotomy_margin_mm of the craniotomy's rim"},
      v.craniotomy_edge_mm, between(0.5, 40.0), SameAs{v.edge_mm, "edge_mm"});
    a({"tumour_margin_mm", "mm", "Width of the refined shell around the tumour"},
      v.tumour_margin_mm, not_negative());
    a({"craniotomy_margin_mm", "mm", "Width of the refined band around the craniotomy's rim"},
      v.craniotomy_margin_mm, not_negative());
    a({"smoothing_mm", "mm",
       "Standard deviation of the Gaussian that smooths the mask before its half-level is meshed",
       "", "It closes sulci that are narrower than an element; 0 switches it off."},
      v.smoothing_mm, between(0.0, 10.0));
  });
}
template <typename A, Of<MeshFile> V>
void visit_kind(A& a, V& v) {
  a({kind_name(v), "", "A ready mesh: Gmsh .msh (2.2, 4.1) or VTK .vtu, mm RAS, linear tetrahedra"},
    v.path, Need::kRequired);
}

template <typename A, Of<TumourEllipsoid> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v)}, Need::kRequired, [&] {
    a({"centre_mm", "mm", "Centre"}, v.centre_mm, finite(), Need::kRequired);
    a({"semi_axes_mm", "mm", "Half axes along x, y, z"}, v.semi_axes_mm, between(0.5, 80.0),
      Need::kRequired);
  });
}
template <typename A, Of<TumourLabel> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v), "", "A label in a segmentation"}, Need::kRequired, [&] {
    a({"file", "",
       "The segmentation: NIfTI, .mgz, or NRRD as 3D Slicer writes it (.nrrd, .seg.nrrd)"},
      v.path, Need::kRequired);
    a({"label", "", "The tumour's label, or a list of labels that are the tumour together", "",
       "Not used where the file names its segments."},
      v.labels, unlimited());
    a({"segment", "", "The tumour's name in a .seg.nrrd", "",
       "Not needed where the file has one segment."},
      v.segment);
  });
}
template <typename A, Of<TumourSurfaceFile> V>
void visit_kind(A& a, V& v) {
  a.section({kind_name(v), "", "A closed surface"}, Need::kRequired, [&] {
    a({"file", "", "The surface: .stl, .ply, .obj or .vtp, mm RAS, outward normals"}, v.path,
      Need::kRequired);
  });
}

template <typename A, Of<Craniotomy> V>
void visit(A& a, V& v) {
  a({"centre_mm", "mm", "Centre", "", "Projected to the nearest point of the brain's surface."},
    v.centre_mm, finite(), Need::kRequired);
  a({"long_axis_mm", "mm", "Full long axis", "paper, section 2.6: 45 x 24 mm"}, v.long_axis_mm,
    between(1.0, 200.0));
  a({"short_axis_mm", "mm", "Full short axis", "paper, section 2.6"}, v.short_axis_mm,
    between(1.0, v.long_axis_mm, "long_axis_mm"));
  a({"long_axis_direction", "", "Direction of the long axis", "front to back",
     "Projected to the tangential plane."},
    v.long_axis_direction, direction());
}

template <typename A, Of<Brainstem> V>
void visit(A& a, V& v) {
  a({"centre_mm", "mm", "Centre"}, v.centre_mm, finite(), Need::kRequired);
  a({"radius_mm", "mm", "Radius"}, v.radius_mm, between(0.0, 60.0));
}

// Stiffness of one tissue. What is not given is that of the rest of the brain.
template <typename A, Of<TissueStiffness> V>
void visit(A& a, V& v) {
  a({"shear_modulus_pa", "Pa", "Shear modulus"}, v.shear_modulus_pa, between(1.0, 1e9),
    SameAs{v.shear_modulus_pa, "material.shear_modulus_pa"});
  a({"poisson_ratio", "", "Drained Poisson ratio"}, v.poisson_ratio, between(0.0, 0.4999),
    SameAs{v.poisson_ratio, "material.poisson_ratio"});
}

template <typename A, Of<Material> V>
void visit(A& a, V& v) {
  a({"shear_modulus_pa", "Pa", "Shear modulus", "paper, Table 1",
     "The range goes from gel phantoms to tendon; outside is a unit mistake."},
    v.shear_modulus_pa, between(100.0, 1e6));
  a({"poisson_ratio", "", "Drained Poisson ratio", "paper, Table 1",
     "Linear tetrahedra lock above about 0.48."},
    v.poisson_ratio, between(0.0, 0.4999));
  a({"tissue_density_kg_m3", "kg/m3", "Density of brain tissue", "paper, Table 1"},
    v.tissue_density_kg_m3, between(500.0, 2000.0));
  a({"fluid_density_saturated_kg_m3", "kg/m3",
     "Density of what surrounds the brain below the fluid level (cerebrospinal fluid)",
     "paper, Table 1"},
    v.fluid_density_saturated_kg_m3, between(0.0, 2000.0));
  a({"fluid_density_unsaturated_kg_m3", "kg/m3", "The same above the fluid level (air)",
     "paper, Table 1"},
    v.fluid_density_unsaturated_kg_m3, between(0.0, 2000.0));
  a({"permeability_m3_s_kg", "m3 s/kg", "Hydraulic conductivity k", "paper, Table 1",
     "With the two keys below it matters where pore pressure is carried (scene.pressure), and in "
     "the "
     "estimate of what leaving it out costs. The range goes from gels to gravel; its ends keep the "
     "matrix of a step within what double precision carries."},
    v.permeability_m3_s_kg, between(1e-16, 1e-2));
  a({"biot_coefficient", "",
     "Biot coefficient alpha: fluid volume extracted over change in solid volume",
     "paper, Table 1"},
    v.biot_coefficient, between(0.0, 1.0));
  a({"storage_per_pa", "1/Pa",
     "The paper's 1/S: fluid that can be forced into the tissue at constant volume",
     "paper, Table 1"},
    v.storage_per_pa, between(0.0, 1.0));
  const TissueStiffness rest{v.shear_modulus_pa, v.poisson_ratio};
  a.section_if({"tumour", "",
                "Stiffness of the tumour, where it differs: of tetrahedra whose centre lies inside "
                "its surface",
                "", "Default: as above."},
               v.tumour, rest);
  a.sections(
      {"regions", "", "Stiffness of labels of the mesh (ventricles, white matter, tentorium, ...)",
       "", "Default: none. Each label has the keys of material.tumour."},
      v.regions, rest);
  a.section({"tissues", "",
             "Shear moduli of the tissues that anatomy.labels tells apart, in units of "
             "shear_modulus_pa"},
            Need::kOptional, [&] {
              const char* const budday =
                  "white over grey 1.36: Budday et al. 2015, J. Mech. Behav. Biomed. Mater. 46:318";
              const Limits limits = between(0.1, 10.0);
              a({"white_matter", "", "White matter", budday}, v.tissues.white_matter, limits);
              a({"grey_matter", "", "Grey matter", budday}, v.tissues.grey_matter, limits);
              a({"cerebellum", "", "Cerebellum", "as grey matter, most of it"},
                v.tissues.cerebellum, limits);
              a({"brainstem", "", "Brainstem",
                 "80 to 100 % stiffer: Arbogast and Margulies 1998, J. Biomech. 31:801"},
                v.tissues.brainstem, limits);
            });
}

template <typename A, Of<AnatomyConfig> V>
void visit(A& a, V& v) {
  a({"labels", "",
     "Label map of the head (NIfTI, NRRD or .mgz): aseg, aparc+aseg, SynthSeg, a map with a "
     "BIDS table of names beside it (*_dseg.tsv), or AAL",
     "", "Without it the model knows none of the following."},
    v.labels);
  a({"numbers", "", "What the labels' numbers mean", "",
     "aal: 1 to 116, odd left and even right, the cerebellum from 91; no white matter, brainstem "
     "or ventricles."},
    v.numbers, kNumbersWords);
  a({"tissues", "",
     "White and grey matter, cerebellum and brainstem with stiffnesses of their own "
     "(material.tissues)"},
    v.tissues, kUsedWords);
  a({"septa", "",
     "Falx and tentorium: slits where no tissue joins left and right, or cerebrum and cerebellum, "
     "each with a fixed sheet that tissue may leave and not pass"},
    v.septa, kUsedWords);
  a({"ventricles", "", "Ventricles as cavities with a free wall (prior.ventricle_pressure_sd_pa)"},
    v.ventricles, kUsedWords);
  a({"septum_gap_mm", "mm", "Gap between tissue and the sheet on either side before surgery",
     "below the millimetre at the skull"},
    v.septum_gap_mm, between(0.0, 5.0));
}

template <typename A, Of<ContactConfig> V>
void visit(A& a, V& v) {
  a({"gap_mm", "mm", "Gap between brain and skull before surgery", "paper, section 2.6"}, v.gap_mm,
    between(0.0, 20.0));
  a({"skull_file", "",
     "The patient's own inner skull surface (.stl, .ply, .obj, .vtp; mm RAS) instead of the "
     "brain's "
     "surface moved outwards by gap_mm"},
    v.skull_file);
  a({"slave_depth_mm", "mm along gravity",
     "Boundary nodes less than this far below the fluid plane through the lowest craniotomy node "
     "may "
     "leave the skull",
     "paper, section 2.6"},
    v.slave_depth_mm, between(0.0, 300.0));
  a({"penalty_n_per_mm", "N/mm per node", "Penalty stiffness of contact", "paper, section 2.3"},
    v.penalty_n_per_mm, between(1e-6, 1e9));
}

template <typename A, Of<PriorConfig> V>
void visit(A& a, V& v) {
  a({"correlation_length_mm", "mm",
     "Fine correlation length L of the residual fields, of (1 + r/L) exp(-r/L)",
     "paper, section 2.2"},
    v.correlation_length_mm, between(0.1, 200.0));
  a({"medium_length_mm", "mm", "Medium correlation length of the residual fields",
     "between the paper's and the coarse one"},
    v.medium_length_mm, between(1.0, 300.0));
  a({"coarse_length_mm", "mm", "Coarse correlation length of the residual fields",
     "about half the width of a brain"},
    v.coarse_length_mm, between(1.0, 300.0));
  a({"force_density_sd_n_m3", "N/m3",
     "Standard deviation of the fine residual field's force density", "decision 0030",
     "0: no such modes. The paper's prior has this part alone."},
    v.force_density_sd_n_m3, not_negative());
  a({"medium_density_sd_n_m3", "N/m3", "The same of the medium residual field", "decision 0018",
     "0: no such modes."},
    v.medium_density_sd_n_m3, not_negative());
  a({"coarse_density_sd_n_m3", "N/m3", "The same of the coarse residual field", "decision 0018",
     "0: no such modes."},
    v.coarse_density_sd_n_m3, not_negative());
  a({"gravity_mode_sd", "in units of the full buoyancy load",
     "Standard deviation of buoyancy modes", "", "0 switches them off."},
    v.gravity_mode_sd, not_negative());
  a({"gravity_direction_sd_deg", "degrees", "How well the direction of gravity is known",
     "decision 0030",
     "The modes across gravity are weaker than those along it by the tangent. 0: no such modes; "
     "the coarse residual field stands for a pose that is off."},
    v.gravity_direction_sd_deg, between(0.0, 80.0));
  a({"gravity_sides_sd", "in units of the full buoyancy load",
     "How differently fluid drains on the left and on the right: air on one side", "decision 0037",
     "0: no such modes. Where a falx parts the halves: 0.58 of the drainage, and as strong as that "
     "turns out (decision 0045)."},
    v.gravity_sides_sd, between(0.0, 8.0));
  a({"gravity_ends_sd", "in units of the full buoyancy load", "The same in front and at the back",
     "decision 0037", "0: no such modes."},
    v.gravity_ends_sd, between(0.0, 8.0));
  a({"gravity_levels_mm", "mm below the reference plane along gravity",
     "Fluid planes of these modes", "", "May be empty."},
    v.gravity_levels_mm, between(-300.0, 300.0));
  a({"tumour_volume_strain_sd", "",
     "Volume strain of tissue that swells (oedema) or shrinks around the tumour, standard "
     "deviation at its centre",
     "decision 0018",
     "0: no such modes. Oedema that raises the water content of white matter from 0.70 to 0.75 "
     "adds 0.2."},
    v.tumour_volume_strain_sd, between(0.0, 2.0));
  a({"tumour_volume_radii_mm", "mm",
     "Extents of these modes, standard deviations of Gaussian bumps about the tumour", "",
     "May be empty."},
    v.tumour_volume_radii_mm, between(1.0, 300.0));
  a({"brain_volume_strain_sd", "",
     "Volume strain of the whole brain and of its halves (mannitol, engorgement), standard "
     "deviation",
     "decision 0018", "0: no such modes."},
    v.brain_volume_strain_sd, between(0.0, 2.0));
  a({"resection_weight_sd", "in units of the tumour's weight in air",
     "Weight that is missing or added at the tumour, standard deviation", "decision 0030",
     "0: no such modes."},
    v.resection_weight_sd, not_negative());
  a({"resection_stress_sd_pa", "Pa",
     "Stress that removed tissue carried at the tumour, standard deviation", "decision 0030",
     "0: no such modes."},
    v.resection_stress_sd_pa, not_negative());
  a({"opening_pressure_sd_pa", "Pa", "Pull and pressure at the craniotomy, standard deviation",
     "decision 0018", "0: no such modes."},
    v.opening_pressure_sd_pa, not_negative());
  a({"ventricle_pressure_sd_pa", "Pa",
     "Pressure on the wall of the ventricles, standard deviation: fluid drained or dammed up",
     "half of the pressure of cerebrospinal fluid",
     "0: no such modes. Without ventricles (anatomy) there are none."},
    v.ventricle_pressure_sd_pa, not_negative());
  a({"ventricle_volume_strain_sd", "",
     "Volume strain where the ventricles lie, standard deviation: fluid is drained or dammed up",
     "decision 0041", "0: no such modes. With ventricles (anatomy) there are none."},
    v.ventricle_volume_strain_sd, between(0.0, 2.0));
  a({"tract_pressure_sd_pa", "Pa",
     "Pressure of instruments on tissue along the way from the opening to the tumour, standard "
     "deviation",
     "decision 0041", "0: no such modes."},
    v.tract_pressure_sd_pa, not_negative());
  a({"scales", "", "Strength of the prior's parts", "",
     "estimated: from the data of every update; a part that they do not need vanishes, and none "
     "is more than eight times as strong as above (method condensed). fixed: as above."},
    v.estimate_scales, kScalesWords);
  a({"broad_weight", "",
     "Weight of the hypothesis that every part is as strong as before the data, whatever they say",
     "decision 0037",
     "Data see a part of the brain; the error bars keep what they cannot see. 0: strengths "
     "estimated from the data hold everywhere (scales estimated)."},
    v.broad_weight, between(0.0, 1.0));
}

template <typename A, Of<InversionConfig> V>
void visit(A& a, V& v) {
  a({"sigma_mm", "mm", "Standard deviation of the misfit between data and model",
     "paper, section 2.2"},
    v.sigma_mm, between(1e-6, 1e3));
  a({"sparse_points", "", "Number of tumour boundary points that guide the model",
     "paper, section 2.6"},
    v.sparse_points, between(3, 1e6));
  a({"max_iterations", "", "Largest number of steepest-descent steps",
     "twice what the paper needed with contact, Table 5"},
    v.max_iterations, between(1, 100000));
  a({"relative_misfit_change", "",
     "Stop when the misfit changes by less than this fraction in a step", "paper, eq. 17"},
    v.relative_misfit_change, between(1e-12, 1.0));
}

template <typename A, Of<SensingConfig> V>
void visit(A& a, V& v) {
  a({"max_age_s", "s",
     "Observations of other sources (ultrasound, stereopsis, pointer) are used beside the newest "
     "one "
     "while they are not older than this"},
    v.max_age_s, between(0.0, 1e6));
  a({"outliers", "", "Data that lie farther from the others than chance explains", "",
     "downweighted: method condensed. kept: all count the same."},
    v.robust_weights, kOutlierWords);
  a({"surface", "", "How a measured cortical surface guides the model", "",
     "distances: along the normal to the deformed model, which may slide along it (method "
     "condensed). "
     "rigid: displacements of a rigid alignment."},
    v.surface, kGuidanceWords);
  a({"surface_points", "", "Number of surface points that guide the model"}, v.surface_points,
    between(3, 1e6));
  a({"surface_pose_sd_mm", "mm",
     "How well the camera's place is known: standard deviation of an error that all points of a "
     "surface share"},
    v.surface_pose_sd_mm, between(0.0, 100.0));
  a({"surface_pose_sd_deg", "degrees", "The same for the camera's direction"},
    v.surface_pose_sd_deg, between(0.0, 45.0));
  a({"tumour", "", "How measured points of the tumour's boundary guide the model", "",
     "distances: along the normal to the deformed model's tumour (method condensed). rigid: "
     "displacements of a rigid alignment, as in the paper."},
    v.tumour, kGuidanceWords);
  a({"probe_pose_sd_mm", "mm",
     "How well the ultrasound probe's place is known: standard deviation of an error that all "
     "points of a boundary share",
     "docs/decisions/0020", "Used with tumour: distances."},
    v.probe_pose_sd_mm, between(0.0, 100.0));
  a({"probe_pose_sd_deg", "degrees", "The same for the probe's direction", "docs/decisions/0020"},
    v.probe_pose_sd_deg, between(0.0, 45.0));
  a({"boundary_error_sd_mm", "mm",
     "What neighbouring points of a tumour boundary are off by alike along the normal, beside the "
     "noise that their observation states: standard deviation of the tracker's errors and the like",
     "docs/decisions/0031", "Used with tumour: distances."},
    v.boundary_error_sd_mm, between(0.0, 100.0));
  a({"boundary_outline_errors", "",
     "What neighbours on the tumour's outline are off by alike besides, up to 0.5 mm over 5 or 10 "
     "mm",
     "docs/decisions/0039",
     "estimated: size and length from the data of the update (method condensed). Used with tumour: "
     "distances."},
    v.boundary_outline_errors, kOutlineWords);
  a({"boundary_average_mm", "mm",
     "A point of a tumour boundary that guides the model stands for the points within this "
     "distance, by the median of their distances",
     "docs/decisions/0031", "0: for itself alone. Used with tumour: distances."},
    v.boundary_average_mm, between(0.0, 20.0));
  a({"landmark_pose_sd_mm", "mm",
     "How well the image that landmarks were found in during surgery is registered: standard "
     "deviation of a shift that all pairs of an observation share",
     "", "Method condensed. 0: a shift of all landmarks is motion of the tissue."},
    v.landmark_pose_sd_mm, between(0.0, 100.0));
  a({"landmark_pose_sd_deg", "degrees", "The same for a turn about the landmarks' centroid"},
    v.landmark_pose_sd_deg, between(0.0, 45.0));
}

template <typename A, Of<CondensedConfig> V>
void visit(A& a, V& v) {
  a({"max_rank", "", "Largest number of prior modes kept, those of the load families among them",
     "docs/decisions/0041"},
    v.max_rank, between(1, 2000));
  a({"memory_limit_gib", "GiB", "Bound on the memory of the preparation"}, v.memory_limit_gib,
    between(0.1, 1e4));
  a({"deadline_ms", "ms",
     "An update's answer is due when this time has passed since its observation was taken up; the "
     "best iterate by then",
     "docs/decisions/0046"},
    v.deadline_ms, between(0.1, 1e6));
  a({"max_contact_iterations", "", "Largest number of steps of one descent"},
    v.max_contact_iterations, between(1, 1000));
  a({"uncertainty_nodes", "",
     "Nodes at which the standard deviation is evaluated; interpolated between them"},
    v.uncertainty_nodes, between(8, 1e5));
  a({"outside_region", "",
     "Data outside the prepared region (around tumour, craniotomy and slaves)", "",
     "extend: used, with the variance that the prepared modes leave out there added to their own. "
     "refuse: an error that names the point."},
    v.outside_region, kOutsideWords);
}

template <typename A, Of<SceneConfig> V>
void visit(A& a, V& v) {
  a({"pressure", "", "Pore pressure", "",
     "auto: left out, in the drained limit. on: carried, by one implicit step of pressure_step_s "
     "from "
     "rest, the brain's whole surface drained; refused with method pcg."},
    v.pressure, kCarryWords);
  a({"contact", "", "Contact between brain and skull", "",
     "auto: left out of an update in which no slave would touch the skull."},
    v.contact, kCarryWords);
  a({"rotation", "", "Rotation in the alignment of boundary points", "",
     "auto: estimated about the axes that the points show. on: about all axes. off: translation "
     "only."},
    v.rotation, kCarryWords);
  a({"surface", "", "Cortical surface data", "",
     "auto and on: used. off: such observations are refused."},
    v.surface, kCarryWords);
  a({"uncertainty", "", "Standard deviation of the displacement at every node", "",
     "auto: carried by method condensed. on: refused with methods that compute none."},
    v.uncertainty, kCarryWords);
  a({"gravity_modes", "", "Buoyancy modes of the prior", "",
     "auto: carried when prior.gravity_mode_sd is not 0. on: refused without any."},
    v.gravity_modes, kCarryWords);
  a({"far_field", "", "Displacement far from the tumour", "",
     "auto and on: carried. off: nodes outside the region of interest are interpolated from "
     "condensed.uncertainty_nodes nodes (method condensed)."},
    v.far_field, kCarryWords);
  a({"region_of_interest_mm", "mm", "Radius of the region of interest around the tumour surface",
     "", "Used with far_field off."},
    v.region_of_interest_mm, between(1.0, 300.0));
  a({"pressure_step_s", "s", "Time since the load changed", "",
     "Used with pressure on. One implicit step leaves 1/(1+x) of a displacement undone where the "
     "truth leaves exp(-x), so "
     "long steps are better left to the drained limit."},
    v.pressure_step_s, between(1e-6, 1e9));
}

// Sections that do nothing without anatomy.labels.
inline constexpr const char* kNeedLabels[] = {"anatomy", "material.tissues"};

template <typename A, Of<CaseConfig> V>
void visit(A& a, V& v) {
  const auto section = [&a](const Key& key, Need need, auto& value) {
    a.section(key, need, [&] { visit(a, value); });
  };
  a({"case_id", "", "Name of the case, in every message and report"}, v.case_id, Need::kRequired);
  a.section({"images"}, Need::kOptional, [&] {
    a({"mri", "", "T1 MRI (NIfTI, NRRD or .mgz) that pictures are drawn on", "",
       "Without it reports have no pictures."},
      v.mri);
    a({"brain", "", "Brain mask or skull-stripped MRI (NIfTI, NRRD or .mgz); voxels > 0 are brain",
       "", "Needed when the mesh is generated."},
      v.brain);
  });
  a.one_of({"mesh", "", "Exactly one of `generate` (mesh from images.brain) and `file`", "",
            "Default: generate."},
           Need::kOptional, v.mesh);
  a.one_of(
      {"tumour", "", "Exactly one of `ellipsoid`, `label_volume`, `surface`", "", "No default."},
      Need::kRequired, v.tumour);
  section({"craniotomy", "",
           "The opening: boundary nodes inside an ellipse in the plane tangential to the brain's "
           "surface"},
          Need::kRequired, v.craniotomy);
  section({"brainstem", "",
           "Where the brainstem leaves the skull: boundary nodes inside a sphere, free of stress "
           "(paper, section 2.6)"},
          Need::kRequired, v.brainstem);
  a.section({"gravity"}, Need::kOptional, [&] {
    a({"direction", "", "Direction in which things fall", "patient lies on the back"},
      v.gravity_direction, direction());
  });
  section({"material"}, Need::kOptional, v.material);
  section({"anatomy", "", "Structures inside the brain, from a label map"}, Need::kOptional,
          v.anatomy);
  section({"contact", "", "Contact between brain and skull"}, Need::kOptional, v.contact);
  section({"prior", "",
           "What is known about the forces before any measurement: zero mean, covariance as below"},
          Need::kOptional, v.prior);
  section({"inversion", "", "The descent, and how far data are trusted"}, Need::kOptional,
          v.inversion);
  section({"sensing", "", "What is made of the room's measurements"}, Need::kOptional, v.sensing);
  section(
      {"condensed", "",
       "The condensed method: what is prepared before surgery, and how long an update may take"},
      Need::kOptional, v.condensed);
  section({"scene", "",
           "Which parts of the work are carried: auto (decided from case and data), on or off", "",
           "Every update lists what was left out, with the reason and an estimate of the error "
           "(docs/architecture.md, \"Scenes\"). Forcing contact or gravity_modes off is for method "
           "condensed; other methods refuse it."},
          Need::kOptional, v.scene);
}

}  // namespace brainshift
