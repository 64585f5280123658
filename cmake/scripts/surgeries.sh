#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# surgeries.sh BUILD_DIR [OUT_DIR]: many different simulated surgeries on two heads, estimated with the
# defaults (docs/surgeries.md). Empties OUT_DIR (default: out/surgeries) and writes to it:
# rows-HEAD.csv (a row per update), of truths from outside outside.md (a line per head, kind and data), musts.md
# and summary.md, points.csv, checks.csv, left_out.csv, pictures, tables.md, summary.json. Exit status 0 only if every check holds.
#   BRAINSHIFT_EXTERNAL_DATA=...  folder with mni152/; without it the second head is left out
#   RESUME=1         keep the surgeries that OUT_DIR has, after an interruption
#   BEFORE=DIR       rows-*.csv of an earlier estimate on the same surgeries, to compare with
#                    (default: docs/surgeries/before)
#   KINDS=a,b        these kinds of truths from outside, or all, and no scenario (docs/surgeries.md)
#   FIXED=1          estimate truths from outside with prior.scales: fixed too, in OUT_DIR-fixed, and hold the
#                    default's interval score against it
#   SEEDS=N          surgeries of a place and kind (default: 4; docs/surgeries.md publishes truths from outside with 2)
#   THOUSAND_NODES=N meshes of about so many thousand nodes (default: those of the case files, 18)
#   QUICK=1          2 places x 2 seeds, from 1001 and 1101, on 6 thousand nodes
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: surgeries.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/surgeries}
name=surgeries
. cmake/scripts/steps.sh

options=(--resume)
first=1  # seed; the second head has other ones, from `first` + 100
before=${BEFORE:-docs/surgeries/before}
if [ "${QUICK:-0}" = 1 ]; then
  options+=(--places 2 --seeds 2 --thousand-nodes 6)
  first=1001
fi
if [ -n "${THOUSAND_NODES:-}" ]; then options+=(--thousand-nodes "$THOUSAND_NODES"); fi
if [ -n "${SEEDS:-}" ]; then options+=(--seeds "$SEEDS"); fi
if [ -n "${KINDS:-}" ]; then
  options+=(--kinds "$KINDS")
fi
fixed=$out-fixed fixed_options=(--fixed-strengths) compared=()
if [ -z "${KINDS:-}" ]; then fixed_options+=(--kinds all); fi
if [ "${FIXED:-0}" = 1 ]; then resume_study "$fixed" "${RESUME:-0}"; fi
resume_study "$out" "${RESUME:-0}"

status=0
head_of() {  # CASE FIRST_SEED
  step "$1" "$bin/surgeries" --head "config/cases/$1.yaml" --first-seed "$2" \
    --out "$out/rows-$1.csv" "${options[@]}" || status=1
  if [ "${FIXED:-0}" = 1 ]; then
    step "$1 with fixed strengths" "$bin/surgeries" --head "config/cases/$1.yaml" --first-seed "$2" \
      --out "$fixed/rows-$1.csv" "${options[@]}" "${fixed_options[@]}" || status=1
  fi
}
head_of colin27 "$first"
if [ -n "${BRAINSHIFT_EXTERNAL_DATA:-}" ]; then
  head_of mni152 "$((first + 100))"
else
  echo "mni152,BRAINSHIFT_EXTERNAL_DATA is not set" >>"$out/left_out.csv"
fi
shopt -s nullglob
current=summary
if [ "${FIXED:-0}" = 1 ]; then compared=(--fixed "$fixed"/rows-*.csv); fi
studies surgeries --dir "$out" --commit "$(commit_name)" --before "$before"/rows-*.csv "${compared[@]}" || status=1
exit "$status"
