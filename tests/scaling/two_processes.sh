#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# two_processes.sh BIN_DIR WORK_DIR: the coarse head's model by two processes against one, and what is refused.
set -euo pipefail
bin=$(realpath "$1") work=$2/two_processes
rm -rf "$work" && mkdir -p "$work"
case=config/cases/colin27-coarse.yaml
. cmake/scripts/mpirun.sh
"$bin/brainshiftd" prepare --case "$case" --out "$work/one.h5" --json >"$work/one.json"
run_processes 2 "$bin/brainshiftd" prepare --case "$case" --out "$work/two.h5" --json >"$work/two.json"
"$bin/model_difference" "$work/one.h5" "$work/two.h5" 1e-5
[ "$(ls "$work"/*.partial* 2>/dev/null | wc -l)" = 0 ] || { echo "a checkpoint was left" >&2; exit 1; }
grep -q '"ranks":\[{.*},{.*}\]' "$work/two.json"

# refused TEXT COMMAND...: one line, status 2, from one process.
refused() {
  local text=$1 status=0
  shift
  run_processes 2 "$@" >/dev/null 2>"$work/err" || status=$?
  if [ "$status" != 2 ] || [ "$(grep -c '^brainshiftd:' "$work/err")" != 1 ] || ! grep -q "$text" "$work/err"; then
    echo "status $status, expected 2 and one line with: $text" >&2
    cat "$work/err" >&2
    exit 1
  fi
}
refused "missing.yaml" "$bin/brainshiftd" prepare --case "$work/missing.yaml" --out "$work/no.h5"
refused "only prepare runs as several processes" "$bin/brainshiftd" serve --config config/daemon.yaml
refused "no_such_folder" "$bin/brainshiftd" prepare --case "$case" --out "$work/no_such_folder/no.h5"
