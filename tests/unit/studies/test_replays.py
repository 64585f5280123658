# SPDX-License-Identifier: GPL-3.0-or-later
"""replays.py: on committed rows and docs/replays.md, and on tables made by hand."""
import math
import shutil

import pytest

from made_up import DOCS, SOURCE, Verdicts, run, table_of, text_of
from studies import replays
from studies.common import InputError
from studies.replays import STAGES
from studies.rows import Table

FOLDER = DOCS / "replays"
ROWS = FOLDER / "rows-colin27.csv"
CORPUS = SOURCE / "tests" / "replays" / "corpus-colin27.csv"
EVEN = (40, 20, 20, 20, 20)
LATENCIES = (500, 60, 20, 50, 30, 40)  # a cold one, then 20 to 60


def passes(latencies, speed="1x", name="1"):
    """One pass; every other stage takes a tenth of the latency. t_solve is 10."""
    return [{"head": "h", "nodes": 100, "kernel": "Any", "surgery": "sag", "seed": 1, "speed": speed, "pass": name,
             "update": n, "sequence": n, "source": "ius", "outcome": "field", "usual_ms": 10, "late": 0,
             "quality": "good", "deadline": 0, "t_solve_ms": 10, "latency_ms": latency,
             **{f"{stage}_ms": f"{0.1 * latency:.6g}" for stage in STAGES[:-1]},
             "sent_late_ms": 0.1 if speed == "1x" else "", "difference_mm": 0.001 if speed == "max" else ""}
            for n, latency in enumerate(latencies, start=1)]


@pytest.fixture
def good():
    return passes(EVEN) + passes(EVEN, "max")


def without_field(row):
    return {key: value if key in ("surgery", "speed", "update") else "" for key, value in row.items()} | {
        "outcome": "superseded"}


def checked(rows):
    return Verdicts(lambda record: replays.check_replays(table_of(rows), record))


def regression(now, committed):
    columns = list(now[0])
    return Verdicts(lambda record: replays.check_regression(
        table_of(now), table_of(committed) if committed else Table(columns), record))


def verdict(found, begin):
    return next((line.split(",")[4] for line in found.lines if line.startswith(begin)), None)


def latency_of(rows):
    return [one for one in replays.stage_times(table_of(rows)) if one.stage == "latency"]


def test_committed_rows_give_the_committed_tables():
    rows, page = Table.read(ROWS), (DOCS / "replays.md").read_text()
    assert replays.percentiles(rows) == (FOLDER / "percentiles.csv").read_text()
    tables = replays.latency_tables(rows)
    assert tables.startswith("18070 nodes, t_solve 35.5 ms, OpenBLAS kernel Cooperlake.\n\n| surgery |")
    assert tables.partition("\n\n")[2] in page


def test_stage_times_interpolate_without_the_cold_update():
    one, = latency_of(passes(LATENCIES))
    assert (one.updates, one.p50_ms, one.max_ms, one.p50_solves) == (5, 40, 60, 4)
    # 95 %: four fifths of the way from 50 to 60
    assert (one.p95_ms, one.p99_ms, one.p95_solves) == pytest.approx((58, 59.6, 5.8))
    assert replays.stage_times(table_of(passes(LATENCIES)))[4].p50_ms == 4  # journal


def test_stage_times_are_divided_by_the_solve_of_their_own_row():
    slow = [{**row, "t_solve_ms": 40} for row in passes((1, 80, 80), name="2")]  # four times as slow all over
    one, = latency_of(passes((1, 20, 20)) + slow)
    assert one.p50_solves == one.p95_solves == 2


def test_stage_times_keep_speeds_and_surgeries_apart():
    other = [{**row, "surgery": "other"} for row in passes((1, 7, 7))]
    found = latency_of(passes((1, 20, 20)) + passes((1, 5, 5), "max") + other)
    assert [(one.surgery, one.speed, one.p50_ms) for one in found] == [("sag", "1x", 20), ("sag", "max", 5),
                                                                        ("other", "1x", 7)]


def test_observations_without_a_field_have_no_times():
    rows = passes(LATENCIES)
    rows[1] = without_field(rows[1])
    assert latency_of(rows)[0].updates == 4


def test_jitter_is_the_spread_of_the_latency():
    rows = passes(LATENCIES)
    rows[3]["sent_late_ms"] = 1.5
    one = replays.jitter(table_of(rows))["sag", "1x"]
    assert (one.cold_p50_ms, one.sent_late_ms) == (500, 1.5)
    assert (one.spread_ms, one.sd_ms) == pytest.approx((18, math.sqrt(250)))
    assert math.isnan(replays.jitter(table_of(passes(LATENCIES, "max")))["sag", "max"].sent_late_ms)


