#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# cohort.sh BUILD_DIR [OUT_DIR]: brainshift-bids on real heads: a dataset of the label maps in BRAINSHIFT_EXTERNAL_DATA
# (synthseg_labels), prepared, operated on and scored with the defaults (docs/cohort.md). Empties OUT_DIR (default: out/cohort) and
# writes to it: bids, here (the derivative), checks.csv, tables.md, summary.json. Exit status 0 only if every check holds.
#   SUBJECTS=20      heads; above the number of maps, mirrored ones
#   OPTIONS=...      of brainshift-bids participant, beside --simulated-tumour
#   ENGINES=1        once more by Snakemake and by a Slurm of this machine, which must give the same tables; ENGINE_SUBJECTS=20 of them
set -euo pipefail
cd "$(dirname "$0")/../.."

build=$(realpath "${1:?usage: cohort.sh BUILD_DIR [OUT_DIR]}")
bin=$build/bin
out=${2:-out/cohort}
name=cohort
subjects=${SUBJECTS:-20} processors=$(nproc)
maps=${BRAINSHIFT_EXTERNAL_DATA:-}/synthseg_labels
[ -d "$maps" ] || { echo "cohort: BRAINSHIFT_EXTERNAL_DATA has no folder synthseg_labels" >&2; exit 2; }
. cmake/scripts/steps.sh
export PYTHONPATH=$build/python:$PWD/tests PYTHONDONTWRITEBYTECODE=1 BRAINSHIFT_SOURCE=$PWD BRAINSHIFT_PROGRAMS=$bin
read -ra options <<<"--simulated-tumour ${OPTIONS:-}"

empty_study "$out"
BRAINSHIFT_STUDY_DIR=$(realpath "$out")
export BRAINSHIFT_STUDY_DIR
check() {  # NAME VALUE BOUND PASS
  echo "cohort,$1,$2,$3,$4,cohort.sh" >>"$out/checks.csv"
}
app() { /usr/bin/python3 -m brainshift.cohort "$@" --programs "$bin"; }
made() { wc -l <"$1/group_subjects.tsv"; }

step "dataset of $subjects heads" /usr/bin/python3 tests/python/label_cohort.py "$maps" "$out/bids" --subjects "$subjects"
status=0
begin=$EPOCHREALTIME
step "participants" app "$out/bids" "$out/here" participant "${options[@]}" || status=1
step "group" /usr/bin/python3 -m brainshift.cohort "$out/bids" "$out/here" group
minutes=$(awk -v s="$(seconds_since "$begin" 1)" 'BEGIN { printf "%.1f", s / 60 }')
rows=$(($(made "$out/here") - 1))
check "subjects with results" "$rows" "== $subjects" $((rows == subjects))
check "minutes of $subjects subjects on $processors processors" "$minutes" "<= 45" "$(awk -v m="$minutes" 'BEGIN { print m <= 45 }')"
if [ "${ENGINES:-0}" = 1 ]; then
  export BRAINSHIFT_COHORT=$out BRAINSHIFT_COHORT_OPTIONS="${options[*]}" BRAINSHIFT_COHORT_SUBJECTS=${ENGINE_SUBJECTS:-$subjects}
  BRAINSHIFT_COHORT=$(realpath "$out")
  for engine in snakemake slurm; do
    same=1
    step "$engine" /usr/bin/python3 -m pytest -q -p no:cacheprovider tests/python/test_cohort_engines.py -k "test_$engine" || same=0
    check "the same tables by $engine (1: bit for bit)" $same "== 1" $same
  done
fi
current=summary
studies summary --dir "$out" --commit "$(commit_name)" --command "make cohort" --title Cohort || status=1
exit "$status"
