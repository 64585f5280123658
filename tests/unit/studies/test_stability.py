# SPDX-License-Identifier: GPL-3.0-or-later
"""Verdicts on the points of stability_suite."""
import json

import pytest

from conftest import SOURCE, table
from studies.checks import summary_json
from studies.rows import Table
from studies.stability import NEEDED, checks, count, judge, seeded_faults

HEADING = ",".join(NEEDED) + "\n"


def point(**changes):
    cells = {"sheet": "mesh", "fault": "none", "parameter": "size (mm)", "x": "1", "row": "condensed", "answered": "1",
             "warned": "0", "status": "converged", "difference": "0.001", "bound": "0.01", "unit": "mm", "must_warn": "0",
             "objection": "", "reason": "loads settled"}
    return ",".join({**cells, **changes}[column] for column in NEEDED) + "\n"


def points(*rows):
    return table(HEADING + "".join(rows))


@pytest.mark.parametrize("changes, verdict", [
    ({}, "green"),
    ({"difference": "0.01"}, "green"),  # the bound itself
    ({"difference": "0.010000000000000002"}, "red"),
    ({"difference": ""}, "red"),
    ({"warned": "1", "difference": "9"}, "yellow"),
    ({"answered": "0", "difference": "", "status": "not_available"}, "grey"),
    ({"answered": "0", "reason": "", "status": "not_available"}, "red"),
    ({"reason": "", "status": "solved"}, "green"),
    ({"reason": ""}, "red"),
    ({"must_warn": "1"}, "red"),
    ({"must_warn": "1", "warned": "1"}, "yellow"),
    ({"objection": "stops otherwise"}, "red")])
def test_a_verdict(changes, verdict):
    assert judge(points(point(**changes))[0]) == verdict


def test_a_fault_is_found_when_every_silent_row_turns_red():
    seeded = points(point(fault="sign", difference="1"), point(fault="sign", row="paper", warned="1"),
                    point(fault="scale", difference="1"), point(fault="scale", row="paper"),
                    point(fault="normal", warned="1"))
    faults = seeded_faults(seeded, ["mesh"])
    assert faults == [("mesh", "sign", 1, 1, 1, 1, ""), ("mesh", "normal", 0, 0, 0, 0, ""),
                      ("mesh", "scale", 2, 1, 2, 1, "size (mm): paper")]
    found = checks(points(point()), faults, None, "out")
    assert [(check.name, check.value, check.bound, check.holds) for check in found] == [
        ("stability, mesh: points wrong without saying so, of 1", 0, "0", True),
        ("stability, mesh: seeded faults found (sign, normal, scale)", 1, "3", False)]


def test_a_product_that_refuses_everything_is_never_wrong():
    guards = table("name,value\nshare_percent,0.65\n")
    refused = checks(points(point(), point(answered="0"), point(answered="0")), [], guards, "out")
    assert [(check.name, check.holds) for check in refused[1:]] == [
        ("stability: points answered accurately and without a warning, %", False),
        ("guards: share of an update of the default head, %", True)]
    costly = checks(points(point()), [], table("name,value\nshare_percent,3.5\n"), "out")
    assert [check.holds for check in costly] == [True, True, False]
    assert not checks(points(point()), [], table("name,value\n"), "out")[-1].holds, "not measured"


@pytest.fixture
def swept(folder):
    folder.write("points.csv", HEADING + point() + point(x="1000", row="paper", warned="1") + point(sheet="data"))
    folder.write("seeded.csv", HEADING + "".join(point(sheet=sheet, fault=fault, difference="1")
                                                 for sheet in ("mesh", "data") for fault in ("sign", "normal", "scale")))
    folder.write("guards.csv", "name,value\nshare_percent,0.65\n")
    return folder


def test_a_good_sweep_ends_well_with_a_map_per_sheet(swept):
    status, output, _ = swept.run("stability")
    assert status == 0 and "2 green, 1 yellow, 0 grey, 0 red" in output
    assert [check["name"] for check in swept.summary()["checks"]] == [
        "stability, mesh: points wrong without saying so, of 2", "stability, data: points wrong without saying so, of 1",
        "stability, mesh: seeded faults found (sign, normal, scale)", "stability, data: seeded faults found (sign, normal, scale)",
        "stability: points answered accurately and without a warning, %", "guards: share of an update of the default head, %"]
    assert swept.text("faults.csv").startswith("sheet,fault,answers,red,rows,red_rows,missed\nmesh,sign,1,1,1,1,\n")
    assert (swept.path / "mesh.png").exists() and (swept.path / "data.png").exists()
    assert swept.run("stability", "--partial")[0] == 0 and len(swept.summary()["checks"]) == 4
    swept.write("seeded.csv", HEADING)
    assert swept.run("stability", "--partial")[0] == 0 and len(swept.summary()["checks"]) == 2
    assert swept.run("stability")[0] == 1, "nothing seeded where all was asked for"


@pytest.mark.parametrize("file, row", [("points.csv", point(objection="stops otherwise")),
                                       ("seeded.csv", point(fault="scale", row="paper")), ("guards.csv", "share_percent,9\n")])
def test_what_is_wrong_ends_with_1(swept, file, row):
    swept.write(file, swept.text(file) + row if file != "guards.csv" else "name,value\n" + row)
    status, output, _ = swept.run("stability")
    assert status == 1 and output.count("FAILS") == 1, output


def test_bad_rows_are_refused_in_one_line(swept):
    swept.write("points.csv", swept.text("points.csv").replace("warned", "alarmed"))
    swept.is_refused("stability", says="points.csv: has no column warned")
    (swept.path / "guards.csv").unlink()
    swept.write("points.csv", HEADING + point())
    swept.is_refused("stability", says="guards.csv: cannot be opened")
    swept.write("points.csv", HEADING + point(bound="little"))
    swept.is_refused("stability", "--partial", says='points.csv: line 2, column bound: "little" is not a number')


def test_the_committed_summary_is_that_of_the_committed_rows():
    """seeded.csv of that run was not kept; faults.csv is what was made of it."""
    docs = SOURCE / "docs" / "stability"
    rows, guards = (Table.read(docs / f"{name}.csv") for name in ("points", "guards"))
    faults = [(row["sheet"], row["fault"], *(int(row[name]) for name in ("answers", "red", "rows", "red_rows")), row["missed"])
              for row in Table.read(docs / "faults.csv")]
    found = checks(rows, faults, guards, "out/stability")
    assert json.loads(summary_json(found)) == json.loads((docs / "summary.json").read_text())
    assert [count(rows, verdict) for verdict in ("green", "yellow", "grey", "red")] == [389, 94, 48, 0]
