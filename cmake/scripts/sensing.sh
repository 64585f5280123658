#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# sensing.sh BUILD_DIR [OUT_DIR]: from the room's measurements to sparse data, accuracy and time
# (docs/sensing.md). Empties OUT_DIR (default: out/sensing) and writes to it: points.csv, checks.csv,
# left_out.csv, charts, tables.md, summary.json. Exit status 0 only if every check holds.
#   BRAINSHIFT_EXTERNAL_DATA=...  folder of recorded data; without it their checks are left out
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
for one in icp estimates reregistration ultrasound tracing stereo; do
  study "$one"
done

# The whole job through the daemon and the client: with the tumour alone, and with the cortex.
through_the_daemon() {
  local surgery=$out/joint-mixed.surgery
  rm -f "$surgery"
  local case_file=config/cases/colin27.yaml
  "$bin/brainshiftd" prepare --case "$case_file" --out "$out/colin27.h5" >"$out/prepare.txt" || return
  "$bin/brainshift" simulate --case "$case_file" --scenario joint-mixed --seed 1 --out "$surgery" || return
  start_daemon "$out/colin27.h5" || return
  "$bin/brainshift" replay "$surgery" --endpoint "$endpoint" --boundary contact --sources ius \
    --report "$out/tumour-alone.json" || return
  "$bin/brainshift" replay "$surgery" --endpoint "$endpoint" --boundary contact \
    --report "$out/joint.json" || return
  stop_daemon || return
  "$bin/brainshift" report "$out/joint.json" --out "$out/report"
}
step "through the daemon: joint-mixed" through_the_daemon || status=1
current=summary
studies sensing --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
