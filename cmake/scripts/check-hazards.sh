#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# check-hazards.sh [SOURCE_DIR]: every test that docs/hazards.md names exists: `Suite.Case` in a source
# of tests, `fuzz.TARGET` in tests/fuzz/CMakeLists.txt, `faults.TOPIC` in tests/faults/CMakeLists.txt,
# `python.test_...` in tests/python and `integration.test_...` in tests/integration. Prints one line per name that does not.
# Exit status: 0 all exist, 1 some do not, 2 the document names none.
set -euo pipefail
export LC_ALL=C
cd "${1:-$(dirname "$0")/../..}"

known=$(
  grep -rhoPz 'TEST(_F|_P)?\(\s*\w+,\s*\w+\s*\)' tests --include=*.cpp | tr -d ' \n' | tr '\0' '\n' |
    sed -E 's/TEST(_F|_P)?\(//; s/,/./; s/\)//'
  sed -n 's/^brainshift_fuzz(\([a-z]*\) .*/fuzz.\1/p' tests/fuzz/CMakeLists.txt
  sed -n 's/^def \(test_[a-z_]*\)(.*/python.\1/p' tests/python/test_*.py
  sed -n 's/^def \(test_[a-z_]*\)(.*/integration.\1/p' tests/integration/test_*.py
  sed -n 's/^faults_test(\([a-z-]*\).*/faults.\1/p' tests/faults/CMakeLists.txt
)
mapfile -t named < <(grep -oE '`([A-Z][A-Za-z]+\.[A-Z][A-Za-z0-9]+|fuzz\.[a-z]+|faults\.[a-z-]+|(python|integration)\.[a-z_]+)`' docs/hazards.md |
  tr -d '`' | sort -u)
[ ${#named[@]} -gt 0 ] || { echo "check-hazards: docs/hazards.md names no test" >&2; exit 2; }
missing=0
for name in "${named[@]}"; do
  grep -qxF "$name" <<<"$known" || { echo "docs/hazards.md: there is no test $name"; missing=1; }
done
[ $missing -eq 0 ] && echo "check-hazards: ${#named[@]} tests exist"
exit $missing
