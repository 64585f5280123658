#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# evidence.sh BUILD_DIR [OUT_DIR]: twins of the paper's five patients, against truths that share the
# estimate's model and against truths that do not (docs/evidence.md). Writes to OUT_DIR (default:
# out/evidence): rows-HEAD.csv and outlines-HEAD.csv (a row per update), checks.csv, left_out.csv, pictures,
# patients-HEAD.md (the paper's Tables 3 to 6 beside ours), page.md (the tables of docs/evidence.md),
# tables.md, summary.json; landmarks-CASE.csv where BRAINSHIFT_EXTERNAL_DATA has landmarks; patient-N/, a
# report of patients 1 to 4 as the daemon and the client play them (the paper's Figs. 6 to 8). Truths from
# outside the prior on the same patients, and what studies outside makes of them, go to OUT_DIR-outside.
# Exit status 0 only if every check holds.
#   RESUME=0         forget the surgeries that OUT_DIR has; otherwise a run goes on where it ended
#   OUTSIDE=0        no truths from outside (the longest part)
#   BRAINSHIFT_EXTERNAL_DATA=...  folder with mni152/, resect_case1/ and resect_case4/; without it
#                    the second head and the landmarks are left out
#   HEADS="..."      case files of heads (default: colin27, and mni152 where it can be had; the truth
#                    `calculix` is of colin27 alone)
#   SEEDS=N          surgeries per patient and truth (default: 2)
#   OUTLINES=N       sags seen through a wrong outline, which must not pass for swelling (default: 12)
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
if [ "${OUTSIDE:-1}" = 1 ]; then resume_study "$out-outside" "${RESUME:-1}"; fi
resume_study "$out" "${RESUME:-1}"

# The paper's Figs. 6 and 7 (patients 1 and 4; 2 and 3), and Fig. 8 (patients 1 and 2, its own
# method), from the tumour alone as there.
play_patient() {
  local patient=patient-$1 case_file=config/cases/patient-$1.yaml reports=()
  local folder=$out/$patient
  mkdir -p "$folder/runs" || return
  "$bin/brainshiftd" prepare --case "$case_file" --out "$folder/model.h5" >"$folder/prepare.log" || return
  start_daemon "$folder/model.h5" || return
  "$bin/brainshift" simulate --case "$case_file" --scenario "$patient" --seed 1 \
    --out "$folder/$patient.surgery" >"$folder/simulate.log" || return
  local methods=(condensed)
  if [ "$1" -le 2 ]; then methods+=(paper); fi
  for method in "${methods[@]}"; do
    "$bin/brainshift" replay "$folder/$patient.surgery" --endpoint "$endpoint" --boundary both \
      --sources ius --method "$method" --report "$folder/runs/$method.json" >"$folder/runs/$method.log" || return
    reports+=("$folder/runs/$method.json")
  done
  "$bin/brainshift" report "${reports[@]}" --out "$folder" >"$folder/report.log" || return
  stop_daemon || return
  rm -f "$folder/model.h5"
}

status=0
heads=colin27
if [ "${QUICK:-0}" != 1 ]; then
  if [ -d "${BRAINSHIFT_EXTERNAL_DATA:-}/mni152" ]; then
    heads+=" mni152"
  else
    echo "mni152,BRAINSHIFT_EXTERNAL_DATA has no second head" >>"$out/left_out.csv"
  fi
fi
for head in ${HEADS:-$heads}; do
  step "$head" "$bin/evidence" --head "$head" --out "$out/rows-$head.csv" "${options[@]}" || status=1
  if [ "${QUICK:-0}" != 1 ]; then
    step "$head, outlines" "$bin/evidence" --head "$head" --patients 1 --truths segmentation \
      --seeds "${OUTLINES:-12}" --resume --out "$out/outlines-$head.csv" || status=1
  fi
done
# Truths from outside the prior on the same patients.
outside_of_patients() {
  local options=(--patients 1 2 3 4 5 --seeds "${SEEDS:-2}" --kinds all)
  if [ "${QUICK:-0}" = 1 ]; then
    options=(--patients 1 2 --seeds 1 --first-seed 1001 --thousand-nodes 6 --kinds air-side,cavity)
  fi
  "$bin/surgeries" "${options[@]}" --resume --out "$out-outside/rows-patients.csv" || return
  studies outside --dir "$out-outside" --commit "$(commit_name)"
}
if [ "${OUTSIDE:-1}" = 1 ]; then
  step "truths from outside" outside_of_patients || status=1
else
  echo "truths from outside,OUTSIDE=0" >>"$out/left_out.csv"
fi
for pairs in 1/Case1-beforeUS-afterUS.tag 4/Case4-MRI-beforeUS.csv; do
  resect=resect-${pairs%%/*}
  file=${BRAINSHIFT_EXTERNAL_DATA:-}/resect_case$pairs
  if [ -f "$file" ]; then
    step "$resect" "$bin/evidence_landmarks" --pairs "$file" --case "config/cases/$resect.yaml" \
      --out "$out/landmarks-$resect.csv" || status=1
  else
    echo "$resect,BRAINSHIFT_EXTERNAL_DATA has no landmarks of this operation" >>"$out/left_out.csv"
  fi
done
if [ "${QUICK:-0}" = 1 ]; then
  echo "figures,the paper's Figs. 6 to 8 are not drawn in the short form" >>"$out/left_out.csv"
else
  for patient in 1 2 3 4; do
    step "patient $patient through daemon and client" play_patient "$patient" || status=1
  done
fi
current=summary
studies evidence --dir "$out" --commit "$(commit_name)" || status=1
exit "$status"
