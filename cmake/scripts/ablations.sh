#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# ablations.sh BUILD_DIR [OUT_DIR]: what each part of the default estimate buys: the estimate with one part
# off, or one on that it leaves out, over the truths of `make evidence` and motions of `make surgeries`, on
# the paper's five patients (docs/ablations.md). Writes to OUT_DIR (default: out/ablations):
# rows-colin27.csv (a row per update), rows.csv (the columns of it that docs/ablations keeps), checks.csv,
# left_out.csv, pictures, page.md (the table of docs/ablations.md), tables.md, summary.json. Exit status 0
# only if every check holds.
#   RESUME=0         forget the surgeries that OUT_DIR has; otherwise a run goes on where it ended
#   VARIANTS="..."   these changes only, beside the default
#   QUICK=1          patients 1 and 2, on 2 thousand nodes; into out/ablations-quick
# Seeds begin at 1001: what is found here decides what the default has, and no surgery that is published
# (make surgeries, make evidence, from seed 1) may.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: ablations.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/ablations}
name=ablations
. cmake/scripts/steps.sh

options=(--resume)
if [ "${QUICK:-0}" = 1 ]; then
  out=${2:-out/ablations-quick}
  options+=(--thousand-nodes 2 --patients 1 2)
fi
if [ -n "${VARIANTS:-}" ]; then
  read -ra variants <<<"$VARIANTS"
  options+=(--variants "${variants[@]}")
fi
resume_study "$out" "${RESUME:-1}"

status=0
step estimates "$bin/ablations" --out "$out/rows-colin27.csv" "${options[@]}"
current=summary
studies ablations --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
