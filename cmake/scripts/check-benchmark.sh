#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# check-benchmark.sh: fails when BENCHMARK.md is of a commit that is no ancestor of this one, or since
# which the inversion has changed by more than comments and blank lines. Exit status 77 without the
# history that tells, and where the page tells its readers that it is outdated and by what, and names a commit up to which it was
# not measured anew: a later change of the inversion fails again.
set -euo pipefail
cd "$(dirname "$0")/../.."

inversion=(common/inversion common/contact common/linalg common/operators common/prior)

commit=$(sed -n 's/.*; commit \([^ ]*\)$/\1/p' docs/benchmark/machine.txt)
[ -n "$commit" ] || { echo "docs/benchmark/machine.txt names no commit" >&2; exit 1; }
case $commit in
  *-dirty) echo "BENCHMARK.md is of $commit: files differed from the commit" >&2; exit 1 ;;
esac
git rev-parse --git-dir >/dev/null 2>&1 || { echo "no git history"; exit 77; }
if ! git cat-file -e "$commit^{commit}" 2>/dev/null; then
  [ "$(git rev-parse --is-shallow-repository)" = false ] || { echo "a shallow history"; exit 77; }
  echo "BENCHMARK.md is of $commit, which this repository does not have" >&2
  exit 1
fi
git merge-base --is-ancestor "$commit" HEAD ||
  { echo "BENCHMARK.md is of $commit, which is no ancestor of HEAD" >&2; exit 1; }
changed_since() {
  git diff --ignore-blank-lines -I'^[[:space:]]*//' "$1" -- "${inversion[@]}" | sed -n 's/^diff --git a\/\([^ ]*\) .*/\1/p'
}
changed=$(changed_since "$commit")
same=$(sed -n 's/^\*\*Outdated\*\*.* not measured anew up to commit \([0-9a-f]*\)\..*/\1/p' BENCHMARK.md)
if [ -n "$changed" ] && [ -n "$same" ]; then
  git merge-base --is-ancestor "$same" HEAD || { echo "BENCHMARK.md names $same, which is no ancestor of HEAD" >&2; exit 1; }
  changed=$(changed_since "$same")
  if [ -z "$changed" ]; then
    echo "BENCHMARK.md is of $commit and says that it is outdated; not measured anew up to $same (make bench)"
    exit 77
  fi
  commit=$same
fi
if [ -n "$changed" ]; then
  echo "BENCHMARK.md is of $commit; since then the inversion has changed (make bench):" >&2
  echo "$changed" >&2
  exit 1
fi
echo "BENCHMARK.md is of $commit; the inversion is the same"
