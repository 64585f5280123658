// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/icp_study.hpp"

#include "common/linalg/openblas.hpp"

int main() {
  brainshift::linalg::choose_blas_kernel();
  brainshift::sensing::study_icp_speed();
  brainshift::sensing::study_icp_convergence();
  brainshift::sensing::study_icp_sphere();
}
