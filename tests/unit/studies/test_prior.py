# SPDX-License-Identifier: GPL-3.0-or-later
"""Quantiles of drawn motion against the published targets."""
import math

import numpy as np
import pytest

from conftest import SOURCE, table
from studies.common import InputError
from studies.prior import Target, check_quantiles, read_targets, share_at_most
from studies.rows import Table

TARGETS = "place,quantile_pct,target_mm,low_mm,high_mm,source\n"
MOST = ("cortex,5,1,0.5,2,A 2001\ncortex,50,5,4,6,A 2001\ncortex,95,13,10,16,A 2001\n"
        "tumour,5,1,0.5,2,B\ntumour,50,3,2,4,B\ntumour,95,9,7,12,B\n"
        "far side,5,0.1,0,0.3,C\nfar side,50,0.7,0.4,1.2,C\n")
LAST = "far side,95,2,1,4,C\n"
DRAWS = "part,settled,cortex_mm,tumour_mm,far_side_mm,outward_mm,min_volume_ratio\n"


def ramp(part, scale):
    """101 draws, 0 to 100 times `scale` mm: the q % quantile is q * scale."""
    return "".join(f"{part},1,{scale * i},{scale * i},{scale * i},{-scale * i},0.9\n" for i in range(101))


def targets_around(scale):
    return TARGETS + "".join(f"{place},{q},{scale * q},{0.9 * scale * q},{1.1 * scale * q},S\n"
                             for place in ("cortex", "tumour", "far side") for q in (5, 50, 95))


@pytest.fixture
def study(records):
    records.write("draws.csv", DRAWS + ramp("total", 0.1) + "total,0,,,,,\n" + ramp("fine", 0.01))
    records.write("truncation.csv", "place,left_out_sd_mm\ncortex,0.12\n")
    records.write("targets.csv", targets_around(0.1))
    return records


def of_targets(folder):
    return folder.run("prior", "--targets", str(folder.path / "targets.csv"))


def test_quantiles_have_a_row_per_part_and_place_and_targets_beside_the_total(study):
    study.write("targets.csv", targets_around(0.2))
    assert of_targets(study)[0] == 1, "ten times wrong"
    rows = study.table("quantiles.csv")
    assert len(rows) == 6 and rows[2]["place"] == "far side" and rows[2].number("draws") == 101
    assert rows[0].number("unsettled") == 1 and rows[3].number("unsettled") == 0
    assert rows[0].number("q5_mm") == 0.5 and rows[0].number("q75_mm") == 7.5 and rows[3].number("q95_mm") == 0.95
    assert rows[0].number("target_q50_mm") == 10 and rows[0]["bracket_q50_mm"] == "9 to 11" and rows[0]["source"] == "S"
    assert rows[3]["target_q50_mm"] + rows[3]["source"] == ""


def test_checks_hold_where_every_quantile_is_inside(study):
    status, output, _ = of_targets(study)
    assert status == 0, output
    checks = study.table("checks.csv")
    assert [row["pass"] for row in checks][:9] == ["1"] * 9 and checks[8]["name"] == "far side 95 % quantile mm"
    assert checks[4]["bound"] == "4.5 to 5.5 mm" and checks[4]["source"] == "S"
    assert (study.path / "prior-predictive.png").exists() and (study.path / "prior-parts.png").exists()


def test_one_quantile_outside_turns_its_check_red(study):
    rows = targets_around(0.1).splitlines()
    rows[5] = "tumour,50,5.45,5.4,5.5,S"  # where 5.0 is measured
    study.write("targets.csv", "\n".join(rows))
    assert of_targets(study)[0] == 1
    assert [row["pass"] for row in study.table("checks.csv")][:9] == ["1"] * 4 + ["0"] + ["1"] * 4


