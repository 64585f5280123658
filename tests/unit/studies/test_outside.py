# SPDX-License-Identifier: GPL-3.0-or-later
"""outside.py: what a check of truths from outside counts, and when it turns red."""
import pytest

from made_up import DOCS, SOURCE, Verdicts, run, table_of, text_of
from studies import clusters, outside
from studies.checks import Record
from studies.common import InputError
from studies.rows import Table, study_rows

FOLDER = DOCS / "surgeries" / "outside"
PAGES = [SOURCE / "README.md", DOCS / "surgeries.md", DOCS / "evidence.md"]

PARTS = {"error_mm": 0.4, "none_mm": 1, "coverage_90": 0.9, "interval_mm": 2, "crps_mm": 0.2, "rms_sd_mm": 0.3,
         "rms_error_mm": 0.25}


def update(seed, stage="tumour", kind="air-side", **cells):
    row = {"head": "h", "place": 1, "seed": seed, "scenario": kind, "stage": stage, "status": "converged",
           "recovered_pct": 96, "tumour_mm": 0.1, "none_tumour_mm": 3, "field_mean_mm": 0.5, "none_field_mean_mm": 1,
           "coverage_90": 0.9, "quality": "good", "flags": "", "nodes": 6000, "quality_reason": "", "beyond_band": 0, "misfit_ratio": 0.5,
           "true_max_mm": 6, "all_interval_mm": 2, "outside": 1}
    row |= {f"{part}_{what}": value for part in ("near", "far", "cortex") for what, value in PARTS.items()}
    return row | cells


@pytest.fixture
def rows():
    return [update(seed, stage) for seed in (1, 2, 3, 4) for stage in ("tumour", "tumour+cortex+tracks")]


SINGLE = "single surgeries with coverage below 0.6 %"
SCORE = ("all truths", "interval score", "all_interval_mm", 0.6)
UNSEEN = "updates without a right caution whose unmarked far field is wrong by 3 mm rms %"


def every(rows, **cells):
    return [row | cells for row in rows]


def verdicts(rows):
    return Verdicts(lambda record: outside.judge(table_of(rows), record))


def test_all_checks_hold_when_all_is_well(rows):
    found = verdicts(rows)
    assert found.red() == [] and len(found.holds) == 7


@pytest.mark.parametrize("cells, red", [
    ({"recovered_pct": 92, "tumour_mm": 0.16}, "air-side: tumour recovered %"),
    ({"field_mean_mm": 0.71}, "air-side: field error over no correction"),
    ({"near_coverage_90": 0.79}, "air-side: coverage of the 90 % interval near"),
    ({"far_coverage_90": 0.79}, "air-side: coverage of the 90 % interval far"),
    ({"coverage_90": 0.59}, SINGLE),
    ({"far_rms_error_mm": 1.8}, UNSEEN),
    ({"beyond_band": 2}, "updates with nodes worse than no correction beyond a simultaneous 90 % band")])
def test_each_figure_has_its_bound(rows, cells, red):
    assert verdicts(every(rows, **cells)).red() == [red]


def test_caution_allows_a_lower_coverage_but_not_any(rows):
    doubtful = every(rows, far_coverage_90=0.7, quality="caution", flags="data_outside_region;mostly_prior")
    red = ["air-side: coverage of the 90 % interval far"]
    assert verdicts(doubtful).red() == []
    assert verdicts(every(doubtful, far_coverage_90=0.64)).red() == red
    assert verdicts(every(doubtful, flags="data_outside_region")).red() == red  # true, and beside the point
    doubtful[0]["quality"] = "good"  # one of eight
    assert verdicts(doubtful).red() == red


def test_a_far_field_that_is_marked_as_unseen_may_be_wrong(rows):
    wrong = every(rows, far_rms_error_mm=5)
    assert verdicts(wrong).red() == [UNSEEN]
    assert verdicts(every(wrong, far_unmarked_mm=2.9)).red() == []
    assert verdicts(every(wrong, far_unmarked_mm=3.1)).red() == [UNSEEN]
    assert verdicts(every(wrong, quality="caution", flags="sources_contradict")).red() == []


