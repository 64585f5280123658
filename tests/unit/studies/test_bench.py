# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks, tables and pictures of `make bench`; BENCHMARK.md says what its raw files say."""
import json
import math

import pytest

from conftest import SOURCE
from studies.bench import Results, checks, machine_line, summary_json, tables, update_table

HEADING = ("mesh,nodes,scenario,method,prior,rank,start,repetition,time_ms,time_over_tsolve,cross_mm,field_mean_mm,"
           "field_max_mm,recovery_pct,active,iterations,status,coverage_90,t_solve_ms\n")
ROWS = HEADING + """\
18k,18000,paper,condensed,case,64,warm,1,4,0.4,0.20,0.3,0.9,90,10,2,converged,0.9,10
18k,18000,paper,condensed,case,64,warm,2,6,0.6,0.10,0.3,0.9,90,12,2,deadline,0.9,10
18k,18000,paper,condensed,case,128,warm,1,10,1.0,0.20,0.3,0.9,90,10,2,converged,0.9,10
18k,18000,paper,condensed,case,128,warm,2,20,2.0,0.10,0.3,0.9,90,10,2,converged,0.9,10
18k,18000,paper,condensed,case,128,warm,3,30,3.0,0.30,0.3,0.9,90,10,2,converged,0.9,10
18k,18000,paper,paper,case,,cold,1,40000,4000,0.25,0.4,1.0,88,11,19,converged,,10
18k,18000,paper,paper,paper,,cold,1,50000,5000,0.45,0.4,1.0,88,11,19,converged,,10
18k,18000,paper,pcg,case,,cold,1,60000,6000,,,,,,,stopped,,10
"""


@pytest.fixture
def results_of(folder):
    def of(rows=HEADING):
        folder.write("error_time-1.csv", rows)
        return Results(folder.path)
    return of


def named(results, part):
    return next(check for check in checks(results, "out") if part in check.name)


def run_with(p50_ms, t_solve_ms, active):
    return {"latency_ms": {"p50": p50_ms}, "cold_ms": 2 * p50_ms, "full_solve_ms": t_solve_ms, "contact": {"active": active}}


def test_times_are_medians_and_errors_those_of_shared_repetitions(results_of):
    results = results_of(ROWS)
    assert len(results.methods) == 5
    most = results.find("18k", "paper", "condensed", "warm")
    assert most.rank == 128, "the largest unless asked for another"
    assert (most.p50_ms, most.max_ms) == (20, 30)
    assert most.compared == 1, "the paper's method has the first repetition only"
    assert most.errors["cross_mm"] == 0.20
    assert results.find("18k", "paper", "condensed", "warm", rank=64).status == "1 of 2 converged"
    stopped = results.find("18k", "paper", "pcg", "cold")
    assert stopped.status == "stopped" and math.isnan(stopped.errors["cross_mm"])
    assert math.isnan(stopped.p50_ms) and stopped.max_ms == 60000, "a time limit is no run time"
    assert results.find("40k", "paper", "condensed", "warm") is None
    assert results.find("18k", "paper", "paper", "cold", "paper").p50_ms == 50000, "the paper's prior is a row of its own"


def test_what_was_not_measured_does_not_pass(results_of):
    found = checks(results_of(), "out")
    assert found and not any(check.holds for check in found) and all(math.isnan(check.value) for check in found)
    summary = json.loads(summary_json(found, ["a part"]))
    assert summary["checks"][0]["value"] is None and summary["checks"][0]["pass"] is False
    assert summary["left_out"] == ["a part"]


