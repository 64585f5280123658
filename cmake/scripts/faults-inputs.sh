#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# faults-inputs.sh BIN_DIR OUT_DIR [CASE...]: what the fault suite serves and sends. For each CASE:
#   coarse  coarse.h5, its surgeries, and other.h5: another patient's, with another mesh and tumour
#   head    head.h5, its surgeries: the default case
# Surgeries of NAME: NAME-joint.surgery (ultrasound, a stereo camera, vessel forks), NAME-boundary.surgery
# (the tumour's boundary alone), NAME-landmarks.surgery (its points with displacements).
# A case whose files are there and newer than the programs is left as it is.
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=$(realpath "${1:?usage: faults-inputs.sh BIN_DIR OUT_DIR [CASE...]}")
out=${2:?usage: faults-inputs.sh BIN_DIR OUT_DIR [CASE...]}
shift 2
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
mkdir -p "$out"

# patient NAME CASE_FILE: the model
patient() {
  if [ "$out/$1.h5" -nt "$bin/brainshiftd" ]; then return; fi
  rm -f "$out/$1.h5.partial"
  "$bin/brainshiftd" prepare --case "$2" --out "$out/$1.h5" >"$out/$1.txt"
}
# surgery NAME CASE_FILE SCENARIO
surgery() {
  if [ "$out/$1.surgery" -nt "$bin/brainshift" ]; then return; fi
  rm -f "$out/$1.surgery"
  "$bin/brainshift" simulate --case "$2" --scenario "$3" --seed 1 --out "$out/$1.surgery"
}
surgeries() {
  surgery "$1-joint" "$2" joint-sag
  surgery "$1-boundary" "$2" paper-icp
  surgery "$1-landmarks" "$2" paper
}

for one in "$@"; do
  case $one in
    coarse)
      sed -e 's/edge_mm: 12.0/edge_mm: 13.0/' -e 's/centre_mm: \[46.0, -47.0, 9.0\]/centre_mm: [44.0, -44.0, 9.0]/' \
        -e 's/^case_id: .*/case_id: other-patient/' config/cases/colin27-coarse.yaml >"$out/other.yaml"
      patient coarse config/cases/colin27-coarse.yaml
      patient other "$out/other.yaml"
      surgeries coarse config/cases/colin27-coarse.yaml
      ;;
    head)
      patient head config/cases/colin27.yaml
      surgeries head config/cases/colin27.yaml
      ;;
    *) echo "faults-inputs: no case $one" >&2; exit 2 ;;
  esac
done
