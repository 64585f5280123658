#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bench.sh BIN_DIR [OUT_DIR]: error against run time of all inversion methods, and the latency of
# updates through the real daemon and client. Empties OUT_DIR (default: out/bench) and writes to it:
# raw CSV and JSON (tests/studies/bench.py), figures, tables.md, summary.json. Exit status
# 0 only if every check holds.
#   QUICK=1     one mesh, few repetitions, few updates; checks that need more do not hold
#   SIZES=...   mesh sizes in thousand nodes, default 5,18,40,100 (QUICK: 18); 100 needs about 17 GiB
#   BUDGET_S=.. time per method, mesh and scenario, default 400 s
#   REFINED=... sizes that are meshed with refinement too, default 18 (QUICK: none)
#   KERNEL=...  the other BLAS kernel that latencies are measured with, default Haswell
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=${1:?usage: bench.sh BIN_DIR [OUT_DIR]}
out=${2:-out/bench}
case_file=config/cases/colin27.yaml
seed=1
kernel=${KERNEL:-Haswell}
if [ "${QUICK:-0}" = 1 ]; then
  sizes=${SIZES-18} refined=${REFINED-} repetitions=5 each=10 growth_updates=1000
else
  sizes=${SIZES-5,18,40,100} refined=${REFINED-18} repetitions=20 each=100 growth_updates=10000
fi

name=bench
. cmake/scripts/steps.sh

fact() { printf '%s,%s\n' "$1" "$2" >>"$out/facts.csv"; }
leave_out() { printf '%s\n' "$1" >>"$out/left_out.csv"; }

prepare() {  # CASE MODEL JSON
  "$bin/brainshiftd" prepare --case "$1" --out "$out/$2.h5" --json >"$out/$3.json"
}

# The default case with nothing rebuilt but the region of 40 mm about the tumour.
prepare_region() {
  sed 's/^  far_field: auto/  far_field: off/' "$case_file" >"$out/region.yaml" || return
  grep -q '^  far_field: off' "$out/region.yaml" || return
  prepare "$out/region.yaml" region prepare-region
}

# The default case with a deadline of 100 ms.
prepare_hurried() {
  sed 's/^  deadline_ms: .*/  deadline_ms: 100/' "$case_file" >"$out/hurried.yaml" || return
  grep -q '^  deadline_ms: 100$' "$out/hurried.yaml" || return
  prepare "$out/hurried.yaml" hurried prepare-hurried && rm "$out/prepare-hurried.json"
}

# The default case with edges for $1 thousand nodes, as bench_error_time scales them.
prepare_size() {
  awk -v size="$1" '/^ *(tumour_|craniotomy_)?edge_mm:/ { $2 = $2 * (18 / size) ^ (1 / 3); $1 = "    " $1 } 1' \
    "$case_file" >"$out/large.yaml" || return
  prepare "$out/large.yaml" large "prepare-$1k" && rm "$out/large.h5" "$out/large.yaml"
}

# NAME SCENARIO EACH: observations of the scenario, none of them twice.
observe() {
  "$bin/bench_observations" --case "$case_file" --scenario "$2" --seed "$seed" --each "$3" \
    --out "$out/$1.surgery"
}

# Notes the time from the daemon's start to the line with its endpoint.
serve() {
  local begin=$EPOCHREALTIME
  start_daemon "$out/$1.h5"
  fact load_to_ready_s "$(seconds_since "$begin" 3)"
}

# The daemon knows its BLAS kernel. `status` ends with 1 where something is not well; it says so all the same.
note_machine() {
  "$bin/brainshift" status --endpoint "$endpoint" --json >"$out/status.json" || [ -s "$out/status.json" ] || return
  studies bench --dir "$out" --machine "$out/status.json" --commit "$(commit_name)" && rm "$out/status.json"
}

# Resident memory of the daemon, bytes.
daemon_rss() { awk '/^VmRSS:/ { print 1024 * $2 }' "/proc/$daemon/status"; }

