#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# calculix.sh BUILD_DIR [OUT_DIR]: the brains of the paper's five patients in CalculiX, with the loads of
# their consistency truths (tests/evidence/calculix.hpp). Writes decks, what CalculiX printed and the
# fields as tables to OUT_DIR (default: out/calculix). `make evidence` reads the fields that are kept
# in tests/evidence/calculix; copy nodes.csv, patient-*.csv and slit.csv there to renew them. Takes a quarter of an hour.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: calculix.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/calculix}
name=calculix
. cmake/scripts/steps.sh

empty_folder "$out"
export OMP_NUM_THREADS=2  # of CalculiX
cp tests/evidence/calculix/slit.inp "$out"
step "slit: deck" "$bin/slit_deck" write "$out"
step "slit: CalculiX" sh -c "cd '$out' && ccx slit >ccx.log"
step "slit: field" "$bin/slit_deck" read "$out"
for patient in ${PATIENTS-1 2 3 4 5}; do
  folder=$out/patient-$patient
  mkdir "$folder"
  cp tests/evidence/calculix/patient.inp "$folder"
  step "patient $patient: deck" "$bin/evidence_calculix" write --patient "$patient" --folder "$folder"
  step "patient $patient: CalculiX" sh -c "cd '$folder' && ccx patient >ccx.log"
  step "patient $patient: field" "$bin/evidence_calculix" read --patient "$patient" --folder "$folder"
  cp "$folder/patient-$patient.csv" "$folder/nodes.csv" "$out"
done
