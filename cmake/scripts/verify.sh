#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# verify.sh BUILD_DIR [OUT_DIR]: the verification suite against closed forms and series. Empties
# OUT_DIR (default: out/verify) and writes to it: points.csv, checks.csv, one chart per study,
# tables.md, summary.json. Exit status 0 only if every test passes and every check holds.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${1:?usage: verify.sh BUILD_DIR [OUT_DIR]}
bin=$build/bin
out=${2:-out/verify}
name=verify
. cmake/scripts/steps.sh

empty_study "$out"
status=0
tests() {
  BRAINSHIFT_STUDY_DIR=$(realpath "$out") \
    ctest --test-dir "$build" -L '^verification$' --no-tests=error --output-on-failure -j 2 || status=1
}
step "verification tests" tests
current=summary
studies summary --dir "$out" --commit "$(commit_name)" --command "make verify" || status=1
exit "$status"