def test_truths_count_alike_in_a_patient_and_patients_in_a_head(rows):
    """Three surgeries of place 1, one of place 2: their means are 0.9 and 0.7."""
    other = [row | {"place": 2, "near_coverage_90": 0.7} for row in rows[:2]]
    found = verdicts(rows[:6] + other)
    assert found.values["air-side: coverage of the 90 % interval near"] == pytest.approx(0.8)
    interval = clusters.mean(table_of(rows[:6] + other), "near_coverage_90")
    assert (interval.mean, interval.count) == (pytest.approx(0.8), 2)
    assert interval.high - interval.low == pytest.approx(2 * 12.7062 * 0.1, rel=1e-4)  # t of one degree of freedom
    # A truth with many updates is one truth.
    many = [update(1, near_coverage_90=1.0), update(1, "b", near_coverage_90=0.8), update(2, near_coverage_90=0.1)]
    assert clusters.mean(table_of(many), "near_coverage_90").mean == pytest.approx(0.5)


def test_a_bound_holds_where_every_head_holds_it(rows):
    other = every(rows, head="g", far_coverage_90=0.78)
    found = verdicts(rows + other)
    assert found.red() == ["air-side: coverage of the 90 % interval far"]
    assert found.values["air-side: coverage of the 90 % interval far"] == pytest.approx(0.78)
    assert verdicts(rows + every(other, far_coverage_90=0.82)).red() == []


def test_the_tumour_is_told_by_its_worst_head(rows):
    small = every(rows, head="g", recovered_pct=50, tumour_mm=0.1)
    found = verdicts(rows + small + every(rows, head="f", recovered_pct=90, tumour_mm=0.2))
    assert found.red() == ["air-side: tumour recovered %"] and found.values["air-side: tumour recovered %"] == 90


def test_scores_are_compared_on_the_same_updates(rows):
    def ratio(others, bounds=None):
        record = Record(None)
        outside.check_against(table_of(rows), table_of(others), "x", bounds or (SCORE,), record)
        return [(float(one[2]), one[4]) for one in record.checks], record.parts_left_out
    twice = every(rows, all_interval_mm=4)
    assert ratio(twice) == ([(0.5, "1")], [])
    assert ratio(twice + [update(77, all_interval_mm=900)]) == ([(0.5, "1")], [])
    assert ratio(every(rows, all_interval_mm=2.5)) == ([(0.8, "0")], [])
    assert ratio(every(twice, place=9))[0] == [] and len(ratio(every(twice, place=9))[1]) == 1
    assert ratio(twice, (("own truths", "interval score", "all_interval_mm", 1.6),))[1] == [
        ("outside", "own truths: interval score over that of x: no rows of the same surgeries")]


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
    assert found.values[SINGLE] == 75
    assert outside.field_ratio(table_of([update(1), update(2) | {"status": "refused", "field_mean_mm": ""}])).mean == 0.75


def test_own_truths_and_those_from_outside_are_told_apart(rows):
    own = update(1, kind="joint-sag", outside=0)
    refused = update(9) | {"outside": "", "status": "refused"}
    inside, from_outside = outside.split(table_of([own, refused, *rows]))
    assert [row["scenario"] for row in inside] == ["joint-sag"] and len(from_outside) == 9
    old = table_of([{key: value for key, value in own.items() if key != "outside"}])
    assert [len(part) for part in outside.split(old)] == [1, 0]


def test_sharpness_of_own_truths_has_two_sides(rows):
    def red(**cells):
        return Verdicts(lambda record: outside.sharpness(table_of(every(rows, **cells)), record)).red()
    assert red() == []
    assert red(near_rms_sd_mm=0.76) == ["own truths on h: rms sd over rms error near the data"]
    assert red(near_coverage_90=0.84) == ["own truths on h: coverage of the 90 % interval near the data"]


