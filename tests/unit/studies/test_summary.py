# SPDX-License-Identifier: GPL-3.0-or-later
"""Records -> charts, tables.md, summary.json; those in docs are what the package makes of its rows."""
import json
import re

import pytest

from conftest import SOURCE, table
from studies.summary import charts_of, logarithmic, with_unit

CHECKS = ("study,name,value,bound,pass,source\n"
          "hertz,force error %,0.825333094,<= 3,1,Johnson 1985\n"
          "hertz,cost,12,shown,,\n")


def test_every_check_that_holds_ends_well(records):
    records.write("checks.csv", CHECKS)
    records.write("points.csv", "study,series,x_name,y_name,x,y\nhertz,P2,elements,error %,2,2.1\nhertz,P2,elements,error %,4,1\n")
    status, output, _ = records.run("summary", "--commit", "abc", "--command", "make verify")
    assert status == 0 and "1 checks, 1 figures without a bound" in output
    assert records.text("tables.md") == (
        "Commit abc; `make verify`\n\n| study | figure | value | bound | holds | reference |\n|---|---|---|---|---|---|\n"
        "| hertz | force error % | 0.825 | <= 3 | yes | Johnson 1985 |\n| hertz | cost | 12 | shown |  |  |\n")
    assert records.summary()["checks"] == [
        {"name": "hertz: force error %", "value": 0.825333094, "bound": "<= 3", "pass": True, "command": "make verify"},
        {"name": "hertz: cost", "value": 12.0, "bound": "shown", "command": "make verify"}]
    assert (records.path / "hertz.png").stat().st_size > 5000


def test_a_check_that_fails_is_shown_and_ends_with_1(records):
    records.write("checks.csv", CHECKS.replace(",1,Johnson", ",0,Johnson"))
    status, output, _ = records.run("summary")
    assert status == 1 and "FAILS  hertz: force error %" in output and "| **no** |" in records.text("tables.md")
    assert records.summary()["checks"][0]["pass"] is False


def test_no_check_at_all_is_no_success(records):
    assert records.run("summary")[0] == 1
    records.write("checks.csv", "study,name,value,bound,pass,source\nhertz,cost,12,shown,,\n")
    assert records.run("summary")[0] == 1


def test_what_could_not_run_is_listed(records):
    records.write("checks.csv", CHECKS)
    records.write("left_out.csv", "study,reason\nmni152,no data\n")
    status, output, _ = records.run("summary")
    assert status == 0 and records.summary()["left_out"] == ["mni152: no data"] and "left   mni152: no data" in output


def test_bad_rows_are_refused_in_one_line(records):
    records.write("checks.csv", "study,name,value,bound,source\n")
    records.is_refused("summary", says="checks.csv: has no column pass")
    records.write("checks.csv", CHECKS.replace("0.825333094", "much"))
    records.is_refused("summary", says='checks.csv: line 2, column value: "much" is not a number')
    records.write("points.csv", "study,series,x_name,y_name,x\n")
    records.is_refused("summary", says="points.csv: has no column y")


def test_a_result_that_cannot_be_written_ends_with_1(records):
    records.write("checks.csv", CHECKS)
    (records.path / "tables.md").mkdir()
    status, _, error = records.run("summary")
    assert status == 1 and error.count("\n") == 1 and "tables.md: cannot be written" in error


def test_a_study_has_a_chart_per_pair_of_axes_and_a_line_per_series(records):
    points = table("study,series,x_name,y_name,x,y\nt,T = 1,z,p,0,1\nt,series,z,p,0,1\nt,series,z,p,0,1\n"
                   "t,T = 1,steps,error %,0,1\nu,T = 1,z,p,0,1\n")
    charts = charts_of(points)
    assert list(charts) == [("t", "z", "p"), ("t", "steps", "error %"), ("u", "z", "p")]
    assert charts["t", "z", "p"] == {"T = 1": [(0, 1)], "series": [(0, 1)]}, "an exact value once"


def test_axes_have_units_and_logarithms_where_values_span_powers_of_ten():
    assert with_unit("element size mm") == "element size (mm)" and with_unit("depth / H") == "depth / H"
    assert with_unit("T") == "T: time over consolidation time" and with_unit("mm") == "mm"
    assert logarithmic("displacement error %") and logarithmic("T") and not logarithmic("depth / H")
    assert logarithmic("assembly and solve s") and not logarithmic("noise sd over grey value")


@pytest.mark.parametrize("study", ["verification", "sensing", "faults"])
def test_the_committed_tables_are_those_of_the_committed_rows(records, study):
    docs = SOURCE / "docs" / study
    for name in ("checks.csv", "left_out.csv"):
        if (docs / name).exists():
            records.write(name, (docs / name).read_text())
    tables = (docs / "tables.md").read_text()
    commit, command = re.match(r"Commit (.*); `(.*)`\n", tables).groups()
    records.run("summary", "--commit", commit, "--command", command)
    assert records.text("tables.md") == tables
    assert records.summary() == json.loads((docs / "summary.json").read_text())
