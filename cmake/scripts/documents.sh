#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# documents.sh BUILD_DIR [OUT_DIR]: types what docs/slicer.md, docs/python.md and docs/cpp.md tell their
# readers to type, as written, in a copy of the tracked files, against one daemon. Empties OUT_DIR (default:
# out/documents) and leaves each page's commands, their output and what they made there.
#
# The commands install packages, and the C++ client into /usr/local: for a machine that may be thrown away,
# and for root or somebody with sudo. It refuses to begin without THROWAWAY=1.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=$(realpath "${1:?usage: documents.sh BUILD_DIR [OUT_DIR]}")
bin=$build/bin
out=${2:-out/documents}
name=documents
if [ "${THROWAWAY:-}" != 1 ]; then
  echo "documents: installs into /usr/local; on a machine that may be thrown away, run it with THROWAWAY=1" >&2
  exit 2
fi
. cmake/scripts/steps.sh
empty_folder "$out"
out=$(realpath "$out")
tree=$out/tree
export PATH=$bin:$PATH

# blocks PAGE LANGUAGE: writes $out/PAGE-LANGUAGE-1, -2, … from the fenced blocks of docs/PAGE.md.
blocks() {
  awk -v prefix="$out/$1-$2-" -v fence="\`\`\`$2" '
    $0 == fence { inside = 1; file = prefix (++count); next }
    /^```/ { inside = 0 }
    inside { print > file }' "docs/$1.md"
}

# expect_blocks PAGE LANGUAGE COUNT: the page has as many as this script knows what to do with.
expect_blocks() {
  local found
  found=$(find "$out" -maxdepth 1 -name "$1-$2-[0-9]" | wc -l)
  if [ "$found" -ne "$3" ]; then
    echo "documents: docs/$1.md has $found blocks of $2, this script knows $3: teach it the new ones" >&2
    return 1
  fi
}

# typed FILE: runs it as a reader does, from the top of the clone. Root needs no sudo.
typed() {
  (
    cd "$tree"
    command -v sudo >/dev/null || sudo() { "$@"; }
    set -x
    . "$1"
  )
}

copy_of_the_tree() {
  mkdir -p "$tree"
  git ls-files -z | xargs -0 cp --parents -t "$tree"
  ln -s "$out/colin27.h5" "$tree/colin27.h5"
}

prepare() {
  (cd "$tree" && brainshiftd prepare --case config/cases/colin27.yaml --out "$out/colin27.h5") >"$out/prepare.log" 2>&1
}

# What the pages take for granted: a recorded surgery S.surgery, and points.txt, x y z of a point per line.
inputs() {
  (cd "$tree" && brainshift simulate --case config/cases/colin27.yaml --scenario paper-icp --seed 1 --out S.surgery)
  PYTHONPATH=$build/python /usr/bin/python3 - "$tree/S.surgery" "$tree/points.txt" <<'PYTHON'
import sys
import numpy as np
import brainshift
with brainshift.Surgery(sys.argv[1]) as surgery:
    bodies = [o.body for o in surgery.observations()]
np.savetxt(sys.argv[2], next(b for b in bodies if isinstance(b, brainshift.TumourBoundary)).points, fmt="%.4f")
PYTHON
}

# The first block of docs/slicer.md starts daemon and bridge in the background of its shell; they outlive
# the block and serve all pages.
serve() {
  (
    cd "$tree"
    . "$out/slicer-sh-1" >"$out/served.log" 2>&1
    jobs -p >"$out/pids"
    # They end with this script, not with this shell.
    disown -a
  )
  local tries
  for tries in $(seq 100); do
    if brainshiftd health --endpoint tcp://127.0.0.1:5555 >/dev/null 2>&1; then break; fi
    if ! kill -0 $(cat "$out/pids"); then cat "$out/served.log" >&2; return 1; fi
    sleep 0.3
  done
  echo "   daemon and bridge: $(tr '\n' ' ' <"$out/pids")"
}
end_served() { [ ! -s "$out/pids" ] || kill -TERM $(cat "$out/pids") 2>/dev/null || true; }
trap 'finish; end_served' EXIT

python_page() {
  typed "$out/python-sh-1"
  # "or unpack it into a folder of PYTHONPATH: it is a zip file"
  /usr/bin/python3 -m zipfile -e "$tree"/client/python/dist/brainshift-*-py3-none-any.whl "$out/site"
  export PYTHONPATH=$out/site
  { echo "import numpy; points = numpy.loadtxt('points.txt')"; cat "$out/python-python-1"; } >"$out/session.py"
  (cd "$tree" && /usr/bin/python3 "$out/session.py") | tee "$out/session.txt"
  grep -Eq '^(GOOD|CAUTION)' "$out/session.txt"
  typed "$out/python-sh-2"
  test -s "$tree/field.png" && test -s "$tree/field.vtu"
}

cpp_page() {
  typed "$out/cpp-sh-1"
  typed "$out/cpp-sh-2" | tee "$out/example.txt"
  grep -q 'largest displacement' "$out/example.txt"
  # The snippets of the page as a program of their own.
  mkdir "$out/viewer"
  {
    echo 'cmake_minimum_required(VERSION 3.25)'
    echo 'project(viewer CXX)'
    echo 'add_executable(viewer viewer.cpp)'
    cat "$out/cpp-cmake-1"
  } >"$out/viewer/CMakeLists.txt"
  {
    echo '#include <cstdio>'
    grep '^#include' "$out/cpp-cpp-1"
    echo 'int show(const std::string& text) { return std::puts(text.c_str()) < 0; }'
    echo 'void draw(const brainshift::Points& u) { std::printf("draws %d nodes\n", int(u.cols())); }'
    echo 'int main() {'
    grep -v '^#include' "$out/cpp-cpp-1"
    echo '  (void)status;'
    echo '}'
  } >"$out/viewer/viewer.cpp"
  cmake -S "$out/viewer" -B "$out/viewer/build"
  cmake --build "$out/viewer/build"
  "$out/viewer/build/viewer" | tee "$out/viewer.txt"
  grep -q '^draws [0-9]' "$out/viewer.txt"
}

slicer_page() {
  typed "$out/slicer-sh-2"
  grep -q 'good, current\|caution, current' "$out/served.log"
}

for page in slicer python cpp; do blocks "$page" sh; done
blocks python python
blocks cpp cmake
blocks cpp cpp
expect_blocks slicer sh 2
expect_blocks python sh 2
expect_blocks python python 1
expect_blocks cpp sh 2
expect_blocks cpp cmake 1
expect_blocks cpp cpp 1
copy_of_the_tree
step "a model file" prepare
step "a surgery and points" inputs
step "docs/slicer.md: daemon and bridge" serve
step "docs/slicer.md: a surgery without a patient" slicer_page
step "docs/python.md" python_page
step "docs/cpp.md" cpp_page
echo "documents: every command of docs/slicer.md, docs/python.md and docs/cpp.md ran as written"
