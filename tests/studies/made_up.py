# SPDX-License-Identifier: GPL-3.0-or-later
"""For tests: tables made by hand, and what a study records of them."""
import os
import subprocess
import sys
from pathlib import Path

from .checks import Record
from .rows import Table

SOURCE = Path(__file__).parents[2]
DOCS = SOURCE / "docs"


def text_of(rows):
    """CSV of dictionaries that have the same keys."""
    return "".join(",".join(map(str, line)) + "\n" for line in (rows[0], *(row.values() for row in rows)))


def table_of(rows):
    return Table.parse(text_of(rows), "table")


def judged(judge):
    """The lines of checks.csv that judge(record) adds."""
    record = Record(None)
    judge(record)
    return [",".join(cells) for cells in record.checks]


def committed(study):
    """The lines of docs/STUDY/checks.csv."""
    return (DOCS / study / "checks.csv").read_text().splitlines()[1:]


class Verdicts:
    """What judge(record) records: values by name, and of those with a bound whether they hold it."""

    def __init__(self, judge):
        record = Record(None)
        judge(record)
        self.lines = [",".join(cells) for cells in record.checks]
        self.values = {name: float(value) for _, name, value, *_ in record.checks}
        self.holds = {name: holds == "1" for _, name, _, _, holds, _ in record.checks if holds}
        self.left_out = [",".join(cells) for cells in record.parts_left_out]

    def red(self):
        return sorted(name for name, holds in self.holds.items() if not holds)


def run(*arguments):
    """python3 -m studies ..."""
    return subprocess.run([sys.executable, "-m", "studies", *map(str, arguments)], capture_output=True, text=True,
                          timeout=100, env={**os.environ, "PYTHONPATH": str(SOURCE / "tests")})
