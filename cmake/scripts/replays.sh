#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# replays.sh BUILD_DIR [OUT_DIR]: five recorded surgeries played through the daemon, with its journal, at
# the recorded times and at full speed (docs/replays.md). Empties OUT_DIR (default: out/replays) and
# writes to it: the corpus (NAME.surgery, corpus.csv), rows-CASE.csv (a row per observation),
# percentiles.csv, latency.md, checks.csv, left_out.csv, pictures, tables.md, summary.json. Exit status
# 0 only if every check holds.
#   QUICK=1            the coarse head, fewer passes; into out/replays-quick
#   SURGERIES="..."    names; play these only (default: all of the corpus)
#   COMMITTED=DIR      rows-CASE.csv of an earlier run, to compare with (default: docs/replays)
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: replays.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/replays}
head=colin27
passes=(--passes-1x 3 --passes-max 10)
if [ "${QUICK:-0}" = 1 ]; then
  out=${2:-out/replays-quick}
  head=colin27-coarse
  passes=(--passes-1x 1 --passes-max 2)
fi
all="sag-progress joint-mixed joint-tangential resection joint-distension"
for one in ${SURGERIES:=$all}; do
  case " $all " in
    *" $one "*) ;;
    *) echo "replays: SURGERIES: $one is not in the corpus: $all" >&2; exit 2 ;;
  esac
done
name=replays
. cmake/scripts/steps.sh
empty_study "$out"

prepare() {
  "$bin/brainshiftd" prepare --case "config/cases/$head.yaml" --out "$out/$head.h5" >"$out/prepare.txt"
}
step "prepare: $head" prepare
step "corpus: five surgeries" "$bin/replays_corpus" --head "config/cases/$head.yaml" --out "$out"

# The default daemon, with a journal. Each pass is a session.
{
  echo "journal_dir: journal"
  echo "limits: {session_starts_per_min: 10000}"
} >"$out/daemon.yaml"
mkdir "$out/journal"
step "serve: load the model file" start_daemon "$out/$head.h5" "$out/daemon.yaml"

surgeries=()
for one in $SURGERIES; do
  surgeries+=("$out/$one.surgery")
done
status=0
step "replay: 1x and full speed" "$bin/replays" "${surgeries[@]}" --endpoint "$endpoint" \
  --out "$out/rows-$head.csv" "${passes[@]}"
step "stop: daemon" stop_daemon
rm -r "$out/journal" "$out/$head.h5"  # a gigabyte that nobody reads

current=summary
studies replays --dir "$out" --commit "$(commit_name)" \
  --committed-rows "${COMMITTED:-docs/replays}/rows-$head.csv" \
  --committed-corpus "tests/replays/corpus-$head.csv" || status=1
exit "$status"
