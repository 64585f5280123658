# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks: a value against a bound that is told in words; and the records that studies keep of them.

A folder of records holds, with headings (cmake/scripts/steps.sh makes them, and save() where it did not; C++
programs append by tests/support/study_record.hpp):

    points.csv    study,series,x_name,y_name,x,y          points of curves
    checks.csv    study,name,value,bound,pass,source      pass: 1, 0, or empty without a bound
    left_out.csv  study,reason                            what could not run here
"""
import json
import math
from dataclasses import dataclass

from .common import WriteError, write_file
from .rows import Table, cell_or_dash, significant

POINTS = ("study", "series", "x_name", "y_name", "x", "y")
CHECKS = ("study", "name", "value", "bound", "pass", "source")
LEFT_OUT = ("study", "reason")


@dataclass
class Check:
    name: str  # stable
    value: float  # NaN: not measured
    bound: str  # in words, with the unit
    holds: bool | None  # None: a figure that is only shown
    command: str  # that measures the value


def at_most(name, value, bound, unit, command):
    """A value that was not measured does not hold."""
    return Check(name, value, f"<= {significant(bound)}" + (f" {unit}" if unit else ""), value <= bound, command)


def every_check_holds(checks):
    """And there is one."""
    bounded = [check for check in checks if check.holds is not None]
    return bool(bounded) and all(check.holds for check in bounded)


def summary_json(checks, left_out=()):
    """{"checks": [...], "left_out": [...]}; a value that is not finite is null, and a figure without
    a bound has no "pass"."""
    entries = []
    for check in checks:
        entry = {"name": check.name, "value": float(check.value) if math.isfinite(check.value) else None,
                 "bound": check.bound}
        if check.holds is not None:
            entry["pass"] = bool(check.holds)
        entries.append({**entry, "command": check.command})
    return json.dumps({"checks": entries, "left_out": list(left_out)}, indent=2, ensure_ascii=False) + "\n"


def print_checks(checks, left_out=()):
    for check in checks:
        verdict = "-" if check.holds is None else "ok" if check.holds else "FAILS"
        print(f"{verdict:<6} {check.name:<75} {cell_or_dash(check.value, 4):>10}   {check.bound}")
    for part in left_out:
        print(f"{'left':<6} {part}")


class Record:
    """What a study finds out, added to the records in `folder` by save()."""

    def __init__(self, folder):
        self.folder, self.checks, self.parts_left_out = folder, [], []

    def check(self, study, name, value, bound, holds, source=""):
        """value: shown with nine digits; source: equation or citation of the reference."""
        self.checks.append((study, name, f"{value:.9g}", bound, "1" if holds else "0", source))
        return bool(holds)

    def figure(self, study, name, value, note, source=""):
        """Without a bound: `note` stands in its place."""
        self.checks.append((study, name, f"{value:.9g}", note, "", source))

    def left_out(self, study, reason):
        self.parts_left_out.append((study, reason))

    def save(self):
        for name, heading, rows in (("points.csv", POINTS, []), ("checks.csv", CHECKS, self.checks),
                                    ("left_out.csv", LEFT_OUT, self.parts_left_out)):
            for cell in (cell for row in rows for cell in row):
                if any(mark in cell for mark in ',"\n'):
                    raise ValueError(f"{cell}: a cell of a table has no comma, quote or line break")
            try:
                with open(self.folder / name, "a", encoding="utf-8") as file:
                    if not file.tell():
                        file.write(",".join(heading) + "\n")
                    file.writelines(",".join(row) + "\n" for row in rows)
            except OSError as error:
                raise WriteError(f"{self.folder / name}: cannot be written: {error.strerror}") from None


def checks_of(rows, command=""):
    """Of a table of checks."""
    return [Check(f"{row['study']}: {row['name']}", row.number("value"), row["bound"],
                  row["pass"] == "1" if row["pass"] else None, command) for row in rows]


def _tables(checks, commit, command):
    verdicts = {"": "", "1": "yes"}
    lines = [f"Commit {commit}; `{command}`", "", "| study | figure | value | bound | holds | reference |",
             "|---|---|---|---|---|---|"]
    for row in checks:
        cells = (row["study"], row["name"], significant(row.number("value"), 3), row["bound"],
                 verdicts.get(row["pass"], "**no**"), row["source"])
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def summarise(folder, commit, command):
    """Records -> tables.md and summary.json; prints them. True when every check holds."""
    rows = Table.read(folder / "checks.csv", CHECKS)
    left_out = [f"{row['study']}: {row['reason']}" for row in Table.read(folder / "left_out.csv", LEFT_OUT)]
    checks = checks_of(rows, command)
    print_checks(checks, left_out)
    write_file(folder / "summary.json", summary_json(checks, left_out))
    write_file(folder / "tables.md", _tables(rows, commit, command))
    bounded = sum(check.holds is not None for check in checks)
    print(f"{bounded} checks, {len(checks) - bounded} figures without a bound in {folder}")
    return every_check_holds(checks)
