# SPDX-License-Identifier: GPL-3.0-or-later
"""With anatomy against without, on rows whose answer is known."""
import pytest

from made_up import DOCS, text_of
from studies.anatomy import Judge, table_text
from studies.checks import Record
from studies.rows import Table

NAMES = ("status", "field_mm", "field_opened_mm", "field_other_mm", "loaded_mm", "tumour_mm", "near_coverage_90", "far_coverage_90",
         "ventricle_change_mm3", "quality")


def row(kind, seed, stage, with_mm, without_mm, coverage=0.9, true=-10000.0, told=-9000.0):
    drained = kind == "ventricles-drain"
    loaded = "" if drained else 0.4
    model = lambda error, change: dict(zip(NAMES, ("converged", error, 0.8 * error, 1.2 * error, loaded, 0.1, coverage, 0.85,
                                                   change, "good")))
    return {"head": "h", "kind": kind, "seed": seed, "stage": stage, "reason": "", "true_mm": 2.0, "true_opened_mm": 2.5,
            "true_other_mm": 1.5, "true_max_mm": 6.0, "volume_loss": 0.4,
            "true_change_mm3": true if drained else "",
            **{f"with_{name}": value for name, value in model(with_mm, told if drained else 0.0).items()},
            **{f"without_{name}": value for name, value in model(without_mm, "").items()}}


def surgeries(kind, with_mm, without_mm, **more):
    """Twenty; the first update is worse than any bound, and only the last one counts."""
    return [row(kind, seed, stage, with_mm if stage else 9.0, without_mm, **more) for seed in range(20) for stage in (0, 1)]


@pytest.fixture
def study(records):
    def judge(*rows):
        records.write("rows-h.csv", text_of([one for some in rows for one in some]))
        status = records.run("anatomy")[0]
        return status, {one["name"].removeprefix("anatomy: h: "): one for one in records.summary()["checks"]}, records
    return judge


def test_bounds_that_hold(study):
    status, checks, records = study(surgeries("air-side", 0.5, 1.0), surgeries("sag", 1.05, 1.0),
                                    surgeries("ventricles-drain", 0.4, 1.0))
    assert status == 0
    assert checks["air-side: field error with anatomy over without"]["value"] == pytest.approx(0.5)
    assert checks["ventricles-drain: error of the ventricles' change of volume %"]["value"] == pytest.approx(10.0)
    assert checks["air-side: field error with anatomy over without on the other half"]["value"] == pytest.approx(0.5)
    assert checks["air-side: the same of the models' answers to the true load"]["value"] == pytest.approx(1.0)
    assert "ventricles-drain: the same of the models' answers to the true load" not in checks
    assert records.text("kinds.md").count("\n| h |") == 3


@pytest.mark.parametrize("kind, error, name", [
    ("air-side", 0.61, "air-side: field error with anatomy over without"),
    ("ventricles-drain", 0.61, "ventricles-drain: field error with anatomy over without"),
    ("sag", 1.11, "sag: field error with anatomy over without")])
def test_an_error_ratio_above_its_bound_turns_it_red(study, kind, error, name):
    status, checks, _ = study(surgeries(kind, error, 1.0))
    assert status == 1 and [one for one, check in checks.items() if check.get("pass") is False] == [name]


def test_a_volume_that_is_a_third_too_small_turns_it_red(study):
    status, checks, _ = study(surgeries("ventricles-drain", 0.4, 1.0, told=-6600.0))
    check = checks["ventricles-drain: error of the ventricles' change of volume %"]
    assert status == 1 and check["pass"] is False and check["value"] == pytest.approx(34.0)


@pytest.mark.parametrize("coverage", [0.79, 0.98])
def test_bars_that_are_too_narrow_or_too_wide_turn_it_red(study, coverage):
    status, checks, _ = study(surgeries("falx-sag", 0.4, 1.0, coverage=coverage))
    assert status == 1
    assert checks["falx-sag: coverage of the 90 % interval near with anatomy"]["pass"] is False
    assert "pass" not in checks["falx-sag: field error with anatomy over without"]


def test_a_refused_update_is_wrong_by_the_true_motion(study):
    rows = surgeries("air-side", 0.5, 1.0)
    for one in rows[:2]:
        one["with_field_mm"] = one["with_near_coverage_90"] = ""
    _, checks, _ = study(rows)
    assert checks["air-side: field error with anatomy over without"]["value"] == pytest.approx((19 * 0.5 + 2.0) / 20)
    assert checks["air-side: coverage of the 90 % interval near with anatomy"]["value"] == pytest.approx(0.9 * 19 / 20)


def test_a_truth_without_an_equilibrium_is_told_and_left_out(study):
    lost = {**{name: "" for name in row("air-side", 0, 0, 1, 1)}, "head": "h", "kind": "air-side", "seed": 99, "reason": "no"}
    status, _, records = study(surgeries("air-side", 0.5, 1.0), [lost])
    assert status == 0
    assert records.summary()["left_out"] == ["anatomy: h: air-side: 1 surgeries without an equilibrium"]


def test_no_rows_are_bad_input(records):
    assert records.run("anatomy")[0] == 2


def test_the_page_has_the_table_of_its_rows():
    rows = Table.read_all(sorted((DOCS / "anatomy").glob("rows-*.csv.gz")))
    assert table_text(rows) in (DOCS / "anatomy.md").read_text()
    record = Record(None)
    Judge(rows, record).run()
    judged = [",".join(one) for one in record.checks]
    committed = (DOCS / "anatomy" / "checks.csv").read_text().splitlines()[1:]
    assert judged == [line for line in committed if not line.endswith(",anatomy.sh")]
