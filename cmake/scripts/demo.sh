#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# demo.sh BIN_DIR [OUT_DIR]: the whole job on the default case, from the MRI to the report, through
# the real daemon and client. BIN_DIR holds the programs; empties OUT_DIR (default: demo) first.
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=${1:?usage: demo.sh BIN_DIR [OUT_DIR]}
out=${2:-demo}
case_file=config/cases/colin27.yaml
scenarios=(paper paper-icp)
seed=1

name=demo
. cmake/scripts/steps.sh

empty_folder "$out"
mkdir "$out/runs"

step "prepare: MRI to mesh and model" \
  "$bin/brainshiftd" prepare --case "$case_file" --out "$out/colin27.h5"
step "serve: daemon on a loopback port" start_daemon "$out/colin27.h5"
for scenario in "${scenarios[@]}" sag-progress; do
  step "simulate: scenario $scenario, seed $seed" \
    "$bin/brainshift" simulate --case "$case_file" --scenario "$scenario" --seed "$seed" \
    --out "$out/$scenario.surgery"
done
for scenario in "${scenarios[@]}"; do
  step "replay: scenario $scenario, condensed method, contact and fixed" \
    "$bin/brainshift" replay "$out/$scenario.surgery" --endpoint "$endpoint" --boundary both \
    --report "$out/runs/$scenario.json"
done
step "replay: scenario paper, the paper's method, contact and fixed" \
  "$bin/brainshift" replay "$out/paper.surgery" --endpoint "$endpoint" --boundary both \
  --method paper --report "$out/runs/paper-method.json"
step "replay: scenario sag-progress, 100 updates by the condensed method, contact" \
  "$bin/brainshift" replay "$out/sag-progress.surgery" --endpoint "$endpoint" --boundary contact \
  --repeat 5 --report "$out/runs/sag-progress.json" --latency-csv "$out/runs/sag-progress-latency.csv"
reports=("${scenarios[@]/%/.json}" paper-method.json sag-progress.json)
step "report: tables and pictures" \
  "$bin/brainshift" report "${reports[@]/#/$out/runs/}" --out "$out"
step "picture: the README's, of scenario paper-icp" \
  /usr/bin/python3 cmake/scripts/before-and-after.py "$out/runs/paper-icp.json" "$out/before-and-after.png"
step "stop: daemon" stop_daemon
printf '   the report is ready: %s/report.html; one more figure follows\n' "$out"
step "error against time: all methods on a mesh of 5 thousand nodes (make bench has the others)" \
  "$bin/bench_error_time" --case "$case_file" --sizes 5 --scenarios paper --quick --out "$out/bench"
step "error against time: figure" studies bench --dir "$out/bench" --figures-only

echo
awk -f cmake/scripts/summary.awk "$out/report.json"
echo

printf 'demo: done in %d min %d s; open %s/report.html (numbers: %s/report.json)\n' \
  $((SECONDS / 60)) $((SECONDS % 60)) "$out" "$out"
