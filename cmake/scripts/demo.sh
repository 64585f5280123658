#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# demo.sh BIN_DIR [OUT_DIR]: the whole job on the default case, from the MRI to the report, through the real
# daemon and client. BIN_DIR holds brainshiftd and brainshift; OUT_DIR (default: demo) is emptied first.
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=${1:?usage: demo.sh BIN_DIR [OUT_DIR]}
out=${2:-demo}
case_file=config/cases/colin27.yaml
scenarios=(paper paper-icp)
seed=1

# A threaded BLAS only slows the factorisation down, and its results vary (docs/architecture.md).
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

daemon=
stop_daemon() {  # a daemon that does not end cleanly fails the demo
  local pid=$daemon
  daemon=
  kill -TERM "$pid"
  wait "$pid"
}
finish() {
  local status=$?
  [ -z "$daemon" ] || stop_daemon || true
  if [ "$status" -ne 0 ]; then
    echo "demo: failed (exit $status) at: $current" >&2
    if [ -s "$out/daemon.log" ]; then echo "demo: last lines of $out/daemon.log:" >&2; tail -n 5 "$out/daemon.log" >&2; fi
  fi
}
trap finish EXIT
trap 'exit 130' INT TERM

# step NAME COMMAND...: runs the command and prints how long it took.
current=start
step() {
  current=$1
  shift
  local begin=$EPOCHREALTIME
  printf '== %s\n' "$current"
  "$@"
  awk -v name="$current" -v a="$begin" -v b="$EPOCHREALTIME" 'BEGIN { printf "   %.1f s\n", b - a }'
}

# Starts the daemon on a free loopback port and sets `endpoint` from its first line on stdout.
start_daemon() {
  local pipe=$out/daemon.pipe line
  mkfifo "$pipe"
  "$bin/brainshiftd" serve --config config/daemon.yaml --model "$out/colin27.h5" \
    --endpoint 'tcp://127.0.0.1:*' >"$pipe" 2>"$out/daemon.log" &
  daemon=$!
  exec {daemon_output}<"$pipe"
  rm "$pipe"
  endpoint=
  while IFS= read -r -t 60 -u "$daemon_output" line; do
    case $line in
      *"listening on "*) endpoint=${line##*listening on }; break ;;
    esac
  done
  if [ -z "$endpoint" ]; then
    echo "demo: brainshiftd ended or said nothing within 60 s" >&2
    return 1
  fi
  # Whatever it says later must not fill the pipe.
  cat <&"$daemon_output" >>"$out/daemon.log" &
  echo "   $endpoint"
}

rm -rf "$out"
mkdir -p "$out/runs"

step "prepare: MRI to mesh and model" \
  "$bin/brainshiftd" prepare --case "$case_file" --out "$out/colin27.h5"
step "serve: daemon on a loopback port" start_daemon
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
step "report: tables and pictures" "$bin/brainshift" report "${reports[@]/#/$out/runs/}" --out "$out"
step "stop: daemon" stop_daemon

current="summary"
echo
awk -f cmake/scripts/summary.awk "$out/report.json"
echo

printf 'demo: done in %d min %d s; open %s/report.html (numbers: %s/report.json)\n' \
  $((SECONDS / 60)) $((SECONDS % 60)) "$out" "$out"
