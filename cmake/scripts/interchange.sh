#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# interchange.sh BUILD_DIR [OUT_DIR]: what `brainshift export` writes, in the programs that it is for:
# ITK, transformix, plastimatch, wb_command, nibabel, VTK (docs/export.md). Empties OUT_DIR (default:
# out/interchange) and writes to it: checks.csv, left_out.csv, tables.md, summary.json; the exported
# and warped files. Exit status 0 only if every check holds.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: interchange.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/interchange}
name=interchange
. cmake/scripts/steps.sh

empty_study "$out"
status=0
step "the toy patient's journal" "$bin/interchange_case" "$out"
step "other programs" /usr/bin/python3 tests/interchange/study.py --bin "$bin" --out "$out" || status=1
current=summary
studies summary --dir "$out" --commit "$(commit_name)" --command "make interchange" \
  --title Interchange || status=1
exit "$status"
