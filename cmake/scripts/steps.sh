# SPDX-License-Identifier: GPL-3.0-or-later
# Sourced by demo.sh, bench.sh, verify.sh, stability.sh, sensing.sh, interchange.sh, surgeries.sh,
# anatomy.sh, evidence.sh, ablations.sh, replays.sh, calculix.sh, prior.sh, advice.sh and page.sh: timed steps, the
# daemon, and the end of a script.
# They set before: `name`, the first word of messages; `bin`, the folder of the programs; `out`, the
# folder of results. They set `current=summary` before a last command whose own output tells what failed.

# A threaded BLAS only slows the factorisation down, and its results vary (docs/architecture.md).
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# What judges and draws the rows: studies NAME ... (tests/studies/__init__.py). It ends with 1 where a check
# does not hold.
studies() { PYTHONPATH=tests PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -m studies "$@"; }

current=start
daemon=
endpoint=

# step TITLE COMMAND...: runs the command, prints how long it took, and ends with the command's status:
# `step ... || status=1` goes on after a failure and remembers it. A function that is called so must
# end its own failing lines with `|| return`, because the shell's -e does not reach into it.
step() {
  current=$1
  shift
  local begin=$EPOCHREALTIME
  printf '== %s\n' "$current"
  "$@"
  local code=$?
  printf '   %s s\n' "$(seconds_since "$begin" 1)"
  return "$code"
}

# seconds_since EPOCHREALTIME DIGITS
seconds_since() { awk -v a="$1" -v b="$EPOCHREALTIME" -v d="$2" 'BEGIN { printf "%.*f", d, b - a }'; }

# empty_folder DIR: makes it, and empties it. Refuses the working folder, its parent and the root.
empty_folder() {
  case $1 in
    "" | / | . | ..) echo "$name: $1 is no folder to empty" >&2; exit 2 ;;
  esac
  rm -rf "$1"
  mkdir -p "$1"
}

# empty_study DIR: the tables that study_record.hpp appends to, with their headings.
empty_study() {
  empty_folder "$1"
  echo "study,series,x_name,y_name,x,y" >"$1/points.csv"
  echo "study,name,value,bound,pass,source" >"$1/checks.csv"
  echo "study,reason" >"$1/left_out.csv"
}

# resume_study DIR RESUME: the same, but with RESUME=1 the rows-*.csv and outlines-*.csv that DIR has stay.
# Programs find it as BRAINSHIFT_STUDY_DIR.
resume_study() {
  local kept
  kept=$(mktemp -d)
  if [ "$2" = 1 ]; then cp "$1"/{rows,outlines}-*.csv "$kept" 2>/dev/null || true; fi
  empty_study "$1"
  cp "$kept"/*.csv "$1" 2>/dev/null || true
  rm -rf "$kept"
  BRAINSHIFT_STUDY_DIR=$(realpath "$1")
  export BRAINSHIFT_STUDY_DIR
}

# commit_name: for tables; "-dirty" when files differ from the commit.
commit_name() { git describe --always --dirty 2>/dev/null || echo unknown; }

# start_daemon MODEL [CONFIG]: starts it on a free loopback port; sets `endpoint` and `daemon`.
start_daemon() {
  local pipe=$out/daemon.pipe line
  mkfifo "$pipe"
  "$bin/brainshiftd" serve --config "${2:-config/daemon.yaml}" --model "$1" \
    --endpoint 'tcp://127.0.0.1:*' >"$pipe" 2>"$out/daemon.log" &
  daemon=$!
  exec {daemon_output}<"$pipe"
  rm "$pipe"
  endpoint=
  while IFS= read -r -t 120 -u "$daemon_output" line; do
    case $line in
      *"listening on "*) endpoint=${line##*listening on }; break ;;
    esac
  done
  if [ -z "$endpoint" ]; then
    echo "$name: brainshiftd ended or said nothing within 120 s" >&2
    return 1
  fi
  # Its later output must not fill the pipe.
  cat <&"$daemon_output" >>"$out/daemon.log" &
}

# A daemon that does not end cleanly fails the script.
stop_daemon() {
  local pid=$daemon
  daemon=
  kill -TERM "$pid"
  wait "$pid"
}

finish() {
  local status=$?
  [ -z "$daemon" ] || stop_daemon || true
  if [ "$status" -ne 0 ] && [ "$current" != summary ]; then
    echo "$name: failed (exit $status) at: $current" >&2
    if [ -s "$out/daemon.log" ]; then
      echo "$name: last lines of $out/daemon.log:" >&2
      tail -n 5 "$out/daemon.log" >&2
    fi
  fi
}
trap finish EXIT
trap 'exit 130' INT TERM
