# SPDX-License-Identifier: GPL-3.0-or-later
"""sensing.py: on committed records, and pictures of rows made by hand."""
import shutil

import pytest

from made_up import DOCS, run, table_of, text_of
from studies import sensing
from studies.checks import summarise
from studies.common import InputError

FOLDER = DOCS / "sensing"


def slice_of(width, height):
    return [{"x_mm": 0.5 * x, "y_mm": 0.5 * y, "brainshift": 10 * x + y, "PLUS": 10 * x} for x in range(width)
            for y in range(height)]


def joint():
    return [{"scenario": scenario, "seed": seed, "newest_source": source, "tumour_mm": 0.1 * seed, "craniotomy_mm": 0.3,
             "craniotomy_vector_mm": 0.4, "coverage_90": 0.9}
            for scenario in ("joint-sag", "joint-mixed") for seed in (1, 2) for source in sensing.SOURCES]


def test_committed_records_give_the_committed_summary(tmp_path):
    for name in ("checks.csv", "left_out.csv"):
        shutil.copy(FOLDER / name, tmp_path)
    tables = (FOLDER / "tables.md").read_text()
    assert not summarise(tmp_path, tables.split(";")[0].removeprefix("Commit "), "make sensing")  # three bounds are missed
    assert (tmp_path / "summary.json").read_text() == (FOLDER / "summary.json").read_text()
    assert (tmp_path / "tables.md").read_text() == tables


@pytest.mark.parametrize("holds, status", [("1", 0), ("0", 1)])
def test_the_command_draws_surgeries_and_slices(tmp_path, holds, status):
    (tmp_path / "points.csv").write_text("study,series,x_name,y_name,x,y\n")
    (tmp_path / "checks.csv").write_text(f"study,name,value,bound,pass,source\njoint,ratio,0.4,<= 0.5,{holds},twin\n")
    (tmp_path / "left_out.csv").write_text("study,reason\n")
    (tmp_path / "slice_spine.csv").write_text(text_of(slice_of(5, 4)))
    (tmp_path / "joint.csv").write_text(text_of(joint()))
    assert run("sensing", "--dir", tmp_path).returncode == status
    assert {path.name for path in tmp_path.glob("*.png")} == {"joint.png", "ultrasound_spine.png"}


def test_a_slice_keeps_its_places():
    values, extent = sensing.grid_of(table_of(slice_of(3, 2)), "brainshift")
    assert values.tolist() == [[0, 10, 20], [1, 11, 21]] and extent == (0, 1, 0.5, 0)
    with pytest.raises(InputError, match="5 voxels, a slice of 3 x 2 has 6"):
        sensing.grid_of(table_of(slice_of(3, 2)[:-1]), "brainshift")


def test_a_missing_column_is_bad_input_in_one_line(tmp_path):
    (tmp_path / "joint.csv").write_text(text_of([{k: v for k, v in row.items() if k != "tumour_mm"} for row in joint()]))
    done = run("sensing", "--dir", tmp_path)
    assert (done.returncode, done.stderr) == (2, f"studies sensing: {tmp_path}/joint.csv: has no column tumour_mm\n")
