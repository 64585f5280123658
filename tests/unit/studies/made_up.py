# SPDX-License-Identifier: GPL-3.0-or-later
"""For tests: tables made by hand, and what a study records of them."""
import contextlib
import io
from pathlib import Path
from types import SimpleNamespace

import studies.__main__
from studies.checks import Record
from studies.rows import Table

SOURCE = Path(__file__).parents[3]
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
    """The command in this process: its exit status and what it printed."""
    output, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
        status = studies.__main__.run([str(one) for one in arguments])
    return SimpleNamespace(returncode=status, stdout=output.getvalue(), stderr=errors.getvalue())
