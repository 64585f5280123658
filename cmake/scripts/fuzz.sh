#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# fuzz.sh BIN_DIR [SECONDS] [TARGET...]: gives every fuzz target (tests/fuzz) that many seconds
# (default 60) of libFuzzer under the address and undefined-behaviour sanitizers. BIN_DIR is that of
# the preset `fuzz`. The corpus grows in out/fuzz/TARGET and is kept; an input that fails a target
# lies in out/fuzz/failed with the target's name in front, its report in out/fuzz/TARGET.log.
# Exit status 0 only if no target failed.
set -euo pipefail
cd "$(dirname "$0")/../.."

bin=$(realpath "${1:?usage: fuzz.sh BIN_DIR [SECONDS] [TARGET...]}")
seconds=${2:-60}
shift $(( $# < 2 ? $# : 2 ))
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(wire igtl case daemon problem plus nifti nrrd dicom mesh surface landmarks sequence surgery model)

out=out/fuzz
mkdir -p "$out/failed"
TMPDIR=$(mktemp -d -p /dev/shm 2>/dev/null || mktemp -d)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT
export UBSAN_OPTIONS=print_stacktrace=1
"$bin/make_seeds" "$TMPDIR/seeds"

failed=0
for target in "${targets[@]}"; do
  mkdir -p "$out/$target"
  folders=("$out/$target" "$TMPDIR/seeds/$target")
  [ ! -d "tests/fuzz/found/$target" ] || folders+=("tests/fuzz/found/$target")
  status=0
  "$bin/fuzz_$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -seed=1 \
    -print_final_stats=1 -artifact_prefix="$out/failed/$target-" "${folders[@]}" \
    >"$out/$target.log" 2>&1 || status=$?
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$out/$target.log")
  edges=$(grep -oE 'cov: [0-9]+' "$out/$target.log" | tail -n 1)
  if [ "$status" -eq 0 ]; then
    echo "$target: ${runs:-?} inputs, ${edges:-cov: ?}, nothing found"
  else
    failed=1
    echo "$target: FAILED, see $out/$target.log: $(grep -m 1 -E 'ERROR: |SUMMARY: |runtime error|does not hold' "$out/$target.log" || true)"
  fi
done
exit "$failed"