def test_ratios_are_in_units_of_the_solve():
    slower = [{**row, "t_solve_ms": 20} for row in passes((1, 60, 60, 60))]  # half of that is the machine
    ratios = replays.stage_ratios(table_of(slower), table_of(passes((1, 20, 20, 20))))
    assert len(ratios) == 2 * len(STAGES) and ratios[-1] == ("latency", "p95", 3, 2, 1.5)


def test_what_takes_next_to_nothing_has_no_ratio_of_its_own():
    of = lambda journal_ms: table_of([{**row, "journal_ms": journal_ms} for row in passes((1, 20, 20))])
    ratios = replays.stage_ratios(of(0.4), of(0.01))
    assert len(ratios) == 2 * (len(STAGES) - 1) and "journal" not in [one[0] for one in ratios]
    assert max(one[-1] for one in replays.stage_ratios(of(5), of(0.01))) == 10  # 0.5 solves over the floor of 0.05


@pytest.mark.parametrize("column, text", [("head", "other"), ("nodes", 101), ("seed", 2), ("source", "tracks"),
                                          ("sequence", 9)])
def test_runs_need_the_same_head_mesh_and_observations(column, text):
    rows = passes((1, 20, 20))
    now, other = table_of(rows), table_of([{**row, column: text} for row in rows])
    assert replays.not_comparable(now, now) == "" and replays.not_comparable(now, Table()) == "no committed rows of it"
    assert replays.not_comparable(now, other) and replays.stage_ratios(now, other) == []


def test_more_passes_of_the_same_observations_can_be_compared():
    once = passes((1, 20, 20))
    assert replays.not_comparable(table_of(once), table_of(once + passes((1, 20, 20), name="2"))) == ""


def test_everything_sent_is_accounted_for(good):
    name = "observations that nothing accounts for"
    for outcome, expected in (("field", "1"), ("superseded", "1"), ("empty_set", "1"), ("", "0"), ("unavailable", "0")):
        good[2]["outcome"] = outcome
        found = checked(good)
        assert verdict(found, f"1x,{name}") == expected and verdict(found, f"max,{name}") == "1"


def test_an_old_field_must_be_marked(good):
    name = "1x,fields later than 3 x the median"
    for cells, expected in (({"latency_ms": 59}, "1"), ({"latency_ms": 61}, "0"), ({"late": 1}, "1"),
                            ({"late": 0, "usual_ms": 0}, "1")):  # last: too few answers before it to tell
        good[3].update(cells)
        assert verdict(checked(good), name) == expected
    assert checked(good).values["the same before a session has enough answers to tell"] == 0  # of max, the last
    assert any(line.startswith("1x,the same before a session has enough answers to tell,1,")
               for line in checked(good).lines)


def test_the_median_is_that_of_the_session(good):
    assert verdict(checked(good + passes((400, 200, 200, 200, 200), name="2")), "1x,fields later than") == "1"


def test_deadlines_are_bound_at_the_recorded_times_alone(good):
    good[9]["deadline"] = 1  # at full speed
    assert verdict(checked(good), "max,missed deadlines") == "" and verdict(checked(good), "1x,missed deadlines") == "1"
    good[4]["deadline"] = 1
    assert verdict(checked(good), "1x,missed deadlines") == "0"


def test_fields_of_the_same_evidence_agree(good):
    name = "both speeds,fields of the same evidence"
    assert verdict(checked(good), name) == "1"
    good[7]["difference_mm"] = 0.011
    assert verdict(checked(good), name) == "0"
    found = checked([{**row, "difference_mm": ""} for row in good])
    assert verdict(found, name) is None and found.left_out[0].startswith("both speeds,")


def test_no_stage_is_more_than_half_as_slow_again(good):
    name = "sag 1x,slowest stage over the committed run"
    for invert, expected in ((2, "1"), (2.9, "1"), (3.1, "0")):
        now = [{**row, "invert_ms": invert} for row in good[:5]] + good[5:]
        found = regression(now, good)
        assert verdict(found, name) == expected and verdict(found, name.replace("1x", "max")) == "1"
    assert any("(invert p50: 0.31 t_solve now; 0.20 committed)" in line for line in found.lines)
    now = [{**row, "invert_ms": 5.9, "t_solve_ms": 20} for row in good[:5]]  # a slower machine
    assert verdict(regression(now, good), name) == "1"


def test_one_slow_update_of_twenty_is_seen_at_the_tail():
    even = passes([20] * 21)
    now = [{**row, "latency_ms": 90} if i in (5, 6) else row for i, row in enumerate(even)]
    found = regression(now, even)
    assert verdict(found, "sag 1x,slowest stage") == "0" and "latency p95" in found.lines[0]


