#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# page.sh BUILD_DIR [OUT_DIR]: the page of `brainshift view` in Chromium beside a daemon (docs/view.md). Empties OUT_DIR (default:
# out/page) and writes to it: rows-updates.csv (a row per update), checks.csv, tables.md, summary.json. Exit status 0
# only if every check holds. Needs the program chromium.
#   CASE=FILE        config/cases/colin27-coarse.yaml by default
#   MODEL=FILE       prepared of it before
#   TURNS=0          nothing is timed; GROWTH_S=0: no page stays open for ten minutes (rows-growth.csv)
set -euo pipefail
cd "$(dirname "$0")/../.."

build=$(realpath "${1:?usage: page.sh BUILD_DIR [OUT_DIR]}")
bin=$build/bin
out=${2:-out/page}
name=page
. cmake/scripts/steps.sh

empty_study "$out"
export BRAINSHIFT_SOURCE=$PWD BRAINSHIFT_PROGRAMS=$bin PYTHONPATH=$build/python PYTHONDONTWRITEBYTECODE=1
current=summary
/usr/bin/python3 tests/python/measure_view.py "${CASE:-config/cases/colin27-coarse.yaml}" "$out" ${MODEL:+--model "$MODEL"} --turns "${TURNS:-5}" --growth-s "${GROWTH_S:-600}"
