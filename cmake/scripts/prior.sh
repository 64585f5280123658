#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# prior.sh BUILD_DIR [OUT_DIR]: what the prior says before any measurement, against published ranges of
# brain shift, and what an unknown stiffness does to the model (docs/decisions/0018). Empties OUT_DIR
# (default: out/prior) and writes to it: draws.csv, truncation.csv, quantiles.csv (targets
# beside them), prior-predictive.png, prior-parts.png, stiffness.csv, stiffness.txt, checks.csv, tables.md, summary.json. Exit status 0 only if
# every quantile lies in its bracket.
#   QUICK=1          6 thousand nodes instead of 18
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: prior.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/prior}
name=prior
. cmake/scripts/steps.sh

size=18
if [ "${QUICK:-0}" = 1 ]; then size=6; fi
empty_study "$out"
BRAINSHIFT_STUDY_DIR=$(realpath "$out")
export BRAINSHIFT_STUDY_DIR

status=0
step "prior predictive" "$bin/prior_predictive" --thousand-nodes "$size" --out "$out" || status=1
stiffness() {
  "$bin/stiffness_study" --thousand-nodes "$size" --out "$out/stiffness.csv" | tee "$out/stiffness.txt"
}
step "unknown stiffness" stiffness || status=1
current=summary
studies prior --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
