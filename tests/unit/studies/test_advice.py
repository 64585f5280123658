# SPDX-License-Identifier: GPL-3.0-or-later
"""What is predicted against what is made, on rows whose answer is known."""
import pytest

HEADING = ("place,seed,scenario,state,candidate,kind,before_sd_mm,predicted_sd_mm,made_sd_mm,before_ratio,"
           "made_ratio,before_error_mm,made_error_mm,refused\n")


def surgery(seed, made):
    """Twelve candidates, a better one before a worse; `made`: the sd of each where it is not as predicted."""
    rows = ""
    for i in range(12):
        predicted = 0.4 + 0.04 * i
        rows += f"1,{seed},paper,half,c{i},sweep,1,{predicted},{made.get(i, predicted)},1,1,0.5,0.3,\n"
    return rows + f"1,{seed},paper,half,none,point,1,,,1,,0.5,,too few\n"


@pytest.fixture
def study(records):
    def judge(made):
        records.write("rows-a.csv", HEADING + "".join(surgery(seed, made(seed)) for seed in range(100)))
        status = records.run("advice")[0]
        return status, {check["name"].removeprefix("advice: "): check for check in records.summary()["checks"]}
    return judge


def test_a_prediction_that_comes_true_holds(study):
    status, checks = study(lambda seed: {})
    assert status == 0
    assert checks["best by brute force among the first two %"]["value"] == 100.0
    assert checks["predicted over made reduction of the first"]["value"] == pytest.approx(1.0)
    assert checks["surgeries left out"]["value"] == 0
    assert checks["sd lost by the first against the best p95 mm"]["value"] == 0.0


def test_a_best_that_stands_third_in_eleven_of_a_hundred_turns_it_red(study):
    status, checks = study(lambda seed: {2: 0.35} if seed < 11 else {1: 0.35})
    assert status == 1
    check = checks["best by brute force among the first two %"]
    assert check["value"] == 89.0 and check["pass"] is False
    assert checks["best by brute force is the first %"]["value"] == 0.0


def test_a_reduction_that_is_a_third_too_large_turns_it_red(study):
    status, checks = study(lambda seed: {0: 0.55})
    check = checks["predicted over made reduction of the first"]
    assert status == 1 and check["pass"] is False and check["value"] == pytest.approx(0.6 / 0.45)
    assert checks["first within 25 % of the made reduction %"]["value"] == 0.0


def test_no_rows_are_bad_input(records):
    records.write("rows-a.csv", HEADING)
    assert records.run("advice")[0] == 2
