#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# anatomy.sh BUILD_DIR [OUT_DIR]: whether falx, tentorium and ventricles of a label map pay: the same surgeries estimated with and
# without them, on real heads (docs/anatomy.md). Empties OUT_DIR (default: out/anatomy) and writes to it: heads/ (cases made of
# the label maps), rows-HEAD.csv (a row per update), prepare.json, checks.csv, left_out.csv, kinds.md, a picture, tables.md,
# summary.json. Exit status 0 only if every check holds.
#   BRAINSHIFT_EXTERNAL_DATA=...  folder with synthseg_labels/; without it nothing is measured, and the status is 0
#   HEADS="seg_01 seg_02"         label maps there; the model of the first is prepared too, and timed
#   SEEDS=20         surgeries per head and kind, from seed 1
#   RESUME=1         keep the surgeries that OUT_DIR has, after an interruption
#   QUICK=1          2 surgeries of the trial head seg_03, from seed 1001
set -euo pipefail
cd "$(dirname "$0")/../.."

build=$(realpath "${1:?usage: anatomy.sh BUILD_DIR [OUT_DIR]}")
bin=$build/bin
out=${2:-out/anatomy}
name=anatomy
. cmake/scripts/steps.sh

read -ra heads <<<"${HEADS:-seg_01 seg_02}"
options=(--resume --thousand-nodes 6 --seeds "${SEEDS:-20}" --first-seed 1)
if [ "${QUICK:-0}" = 1 ]; then
  read -ra heads <<<"${HEADS:-seg_03}"
  options=(--resume --thousand-nodes 6 --seeds 2 --first-seed 1001)
fi
resume_study "$out" "${RESUME:-0}"
maps=${BRAINSHIFT_EXTERNAL_DATA:-}/synthseg_labels
if [ ! -d "$maps" ]; then
  echo "anatomy: BRAINSHIFT_EXTERNAL_DATA has no folder synthseg_labels: nothing is measured" >&2
  echo "anatomy,BRAINSHIFT_EXTERNAL_DATA has no folder synthseg_labels" >>"$out/left_out.csv"
  exit 0
fi
check() {  # NAME VALUE BOUND PASS
  echo "anatomy,$1,$2,$3,$4,anatomy.sh" >>"$out/checks.csv"
}
case_of() {  # HEAD
  rm -f "$out/heads/$1"* || return
  PYTHONPATH=$build/python:tests/python PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 tests/anatomy/label_head.py \
    "$maps/$1.nii.gz" "$out/heads/$1.yaml" --programs "$bin" >"$out/heads/$1.log"
}
# The model as a user prepares it: default edges, about 18 thousand nodes.
prepare() {  # HEAD
  "$bin/brainshiftd" prepare --case "$out/heads/$1.yaml" --out "$out/model.h5" --json >"$out/prepare.json" || return
  rm -f "$out/model.h5"
  local figures
  figures=$(/usr/bin/python3 -c 'import json, sys
told = json.load(open(sys.argv[1]))
print(told["mesh"]["nodes"], told["total_s"], told["model_file_bytes"] / 2**20)' "$out/prepare.json") || return
  read -r nodes seconds mib <<<"$figures"
  check "$1: seconds to prepare $nodes nodes" "$seconds" "<= 40" "$(awk -v x="$seconds" 'BEGIN { print x <= 40 }')"
  check "$1: MiB of the model file" "$mib" "<= 350" "$(awk -v x="$mib" 'BEGIN { print x <= 350 }')"
}

status=0
mkdir -p "$out/heads"
for head in "${heads[@]}"; do
  step "case of $head" case_of "$head"
  step "$head" "$bin/anatomy" --head "$out/heads/$head.yaml" --out "$out/rows-$head.csv" "${options[@]}" || status=1
done
step "prepare ${heads[0]}" prepare "${heads[0]}" || status=1
current=summary
studies anatomy --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
