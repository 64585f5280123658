// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/scenario.hpp"

#include <fmt/format.h>

namespace brainshift::client {

namespace {

Scenario paper() {
  Scenario scenario;
  scenario.name = "paper";
  scenario.description =
      "gravity sag; 200 tumour surface points with noisy displacements (paper 2.6)";
  scenario.fluid_levels_mm = {55.0};
  return scenario;
}

Scenario paper_icp() {
  Scenario scenario = paper();
  scenario.name = "paper-icp";
  scenario.description =
      "the same sag; tumour boundary points on ultrasound sections, registered by ICP";
  scenario.measurement = Measurement::kProbeSections;
  scenario.sparse_points = 0;
  return scenario;
}

Scenario sag_progress() {
  constexpr int kObservations = 20;
  constexpr double kFirst_mm = 15.0, kLast_mm = 55.0;
  Scenario scenario;
  scenario.name = "sag-progress";
  scenario.description =
      "20 observations, 30 s apart, while the fluid falls from 15 to 55 mm; in colin27 416 to 383 "
      "active slaves, tumour 2.4 to 2.6 mm, at most 4.7 mm";
  for (int i = 0; i < kObservations; ++i) {
    scenario.fluid_levels_mm.push_back(kFirst_mm +
                                       (kLast_mm - kFirst_mm) * i / (kObservations - 1));
  }
  return scenario;
}

// Oedema deep to the tumour presses the hemisphere against the skull and the tumour towards the
// craniotomy, while hardly any fluid has drained: contact on a wide
// front. An estimate sees the tumour alone and finds less contact than
// there is; even it has more than 500 active slaves in colin27.
Scenario distension() {
  Scenario scenario;
  scenario.name = "distension";
  scenario.description =
      "brain swelling that presses on the skull; in colin27 1,648 of 2,394 slaves active, tumour "
      "3.6 mm, at most 4.8 mm";
  scenario.fluid_levels_mm = {0.0};
  scenario.swelling = {0.5, 60.0, 30.0};
  return scenario;
}

// The fluid has only begun to drain: the upper brain sinks a little, away from the skull, and
// pushes the rest of it outwards by less than the gap. (Gravity alone, because the force prior can
// represent it: an estimate of this surgery stays off the skull as its truth does.)
Scenario no_contact() {
  Scenario scenario;
  scenario.name = "no-contact";
  scenario.description =
      "a beginning sag, the brain stays off the skull; in colin27 by 0.4 mm, tumour 0.6 mm, at "
      "most 1.8 mm";
  scenario.fluid_levels_mm = {-50.0};
  scenario.contact_free = true;
  return scenario;
}

// Tumour boundary and exposed cortex, both to be registered.
Scenario joint(Scenario scenario, const char* name, const char* description) {
  scenario.name = name;
  scenario.description = description;
  scenario.measurement = Measurement::kProbeSections;
  scenario.sparse_points = 0;
  scenario.interval_s = 300.0;
  scenario.stiffness_sd = 0.3;
  scenario.cortex = CortexView{};
  scenario.cortex->tracks = 20;
  return scenario;
}

Scenario joint_sag() {
  return joint(paper(), "joint-sag",
               "the paper's sag, seen by ultrasound, by a stereo camera and by 20 vessel forks");
}

Scenario joint_distension() {
  return joint(distension(), "joint-distension",
               "brain swelling, seen by ultrasound, stereo camera and vessel forks");
}

// Gravity that pulls beside its known direction shifts the cortex along itself.
Scenario joint_tangential() {
  Scenario scenario = joint(paper(), "joint-tangential",
                            "a sag 25 degrees beside the direction that the case knows, along the "
                            "exposed cortex; ultrasound, stereo camera, vessel forks");
  scenario.gravity_tilt_deg = 25.0;
  return scenario;
}

Scenario joint_mixed() {
  Scenario scenario = joint(paper(), "joint-mixed",
                            "sag 12 degrees beside its known direction with swelling deep to the "
                            "tumour; ultrasound, stereo camera, vessel forks");
  scenario.fluid_levels_mm = {30.0};
  scenario.gravity_tilt_deg = 12.0;
  scenario.swelling = {0.25, 45.0, 15.0};
  // Mannitol and breathing take a few parts in a hundred of the brain's water at most.
  scenario.largest_shrinkage = 0.02;
  return scenario;
}

// The paper's sag while the superficial part of the tumour is gone.
Scenario resection() {
  Scenario scenario =
      joint(paper(), "resection",
            "the paper's sag with the superficial 70 % of the tumour removed; ultrasound of what "
            "is left and of the cavity's wall, stereo camera, vessel forks");
  scenario.resection = Resection{};
  return scenario;
}

// A spatula holds the cortex aside while the fluid drains.
Scenario retraction() {
  Scenario scenario = joint(paper(), "retraction",
                            "sag while a spatula presses on the exposed cortex and draws it aside; "
                            "ultrasound, stereo camera, vessel forks");
  scenario.fluid_levels_mm = {30.0};
  scenario.retraction = Retraction{4000.0, 12.0, 45.0};
  return scenario;
}

// A patient of the paper: its instruments, and Table 3's initial misfit.
Scenario patient(int number, double misfit_mm, double fluid_level_mm, const Swelling& swelling,
                 const char* what) {
  Scenario scenario;
  scenario.name = "patient-" + std::to_string(number);
  scenario.description =
      fmt::format("{} of the paper's patient {}; case patient-{}", what, number, number);
  scenario.fluid_levels_mm = {fluid_level_mm};
  scenario.swelling = swelling;
  scenario.measurement = Measurement::kProbeSections;
  scenario.sparse_points = 0;
  scenario.interval_s = 300.0;
  scenario.cortex = CortexView{};
  scenario.tumour_displacement_mm = misfit_mm;
  return scenario;
}

}  // namespace

const std::vector<Scenario>& all_scenarios() {
  static const std::vector<Scenario> scenarios = {
      paper(), paper_icp(), distension(), sag_progress(), no_contact(), joint_sag(),
      joint_distension(), joint_tangential(), joint_mixed(), resection(), retraction(),
      // The exposed cortex contracts fully; the brain moves along gravity (10 degrees).
      patient(1, 4.8, 55.0, {}, "sag"),
      // It distends fully; the brain moves against gravity (140 degrees).
      patient(2, 5.9, 0.0, {0.5, 60.0, 30.0}, "distension"),
      // It moves along itself (105 degrees to gravity).
      patient(3, 6.1, 10.0, {0.5, 45.0, 5.0, Vec3(-15.0, -26.0, 0.0)}, "tangential motion"),
      // Two fifths of it contract, the rest distends (93 degrees).
      patient(4, 4.0, 40.0, {0.25, 45.0, 10.0, Vec3(15.0, 26.0, 0.0)}, "partial sag"),
      // It distends a little (141 degrees).
      patient(5, 3.6, 0.0, {0.5, 50.0, 25.0}, "slight distension")};
  return scenarios;
}

const Scenario* find_scenario(const std::string& name) {
  for (const Scenario& scenario : all_scenarios()) {
    if (scenario.name == name) return &scenario;
  }
  return nullptr;
}

}  // namespace brainshift::client
