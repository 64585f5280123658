#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""check-names.py BUILD_DIR: no two files that are compiled as one define the same name for themselves.

In a unity build (BRAINSHIFT_UNITY) a name of an unnamed namespace is visible in the files behind it: two equal names do not
compile, or, worse, a call reaches the other file's overload. What two files share stands once, in a header. Exit status 1
with one line for each name. 2: the build was to compile several files as one and does not. 77: it was not to.
"""
import collections
import json
import pathlib
import re
import sys

DEFINITION = re.compile(
    r"^(?:template\s*<[^>]*>\s*)?"
    r"(?:(?:inline|static|constexpr|const|\[\[\w+\]\])\s+)*"
    r"(?:(?:struct|class|enum class|enum|union)\s+(?P<type>\w+)\s*(?::[^:].*)?\{"
    r"|using\s+(?P<alias>\w+)\s*="
    r"|(?P<value>[\w:<>,\s*&]+?[\s*&])(?P<name>\w+)\s*(?:\[[^\]]*\])?\s*(?:\(|=|\{|;))")
KEYWORDS = {"return", "if", "for", "while", "switch", "else", "case", "using", "namespace", "public", "private", "typedef"}
MACRO = re.compile(r"^#define\s+(\w+)")


def names(text):
    """Names that a file defines in its unnamed namespaces, and its macros, with the whole line of an alias.

    Relies on the house format. Equal aliases are one; printers of GoogleTest (PrintTo) are told apart by their type.
    """
    found = {}
    scopes = []  # True: an unnamed namespace
    for line in text.split("\n"):
        macro = MACRO.match(line)
        if macro:
            found[macro[1]] = ""
        opened = re.match(r"^namespace\b([\w:\s]*)\{", line)
        if opened:
            scopes.append(opened[1].strip() == "")
            continue
        if re.match(r"^\}  // namespace", line):
            if scopes:
                scopes.pop()
            continue
        if not scopes or not scopes[-1]:
            static = re.match(r"^static\s+[\w:<>,\s*&]+?[\s*&](\w+)\s*(?:\(|=|\{|;)", line)
            if static:
                found[static[1]] = ""
            continue
        alias = re.match(r"^using\s+(\w+)\s*=.*;$", line)
        if alias:
            found[alias[1]] = line
            continue
        if not line or line[0] in " }#/)" or line.startswith(("TEST", "INSTANTIATE", "MATCHER")):
            if line.startswith("MATCHER"):
                found[re.match(r"MATCHER\w*\((\w+)", line)[1]] = ""
            continue
        definition = DEFINITION.match(line)
        if not definition:
            continue
        name = definition["type"] or definition["name"]
        if name and name not in KEYWORDS and (definition["value"] or "").split(" ")[0] not in KEYWORDS:
            found[name] = ""
    return found


def units(build):
    """The lists of files that are compiled as one."""
    commands = json.loads((pathlib.Path(build) / "compile_commands.json").read_text())
    for unit in sorted(pathlib.Path(command["file"]) for command in commands if "/Unity/unity_" in command["file"]):
        yield [pathlib.Path(path) for path in re.findall(r'^#include "(.*)"', unit.read_text(), re.MULTILINE)]


def main():
    folders = collections.defaultdict(lambda: collections.defaultdict(list))
    compared = 0
    for index, files in enumerate(units(sys.argv[1])):
        compared += len(files)
        for file in files:
            for name, line in names(file.read_text()).items():
                folders[(file.parent, index)][name].append((file.name, line))
    bad = 0
    for (folder, _), defined in sorted(folders.items()):
        for name, places in sorted(defined.items()):
            equal_aliases = len({line for _, line in places}) == 1 and places[0][1]
            if len(places) > 1 and not equal_aliases and name != "PrintTo":
                print(f"{folder}: {name} in {', '.join(sorted(file for file, _ in places))}")
                bad += 1
    if compared == 0:
        asked = "BRAINSHIFT_UNITY:BOOL=ON" in (pathlib.Path(sys.argv[1]) / "CMakeCache.txt").read_text()
        print("check-names: no files are compiled as one")
        return 2 if asked else 77
    print(f"check-names: {compared} files, {bad} names that stand twice in what is compiled as one")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