def test_the_table_has_a_line_per_head_kind_and_data(rows):
    lines = outside.table_text(table_of(rows)).splitlines()
    assert len(lines) == 4
    assert lines[2].startswith("| h | air-side | tumour | 4 | 1 | 96 | 0.1 | 0.5 | 0.4 | 0.4 | 0.4 | 0.9 | 0.9 | 2 | 2 | 0.2 |")
    assert lines[2].endswith("| 1.2 | 100 | 0 | 0 | 6 |")


def test_committed_rows_give_the_committed_checks_and_figures():
    own, rows = outside.split(study_rows(FOLDER, outside.COLUMNS))
    record = Record(None)
    outside.judge(rows, record)
    outside.sharpness(own, record)
    committed = (FOLDER / "checks.csv").read_text().splitlines()[1:]
    assert [",".join(one) for one in record.checks] == committed[:len(record.checks)]  # the others need other tables
    commit = (FOLDER / "summary.md").read_text().partition("commit ")[2].partition(".")[0]
    assert outside.summary_text(rows, commit) == (FOLDER / "summary.md").read_text()
    assert outside.table_text(rows) == (FOLDER / "outside.md").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_have_the_committed_figures(page):
    text = page.read_text()
    assert "<!-- outside: summary.md -->" in text
    assert outside.with_blocks(text, page, FOLDER) == text, "studies outside --dir docs/surgeries/outside --pages ..."


def test_a_block_that_is_not_closed_is_bad_input(tmp_path):
    (tmp_path / "a.md").write_text("new\n")
    assert outside.with_blocks("x\n<!-- outside: a.md -->\nold\n<!-- end -->\ny\n", "p", tmp_path) == (
        "x\n<!-- outside: a.md -->\nnew\n<!-- end -->\ny\n")
    for text in ("<!-- outside: a.md -->\nold", "<!-- outside: ../a.md -->\nold\n<!-- end -->"):
        with pytest.raises(InputError, match="p: a block of outside.py is not closed"):
            outside.with_blocks(text, "p", tmp_path)


def test_the_command_tells_every_must_and_ends_with_1_where_one_is_missed(tmp_path, rows):
    (tmp_path / "rows-h.csv").write_text(text_of(rows))
    assert run("outside", "--dir", tmp_path).returncode == 0
    text = (tmp_path / "musts.md").read_text()
    assert text.startswith("7 of 7 bounds hold, 0 are missed.") and "| coverage of the 90 % interval near |" in text
    assert "over that of fixed strengths: no rows of the same surgeries" in text
    assert not (tmp_path / "outside-reliability.png").exists()
    (tmp_path / "rows-h.csv").write_text(text_of(every(rows, far_coverage_90=0.5)))
    fixed = tmp_path / "fixed.csv"
    fixed.write_text(text_of(every(rows, all_interval_mm=1.9)))
    done = run("outside", "--dir", tmp_path, "--fixed", fixed)
    assert done.returncode == 1 and "FAILS  outside: air-side: coverage of the 90 % interval far" in done.stdout
    assert "FAILS  outside: all truths: interval score over that of fixed strengths" in done.stdout
    assert "**missed** in 1 of 1: 0.5 (`air-side`)" in (tmp_path / "musts.md").read_text()


def test_reliability_is_drawn_where_the_rows_have_all_intervals(tmp_path, rows):
    more = {f"{part}_coverage_{one}": one / 100 for part in ("near", "far") for one in outside.INTERVALS}
    outside.publish(table_of(every(rows, **more)), Record(None), tmp_path, "abc")
    assert (tmp_path / "outside-reliability.png").stat().st_size > 5000
    assert f"/{tmp_path.name}/outside-reliability.png)" in (tmp_path / "reliability.txt").read_text()


def test_rows_of_own_truths_alone_are_bad_input(tmp_path, rows):
    (tmp_path / "rows-h.csv").write_text(text_of(every(rows, outside=0)))
    done = run("outside", "--dir", tmp_path)
    assert (done.returncode, done.stderr) == (2, f"studies outside: {tmp_path}: no truth from outside in rows-*.csv\n")
