# SPDX-License-Identifier: GPL-3.0-or-later
"""brainshift-bids with the programs themselves, on a made-up head and a coarse mesh."""
import pathlib
import shutil

import bids_tree
from conftest import PROGRAMS
from test_cohort import app, everything, table


def test_a_head_is_prepared_operated_on_and_scored(tmp_path):
    """Twice: on one processor with little memory, and elsewhere on all: the same tables, bit for bit."""
    bids = bids_tree.dataset(tmp_path / "ds")
    beside = bids_tree.subject(bids, "01")
    places = [(x, y, 25 + x / 2 * (y % 40 == 0)) for x in (10, 20, 30) for y in (-40, -20, 0)]
    (beside / "sub-01_landmarks.csv").write_text("".join(f"{x},{y},{z},{x + 0.3},{y},{z - 1.5}\n" for x, y, z in places))
    (beside / "sub-01_acq-b_landmarks.csv").write_text("1,2,3\n")
    (beside / "sub-01_acq-c_landmarks.csv").write_text("".join(f"{x},{y},30,{x},{y},29\n" for x, y, _ in places))
    how = ["participant", "--programs", PROGRAMS, "--edge-mm", 16]
    done = app(bids, tmp_path / "a", *how, "--n-cpus", 1, "--mem-mb", 3000, expect=2)
    assert len(done.stderr.splitlines()) == 1
    assert "sub-01: left out: 2 of 4 surgeries: acq-b: brainshift import" in done.stderr
    assert "acq-c: brainshift replay" in done.stderr and "lie in one plane" in done.stderr
    rows = table(tmp_path / "a" / "sub-01" / "sub-01_surgeries.tsv")
    assert [row["surgery"] for row in rows] == ["joint-sag", "landmarks"]
    assert float(rows[0]["tumour_recovered_pct"]) > 80.0
    assert 0.5 < float(rows[0]["coverage_90"]) <= 1.0
    assert rows[1]["tumour_error_mm"] == "n/a" and rows[1]["quality"] in ("good", "caution")
    page = (tmp_path / "a" / "sub-01" / "sub-01_report.html").read_text()
    assert "joint-sag" in page and "data:image/" in page

    for name in "bc":
        (beside / f"sub-01_acq-{name}_landmarks.csv").unlink()
    moved = pathlib.Path(shutil.move(bids, tmp_path / "elsewhere"))
    app(moved, tmp_path / "b", *how)
    app(moved, tmp_path / "b", "group")
    app(moved, tmp_path / "a", "group")
    (tmp_path / "a" / "group_leftout.tsv").unlink()
    (tmp_path / "b" / "group_leftout.tsv").unlink()
    assert everything(tmp_path / "a") == everything(tmp_path / "b")
    assert app("compare", tmp_path / "a", tmp_path / "b").returncode == 0
