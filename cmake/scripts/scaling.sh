#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# scaling.sh BUILD_DIR [OUT_DIR]: what a model's preparation takes by one process and by several (docs/scaling.md). The build needs
# BRAINSHIFT_MPI. Empties OUT_DIR (default: out/scaling) and writes rows.csv (a row per run), updates.csv (models by several
# processes against that by one), machine.txt, fit.csv, tables.md and pictures. One size after the other, its runs in turn.
#   QUICK=1          two small meshes, into out/scaling-quick
#   EDGES="9 7 5.75 4.4 3.25"   edge lengths of the mesh of config/cases/colin27.yaml, mm: 5, 10, 18, 39, 94 thousand nodes (2.35: 250)
#   RANKS="2"        numbers of processes beside one
#   MEMORY_GIB=8     what a process may take; a preparation that needs more is refused
#   CORES=1          also one process with all cores, today's way
#   RESUME=1         keeps the rows of sizes that OUT_DIR has
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:?usage: scaling.sh BUILD_DIR [OUT_DIR]}
bin=$(realpath "$build/bin")
out=${2:-out/scaling}
edges=${EDGES:-9 7 5.75 4.4 3.25}
if [ "${QUICK:-0}" = 1 ]; then
  out=${2:-out/scaling-quick}
  edges=${EDGES:-12 9}
fi
[ -x "$bin/brainshiftd-mpi" ] || { echo "scaling: $bin/brainshiftd-mpi: configure with -DBRAINSHIFT_MPI=ON" >&2; exit 2; }
name=scaling
. cmake/scripts/steps.sh
. cmake/scripts/mpirun.sh
[ "${RESUME:-0}" = 1 ] && [ -e "$out/rows.csv" ] || empty_folder "$out"
[ -e "$out/rows.csv" ] || echo "edge_mm,nodes,slaves,processes,threads,total_s,mesh_s,factor_s,condense_s,work_s,peak_bytes,least_peak_bytes,sent_bytes,file_bytes,load" >"$out/rows.csv"
[ -e "$out/updates.csv" ] || echo "edge_mm,nodes,processes,update_mm,greatest_mm,compliance,modes_mm,same_contact,update_ms" >"$out/updates.csv"
rm -f "$out"/checks.csv "$out"/points.csv "$out"/left_out.csv
{ nproc; sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -1; } >"$out/machine.txt"

# A row of what `prepare --json` printed. work_s: the most processor time that a process spent outside messages.
row() {  # JSON EDGE PROCESSES THREADS
  /usr/bin/python3 - "$@" "$(cut -d' ' -f2 /proc/loadavg)" <<'PYTHON'
import json, sys
path, edge, processes, threads, load = sys.argv[1:]
r = json.load(open(path))
ranks = r.get("ranks", [{"peak_memory_bytes": r["peak_memory_bytes"], "processor_s": r["processor_s"], "exchange_s": 0, "bytes_sent": 0}])
of = lambda key: [b[key] for b in r["prepare"].values()]
peaks = [rank["peak_memory_bytes"] for rank in ranks]
print(edge, r["mesh"]["nodes"], r["sets"]["slaves"], processes, threads, round(r["total_s"], 2), round(r["mesh_s"], 2),
      round(sum(of("factor_s")) + sum(of("analyse_s")), 2), round(sum(of("condensed_s")) - sum(of("factor_s")) - sum(of("analyse_s")), 2),
      round(max(rank["processor_s"] - rank["exchange_s"] for rank in ranks), 2), max(peaks), min(peaks),
      sum(rank["bytes_sent"] for rank in ranks), r["model_file_bytes"], load, sep=",")
PYTHON
}

# One run. Its model stays for the comparison.
run() {  # EDGE PROCESSES THREADS
  local model=$out/model-$2-$3.h5 json=$out/run-$1-$2-$3.json
  if [ "$2" = 1 ]; then
    "$bin/brainshiftd" prepare --case "$out/case.yaml" --out "$model" --json --threads "$3" >"$json"
  else
    run_processes "$2" "$bin/brainshiftd" prepare --case "$out/case.yaml" --out "$model" --json >"$json"
  fi || return
  row "$json" "$1" "$2" "$3" >>"$out/rows.csv"
  rm "$json"
}

for edge in $edges; do
  if grep -q "^$edge," "$out/rows.csv"; then continue; fi
  sed -E "s/^( *(edge_mm|tumour_edge_mm|craniotomy_edge_mm): ).*/\1$edge/; s/^( *memory_limit_gib: ).*/\1${MEMORY_GIB:-8}/" \
    config/cases/colin27.yaml >"$out/case.yaml"
  for processes in ${RANKS:-2}; do
    step "edge $edge mm: one process, one thread" run "$edge" 1 1
    step "edge $edge mm: $processes processes" run "$edge" "$processes" 1
    difference=$("$bin/model_difference" "$out/model-1-1.h5" "$out/model-$processes-1.h5")
    echo "   $difference"
    /usr/bin/python3 -c 'import json, sys
d = json.loads(sys.argv[3])
print(sys.argv[1], d["nodes"], sys.argv[2], d["update_mm"], d["greatest_mm"], d["compliance"], d["modes_mm"], int(d["same_contact"]), d["update_ms"], sep=",")' \
      "$edge" "$processes" "$difference" >>"$out/updates.csv"
    rm "$out/model-$processes-1.h5"
  done
  if [ "${CORES:-0}" = 1 ]; then step "edge $edge mm: one process, all cores" run "$edge" 1 "$(nproc)"; fi
  rm -f "$out"/model-*.h5 "$out/case.yaml"
done
current=summary
studies scaling --dir "$out" --commit "$(commit_name)"
