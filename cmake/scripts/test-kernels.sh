#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# test-kernels.sh PRESET [KERNEL...]: runs the tests of what links BLAS (label blas), and those of the studies where they are
# built, with OpenBLAS kernels that this machine would not choose by itself, so that a result that holds on one processor only
# is found here.
# Without a name: one other kernel (Haswell; on a machine that chooses Haswell, SkylakeX or Nehalem).
# Kernels: Haswell, Zen (AVX2), SkylakeX (AVX-512), Nehalem (any x86-64 with SSE4.2).
set -euo pipefail
preset=${1:?usage: test-kernels.sh PRESET [KERNEL...]}
shift
cd "$(git rev-parse --show-toplevel)"
program=build/$preset/bin/brainshiftd
[ -x "$program" ] || { echo "test-kernels: $program is not built: make build" >&2; exit 1; }

# The last one: a program starts itself again where OpenBLAS does not know the processor.
kernel_in_use() { OPENBLAS_VERBOSE=2 "$program" --version 2>&1 | sed -n 's/^Core: //p' | tail -1; }
has() { grep -qw "$1" /proc/cpuinfo; }
runs_here() {
  case $1 in
    Haswell | Zen) has avx2 ;;
    SkylakeX | Cooperlake) has avx512dq ;;
    *) true ;;
  esac
}

own=$(kernel_in_use)
echo "test-kernels: OpenBLAS chooses ${own:-an unnamed kernel} on this machine"
if [ $# -eq 0 ]; then
  for kernel in Haswell SkylakeX Nehalem; do
    if [ "$kernel" != "$own" ] && runs_here "$kernel"; then
      set -- "$kernel"
      break
    fi
  done
fi
failed=()
for kernel in "$@"; do
  if ! runs_here "$kernel"; then
    echo "test-kernels: $kernel left out: this processor lacks its instructions"
    continue
  fi
  used=$(OPENBLAS_CORETYPE=$kernel kernel_in_use)
  [ "$used" = "$kernel" ] || { echo "test-kernels: OpenBLAS takes $used for $kernel" >&2; exit 1; }
  echo "test-kernels: tests of what links BLAS with OPENBLAS_CORETYPE=$kernel"
  OPENBLAS_CORETYPE=$kernel cmake/scripts/run-tests.sh "$preset" -L '^blas$' || failed+=("$kernel")
  if [ -x "build/$preset/bin/stability_suite" ]; then  # make studies
    OPENBLAS_CORETYPE=$kernel cmake/scripts/run-tests.sh studies -LE '^python$' || failed+=("$kernel, studies")
  fi
done
[ ${#failed[@]} -eq 0 ] || { echo "test-kernels: tests failed with ${failed[*]}" >&2; exit 1; }
