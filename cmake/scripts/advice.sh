#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# advice.sh BUILD_DIR [OUT_DIR]: what `brainshift advise` predicts against measurements that are made, on 120
# simulated surgeries (docs/advise.md). Empties OUT_DIR (default: out/advice) and writes to it: rows-colin27.csv
# (a row per surgery and candidate), checks.csv, pictures, tables.md, summary.json. Exit status 0 only if every
# check holds.
#   RESUME=1         keep the surgeries that OUT_DIR has, after an interruption
#   QUICK=1          2 places x 2 seeds
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: advice.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/advice}
name=advice
. cmake/scripts/steps.sh

options=(--resume)
if [ "${QUICK:-0}" = 1 ]; then options+=(--places 2 --seeds 2); fi
resume_study "$out" "${RESUME:-0}"

status=0
step surgeries "$bin/advice_study" --out "$out/rows-colin27.csv" "${options[@]}" || status=1
current=summary
studies advice --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