def test_without_comparable_rows_the_comparison_is_left_out(good):
    assert regression(good, []).left_out == ["regression,no rows of an earlier run are kept for this head"]
    found = regression(good, passes(EVEN))
    assert verdict(found, "sag 1x,slowest stage") == "1" and verdict(found, "sag max,slowest stage") is None
    assert found.left_out == ["sag max,regression: no committed rows of it"]
    found = regression(good, [{**row, "head": "another"} for row in good])
    assert found.left_out[0] == "sag 1x,regression: head is h; that of the committed rows another"


def entry(sequence):
    return {"surgery": "sag", "seed": 9, "sequence": sequence, "source": "ius", "recorded_ns": 750000000 * sequence,
            "acquired_ns": 30000000000 * sequence, "coordinates": 6, "mean_mm": 3.7 * sequence, "ordered_mm": -0.5,
            "crc32": 7 * sequence}


THREE = [entry(1), entry(2), entry(3)]


@pytest.mark.parametrize("cells, text", [
    ({"seed": 8}, "observation 2: seed 8, committed 9"), ({"source": "tracks"}, "of tracks, committed of ius"),
    ({"recorded_ns": 1500000001}, "recorded at 1500000001 ns"), ({"acquired_ns": 60000000001}, "acquired at 60000000001 ns"),
    ({"coordinates": 7}, "7 coordinates, committed 6"), ({"mean_mm": 7.40001}, "mean and ordered mean 7.40001"),
    ({"ordered_mm": -0.6}, "mean"), ({"surgery": "other"}, "is not in the committed table")])
def test_every_kind_of_change_of_the_corpus_is_a_difference(cells, text):
    made = [THREE[0], {**THREE[1], **cells}, THREE[2]]
    assert text in replays.compare_corpora(table_of(THREE), table_of(made))[2][0]


def test_rounding_is_no_change_of_the_corpus_and_a_missing_observation_is():
    made = [{**THREE[0], "mean_mm": 3.7 + 1e-8, "crc32": 1}, THREE[1]]
    assert replays.compare_corpora(table_of(THREE), table_of(made)) == (1, 1, ["sag, observation 3: is missing"])


@pytest.mark.parametrize("bad", ["soon", "", "-1", "0.5", "nan"])
def test_a_corpus_whose_number_is_none_names_its_line(bad):
    with pytest.raises(InputError, match="table: line 3, column recorded_ns"):
        replays.entries_of(table_of([THREE[0], {**THREE[1], "recorded_ns": bad}]))


def test_a_changed_corpus_is_red():
    def found(committed, made):
        return Verdicts(lambda record: replays.check_corpus(committed, table_of(made), record))
    assert verdict(found(table_of(THREE), THREE), "corpus,") == "1"
    red = found(table_of(THREE), [{**THREE[0], "mean_mm": 1}, *THREE[1:]])
    assert verdict(red, "corpus,") == "0" and "; first: sag; observation 1: mean" in red.lines[0]
    assert found(None, THREE).left_out == ["corpus,no table of its observations is kept for this case"]


def test_the_command_judges_against_the_committed_run(tmp_path, good):
    shutil.copy(ROWS, tmp_path)
    shutil.copy(CORPUS, tmp_path / "corpus.csv")
    done = run("replays", "--dir", tmp_path, "--committed-rows", ROWS, "--committed-corpus", CORPUS)
    assert done.returncode == 0 and done.stdout.count("\nok ") + done.stdout.startswith("ok") == 17
    for name in ("replays-latency.png", "replays-stages.png"):
        assert 5_000 < (tmp_path / name).stat().st_size < 60_000
    assert (tmp_path / "percentiles.csv").read_text() == (FOLDER / "percentiles.csv").read_text()


def test_a_missed_deadline_ends_with_1_and_a_missing_column_with_2(tmp_path, good):
    shutil.copy(CORPUS, tmp_path / "corpus.csv")
    good[4]["deadline"] = 1
    (tmp_path / "rows-h.csv").write_text(text_of(good))
    done = run("replays", "--dir", tmp_path)
    assert done.returncode == 1 and "FAILS  1x: missed deadlines" in done.stdout
    (tmp_path / "rows-h.csv").write_text(text_of([{k: v for k, v in row.items() if k != "usual_ms"} for row in good]))
    done = run("replays", "--dir", tmp_path)
    assert (done.returncode, done.stderr) == (2, f"studies replays: {tmp_path}/rows-h.csv: has no column usual_ms\n")
