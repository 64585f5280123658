# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows, checks, statistics, exit status."""
import gzip
import json
import math

import numpy as np
import pytest

from conftest import table
from studies import chart
from studies.__main__ import NAMES, run
from studies.checks import Check, Record, at_most, every_check_holds, summary_json
from studies.common import InputError, WriteError, write_file
from studies.rows import Table, csv_text, significant, study_rows
from studies.stats import (Interval, correlation, incomplete_beta, mean_std, over_patients, paired_t_test, pareto_front,
                           percentile, ratio_over_patients, t_quantile)

NONE = math.nan


def test_a_table_reads_cells_by_column():
    rows = table("a,b,c\r\n1.5,x,\n\n-2e-3,,7\n")
    assert len(rows) == 2
    assert rows[0].number("a") == 1.5 and rows[1].number("a") == -2e-3
    assert rows[0]["b"] == "x" and math.isnan(rows[0].number("c")), "an empty cell is no value"
    assert rows.has("c") and not rows.has("d")
    with pytest.raises(InputError, match="t.csv: has no column d"):
        rows[0].number("d")
    assert rows.mean("c") == 7.0 and math.isnan(table("a\n\n").mean("a"))


@pytest.mark.parametrize("text, column, says", [
    ("a,b\n1,2\n3\n", "a", "t.csv: line 3 has 1 cells, the heading has 2"),
    ("", "a", "t.csv: has no heading"),
    ("a\n1\n", "d", "t.csv: has no column d"),
    ("a\n1\nx\n", "a", 't.csv: line 3, column a: "x" is not a number'),
    ("a\n1_0\n", "a", 't.csv: line 2, column a: "1_0" is not a number')])
def test_a_bad_table_is_told_with_its_place(text, column, says):
    with pytest.raises(InputError, match="^" + says.replace("(", r"\(")):
        table(text).numbers(column)


def test_tables_are_joined_only_with_equal_headings(tmp_path):
    for name, text in (("1.csv", "a,b\n1,2\n"), ("2.csv", "a,b\n3,4\n"), ("3.csv", "b,a\n5,6\n")):
        (tmp_path / name).write_text(text)
    assert list(Table.read_all([tmp_path / "1.csv", tmp_path / "2.csv"]).numbers("b")) == [2, 4]
    with pytest.raises(InputError, match="3.csv: its columns are not those of"):
        Table.read_all([tmp_path / "1.csv", tmp_path / "3.csv"])
    with pytest.raises(InputError, match="cannot be opened"):
        Table.read(tmp_path / "none.csv")


def test_compressed_rows_are_read_as_others_are(tmp_path):
    packed = tmp_path / "rows-h.csv.gz"
    packed.write_bytes(gzip.compress(b"a\n7\n"))
    assert list(study_rows(tmp_path, ("a",)).numbers("a")) == [7]
    (tmp_path / "rows-h.csv").write_text("a\n7\n")
    with pytest.raises(InputError, match="rows-h.csv.gz: rows-h.csv stands beside it"):
        study_rows(tmp_path, ("a",))
    for content in (b"a\n7\n", gzip.compress(b"a\n7\n")[:-6]):
        packed.write_bytes(content)
        with pytest.raises(InputError, match="rows-h.csv.gz: is not what gzip writes"):
            Table.read(packed)


def test_rows_are_chosen_and_grouped_in_their_order():
    rows = table("s,k,v\nb,1,1\na,1,2\nb,2,\n")
    assert rows.values("s") == ["b", "a"]
    assert list(rows.groups("s", "k")) == [("b", "1"), ("a", "1"), ("b", "2")]
    assert len(rows.where(s="b")) == 2 and len(rows.where(lambda row: row.number("v") > 1, k="1")) == 1
    assert rows.largest("v") == 2 and list(rows.finite("v")) == [1, 2]
    with pytest.raises(InputError, match="has no column z"):
        rows.where(z="1")


