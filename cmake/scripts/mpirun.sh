# SPDX-License-Identifier: GPL-3.0-or-later
# Sourced. run_processes N COMMAND...: as N processes of this machine, one thread each, also where it has fewer cores (then
# those that wait give their core away) and as root (containers).
run_processes() {
  local count=$1
  shift
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
    mpirun -np "$count" --oversubscribe --bind-to none --mca mpi_yield_when_idle 1 --mca btl self,vader \
    -x OMP_NUM_THREADS=1 -x OPENBLAS_NUM_THREADS=1 --quiet "$@"
}
