#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-format.sh check|write: compares the C++ sources with .clang-format, or rewrites them.
# Other versions than Debian 12's 14 format differently, so they are refused rather than allowed to disagree.
set -euo pipefail
mode=${1:-}
[ "$mode" = check ] || [ "$mode" = write ] || { echo "usage: clang-format.sh check|write" >&2; exit 2; }
cd "$(git rev-parse --show-toplevel)"

tool=
for candidate in clang-format-14 clang-format; do
  if command -v "$candidate" >/dev/null && "$candidate" --version | grep -q 'version 14\.'; then
    tool=$candidate
    break
  fi
done
[ -n "$tool" ] || { echo "clang-format 14 not found: apt-get install clang-format" >&2; exit 1; }

bad=0
total=0
while IFS= read -r file; do
  [ -f "$file" ] || continue
  total=$((total + 1))
  if [ "$mode" = write ]; then
    "$tool" --style=file -i "$file"
  elif ! "$tool" --style=file "$file" | cmp -s - "$file"; then
    echo "not in the house format: $file" >&2
    bad=$((bad + 1))
  fi
done < <(git ls-files --cached --others --exclude-standard '*.cpp' '*.hpp')

[ "$mode" = write ] || echo "format-check: $((total - bad)) of $total files in the house format"
[ "$bad" -eq 0 ]
