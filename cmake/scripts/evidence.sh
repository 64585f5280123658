#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# evidence.sh BUILD_DIR [OUT_DIR]: twins of the paper's five patients, against truths that share the
# estimate's model and against truths that do not (docs/evidence.md). Writes to OUT_DIR (default:
# out/evidence): rows-HEAD.csv (a row per update), points.csv, checks.csv, left_out.csv, pictures,
# patients-HEAD.md (the paper's Tables 3 to 6 beside ours), tables.md, summary.json; landmarks.csv
# where BRAINSHIFT_EXTERNAL_DATA has landmarks. Exit status 0 only if every check holds.
#   RESUME=0         forget the surgeries that OUT_DIR has; otherwise a run goes on where it ended
#   HEADS="..."      case files of heads (default: colin27; mni152 needs BRAINSHIFT_EXTERNAL_DATA;
#                    the truth `calculix` is of colin27 alone)
#   SEEDS=N          surgeries per patient and truth (default: 2)
#   QUICK=1          patients 1 and 2, consistency, mesh, gap and all, one seed (1001), 6 thousand nodes;
#                    into out/evidence-quick
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: evidence.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/evidence}
name=evidence
. cmake/scripts/steps.sh

options=(--resume --seeds "${SEEDS:-2}")
if [ "${QUICK:-0}" = 1 ]; then
  out=${2:-out/evidence-quick}
  options=(--resume --seeds 1 --first-seed 1001 --thousand-nodes 6 --patients 1 2
    --truths consistency mesh gap all)
fi
resume_study "$out" "${RESUME:-1}"

status=0
for head in ${HEADS:-colin27}; do
  step "$head" "$bin/evidence" --head "$head" --out "$out/rows-$head.csv" "${options[@]}" || status=1
done
pairs=${BRAINSHIFT_EXTERNAL_DATA:-}/resect_case4/Case4-MRI-beforeUS.csv
if [ -f "$pairs" ]; then
  step landmarks "$bin/evidence_landmarks" --pairs "$pairs" --case config/cases/resect-4.yaml \
    --out "$out/landmarks.csv" || status=1
else
  echo "landmarks,BRAINSHIFT_EXTERNAL_DATA has no landmarks of a real operation" >>"$out/left_out.csv"
fi
step summary "$bin/evidence_summary" "$out"/rows-*.csv || status=1
current=summary
"$bin/study_summary" --dir "$out" --commit "$(commit_name)" --command "make evidence" \
  --title Evidence || status=1
exit "$status"