# A report without the course of the surgery, whose latencies are in a file of their own; files by their place in the repository.
shorten() {
  /usr/bin/python3 - "$1" "$PWD/" <<'END'
import json, sys
path, root = sys.argv[1:]
reports = json.loads(open(path).read().replace('"' + root, '"'))
for report in reports:
    report.pop("course", None)
with open(path, "w") as out:
    json.dump(reports, out, indent=2)
    out.write("\n")
END
}

replay() {  # SURGERY NAME CYCLES
  "$bin/brainshift" replay "$out/$1.surgery" --endpoint "$endpoint" --boundary contact \
    --method condensed --repeat "${3:-1}" --report "$out/run-$2.json" \
    --latency-csv "$out/latency-$2.csv" || return
  shorten "$out/run-$2.json" || return
  rm -rf "$out/run-$2" "$out"/run-"$2"*.vtu
}

# Five sessions with one update each.
first_updates() {
  local i
  for i in 1 2 3 4 5; do replay cold "cold-$i$1" || return; done
}

measure_growth() {
  replay no-contact warm-up $((growth_updates / (each * 5))) || return
  fact rss_before_bytes "$(daemon_rss)"
  replay no-contact growth $((growth_updates / each)) || return
  fact rss_after_bytes "$(daemon_rss)"
  fact growth_updates "$growth_updates"
  rm "$out"/run-{warm-up,growth}.json "$out"/latency-{warm-up,growth}.csv
}

# Sag of patient 1, forward: the same mesh, forces and contact in the forward model here and in CalculiX. A row each of
# peers.csv.
peer() {  # NAME DECK_FILTER OPTIONS...
  local folder=$out/peer began seconds
  empty_folder "$folder" || return
  sed "$2" tests/evidence/calculix/patient.inp >"$folder/patient.inp" || return
  "$bin/evidence_calculix" write --patient 1 --folder "$folder" "${@:3}" || return
  began=$EPOCHREALTIME
  (cd "$folder" && OMP_NUM_THREADS=2 ccx patient >ccx.log) || return
  seconds=$(seconds_since "$began" 1)
  "$bin/evidence_calculix" read --patient 1 --folder "$folder" || return
  awk -v row="$1,$seconds" 'NR == 2 { print row "," $0 }' "$folder/apart.csv" >>"$out/peers.csv"
}
peers() {
  echo "code,seconds,mean_mm,max_mm" >"$out/peers.csv"
  peer "CalculiX: linear elastic; small displacements" 's/, NLGEOM//' --linear || return
  peer "CalculiX: neo-Hookean; large displacements" '' || return
  awk -F, 'NR == 2 { printf "here: assembly and factor,%s,,\nhere: contact by that factor,%s,0,0\n", $1, $2 }' \
    "$out/peer/forward.csv" >>"$out/peers.csv" || return
  rm -r "$out/peer"
}

# Every latency of one kernel; $1: "" or @KERNEL, $2: which recording of sag-progress.
latencies() {
  step "serve: load the model file$1" serve colin27
  step "replay: $2$1" replay "$2" "sag-progress$1"
  [ -n "$1" ] || note_machine
  [ -n "$1" ] || fact rss_session_bytes "$(daemon_rss)"
  local one
  for one in no-contact paper joint-sag joint-mixed distension; do
    step "replay: $one$1" replay "$one" "$one$1"
  done
  step "replay: distension, five sessions with one update each$1" first_updates "$1"
  if [ -z "$1" ]; then
    step "replay: no-contact, $growth_updates updates, memory of the daemon" measure_growth
  fi
  step "stop: daemon" stop_daemon
  step "serve: the region about the tumour$1" start_daemon "$out/region.h5"
  step "replay: region$1" replay short "region$1"
  step "stop: daemon" stop_daemon
  [ -z "$1" ] || return 0
  step "serve: a deadline of 100 ms" start_daemon "$out/hurried.h5"
  for one in joint-mixed distension; do
    step "replay: $one, a deadline of 100 ms" replay "$one" "$one-100ms"
  done
  step "stop: daemon" stop_daemon
}