def test_numbers_are_written_as_the_programs_write_them():
    assert [significant(value, 3) for value in (0.82533, 1630.2, 1.148e-11, 100, NONE)] == ["0.825", "1.63e+03", "1.15e-11", "100", ""]
    assert csv_text(("a", "b"), [("x", 1 / 3), ("y", NONE)]) == "a,b\nx,0.333333\ny,\n"


def test_a_value_that_was_not_measured_does_not_hold():
    assert at_most("n", 0.4, 0.4, "mm", "c") == Check("n", 0.4, "<= 0.4 mm", True, "c")
    assert not at_most("n", NONE, 0.4, "", "c").holds
    assert not every_check_holds([]) and not every_check_holds([Check("n", 1, "shown", None, "c")])
    assert every_check_holds([Check("n", 1, "shown", None, "c"), at_most("n", 1, 2, "", "c")])


def test_the_summary_has_null_without_a_value_and_no_verdict_without_a_bound():
    text = summary_json([Check("a", NONE, "<= 1", False, "c"), Check("b", 2, "shown", None, "c")], ["a part"])
    assert json.loads(text) == {"checks": [{"name": "a", "value": None, "bound": "<= 1", "pass": False, "command": "c"},
                                           {"name": "b", "value": 2.0, "bound": "shown", "command": "c"}],
                                "left_out": ["a part"]}
    assert text.startswith('{\n  "checks": [\n    {\n      "name": "a",') and text.endswith("}\n")


def test_a_record_refuses_what_no_cell_can_hold(tmp_path):
    for text in ("a,b", 'a"b', "a\nb"):
        record = Record(tmp_path)
        record.check("s", text, 1.0, "<= 1", True)
        with pytest.raises(ValueError):
            record.save()
    with pytest.raises(WriteError):
        Record(tmp_path / "none").save()


# Two-sided p of published tables: t = 2.571 at 5 degrees of freedom is 0.05, 4.032 is 0.01; 12.706 at 1
# is 0.05; 1.984 at 100 is 0.05.
def test_incomplete_beta_gives_the_tabled_quantiles_of_student():
    for t, freedom, p in ((2.5706, 5, 0.05), (4.0321, 5, 0.01), (12.7062, 1, 0.05), (1.98397, 100, 0.05)):
        assert incomplete_beta(freedom / 2, 0.5, freedom / (freedom + t * t)) == pytest.approx(p, abs=1e-5)
    assert incomplete_beta(0.5, 0.5, 0.5) == pytest.approx(0.5, abs=1e-14), "by symmetry, where both fractions meet"
    assert incomplete_beta(2, 3, 0) == 0 and incomplete_beta(2, 3, 1) == 1
    assert incomplete_beta(1, 1, 0.37) == pytest.approx(0.37, abs=1e-14), "uniform"


def test_the_paired_test_of_students_sleep_data():
    """Student 1908: ten pairs, t = -4.0621, p = 0.00283."""
    first = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
    second = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]
    test = paired_t_test(first, second)
    assert test.pairs == 10 and test.mean == pytest.approx(-1.58, abs=1e-12)
    assert test.t == pytest.approx(-4.0621, abs=1e-4) and test.p == pytest.approx(0.002833, abs=1e-6)


# Tables of Student's t: 12.706, 2.776, 1.984.
@pytest.mark.parametrize("freedom, quantile", [(1, 12.7062), (4, 2.77645), (100, 1.98397)])
def test_the_interval_over_patients_is_students(freedom, quantile):
    assert t_quantile(freedom) == pytest.approx(quantile, rel=1e-5)


def test_a_mean_over_patients_has_the_width_that_their_number_allows():
    found = over_patients([1, 2, 3, 4, 5, NONE])
    assert (found.mean, found.count) == (3, 5)
    half = 2.77645 * math.sqrt(2.5 / 5)
    assert (found.low, found.high) == (pytest.approx(3 - half, rel=1e-5), pytest.approx(3 + half, rel=1e-5))
    assert str(found) == "3; 1.04 to 4.96 over 5 patients"
    one = over_patients([2])
    assert (one.mean, one.low, one.high) == (2, -math.inf, math.inf) and str(one) == "2 of 1 patient"
    assert over_patients([NONE]).count == 0 and math.isnan(Interval().mean)


