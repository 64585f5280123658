# SPDX-License-Identifier: GPL-3.0-or-later
"""outside.py: what a check of truths from outside counts, and when it turns red."""
import pytest

from made_up import Verdicts, table_of
from studies import outside, surgeries

PARTS = {"error_mm": 0.4, "none_mm": 1, "coverage_90": 0.9, "interval_mm": 2, "crps_mm": 0.2, "rms_sd_mm": 0.3,
         "rms_error_mm": 0.25}


def update(seed, stage="tumour", kind="air-side", **cells):
    row = {"head": "h", "place": 1, "seed": seed, "scenario": kind, "stage": stage, "status": "converged",
           "recovered_pct": 96, "tumour_mm": 0.1, "none_tumour_mm": 3, "field_mean_mm": 0.5, "none_field_mean_mm": 1,
           "coverage_90": 0.9, "quality": "good", "quality_reason": "", "beyond_band": 0, "misfit_ratio": 0.5,
           "true_max_mm": 6, "all_interval_mm": 2, "outside": 1}
    row |= {f"{part}_{what}": value for part in ("near", "far", "cortex") for what, value in PARTS.items()}
    return row | cells


@pytest.fixture
def rows():
    return [update(seed, stage) for seed in (1, 2, 3, 4) for stage in ("tumour", "tumour+cortex+tracks")]


def every(rows, **cells):
    return [row | cells for row in rows]


def verdicts(rows):
    return Verdicts(lambda record: outside.judge(table_of(rows), surgeries.last_updates, record))


def test_all_checks_hold_when_all_is_well(rows):
    found = verdicts(rows)
    assert found.red() == [] and len(found.holds) == 7


@pytest.mark.parametrize("cells, red", [
    ({"recovered_pct": 92, "tumour_mm": 0.16}, "air-side: tumour recovered %"),
    ({"field_mean_mm": 0.71}, "air-side: field error over no correction"),
    ({"near_coverage_90": 0.79}, "air-side: coverage of the 90 % interval near"),
    ({"far_coverage_90": 0.79}, "air-side: coverage of the 90 % interval far"),
    ({"coverage_90": 0.59}, "outside: share of single surgeries with coverage below 0.6 %"),
    ({"far_rms_error_mm": 1.8}, "outside: updates that say good while the far field is wrong by 3 mm rms %"),
    ({"beyond_band": 2}, "outside: updates with nodes worse than no correction beyond a simultaneous 90 % band")])
def test_each_figure_has_its_bound(rows, cells, red):
    assert verdicts(every(rows, **cells)).red() == [red]


def test_caution_allows_a_lower_coverage_but_not_any(rows):
    doubtful = every(rows, far_coverage_90=0.7, quality="caution")
    assert verdicts(doubtful).red() == []
    doubtful[0]["quality"] = "good"  # one of eight
    assert verdicts(doubtful).red() == ["air-side: coverage of the 90 % interval far"]
    assert verdicts(every(rows, far_coverage_90=0.64, quality="caution")).red() == [
        "air-side: coverage of the 90 % interval far"]


def test_what_is_out_of_sight_may_stay_as_wrong_as_it_is(rows):
    hidden = every(rows, scenario="haematoma-other", field_mean_mm=1.0)
    assert verdicts(hidden).red() == []
    assert verdicts(every(hidden, field_mean_mm=1.01)).red() == ["haematoma-other: field error over no correction"]


def test_a_refused_update_covers_and_recovers_nothing(rows):
    kept = ("head", "place", "seed", "scenario", "stage")
    for i in (1, 3, 5):
        rows[i] = {key: value if key in kept else "" for key, value in rows[i].items()} | {"status": "refused"}
    found = verdicts(rows)
    assert found.values["air-side: tumour recovered %"] == 24
    assert found.values["air-side: coverage of the 90 % interval near"] == pytest.approx(0.9 * 5 / 8)
    assert found.values["outside: share of single surgeries with coverage below 0.6 %"] == 75


def test_own_truths_and_those_from_outside_are_told_apart(rows):
    own = update(1, kind="joint-sag", outside=0)
    refused = update(9) | {"outside": "", "status": "refused"}
    inside, from_outside = outside.split(table_of([own, refused, *rows]))
    assert [row["scenario"] for row in inside] == ["joint-sag"] and len(from_outside) == 9
    old = table_of([{key: value for key, value in own.items() if key != "outside"}])
    assert [len(part) for part in outside.split(old)] == [1, 0]


def test_sharpness_of_own_truths_has_two_sides(rows):
    def red(**cells):
        return Verdicts(lambda record: outside.sharpness(table_of(every(rows, **cells)), surgeries.last_updates, record)).red()
    assert red() == []
    assert red(near_rms_sd_mm=0.76) == ["own truths: rms sd over rms error near the data"]
    assert red(near_coverage_90=0.84) == ["own truths: coverage of the 90 % interval near the data"]


def test_the_table_has_a_line_per_head_kind_and_data(rows):
    lines = outside.table_text(table_of(rows)).splitlines()
    assert len(lines) == 4
    assert lines[2].startswith("| h | air-side | tumour | 4 | 96 | 0.1 | 0.5 | 0.4 | 0.4 | 0.4 | 0.9 | 0.9 | 2 | 2 | 0.2 |")
    assert lines[2].endswith("| 1.2 | 100 | 0 | 6 |")
