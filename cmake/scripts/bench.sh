#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bench.sh BIN_DIR [OUT_DIR]: error against run time of all inversion methods, and the latency of
# updates through the real daemon and client. Empties OUT_DIR (default: out/bench) and writes to it:
# raw CSV, figures, tables.md, scenes.txt, summary.json. Exit status 0 only if every check holds.
#   QUICK=1     one mesh, few repetitions, few updates; checks that need more do not hold;
#               no scenes.txt
#   SIZES=...   mesh sizes in thousand nodes, default 5,18,40,100 (QUICK: 18); 100 needs 20 GiB
#   BUDGET_S=.. time per method, mesh and scenario, default 200 s
#   REFINED=... sizes that are meshed with refinement too, default 18 (QUICK: none)
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=${1:?usage: bench.sh BIN_DIR [OUT_DIR]}
out=${2:-out/bench}
case_file=config/cases/colin27.yaml
seed=1
if [ "${QUICK:-0}" = 1 ]; then
  sizes=${SIZES-18} refined=${REFINED-} repetitions=5 cycles=10 growth_updates=1000
else
  sizes=${SIZES-5,18,40,100} refined=${REFINED-18} repetitions=20 cycles=100 growth_updates=10000
fi

name=bench
. cmake/scripts/steps.sh

fact() { printf '%s,%s\n' "$1" "$2" >>"$out/facts.csv"; }

# Notes the time from the daemon's start to the line with its endpoint.
serve() {
  local begin=$EPOCHREALTIME
  start_daemon "$out/colin27.h5"
  fact load_to_ready_s "$(seconds_since "$begin" 3)"
}

# Resident memory of the daemon, bytes.
daemon_rss() { awk '/^VmRSS:/ { print 1024 * $2 }' "/proc/$daemon/status"; }

replay() {  # SCENARIO CYCLES NAME
  "$bin/brainshift" replay "$out/$1.surgery" --endpoint "$endpoint" --boundary contact \
    --method condensed --repeat "$2" --report "$out/$3.json" --latency-csv "$out/latency-$3.csv"
}

measure_growth() {
  replay no-contact 500 warm-up
  fact rss_before_bytes "$(daemon_rss)"
  replay no-contact "$growth_updates" growth
  fact rss_after_bytes "$(daemon_rss)"
  fact growth_updates "$growth_updates"
}

prepare() {
  "$bin/brainshiftd" prepare --case "$case_file" --out "$out/colin27.h5" --json >"$out/prepare.json"
}

empty_folder "$out"
echo "name,value" >"$out/facts.csv"

step "prepare: default case, both boundaries" prepare
step "serve: load the model file" serve
for scenario in no-contact paper distension sag-progress; do
  step "simulate: $scenario, seed $seed" "$bin/brainshift" simulate --case "$case_file" \
    --scenario "$scenario" --seed "$seed" --out "$out/$scenario.surgery"
done
# 20 observations in sag-progress, 1 in the others.
step "replay: sag-progress, $((20 * cycles)) updates" replay sag-progress "$cycles" sag-progress
for scenario in paper distension no-contact; do
  step "replay: $scenario, $cycles updates" replay "$scenario" "$cycles" "$scenario"
done
step "replay: no-contact, $growth_updates updates, memory of the daemon" measure_growth
step "stop: daemon" stop_daemon

# One process per mesh, so that the memory of one does not count for the next.
error_time() {
  "$bin/bench_error_time" --case "$case_file" --repetitions "$repetitions" \
    --method-budget-s "${BUDGET_S:-200}" --out "$out" "$@"
}
for size in ${sizes//,/ }; do
  step "error against time: $size thousand nodes" error_time --sizes "$size"
done
for size in ${refined//,/ }; do
  step "error against time: $size thousand nodes, refined" error_time --sizes "$size" \
    --local-factor 0.6 --methods condensed,paper-woodbury,cg
done

options=()
case ",$sizes," in
  *,100,*) options+=(--with-100k) ;;
  *) options+=(--left-out "mesh of 100 thousand nodes: not among SIZES=$sizes") ;;
esac
if [ "${QUICK:-0}" = 1 ]; then
  options+=(--left-out "QUICK=1: $((20 * cycles)) updates for the tail, $growth_updates for the memory")
else
  # The table of docs/architecture.md.
  scenes() { "$bin/bench_scenes" "$case_file" >"$out/scenes.txt"; }
  step "scenes: what leaving out parts saves and costs" scenes
  # Its exit status repeats the checks below, so only a missing result is an error here.
  exactness() {
    "$bin/bench_exactness" --case "$case_file" --scenario "$1" --out "$out/direct-$1.json" >/dev/null ||
      [ -s "$out/direct-$1.json" ]
  }
  for scenario in paper distension; do
    step "exactness: condensed against the direct posterior, $scenario" exactness "$scenario"
  done
fi
current=summary
echo
"$bin/bench_summary" --dir "$out" --commit "$(commit_name)" "${options[@]}"
