#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""check-names.py [SOURCE_DIR]: no two .cpp files of a folder define the same name for themselves.

A unity build (BRAINSHIFT_UNITY) compiles the files of a folder as one. A name of an unnamed namespace is then visible in the
files behind it: two equal names do not compile, or, worse, a call reaches the other file's overload. So names are unique
within a folder; what two files share stands once, in a header. Exit status 1 with one line for each name.
"""
import collections
import pathlib
import re
import subprocess
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


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", "*.cpp"], capture_output=True,
                            text=True, check=False)
    files = [root / line for line in listed.stdout.splitlines()] if listed.returncode == 0 else root.rglob("*.cpp")
    folders = collections.defaultdict(lambda: collections.defaultdict(list))
    for file in files:
        if file.is_file():
            for name, line in names(file.read_text()).items():
                folders[file.parent][name].append((file.name, line))
    bad = 0
    for folder, defined in sorted(folders.items()):
        for name, places in sorted(defined.items()):
            equal_aliases = len({line for _, line in places}) == 1 and places[0][1]
            if len(places) > 1 and not equal_aliases and name != "PrintTo":
                print(f"{folder}: {name} in {', '.join(sorted(file for file, _ in places))}")
                bad += 1
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
