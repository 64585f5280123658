#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# check-comments.sh [SOURCE_DIR]: checks what no compiler does.
#   1  No line with a comment is longer than 100 columns (*.hpp, *.cpp, *.proto).
#   2  Every unit of common has a test of its name in the mirrored folder of tests/unit, or that
#      folder's CMakeLists.txt has a line "# <unit>: tested in <file>", and the file exists. A unit is
#      a header with the source of its name, or a source without a header of its name.
#   3  A folder of common has at most 16 units.
# Prints one line per violation. Exit status: 0 none, 1 violations, 2 nothing to check.
set -euo pipefail
export LC_ALL=C
cd "${1:-$(dirname "$0")/../..}"
longest=100
most_units=16

mapfile -t files < <(find common server client tests proto -name '*.[ch]pp' -o -name '*.proto' | sort)
[ ${#files[@]} -gt 0 ] || { echo "check-comments: no sources below $PWD" >&2; exit 2; }

# Columns are characters: the bytes of UTF-8 that continue one do not count. A // in a string begins
# no comment.
long_comments() {
  awk -v longest=$longest '
    length($0) > longest {
      code = $0
      gsub(/"([^"\\]|\\.)*"/, "", code)
      columns = gsub(/[^\200-\277]/, "&")
      if (columns > longest && index(code, "//"))
        printf "%s:%d: a comment line of %d columns: at most %d\n", FILENAME, FNR, columns, longest
    }' "${files[@]}"
}

units_of() {  # FOLDER: names of its units
  find "$1" -maxdepth 1 -name '*.[ch]pp' -printf '%f\n' | sed 's/\.[ch]pp$//' | sort -u
}

# FOLDER UNIT: nothing, or why the unit counts as untested.
untested() {
  local tests=tests/unit/${1#common/} place file
  [ -e "$tests/$2_test.cpp" ] && return
  place=$(sed -n "s/^# $2: tested in //p" "$tests/CMakeLists.txt" 2>/dev/null | head -n 1)
  if [ -z "$place" ]; then
    echo "neither $tests/$2_test.cpp nor a line \"# $2: tested in ...\" in $tests/CMakeLists.txt"
    return
  fi
  for file in $(grep -oE '[A-Za-z0-9_./-]+\.(cpp|py|sh)' <<<"$place"); do
    [ -e "$tests/$file" ] || [ -e "tests/unit/$file" ] || [ -e "tests/$file" ] ||
      echo "$tests/CMakeLists.txt names $file, which does not exist"
  done
}

found=$(
  long_comments
  while IFS= read -r folder; do
    mapfile -t units < <(units_of "$folder")
    [ ${#units[@]} -le $most_units ] ||
      echo "$folder: ${#units[@]} units: at most $most_units"
    for unit in "${units[@]}"; do
      reason=$(untested "$folder" "$unit")
      [ -z "$reason" ] || echo "$folder/$unit: $reason"
    done
  done < <(find common -name '*.[ch]pp' -printf '%h\n' | sort -u)
)
if [ -n "$found" ]; then
  echo "$found"
  echo "check-comments: $(wc -l <<<"$found") violations" >&2
  exit 1
fi
echo "check-comments: ${#files[@]} files and their tests are in order"