def surgeries(count, paper_ms, paper_mm, condensed_mm, condensed_field_mm=None):
    """By the condensed method and by Woodbury's form; two of them by the paper's method too."""
    rows = [HEADING]
    for i in range(1, count + 1):
        of_surgery = [("condensed", "116", 20, condensed_mm, condensed_field_mm or condensed_mm),
                      ("paper-woodbury", "", 0.4 * paper_ms, paper_mm, paper_mm)]
        for method, rank, ms, mm, field_mm in of_surgery + [("paper", "", paper_ms, paper_mm, paper_mm)] * (i <= 2):
            rows += [f"{mesh},paper,{method},case,{rank},cold,{i},{ms},4000,{mm + 0.01 * i},{field_mm + 0.02 * i},1.0,88,11,19,"
                     "converged,0.9,10\n" for mesh in ("5k,5000", "18k,18000")]
    return "".join(rows)


def test_the_ratio_to_the_paper_needs_errors_that_are_not_larger_over_twenty_surgeries(results_of):
    def check(*arguments, method="paper, the case"):
        return named(results_of(surgeries(*arguments)), method)

    good = check(20, 60000, 0.25, 0.25)
    assert good.holds and good.value == 3000 and "over 20 surgeries" in good.name
    assert check(20, 60000, 0.25, 0.25, method="paper-woodbury, the case").holds
    assert not check(20, 60000, 0.25, 0.26).holds, "a greater error"
    assert not check(20, 60000, 0.25, 0.26, 0.25).holds and not check(20, 60000, 0.25, 0.25, 0.26).holds, "in one of both"
    assert not check(20, 59000, 0.25, 0.25).holds, "2,950 times"
    assert not check(19, 60000, 0.25, 0.25).holds, "too few surgeries"
    assert not check(20, 60000, 0.25, 0.25, method="paper, the paper").holds, "nothing by the paper's prior"


def test_times_are_in_units_of_the_solve_of_the_same_report(results_of):
    results = results_of()
    results.runs = {"sag-progress": run_with(4, 10, 400), "sag-progress@Haswell": run_with(5, 10, 400),
                    "region": run_with(2, 10, 0), "no-contact": run_with(4, 10, 0), "cold-1": run_with(6, 10, 501),
                    "cold-2": run_with(7, 10, 900), "cold-3": run_with(50, 10, 900), "cold-1@Haswell": run_with(1, 10, 500)}
    assert named(results, "warm update with contact").value == 0.4 and named(results, "warm update with contact").holds
    other = named(results, "warm update with contact, p50 / t_solve, BLAS kernel Haswell")
    assert other.value == 0.5 and not other.holds
    assert not named(results, "region of 40 mm").holds, "nothing pressed"
    assert named(results, "first update").value == 1.4 and named(results, "first update").holds, "the median of three sessions"
    assert not named(results, "median / t_solve, BLAS kernel Haswell").holds, "too few press"
    assert not named(results, "update without contact").holds, "0.4 is above 0.2"


def test_the_slowest_updates_are_bound_at_their_tail_too(results_of):
    results = results_of()
    slow = run_with(14, 10, 900)
    slow["latency_ms"]["p95"] = 31
    results.runs = {"distension": run_with(26, 10, 900), "joint-mixed": slow}
    held = {part: named(results, part).holds for part in ("swelling that presses", "sag, swelling and shrinkage", "the same, p95")}
    assert held == {"swelling that presses": False, "sag, swelling and shrinkage": True, "the same, p95": False}


def test_the_first_field_is_the_provisional_one_where_that_comes_sooner(results_of):
    results = results_of()
    results.runs = {"sag-progress": run_with(4, 10, 400)}
    assert named(results, "first field").value == 0.4 and not named(results, "first field").holds
    results.runs["sag-progress"]["first_iterate_ms"] = 2
    assert named(results, "first field").value == 0.2 and named(results, "first field").holds
    results.runs["sag-progress"]["first_iterate_ms"] = 9
    assert named(results, "first field").value == 0.4, "of the few that were long"


