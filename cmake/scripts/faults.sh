#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# faults.sh BUILD_DIR [OUT_DIR [TOPIC...]]: the daemon, the client and the command line through faults
# and loads (docs/faults.md). Empties OUT_DIR (default: out/faults) and writes to it: raw CSV, a folder
# per topic; checks.csv, left_out.csv, tables.md, summary.json. TOPIC: those of `faults --help`, and
# power-cuts; default all. Exit status 0 only if every check holds.
#   BRIEF=1       the short forms that the tests run
#   INPUTS=DIR    where models and surgeries are kept from run to run (default: BUILD_DIR/fault-inputs)
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: faults.sh BUILD_DIR [OUT_DIR [TOPIC...]]}
bin=$build/bin
out=${2:-out/faults}
inputs=${INPUTS:-$build/fault-inputs}
name=faults
. cmake/scripts/steps.sh

topics=("${@:3}")
if [ ${#topics[@]} -eq 0 ]; then
  topics=(kills power-cuts files messages unfinished half-open crowds restart clocks stalled viewers rate cost)
fi
brief=()
if [ "${BRIEF:-0}" = 1 ]; then brief=(--brief); fi

# Which model a topic serves: the head where times matter, the coarse one elsewhere.
model_of() {
  case $1 in
    stalled | viewers | rate | cost) if [ ${#brief[@]} -eq 0 ]; then echo head; else echo coarse; fi ;;
    *) echo coarse ;;
  esac
}

surgery_of() {
  case $1 in
    kills) echo landmarks ;;
    stalled | viewers | rate | cost) echo boundary ;;
    *) echo joint ;;
  esac
}

empty_study "$out"
BRAINSHIFT_STUDY_DIR=$(realpath "$out")
export BRAINSHIFT_STUDY_DIR
status=0
for topic in "${topics[@]}"; do
  if [ "$topic" = power-cuts ]; then
    step power-cuts "$bin/unit_server_journal" --gtest_filter='PowerCut.*' --gtest_brief=1 || status=1
    continue
  fi
  model=$(model_of "$topic")
  cmake/scripts/faults-inputs.sh "$bin" "$inputs" "$model"
  step "$topic" "$bin/faults" "$topic" --work "$out/$topic" --model "$inputs/$model.h5" \
    --surgery "$inputs/$model-$(surgery_of "$topic").surgery" --other-model "$inputs/other.h5" "${brief[@]}" || status=1
done
current=summary
studies summary --dir "$out" --commit "$(commit_name)" --command "make faults" --title Faults || status=1
exit "$status"
