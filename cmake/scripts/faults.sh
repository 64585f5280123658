#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# faults.sh BUILD_DIR [OUT_DIR [TOPIC...]]: the daemon, the client and the command line through faults
# and loads (docs/faults.md). Empties OUT_DIR (default: out/faults) and writes to it: raw CSV, a folder
# per topic; checks.csv, left_out.csv, tables.md, summary.json. TOPIC: those of `faults --help`, and
# power-cuts, streams, malformed, stops, displays; default all. Exit status 0 only if every check holds.
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
  topics=(kills power-cuts files messages unfinished half-open crowds hang-ups restart clocks stalled viewers rate cost
    choices largest allocations threads stops displays streams malformed)
fi
brief=()
if [ "${BRIEF:-0}" = 1 ]; then brief=(--brief); fi

# Which model a topic serves: the head where times matter, the coarse one elsewhere.
model_of() {
  case $1 in
    stalled | viewers | rate | cost | largest) if [ ${#brief[@]} -eq 0 ]; then echo head; else echo coarse; fi ;;
    *) echo coarse ;;
  esac
}

surgery_of() {
  case $1 in
    kills) echo landmarks ;;
    stalled | viewers | rate | cost | allocations) echo boundary ;;
    *) echo joint ;;
  esac
}

# The tests that are Python's, with their figures recorded; stops of 1 to 60 s.
with_python() {
  local stops="1 2 4 8 15 30 60"
  if [ ${#brief[@]} -gt 0 ]; then stops="1 3"; fi
  env PYTHONPATH="$build/python" PYTHONDONTWRITEBYTECODE=1 BRAINSHIFT_SOURCE="$PWD" BRAINSHIFT_PROGRAMS="$(realpath "$bin")" \
    BRAINSHIFT_STOPS_S="$stops" /usr/bin/python3 -m pytest -q -p no:cacheprovider "tests/python/test_$1.py"
}

empty_study "$out"
BRAINSHIFT_STUDY_DIR=$(realpath "$out")
export BRAINSHIFT_STUDY_DIR
status=0
for topic in "${topics[@]}"; do
  case $topic in
    power-cuts) step power-cuts "$bin/unit_server_journal" --gtest_filter='PowerCut.*' --gtest_brief=1 || status=1 ;;
    streams) step streams "$bin/unit_tools_bridge" --gtest_filter='InboxSweep.In200*' --gtest_brief=1 || status=1 ;;
    malformed) step malformed "$bin/unit_wire" --gtest_filter='MalformedFrames.*' --gtest_brief=1 || status=1 ;;&
    stops | displays | malformed) step "$topic" with_python "$topic" || status=1 ;;
  esac
  case $topic in power-cuts | streams | stops | displays | malformed) continue ;; esac
  model=$(model_of "$topic")
  cmake/scripts/faults-inputs.sh "$bin" "$inputs" "$model"
  step "$topic" "$bin/faults" "$topic" --work "$out/$topic" --model "$inputs/$model.h5" \
    --surgery "$inputs/$model-$(surgery_of "$topic").surgery" --other-model "$inputs/other.h5" "${brief[@]}" || status=1
done
current=summary
studies summary --dir "$out" --commit "$(commit_name)" --command "make faults" --title Faults || status=1
exit "$status"