empty_folder "$out"
echo "name,value" >"$out/facts.csv"
: >"$out/left_out.csv"

step "prepare: default case, both boundaries" prepare "$case_file" colin27 prepare
step "prepare: the same with the region about the tumour only" prepare_region
step "prepare: the same with a deadline of 100 ms" prepare_hurried
# 20 moments in sag-progress, 1 in the others.
step "observe: sag-progress, $((20 * each)) observations" observe sag-progress sag-progress "$each"
step "observe: sag-progress, 200 observations" observe short sag-progress 10
for scenario in no-contact paper; do
  step "observe: $scenario" observe "$scenario" "$scenario" "$each"
done
for scenario in joint-sag joint-mixed distension; do
  step "observe: $scenario" observe "$scenario" "$scenario" 10
done
step "observe: distension, once" observe cold distension 1
case ",$sizes," in
  *,100,*) step "prepare: 100 thousand nodes, both boundaries" prepare_size 100 ;;
esac
latencies "" sag-progress
export OPENBLAS_CORETYPE=$kernel
latencies "@$kernel" short
unset OPENBLAS_CORETYPE
stages() {
  "$bin/bench_update" --model "$out/colin27.h5" --passes 1 --stages-csv "$out/stages.csv" \
    --limits-csv "$out/limits.csv" \
    "$out"/{short,paper,no-contact,joint-sag,joint-mixed,distension}.surgery
}
step "stages: where the time of an update goes" stages
rm "$out"/*.surgery "$out"/*.h5 "$out"/{region,hurried}.yaml  # a gigabyte that nobody reads

# One process per mesh, so that the memory of one does not count for the next.
error_time() {  # REPETITIONS OPTIONS...
  "$bin/bench_error_time" --case "$case_file" --repetitions "$1" \
    --method-budget-s "${BUDGET_S:-400}" --out "$out" "${@:2}"
}
for size in ${sizes//,/ }; do
  case $size in
    5) step "error against time: 5 thousand nodes" error_time "$repetitions" --sizes 5 ;;
    18)
      step "error against time: 18 thousand nodes" error_time "$repetitions" --sizes 18 --scenarios paper \
        --methods condensed,paper,paper-woodbury --timed 2 --compared 3
      leave_out "18 thousand nodes: pcg and distension, which take an hour"
      ;;
    *)  # a truth of another stiffness costs a factorisation each
      step "error against time: $size thousand nodes" error_time 3 --sizes "$size" \
        --scenarios paper --methods condensed
      leave_out "$size thousand nodes: all methods but condensed; three surgeries"
      ;;
  esac
done
for size in ${refined//,/ }; do
  step "error against time: $size thousand nodes, refined" error_time 3 --sizes "$size" \
    --local-factor 0.6 --scenarios paper --methods condensed
done
for size in 40 100; do
  case ",$sizes," in
    *,$size,*) ;;
    *) leave_out "mesh of $size thousand nodes: not among SIZES=$sizes" ;;
  esac
done
if [ "${QUICK:-0}" = 1 ]; then
  leave_out "QUICK=1: $((20 * each)) updates for the tail, $growth_updates for the memory; scenes"
else
  scenes() { "$bin/bench_scenes" --case "$case_file" --csv "$out/scenes.csv" >"$out/scenes.txt"; }
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
if [ "${QUICK:-0}" != 1 ] && command -v ccx >/dev/null; then
  step "peers: CalculiX on the same mesh and load" peers
else
  leave_out "CalculiX beside this: QUICK=1, or no ccx (docker/packages-calculix.txt)"
fi
current=summary
echo
studies bench --dir "$out"
