# SPDX-License-Identifier: GPL-3.0-or-later
"""`brainshift advise` as a user runs it, on the coarse head and the paper's simulated surgery."""
import json

import pytest
from programs import brainshift, good, refused, write


@pytest.fixture
def advise(inputs):
    head = inputs / "head"
    return lambda *more: brainshift("advise", head / "paper.surgery", "--model", head / "model.h5", *more)


def test_the_table_the_json_and_the_picture_say_the_same(folder, advise):
    done = good(advise("--picture", folder / "advice.png"))
    lines = done.stdout.splitlines()
    assert lines[0].startswith("tumour boundary: sd ") and " of ius" in lines[0]
    assert max(map(len, lines)) <= 100
    assert lines[-1] == f"wrote {folder / 'advice.png'}"
    assert (folder / "advice.png").read_bytes().startswith(b"\x89PNG")
    told = json.loads(good(advise("--json")).stdout)
    usable = [one for one in told["candidates"] if one["reduction_mm"] is not None]
    assert len(usable) >= 10
    assert [one["rank"] for one in told["candidates"]] == list(range(1, len(told["candidates"]) + 1))
    assert usable == sorted(usable, key=lambda one: -one["reduction_mm"])
    for one, line in zip(usable, lines[2:]):
        assert one["name"] in line and f"{one['sd_after_mm']:.3f}" in line
        assert one["sd_before_mm"] - one["sd_after_mm"] == pytest.approx(one["reduction_mm"])
        assert one["reduction_mm"] > 0.0


def test_a_pointer_at_the_target_beats_one_far_from_it(folder, advise):
    where = json.loads(good(advise("--json")).stdout)["target"]["centre_mm"]
    table = write(folder / "c.csv", "name,kind,x,y,z,radius_mm\n"
                  f"away,point,{where[0]},{where[1] - 30},{where[2]},\nthere,point,{where[0]},{where[1]},{where[2]},\n")
    told = json.loads(good(advise("--json", "--candidates", table, "--target", *where)).stdout)
    assert [one["name"] for one in told["candidates"]] == ["there", "away"]


def test_what_is_wrong_is_one_line(folder, inputs, advise):
    refused(advise("--observations", 99), "--observations is 99, but", "holds")
    refused(advise("--target", 300, 0, 0), "target (300.0, 0.0, 0.0) mm: point", "outside the brain")
    refused(advise("--target", 0.03, 0.01, 0.02), "--target 0.03 0.01 0.02", "in metres it would be (30.0, 10.0, 20.0)")
    refused(advise("--candidates", folder / "none.csv"), folder / "none.csv")
    refused(brainshift("advise", inputs / "toy" / "a.surgery", "--model", inputs / "head" / "model.h5"), "meta.model_id is")
