#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-tidy.sh BUILD_DIR [FOLDER...]: runs clang-tidy with .clang-tidy over the sources of the given folders
# (default: common server client). Exits 1 on a finding. BUILD_DIR is of its own and is configured here:
# clang-tidy cannot read the headers that GCC has precompiled. Of it only Protobuf's sources are built. The files of
# a folder are read as one, so that their headers are looked at once: a quarter of the time.
set -euo pipefail
mkdir -p "${1:?usage: clang-tidy.sh BUILD_DIR [FOLDER...]}"
build=$(realpath "$1")
shift
folders=("$@")
[ ${#folders[@]} -gt 0 ] || folders=(common server client)
command -v run-clang-tidy >/dev/null || { echo "clang-tidy not found: apt-get install clang-tidy" >&2; exit 1; }

root=$(git rev-parse --show-toplevel)
cd "$root"
cmake -S . -B "$build" -G Ninja --log-level=WARNING -DCMAKE_BUILD_TYPE=Release -DBRAINSHIFT_UNITY=ON \
  -DBRAINSHIFT_PRECOMPILE=OFF -DBRAINSHIFT_CCACHE= >/dev/null
cmake --build "$build" --target brainshift_proto  # Protobuf's headers
# clang-tidy 14 needs tens of minutes for the mesher, which relies on the compiler.
mapfile -t files < <(python3 - "$build" "${folders[@]%/}" <<'PY'
import json, pathlib, sys
build, *folders = sys.argv[1:]
root = pathlib.Path.cwd()
for entry in json.loads((pathlib.Path(build) / "compile_commands.json").read_text()):
    source = pathlib.Path(entry["directory"], entry["file"])
    place = source.relative_to(build if source.is_relative_to(build) else root)
    if source.name != "mesh_generation.cpp" and any(place.is_relative_to(folder) for folder in folders):
        print(f"^{source}$")
PY
)
[ ${#files[@]} -gt 0 ] || { echo "clang-tidy.sh: no source in: ${folders[*]}" >&2; exit 2; }
# Findings, and which source was read last; neither the command lines nor the count of warnings in system headers.
# Options that only GCC knows stand in the compile commands. A file that reads the sources of a folder includes them.
done_=0
PYTHONUNBUFFERED=1 run-clang-tidy -quiet -extra-arg=-Wno-unknown-warning-option -extra-arg=-Wno-unused-command-line-argument \
  -header-filter='/(common|server|client)/.*\.[ch]pp$' -checks=-bugprone-suspicious-include \
  -p "$build" -j "${JOBS:-$(nproc)}" "${files[@]}" 2>&1 |
  while IFS= read -r line; do
    case $line in
      clang-tidy*) read=${line##*/CMakeFiles/}; echo "$((++done_))/${#files[@]} ${read%%.dir/*}" ;;
      "" | *" warnings generated." | *" warning generated.") ;;
      *) printf '%s\n' "$line" ;;
    esac
  done
