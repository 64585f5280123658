#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# check-includes.sh BUILD_DIR [SOURCE_DIR]: checks every #include of common, server and client. The CMake
# links, which the configure step writes to BUILD_DIR/folder_links.txt, say what a folder may include.
#   1  A source includes its own folder, folders that its folder links, and onward their public links.
#      A header includes only what its folder's public links give, because it carries its includes on.
#   2  Inside a folder the includes have no cycle. A unit is a header with the sources of its name.
#   3  common includes neither server nor client; server and client do not include each other, but for
#      server/main, which may be a client (client/lib).
#   4  Protobuf headers stay in common/wire, ZeroMQ headers in server/transport and client/lib, CGAL
#      headers in folders whose CMakeLists.txt links CGAL.
#   5  Sources are called .hpp or .cpp, and include one another by the path from the root.
# Prints one line per violation. Exit status: 0 none, 1 violations, 2 nothing to check.
set -euo pipefail
build=${1:?usage: check-includes.sh BUILD_DIR [SOURCE_DIR]}
links=$(realpath "$build")/folder_links.txt
[ -s "$links" ] || { echo "check-includes: $links is missing: run cmake first" >&2; exit 2; }
cd "${2:-$(dirname "$0")/../..}"

# client/examples are projects of their own.
mapfile -t files < <(find common server client -path client/examples -prune -o -name '*.[ch]pp' -print | LC_ALL=C sort)
[ ${#files[@]} -gt 0 ] || { echo "check-includes: no sources below $PWD" >&2; exit 2; }

other_names() {
  find common server client -path client/examples -prune -o \
    -regextype egrep -regex '.*\.(c|cc|cxx|h|hh|hxx|inl|ipp|tpp)' -printf '%p: sources are called .hpp or .cpp\n'
}
includes() {  # "FILE INCLUDED KIND", one line for each #include; KIND: < or "
  awk '/^[ \t]*#[ \t]*include[ \t]*[<"]/ {
    name = $0
    sub(/^[^<"]*/, "", name)
    kind = substr(name, 1, 1)
    name = substr(name, 2)
    sub(/[>"].*$/, "", name)
    print FILENAME, name, kind
  }' "${files[@]}"
}
cgal_folders() { grep -lr --include=CMakeLists.txt 'CGAL::' common server client | sed 's|/CMakeLists.txt$||' || true; }

found=$(awk -v cgal="$(cgal_folders | tr '\n' ' ')" '
  # client/lib/brainshift holds what is included as <brainshift/...>; it is client/lib.
  function folder_of(path) { sub(/\/[^\/]*$/, "", path); sub(/^client\/lib\/brainshift$/, "client/lib", path); return path }
  function unit_of(path) { sub(/\.[ch]pp$/, "", path); return path }
  function part_of(path) { sub(/\/.*$/, "", path); return path }
  function in_list(word, list) { return index(" " list " ", " " word " ") > 0 }
  function report(file, included, why) { print file ": includes " included ": " why }

  # Adds to set[] what a folder gives to those who link it: itself and its public links, onward.
  function add_given(set, folder,    words, n, i) {
    if (folder in set) return
    set[folder]
    n = split(public_links[folder], words, " ")
    for (i = 1; i <= n; ++i) add_given(set, words[i])
  }
  function may_include(folder, target, is_header,    set, words, n, i) {
    add_given(set, folder)
    n = is_header ? 0 : split(private_links[folder], words, " ")
    for (i = 1; i <= n; ++i) add_given(set, words[i])
    return target in set
  }
  # Depth first along the includes of one folder. Reports the arrow that closes a cycle.
  function visit(unit,    words, n, i, next_unit, path, at) {
    state[unit] = "open"
    trail[++depth] = unit
    n = split(arrows[unit], words, " ")
    for (i = 1; i <= n; ++i) {
      next_unit = words[i]
      if (state[next_unit] == "open") {
        for (at = depth; trail[at] != next_unit; --at) path = " -> " name_of(trail[at]) path
        report(arrow_file[unit, next_unit], arrow_name[unit, next_unit],
               "closes a cycle in its folder: " name_of(next_unit) path " -> " name_of(next_unit))
        path = ""
      } else if (state[next_unit] == "") {
        visit(next_unit)
      }
    }
    --depth
    state[unit] = "done"
  }
  function name_of(unit) { sub(/^.*\//, "", unit); return unit }

  FNR == NR {  # folder_links.txt
    known[$1]
    for (i = 3; i <= NF; ++i) {
      if (sub(/!$/, "", $i)) private_links[$1] = private_links[$1] " " $i
      else public_links[$1] = public_links[$1] " " $i
    }
    next
  }
  {
    file = $1
    included = $2
    folder = folder_of(file)
    if (!(folder in known) && !(folder in told)) {
      told[folder]
      print file ": the folder " folder " is not in folder_links.txt: its CMakeLists.txt declares no library and records no links"
    }
    if (included ~ /\.pb\.h$/ || included ~ /^google\/protobuf\//) {
      if (folder != "common/wire") report(file, included, "Protobuf headers stay in common/wire")
    } else if (included ~ /^zmq/) {
      if (!in_list(folder, "server/transport client/lib"))
        report(file, included, "ZeroMQ headers stay in server/transport and client/lib")
    } else if (included ~ /^CGAL\//) {
      if (!in_list(folder, cgal)) report(file, included, folder "/CMakeLists.txt does not link CGAL")
    }
    if (included !~ /^(common|server|client)\//) {
      if ($3 == "\"" && included !~ /^brainshift\/v1\/[a-z]+\.pb\.h$/)
        report(file, included, "not a path from the root in common, server or client")
      next
    }

    target = folder_of(included)
    from = part_of(file)
    to = part_of(included)
    health = folder == "server/main" && target == "client/lib"  # brainshiftd health is a client
    if (from != to && to != "common" && !health) {
      report(file, included, from " must not include " to)
    } else if (target == folder) {
      a = unit_of(file)
      b = unit_of(included)
      if (a != b && !((a, b) in arrow_file)) {
        if (!(a in arrows)) units[++count] = a
        arrows[a] = arrows[a] " " b
        arrow_file[a, b] = file
        arrow_name[a, b] = included
      }
    } else if (folder in known && !may_include(folder, target, file ~ /\.hpp$/)) {
      if (file ~ /\.hpp$/ && may_include(folder, target, 0))
        report(file, included, folder " links " target " privately, so no header may include it")
      else
        report(file, included, folder " does not link " target)
    }
  }
  END { for (i = 1; i <= count; ++i) if (state[units[i]] == "") visit(units[i]) }
' "$links" <(includes); other_names)

if [ -n "$found" ]; then
  echo "$found"
  echo "check-includes: $(wc -l <<<"$found") violations" >&2
  exit 1
fi
echo "check-includes: ${#files[@]} files keep to the links of $(wc -l <"$links") folders"
