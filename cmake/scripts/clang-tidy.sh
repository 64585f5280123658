#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-tidy.sh BUILD_DIR [FOLDER...]: runs clang-tidy with .clang-tidy over the sources of the given folders
# (default: common server client) that BUILD_DIR/compile_commands.json knows. Exits 1 on a finding.
set -euo pipefail
build=$(realpath "${1:?usage: clang-tidy.sh BUILD_DIR [FOLDER...]}")
shift
folders=("$@")
[ ${#folders[@]} -gt 0 ] || folders=(common server client)
command -v run-clang-tidy >/dev/null || { echo "clang-tidy not found: apt-get install clang-tidy" >&2; exit 1; }

# Sources include generated Protobuf headers.
if ninja -C "$build" -t query brainshift_proto >/dev/null 2>&1; then
  cmake --build "$build" --target brainshift_proto
fi
# clang-tidy 14 needs tens of minutes for a source that instantiates CGAL; those few rely on the compiler.
root=$(git rev-parse --show-toplevel)
cd "$root"
mapfile -t files < <(git ls-files "${folders[@]/%//*.cpp}" | xargs grep -L '#include <CGAL/' | sed "s|.*|^$root/&\$|")
[ ${#files[@]} -gt 0 ] || { echo "clang-tidy.sh: no source in: ${folders[*]}" >&2; exit 2; }
# Only findings: neither the command lines nor the count of warnings in system headers.
run-clang-tidy -quiet -p "$build" -j "${JOBS:-$(nproc)}" "${files[@]}" 2>&1 |
  { grep --line-buffered -vE '^clang-tidy|warnings? generated|^$' || true; }
