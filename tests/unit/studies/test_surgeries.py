# SPDX-License-Identifier: GPL-3.0-or-later
"""surgeries.py: on committed rows, and on tables made by hand: what a check counts, and when it turns red."""
import shutil

import pytest

from made_up import DOCS, Verdicts, committed, judged, run, table_of, text_of
from studies import surgeries
from studies.rows import Table

FOLDER = DOCS / "surgeries"
TABLES = sorted(FOLDER.glob("rows-*.csv.gz"))
BEFORE = sorted((FOLDER / "before").glob("rows-*.csv"))


def good(seed, alone):
    return {"head": "h", "place": 1, "seed": seed, "scenario": "joint-sag",
            "stage": "tumour" if alone else "tumour+cortex+tracks", "status": "converged", "nodes": 100,
            "recovered_pct": 98, "tumour_mm": 0.1, "field_mean_mm": 0.2, "craniotomy_mm": 1 if alone else 0.3,
            "craniotomy_closest_mm": 1 if alone else 0.4, "worse_nodes": 0, "worst_excess_mm": -1,
            "coverage_90": 0.9, "sources": 1 if alone else 3, "contradictions": 0, "quality": "good", "inverted": 0,
            "min_volume_ratio": 0.8, "contact_decrement": 1e-4, "contact_violation_mm": 0.001, "update_ms": 30,
            "t_solve_ms": 20, "warm_cold_mm": "" if alone else 0.001, "swelling_strain": 0, "volume_strain": 0,
            "removed_nodes": 0}


@pytest.fixture
def rows():
    return [good(seed, alone) for seed in (1, 2, 3, 4) for alone in (True, False)]


def every(rows, **cells):
    return [{**row, **cells} for row in rows]


def verdicts(rows, before=()):
    now = table_of(rows)
    return Verdicts(lambda record: surgeries.judge(now, table_of(before) if before else Table(now.columns), record))


def test_committed_rows_give_the_committed_checks():
    now, before = Table.read_all(TABLES), Table.read_all(BEFORE)
    assert judged(lambda record: surgeries.judge(now, before, record)) == committed("surgeries")


def test_all_checks_hold_when_all_is_well(rows):
    found = verdicts(rows, rows)
    assert found.red() == [] and len(found.holds) == 13


def test_the_tumour_may_miss_its_share_where_the_error_is_small(rows):
    assert verdicts(every(rows, recovered_pct=80)).red() == []
    assert verdicts(every(rows, recovered_pct=80, tumour_mm=0.16)).red() == ["joint-sag: tumour recovered %"]


def test_a_refused_update_recovers_and_covers_nothing(rows):
    kept = ("head", "place", "seed", "scenario", "stage")
    for i in (1, 3):
        rows[i] = {key: value if key in kept else "" for key, value in rows[i].items()} | {"status": "refused"}
    found = verdicts(rows)
    assert found.red() == ["joint-sag: coverage of the 90 % interval", "joint-sag: tumour recovered %",
                           "share of single surgeries with coverage below 0.6 %",
                           "updates without the contact certificate"]
    assert found.values["joint-sag: tumour recovered %"] == 49
    assert found.values["share of single surgeries with coverage below 0.6 %"] == 50
    assert found.values["updates that were refused"] == 2


def test_every_update_counts_where_one_is_too_many(rows):
    rows[2]["worse_nodes"], rows[2]["inverted"], rows[4]["contact_decrement"] = 1, 3, 0.01
    assert verdicts(rows).red() == [
        "fields with inverted elements; whatever their quality",
        "joint-sag: updates somewhere worse than no correction by more than their interval",
        "updates without the contact certificate"]


@pytest.mark.parametrize("cells", [{"inverted": 3}, {"inverted": 3, "quality": "unusable"}, {"inverted": ""},
                                   {"min_volume_ratio": -0.1}, {"min_volume_ratio": ""}])
def test_an_inverted_element_is_one_too_many_whatever_the_quality(rows, cells):
    rows[0].update(cells)
    found = verdicts(rows)
    assert found.red() == ["fields with inverted elements; whatever their quality"]
    assert found.values["updates of quality good"] + found.values["updates of quality unusable"] == 8


def test_coverage_has_two_sides(rows):
    assert verdicts(every(rows, coverage_90=0.98)).red() == ["joint-sag: coverage of the 90 % interval"]
    low = every(rows, coverage_90=0.79)
    assert verdicts(low).red() == ["joint-sag: coverage of the 90 % interval"]
    low[1]["coverage_90"] = 0.59
    assert len(verdicts(low).red()) == 2  # and one of four single surgeries


def test_the_craniotomy_is_held_to_the_better_of_both_estimates_from_the_tumour(rows):
    assert verdicts(rows, every(rows, craniotomy_mm=0.55)).red() == [
        "joint-sag: craniotomy error by displacement over that of the tumour alone"]


def test_sag_is_held_to_the_estimate_before_on_the_same_surgeries_only(rows):
    before = every(rows, field_mean_mm=0.17)
    assert verdicts(rows, before).red() == ["joint-sag: field error over that of the estimate before"]
    other = verdicts(rows, every(before, place=9))
    assert other.red() == [] and other.left_out == ["h,joint-sag: sag against the estimate before: other surgeries"]
    assert verdicts(rows).left_out == ["h,joint-sag: sag against the estimate before: no --before given"]
    assert verdicts(every(rows, volume_strain=-0.01), before).red() == []


def test_warm_cold_time_and_contradictions(rows):
    rows[1]["warm_cold_mm"], rows[1]["contradictions"] = 0.02, 1
    found = verdicts(every(rows, update_ms=41))
    assert found.red() == ["update with three sources over one solve: p50",
                           "updates that call consistent sources contradictory %",
                           "warm against cold mm: largest of any node and surgery"]
    assert found.values["updates that call consistent sources contradictory %"] == 25


def test_a_certificate_that_is_not_published_is_left_out(rows):
    found = verdicts(every(rows, contact_decrement="", contact_violation_mm=""))
    assert found.red() == [] and "h,contact certificate: the estimate publishes none" in found.left_out


def test_the_command_ends_with_1_because_a_bound_is_missed(tmp_path):
    for table in TABLES:
        shutil.copy(table, tmp_path)
    done = run("surgeries", "--dir", tmp_path, "--before", *BEFORE)
    assert done.returncode == 1 and "FAILS  colin27: updates that call consistent sources" in done.stdout
    assert (tmp_path / "checks.csv").read_text() == (FOLDER / "checks.csv").read_text()
    for name in ("surgeries-tumour.png", "surgeries-coverage.png", "surgeries-field.png"):
        assert 5_000 < (tmp_path / name).stat().st_size < 60_000
    assert '"pass": false' in (tmp_path / "summary.json").read_text()


def test_a_missing_column_is_bad_input_in_one_line(tmp_path, rows):
    for row in rows:
        del row["coverage_90"]
    (tmp_path / "rows-h.csv").write_text(text_of(rows))
    done = run("surgeries", "--dir", tmp_path)
    assert done.returncode == 2
    assert done.stderr == f"studies surgeries: {tmp_path}/rows-h.csv: has no column coverage_90\n"


def test_no_rows_are_bad_input(tmp_path):
    done = run("surgeries", "--dir", tmp_path)
    assert done.returncode == 2 and done.stderr == f"studies surgeries: {tmp_path}: no row in rows-*.csv\n"