def test_without_settled_draws_no_check_holds(study):
    study.write("draws.csv", DRAWS + "total,0,,,,,\n")
    assert of_targets(study)[0] == 1
    assert [row["pass"] for row in study.table("checks.csv")][:9] == ["0"] * 9


def test_figures_have_no_verdict(study):
    rows = study.text("draws.csv").splitlines(keepends=True)
    ratios = iter([-0.1, 0.4, 0.6, *[0.9] * 98])
    study.write("draws.csv", "".join(line.replace(",0.9\n", f",{next(ratios)}\n") if line.startswith("total,1") else line for line in rows))
    of_targets(study)
    figures = {row["name"]: row for row in study.table("checks.csv") if not row["pass"]}
    assert figures["draws with inverted elements %"].number("value") == pytest.approx(100 / 101)
    assert figures["draws with det F of 0.5 or less %"].number("value") == pytest.approx(200 / 101)
    assert figures["mean of the cortex's outward motion mm"].number("value") == pytest.approx(-5)
    assert figures["correlation of cortex and tumour"].number("value") == pytest.approx(1)
    assert figures["draws whose contact did not settle"].number("value") == 1
    assert figures["cortex left out by truncation mm"]["bound"] == "sd per component; not drawn" and len(figures) == 8


def test_volume_ratios_that_are_no_number_count():
    assert share_at_most(np.array([math.nan, 1.0]), 0.0) == 50 and share_at_most(np.array([0.0, 1.0]), 0.0) == 50
    assert math.isnan(share_at_most(np.array([]), 0.0))


def test_targets_are_what_the_table_says():
    targets = read_targets(table(TARGETS + MOST + LAST))
    assert len(targets) == 9 and targets["far side", 50] == Target(0.7, 0.4, 1.2, "C")
    assert len(read_targets(Table.read(SOURCE / "tests/prior_study/targets.csv"))) == 9


def test_a_bracket_holds_its_ends():
    target = Target(1.5, 1.0, 2.0, "S")
    assert target.holds(1.0) and target.holds(2.0)
    assert not (target.holds(0.999) or target.holds(2.001) or target.holds(math.nan))


@pytest.mark.parametrize("row, says", [
    ("ear,95,2,1,4,C", 'line 10, column place: "ear" is unknown'), ("far side,75,2,1,4,C", "line 10, column quantile_pct"),
    ("far side,,2,1,4,C", "line 10, column quantile_pct"), ("far side,95,2,1,4,", "line 10, column source: is missing"),
    ("far side,50,0.7,0.4,1.2,C", "line 10, column place: stands with this quantile_pct in an earlier line"),
    ("far side,95,two,1,4,C", 'line 10, column target_mm: "two" is not a number'),
    *((f"far side,95,{numbers},C", "line 10, column target_mm: must be 0 <= low_mm <= target_mm <= high_mm")
      for numbers in ("2,3,4", "2,1,1.5", "2,-1,4", ",1,4", "nan,1,4"))])
def test_a_wrong_target_is_told_with_its_line(row, says):
    with pytest.raises(InputError, match="t.csv: " + says):
        read_targets(table(TARGETS + MOST + row + "\n"))


def test_targets_must_be_complete(study):
    study.write("targets.csv", TARGETS + MOST)
    study.is_refused("prior", "--targets", str(study.path / "targets.csv"), says="no target for far side, quantile_pct 95")
    study.is_refused("prior", "--targets", "/nowhere/t.csv", says="cannot be opened")
    study.write("targets.csv", "place,target_mm\ncortex,3\n")
    study.is_refused("prior", "--targets", str(study.path / "targets.csv"), says="has no column quantile_pct")


def test_bad_rows_are_refused_in_one_line(study):
    study.write("draws.csv", study.text("draws.csv").replace("far_side_mm", "far_mm"))
    study.is_refused("prior", says="draws.csv: has no column far_side_mm")
    study.write("draws.csv", DRAWS + ramp("fine", 1))
    study.is_refused("prior", says="no row of total")
