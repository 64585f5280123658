#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# bill-of-materials.sh PROGRAM...: what an image consists of, as CycloneDX 1.5 JSON on stdout: every
# Debian package in dpkg's database with its exact version and source, and for each program its
# SHA-256 and the packages whose libraries it loads.
# Fails when a library of a program is missing or belongs to no package.
set -euo pipefail

fail() { echo "bill-of-materials: $*" >&2; exit 1; }
[ $# -gt 0 ] || { echo "usage: bill-of-materials.sh PROGRAM..." >&2; exit 2; }

distro=$(. /etc/os-release && echo "$ID-$VERSION_ID")

# Names, versions and paths of Debian hold no character that JSON would have to escape.
purl() { printf 'pkg:deb/debian/%s@%s?arch=%s&distro=%s' "$1" "${2//+/%2B}" "$3" "$distro"; }

# The package that a library's file belongs to. dpkg may know it by its path from before /lib
# became a link to /usr/lib, and liblapack.so.3 and its like are links to alternatives.
package_of() {
  local path
  for path in "$1" "$(realpath "$1")"; do
    for path in "$path" "${path#/usr}" "/usr$path"; do
      dpkg-query -S "$path" 2>/dev/null | head -n 1 | sed 's/: .*//' | grep . && return
    done
  done
  return 1
}

purl_of_package() {
  local name version arch
  read -r name version arch < <(dpkg-query -W -f '${Package} ${Version} ${Architecture}\n' "$1")
  purl "$name" "$version" "$arch"
}

# The packages whose libraries a program loads, one purl per line.
libraries_of() {
  local linked library owner
  linked=$(ldd "$1") || fail "$1: ldd cannot read it"
  ! grep 'not found' <<<"$linked" >&2 || fail "$1: libraries are missing"
  while read -r library; do
    owner=$(package_of "$library") || fail "$library belongs to no package"
    purl_of_package "$owner"
    echo
  done < <(grep -o '/[^ ]*\.so[^ ]*' <<<"$linked") | sort -u
}

programs=()
for program in "$@"; do
  programs+=("$(command -v "$program")") || fail "$program: no such program"
done

printf '{"bomFormat":"CycloneDX","specVersion":"1.5","version":1,\n"components":[\n'
for program in "${programs[@]}"; do
  printf '{"type":"application","bom-ref":"%s","name":"%s","version":"%s","hashes":[{"alg":"SHA-256","content":"%s"}]},\n' \
    "$(basename "$program")" "$(basename "$program")" "$("$program" --version | awk '{print $NF}')" \
    "$(sha256sum "$program" | cut -d' ' -f1)"
done
comma=
while read -r name version arch source source_version; do
  printf '%s{"type":"library","bom-ref":"%s","name":"%s","version":"%s","purl":"%s","properties":[{"name":"debian:source","value":"%s %s"}]}' \
    "$comma" "$(purl "$name" "$version" "$arch")" "$name" "$version" "$(purl "$name" "$version" "$arch")" "$source" "$source_version"
  comma=$',\n'
done < <(dpkg-query -W -f '${db:Status-Status} ${Package} ${Version} ${Architecture} ${source:Package} ${source:Version}\n' |
  sed -n 's/^installed //p')
printf '\n],\n"dependencies":[\n'
comma=
for program in "${programs[@]}"; do
  libraries=$(libraries_of "$program")
  printf '%s{"ref":"%s","dependsOn":[%s]}' "$comma" "$(basename "$program")" \
    "$(sed 's/.*/"&"/' <<<"$libraries" | paste -sd, -)"
  comma=$',\n'
done
printf '\n]}\n'
