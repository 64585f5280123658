#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# run-tests.sh PRESET [CTEST ARGUMENTS...]: CTest's tests of a test preset, and then how many cases they were: a CTest test is
# a whole program, of GoogleTest or pytest, whose cases are counted from what it wrote to test_results.
# Ends with CTest's status.
set -uo pipefail
cd "$(dirname "$0")/../.." || exit 1
preset=${1:?usage: run-tests.sh PRESET [CTEST ARGUMENTS...]}
shift
build=build/$preset
[ -d "$build" ] || build=build/release  # the test presets of the release build
rm -rf "$build/test_results"
mkdir -p "$build/test_results"
ctest --preset "$preset" -j "${JOBS:-2}" --output-junit test_results/ctest.xml "$@"
status=$?
python3 cmake/scripts/count-cases.py "$build/test_results" || status=1
exit "$status"
