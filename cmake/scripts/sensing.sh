#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# sensing.sh BUILD_DIR [OUT_DIR]: from the room's measurements to sparse data, accuracy and time
# (docs/sensing.md). Empties OUT_DIR (default: out/sensing) and writes to it: points.csv, checks.csv,
# left_out.csv, charts, tables.md, summary.json. Exit status 0 only if every check holds.
#   BRAINSHIFT_EXTERNAL_DATA=...  folder of recorded data; without it their checks are left out
#   STUDIES="register ..."        some of the steps alone (default: all of them)
#   FIRST_SEED=1, COUNT=20        of the registrations by ultrasound
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: sensing.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/sensing}
name=sensing
. cmake/scripts/steps.sh

empty_study "$out"
BRAINSHIFT_STUDY_DIR=$(realpath "$out")
export BRAINSHIFT_STUDY_DIR
status=0
study() { step "$1" "$bin/sensing_$1" || status=1; }
wanted() { [[ " ${STUDIES:-icp estimates reregistration ultrasound tracing stereo register joint} " == *" $1 "* ]]; }
for one in icp estimates reregistration ultrasound tracing stereo; do
  if wanted "$one"; then study "$one"; fi
done

prepare() { "$bin/brainshiftd" prepare --case "$1" --out "$2" >"${2%.h5}-prepare.txt"; }
if wanted register || wanted joint; then
  step "prepare: colin27" prepare config/cases/colin27.yaml "$out/colin27.h5" || status=1
fi

# register_head NAME CASE MODEL: `brainshift register --ultrasound` as a user types it, for every seed from a first
# registration that is off; the same with a depth that is 1.5 % too long; and from a first one that is farther off.
first_seed=${FIRST_SEED:-1} seeds=${COUNT:-20}
register_head() {
  local folder=$out/register-$1 seed way device first
  mkdir -p "$folder"
  "$bin/sensing_register" write "$2" "$folder" "$first_seed" "$seeds" || return
  for ((seed = first_seed; seed < first_seed + seeds; ++seed)); do
    for way in "out device first" "deep device-deep first" "far device far-first"; do
      read -r way device first <<<"$way"
      # A refusal leaves no file behind: what judges counts it.
      "$bin/brainshift" register --ultrasound "$folder/$seed-us.igs.mha" --device "$folder/$device.xml" \
        --mri "$folder/mri.nii.gz" --registration "$folder/$seed-$first.txt" --model "$3" \
        --out "$folder/$seed-$way.txt" >"$folder/$seed-$way.log" 2>&1 || tail -n 1 "$folder/$seed-$way.log"
    done
  done
  "$bin/sensing_register" judge "$2" "$folder" "$first_seed" "$seeds"
}
# A head of labels alone, from its label map to the registration.
register_labels() {
  local folder=$out/head-labels map=$BRAINSHIFT_EXTERNAL_DATA/synthseg_labels/seg_01.nii.gz
  mkdir -p "$folder"
  "$bin/sensing_register" head "$map" "$folder" || return
  "$bin/brainshift" init --mri "$folder/t1.nii.gz" --labels "$map" --tumour "$folder/tumour.nii.gz" \
    --position supine,left-60 --out "$folder/labels.yaml" || return
  prepare "$folder/labels.yaml" "$out/labels.h5" || return
  register_head labels "$folder/labels.yaml" "$out/labels.h5"
}
if wanted register; then
  step "registration by ultrasound: colin27" register_head colin27 config/cases/colin27.yaml "$out/colin27.h5" || status=1
  if [ -n "${BRAINSHIFT_EXTERNAL_DATA:-}" ]; then
    step "registration by ultrasound: a head of labels" register_labels || status=1
  else
    echo "register,a head of labels: BRAINSHIFT_EXTERNAL_DATA is not set" >>"$out/left_out.csv"
  fi
fi

# The whole job through the daemon and the client: with the tumour alone, and with the cortex.
through_the_daemon() {
  local surgery=$out/joint-mixed.surgery
  rm -f "$surgery"
  local case_file=config/cases/colin27.yaml
  "$bin/brainshift" simulate --case "$case_file" --scenario joint-mixed --seed 1 --out "$surgery" || return
  start_daemon "$out/colin27.h5" || return
  "$bin/brainshift" replay "$surgery" --endpoint "$endpoint" --boundary contact --sources ius \
    --report "$out/tumour-alone.json" || return
  "$bin/brainshift" replay "$surgery" --endpoint "$endpoint" --boundary contact \
    --report "$out/joint.json" || return
  stop_daemon || return
  "$bin/brainshift" report "$out/joint.json" --out "$out/report"
}
if wanted joint; then step "through the daemon: joint-mixed" through_the_daemon || status=1; fi
current=summary
studies sensing --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
