#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""check-documents.py [SOURCE_DIR]: what the pages (*.md) promise about the repository.

  1  A link to a file or folder leads to one; an anchor leads to a heading of that page.
  2  A path in backticks that begins with a folder of the repository exists. A word in capitals is a placeholder.
  3  Every page of docs is in the index, docs/README.md; decisions and parts of a study count by their folder or page.
  4  Every picture below docs is a PNG with a palette (palette-pictures.py makes it one).
  5  The map of folders in docs/architecture.md has a row for each target of common, server and client, and names the
     targets directly below it, as the CMake files link them.

Prints one line per violation. Exit status: 0 none, 1 violations, 2 nothing to check.
"""
import pathlib
import re
import sys

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
PATH = re.compile(r"(?:common|server|client|tests|config|cmake|docker|docs|proto)/[\w./*{},-]+")
CODE_BLOCK = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def anchors(page):
    """The anchors that a page offers: its headings in lower case, without punctuation, blanks as hyphens."""
    text = CODE_BLOCK.sub("", page.read_text())
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


def broken_links(page):
    for target in LINK.findall(CODE_BLOCK.sub("", page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        if not file.exists():
            yield f"link to {target}, which does not exist"
        elif anchor and anchor not in anchors(file):
            yield f"link to {target}: no such heading"


def missing_paths(page, root):
    for code in re.findall(r"`([^`\n]+)`", CODE_BLOCK.sub("", page.read_text())):
        if not PATH.fullmatch(code) or re.search(r"[A-Z]{3}|[*{]", code):
            continue
        if not (root / code.rstrip("/")).exists() and not list(root.glob(code + ".*")):
            yield f"names {code}, which does not exist"


def without_palette(picture):
    head = picture.read_bytes()[:26]
    return head[:8] != b"\x89PNG\r\n\x1a\n" or head[25] != 3


def links_of_folders(root):
    """Folder of each library -> folders that it links directly, without those that one of them links already."""
    names, links = {}, {}
    for part in ("common", "server", "client"):
        for file in sorted((root / part).rglob("CMakeLists.txt")):
            text = re.sub(r"#.*", "", file.read_text())
            library = re.search(r"brainshift_library\((.*?)\)", text, re.DOTALL)
            if library:
                folder = str(file.parent.relative_to(root))
                names[re.sub(r"^common_|^client_(?=tools_)", "", folder.replace("/", "_"))] = folder
                links[folder] = re.findall(r"brainshift::(\w+)", library[1])
    links = {folder: {names[n] for n in linked if n in names} for folder, linked in links.items()}

    def below(folder):
        return links[folder].union(*map(below, links[folder]))

    return {folder: {a for a in linked if not any(a in below(b) for b in linked)} for folder, linked in links.items()}


def wrong_rows(root):
    text = (root / "docs" / "architecture.md").read_text()
    rows = {}
    for table in re.findall(r"^\| `(\w+)` \| comes in", text, re.MULTILINE):
        body = text[text.index(f"| `{table}` | comes in") :].partition("\n")[2].split("\n\n")[0]
        for folder, uses in re.findall(r"^\| `([\w/]+)` \| .* \| ([^|]*) \|$", body, re.MULTILINE):
            used = re.findall(r"`([\w/]+)`", uses)
            rows[f"{table}/{folder}"] = {u if re.match("(?:server|client)/", u) else f"common/{u}" for u in used}
    for folder, linked in links_of_folders(root).items():
        if rows.get(folder) != linked:
            uses = ", ".join(f"`{name.removeprefix('common/')}`" for name in sorted(linked)) or "–"
            yield f"docs/architecture.md: {folder} uses {uses}, which its row does not say"
    for folder in rows:
        if not (root / folder).is_dir():
            yield f"docs/architecture.md: {folder} has a row and does not exist"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parents[2])
    pages = sorted(p for p in root.rglob("*.md") if not {"build", "out", "demo"} & set(p.relative_to(root).parts))
    if not pages:
        print(f"check-documents: no pages below {root}", file=sys.stderr)
        return 2
    found = []
    for page in pages:
        name = page.relative_to(root)
        found += [f"{name}: {reason}" for reason in broken_links(page)]
        if name.name != "CHANGELOG.md" and "decisions" not in name.parts:
            found += [f"{name}: {reason}" for reason in missing_paths(page, root)]
    index = root / "docs" / "README.md"
    linked = {target.partition("#")[0] for target in LINK.findall(index.read_text())} if index.exists() else set()
    found += [f"docs/README.md: does not name {p.name}" for p in sorted((root / "docs").glob("*.md"))
              if p != index and p.name not in linked]
    found += [f"{p.relative_to(root)}: has no palette; run cmake/scripts/palette-pictures.py"
              for p in sorted((root / "docs").rglob("*.png")) if without_palette(p)]
    found += wrong_rows(root)
    for line in found:
        print(line)
    print(f"check-documents: {len(pages)} pages, {len(found)} violations", file=sys.stderr if found else sys.stdout)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