def test_ratios_are_averaged_as_factors():
    found = ratio_over_patients([0.5, 2, NONE, -1])
    assert (found.mean, found.count) == (pytest.approx(1), 2) and found.low == pytest.approx(1 / found.high)
    assert ratio_over_patients([3]).high == math.inf


def test_the_paired_test_leaves_missing_pairs_out_and_needs_two():
    test = paired_t_test([1, NONE, 3], [2, 5, NONE])
    assert (test.pairs, test.mean, test.p) == (1, -1, 1)
    assert paired_t_test([], []).pairs == 0
    assert paired_t_test([2, 3], [1, 2]).p == 0 and paired_t_test([2, 3], [2, 3]).p == 1


def test_the_pareto_front_is_what_no_other_point_beats():
    assert pareto_front([]) == []
    assert pareto_front([(3, 1), (1, 3), (2, 2), (3, 3), (2, 4)]) == [1, 2, 0]
    assert pareto_front([(1, 1), (1, 1), (1, 2), (2, 1)]) == [0], "ties"
    assert pareto_front([(NONE, 0), (0, NONE), (-math.inf, 1), (1, 1)]) == [3]
    points = np.random.default_rng(11).random((200, 2))
    front = [i for i, one in enumerate(points)
             if not any((other <= one).all() and (other != one).any() for other in points)]
    assert len(front) > 2 and sorted(pareto_front(points)) == front


def test_percentiles_lie_between_the_values_next_to_the_rank():
    assert percentile([4, 1, 3, 2], 50) == 2.5 and percentile([1, 2], 95) == pytest.approx(1.95)
    assert math.isnan(percentile([], 50)) and percentile([7], 99) == 7
    assert mean_std([]) == (0, 0) and mean_std([3]) == (3, 0) and mean_std([1, 3])[1] == pytest.approx(math.sqrt(2))


def test_correlation_is_pearsons():
    assert correlation([1, 2, 3], [2, 4, 6]) == pytest.approx(1) and correlation([1, 2, 3], [3, 2, 1]) == pytest.approx(-1)
    assert correlation([1, 2, 3], [1, 3, 1]) == pytest.approx(0) and math.isnan(correlation([1, 1], [1, 2]))


def test_log_axes_have_three_to_nine_round_ticks():
    for low, high in ((0.01, 1e4), (5000, 19000), (1e-16, 1e9), (0.9, 1.1e3)):
        ticks = chart.log_ticks(low, high)
        assert 3 <= len(ticks) <= 9 and low <= min(ticks) and max(ticks) <= high


def test_a_picture_keeps_the_styles_colours_and_is_small(tmp_path):
    fig, ax = chart.figure("t")
    for k, colour in enumerate(chart.COLOURS):
        ax.axhspan(k, k + 1, color=colour)
    chart.label(ax, "x (mm)", "y (mm)")
    chart.save(fig, tmp_path / "p.png")
    image = chart.Image.open(tmp_path / "p.png")
    assert image.mode == "P" and (tmp_path / "p.png").stat().st_size < 60_000
    there = {colour for _, colour in image.convert("RGB").getcolors()}
    assert {tuple(bytes.fromhex(one[1:])) for one in (*chart.COLOURS, "#ffffff")} <= there


def test_a_file_is_written_whole_or_told(tmp_path):
    write_file(tmp_path / "f", "text")
    assert (tmp_path / "f").read_text() == "text" and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(WriteError, match="cannot be written"):
        write_file(tmp_path / "no" / "f", "text")


def test_bad_usage_is_told_in_one_line(capsys):
    assert "summary" in NAMES and "bench" in NAMES and "rows" not in NAMES
    for arguments in ([], ["nothing"], ["summary"], ["summary", "--colour", "red"], ["summary", "--dir", "/nowhere"]):
        assert run(arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1
