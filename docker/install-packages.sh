#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# install-packages.sh FILE: installs the Debian packages listed in FILE (one per line, # starts a
# comment). It asks dpkg first: when no package is missing, it needs neither network nor root.
set -euo pipefail

fail() { echo "install-packages: $*" >&2; exit 1; }

[ $# -eq 1 ] || { echo "usage: install-packages.sh FILE" >&2; exit 2; }
[ -r "$1" ] || { echo "install-packages: $1: no such readable file" >&2; exit 2; }
command -v dpkg-query >/dev/null || fail "dpkg-query not found: this script is for Debian 12; see $1 for what is needed"

mapfile -t wanted < <(sed 's/#.*//' "$1" | tr -s '[:space:]' '\n' | sed '/^$/d')
[ ${#wanted[@]} -gt 0 ] || fail "$1 names no package"

installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null | sed -n 's/^installed //p' || true)
mapfile -t missing < <(comm -23 <(printf '%s\n' "${wanted[@]}" | sort -u) <(sort -u <<<"$installed"))
if [ ${#missing[@]} -eq 0 ]; then
  echo "install-packages: all ${#wanted[@]} packages of $1 are installed"
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || fail "must be root (or have sudo) to install: ${missing[*]}"
  as_root=(sudo)
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o Dpkg::Use-Pty=0 -qq "$@" >"$log" 2>&1
}
install() { apt install -y --no-install-recommends "${missing[@]}"; }
give_up() { tail -n 20 "$log" >&2; fail "apt-get $1 failed"; }

# Lists older than a day name versions that a mirror may have dropped. A fresh machine has no lists.
lists_fresh() {
  find /var/lib/apt/lists -maxdepth 1 -name '*_Packages*' -mmin -1440 2>/dev/null | grep -q .
}
echo "install-packages: installing ${#missing[@]} of ${#wanted[@]} packages of $1 (a few minutes)"
if lists_fresh && install; then exit 0; fi
apt update || give_up update
install || give_up "install ${missing[*]}"
