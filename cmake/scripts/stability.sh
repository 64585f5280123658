#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# stability.sh BIN_DIR [OUT_DIR]: sweeps the product to the edges of what may be asked of it
# (docs/stability.md). Writes OUT_DIR (default: out/stability; emptied first): points.csv, seeded.csv,
# guards.csv; a map per sheet, faults.csv, summary.json. Exit status 0 only if no answer is wrong without a
# warning, every seeded fault is found, and the guards cost at most 3 %.
#   QUICK=1     ends and middle of every sweep; no seeded faults, no cost of the guards
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=${1:?usage: stability.sh BIN_DIR [OUT_DIR]}
out=${2:-out/stability}

name=stability
. cmake/scripts/steps.sh

empty_folder "$out"

if [ "${QUICK:-0}" = 1 ]; then
  step "sweeps, coarse" "$bin/stability_suite" --coarse --out "$out"
  part=(--partial)
else
  step "guards: their cost on the default head" "$bin/bench_guards" "$out/guards.csv"
  step "sweeps" "$bin/stability_suite" --out "$out"
  part=()
fi
current=summary
studies stability --dir "$out" "${part[@]}"