def test_a_deadline_holds_for_the_first_update_too(results_of):
    results = results_of()
    hurried = {"cold_ms": 121, "latency_ms": {"max": 110}}
    results.runs = {"distension-100ms": hurried}
    assert math.isnan(named(results, "deadline").value), "one of the two surgeries is missing"
    results.runs["joint-mixed-100ms"] = {"cold_ms": 90, "latency_ms": {"max": 119}}
    assert named(results, "deadline").value == 121 and not named(results, "deadline").holds
    hurried["cold_ms"] = 100
    assert named(results, "deadline").value == 119 and named(results, "deadline").holds


def test_tail_and_memory_need_their_number_of_updates(results_of):
    results = results_of()
    results.latency_ms["sag-progress"] = [5.0] * 1999
    results.facts = {"rss_before_bytes": 1e9, "rss_after_bytes": 1e9, "growth_updates": 10000}
    assert named(results, "p99").holds and named(results, "growth").holds
    results.latency_ms["sag-progress"].pop()
    results.facts["growth_updates"] = 9999
    assert not named(results, "p99").holds and not named(results, "growth").holds


@pytest.mark.parametrize("coverages, value, holds", [((0.75, 1.0), 0.875, True), ((0.75, 0.8), 0.775, False),
                                                     ((0.97, 1.0), 0.985, False)])
def test_coverage_is_the_mean_over_all_surgeries_of_the_method(results_of, coverages, value, holds):
    rows = "".join(f"18k,18000,paper,condensed,case,116,cold,{i},20,2,0.2,0.3,1.0,88,11,9,converged,{one},10\n"
                   for i, one in enumerate(coverages))
    check = named(results_of(HEADING + rows), "within the 90 % interval")
    assert check.value == pytest.approx(value) and check.holds == holds


def test_a_mesh_that_is_left_out_is_not_checked(results_of):
    results = results_of()
    count = len(checks(results, "out"))
    results.left_out = ["mesh of 100 thousand nodes: not among SIZES=5,18"]
    assert len(checks(results, "out")) == count - 3
    results.left_out = ["100 thousand nodes: all methods but condensed; three surgeries"]
    assert len(checks(results, "out")) == count, "the mesh was measured"


@pytest.mark.parametrize("rows, value, holds", [
    ("paper,contact,0,1,0.5,1.0,1,1\npaper,uncertainty,0,1,0.005,0,1,1\n", 0.5, True),
    ("paper,contact,0,1,0.5,1.0,1,1\npaper,far_field,0,1,0.5,0.4,1,1\n", 1.25, False),
    ("paper,contact,0,1,0.5,0,1,1\n", math.nan, False)])
def test_what_is_left_out_changes_no_more_than_its_estimate(folder, results_of, rows, value, holds):
    folder.write("scenes.csv", "scenario,left_out,active,largest_mm,difference_mm,estimate_mm,invert_ms,rebuild_ms\n" + rows)
    check = named(results_of(), "leaving out")
    assert check.value == pytest.approx(value, nan_ok=True) and check.holds == holds


def test_results_are_what_the_script_leaves_behind(folder):
    folder.write("machine.txt", "a processor; commit abc\n")
    folder.write("left_out.csv", "this\nand that\n")
    folder.write("stages.csv", "surgery,stage,p50_ms,over_tsolve,times\nshort,contact,3,0.3,2\n")
    folder.write("limits.csv", "surgery,p50_ms,active,rows,bytes,operations,limit_ms,bytes_per_s,operations_per_s\n"
                 "short,30,400,600,52428800,2e8,3,1.7e10,1.1e11\n")
    folder.write("peers.csv", "code,seconds,mean_mm,max_mm\nhere: factor,1.25,,\nanother code,120,0.07,1.4\n")
    folder.write("run-short.json", json.dumps([run_with(3, 10, 5)]))
    folder.write("latency-short.csv", "update,latency_ms\n1,9\n2,\n3,4\n")
    results = Results(folder.path)
    text = tables(results, checks(results, "out"))
    assert "a processor; commit abc" in text and "| contact | 0.3 |" in text and "- and that" in text
    assert "reads 17 GB/s and makes 110 billion" in text and "| short | 400 | 600 | 30 | 50 | 200 | 3 | 10 |" in text
    assert "| here: factor | 1.25 | - | - |" in text and "| another code | 120 | 0.07 | 1.4 |" in text
    assert list(results.latency_ms["short"]) == [4], "without the first update and what has no time"


