#!/bin/bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A cohort on Slurm: an array with a task per subject, then the group (docs/cohort.md).
#
#   docs/cohort/slurm.sh BIDS OUT [options of participant, e.g. --seed 1 2]
#
# Run on the login node; it submits two jobs and prints the number of the second. Variables: APP, the program (default
# brainshift-bids); CPUS and MEM_MB of a task (1, 4000); TRIES of a task that failed or lost its node (3);
# SBATCH, more options of both jobs, e.g. "--partition=long --time=4:00:00".
set -euo pipefail

if [ -z "${SLURM_ARRAY_TASK_ID:-}" ] || [ -z "${BRAINSHIFT_COHORT:-}" ]; then # submits
  [ $# -ge 2 ] || { echo "usage: slurm.sh BIDS OUT [options of participant]" >&2; exit 2; }
  bids=$(realpath "$1") out=$(realpath -m "$2")
  mapfile -t subjects < <(find -L "$bids" -maxdepth 1 -type d -name 'sub-*' -printf '%f\n' | LC_ALL=C sort)
  [ ${#subjects[@]} -gt 0 ] || { echo "slurm.sh: $bids has no folder sub-*" >&2; exit 2; }
  mkdir -p "$out/.work/logs"
  printf '%s\n' "${subjects[@]}" >"$out/.work/subjects"
  export BRAINSHIFT_COHORT=$out/.work/subjects APP=${APP:-brainshift-bids} TRIES=${TRIES:-3} MEM_MB=${MEM_MB:-4000}
  # shellcheck disable=SC2086
  array=$(sbatch --parsable ${SBATCH:-} --job-name=brainshift --requeue --open-mode=append --array=0-$((${#subjects[@]} - 1)) \
    --cpus-per-task="${CPUS:-1}" --mem="$MEM_MB" --output="$out/.work/logs/%x-%a.log" "$0" "$bids" "$out" "${@:3}")
  # shellcheck disable=SC2086
  sbatch --parsable ${SBATCH:-} --job-name=brainshift-group --dependency="afterany:$array" --open-mode=append \
    --output="$out/.work/logs/%x.log" --wrap "$APP $(printf '%q %q' "$bids" "$out") group"
  exit
fi

# A task. A node that dies requeues it (--requeue); a program that failed is tried again. Each goes on where it was.
subject=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$BRAINSHIFT_COHORT")
for ((try = 1; try <= TRIES; ++try)); do
  status=0
  $APP "$1" "$2" participant --participant-label "$subject" --n-cpus "${SLURM_CPUS_PER_TASK:-1}" --mem-mb "$MEM_MB" "${@:3}" || status=$?
  [ $status -le 0 ] || [ $status -eq 2 ] || { echo "slurm.sh: $subject: try $try of $TRIES ended with $status" >&2; continue; }
  # 2: the subject cannot run; group_leftout.tsv says why. Whoever ends last makes the tables: the second job starts before
  # a task that was requeued has ended, and makes them only where a task failed for good.
  ended=$2/.work/ended-$SLURM_ARRAY_JOB_ID
  mkdir -p "$ended" && touch "$ended/$subject"
  if [ "$(find "$ended" -type f | wc -l)" -eq "$(wc -l <"$BRAINSHIFT_COHORT")" ]; then $APP "$1" "$2" group || [ $? -eq 2 ] || exit 1; fi
  exit 0
done
exit 1
