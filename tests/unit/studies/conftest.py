# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of tests/studies share. CTest sets PYTHONPATH (CMakeLists.txt)."""
import json
from pathlib import Path

import pytest

from studies.__main__ import run
from studies.rows import Table

SOURCE = Path(__file__).parents[3]
HEADINGS = {"points.csv": "study,series,x_name,y_name,x,y", "checks.csv": "study,name,value,bound,pass,source",
            "left_out.csv": "study,reason"}


def table(text):
    return Table.parse(text, "t.csv")


class Folder:
    """Rows of a study, and what the package makes of them."""

    def __init__(self, path, capsys):
        self.path, self._capsys = path, capsys

    def write(self, name, text):
        (self.path / name).write_text(text)

    def text(self, name):
        return (self.path / name).read_text()

    def summary(self):
        return json.loads(self.text("summary.json"))

    def table(self, name):
        return Table.read(self.path / name)

    def run(self, name, *options):
        """(exit status, standard output, standard error)"""
        self._capsys.readouterr()
        status = run([name, "--dir", str(self.path), *options])
        return (status, *self._capsys.readouterr())

    def is_refused(self, name, *options, says):
        status, _, error = self.run(name, *options)
        assert status == 2 and error.count("\n") == 1 and says in error, error


@pytest.fixture
def folder(tmp_path, capsys):
    return Folder(tmp_path, capsys)


@pytest.fixture
def records(folder):
    """With the headings of records that have no rows yet."""
    for name, heading in HEADINGS.items():
        folder.write(name, heading + "\n")
    return folder