def test_the_largest_rank_is_compared_with_the_direct_posterior(folder):
    folder.write("direct-distension.json", '{"reduced": [{"rank": 32, "max_mm": 0.5}, {"rank": 128, "max_mm": 0.002}]}')
    folder.write("prepare.json", '{"total_s": 12.5, "mesh": {"nodes": 7}, "peak_memory_bytes": 100}')
    folder.write("prepare-100k.json", '{"total_s": 340, "mesh": {}}')
    results = Results(folder.path)
    assert results.fact("direct_max_mm distension") == 0.002
    assert math.isnan(results.fact("direct_max_mm paper")) and math.isnan(results.fact("model_file_bytes"))
    assert results.fact("prepare_s") == 12.5 and results.fact("large_prepare_s") == 340
    for text, says in (("[", "direct-paper.json: is not JSON"), ("{}", 'has no array "reduced"'), ("[]", "must be a JSON object")):
        folder.write("direct-paper.json", text)
        folder.is_refused("bench", says=says)


def test_bad_input_is_refused_in_one_line(folder):
    folder.is_refused("bench", "--dir", "/nowhere", says="the folder does not exist")
    folder.write("stages.csv", "surgery,stage\n")
    folder.is_refused("bench", says="stages.csv: has no column over_tsolve")


def test_missing_measurements_end_with_1_and_figures_alone_with_0(folder):
    folder.write("error_time-18k.csv", ROWS)
    assert folder.run("bench", "--figures-only")[0] == 0 and (folder.path / "error_time-18k-paper.png").exists()
    assert not (folder.path / "summary.json").exists()
    status, output, _ = folder.run("bench")
    assert status == 1 and "FAILS  warm update with contact" in output
    assert "| not measured |" in folder.text("tables.md")


def test_the_machine_is_told_with_the_daemons_kernel(folder):
    line = machine_line({"blas_kernel": "Haswell"}, "abc")
    assert ", BLAS kernel Haswell; memory " in line and line.endswith(" GiB; commit abc")
    folder.write("status.json", '{"blas_kernel": "Zen"}')
    assert folder.run("bench", "--machine", str(folder.path / "status.json"), "--commit", "abc")[0] == 0
    assert "BLAS kernel Zen" in folder.text("machine.txt")


def test_the_table_of_the_page_marks_what_is_above_its_bound(folder):
    folder.write("limits.csv", "surgery,p50_ms,active,rows,bytes,operations,limit_ms,bytes_per_s,operations_per_s\n"
                 "short,30,400,600,52428800,2e8,3,1.7e10,1.1e11\n")
    folder.write("run-sag-progress.json", json.dumps([run_with(3, 10, 400)]))
    folder.write("run-no-contact.json", json.dumps([run_with(3, 10, 0)]))
    text = update_table(Results(folder.path))
    assert "| sag, contact | 400 | 10 | 6 | 3 | - | - | - | 0.3 | - | 0.45 | 50 | 200 | 3 |" in text
    assert "| no contact | 0 | 10 | 6 | 3 | - | - | - | **0.3** | - | 0.2 | - | - | - |" in text


def test_the_page_has_the_tables_of_its_raw_files():
    results = Results(SOURCE / "docs" / "benchmark")
    found = checks(results, "out/bench")
    assert tables(results, found) == (SOURCE / "docs/benchmark/tables.md").read_text()
    assert update_table(results) in (SOURCE / "BENCHMARK.md").read_text()
    assert json.loads(summary_json(found, results.left_out)) == json.loads((SOURCE / "docs/benchmark/summary.json").read_text())
